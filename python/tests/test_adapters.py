"""Each adapter is run by the library that it is for; its checks pass without warnings."""

import copy
import unittest
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import marathon_rl

IDS = marathon_rl.ids()
# warnings that the libraries give about themselves; where it is about our environments, tests ask for errors
pytestmark = pytest.mark.filterwarnings("default")


class TestStableBaselines3:
    @pytest.mark.parametrize("id", IDS)
    def test_its_checker_passes(self, id: str) -> None:
        from stable_baselines3.common.env_checker import check_env  # noqa: PLC0415

        with warnings.catch_warnings():
            warnings.simplefilter("error")
            if id in gymnasium.registry:
                # Gymnasium's own tasks have Gymnasium's bounds of actions
                warnings.filterwarnings("ignore", ".*symmetric and normalized Box action space.*")
            check_env(marathon_rl.MarathonEnv(id, render_mode="rgb_array", width=32, height=32))

    def test_many_agents_are_as_its_own_vector_of_single_ones(self) -> None:
        from stable_baselines3.common.vec_env import DummyVecEnv  # noqa: PLC0415

        from marathon_rl.adapters.sb3 import Sb3VecEnv  # noqa: PLC0415

        ours = Sb3VecEnv("walker", 4, max_episode_steps=25)
        theirs = DummyVecEnv([lambda: marathon_rl.MarathonEnv("walker", max_episode_steps=25)] * 4)
        for env in (ours, theirs):
            env.seed(7)
        assert np.array_equal(ours.reset(), theirs.reset())
        rng, ends = np.random.default_rng(0), 0
        for _ in range(60):
            actions = rng.uniform(-1, 1, (4, 6)).astype(np.float32)
            (obs, reward, done, infos), (o, r, d, i) = ours.step(actions), theirs.step(actions)
            assert np.array_equal(obs, o) and np.array_equal(done, d)
            np.testing.assert_allclose(reward, r, rtol=1e-6)
            for k in np.flatnonzero(done):
                ends += 1
                assert np.array_equal(infos[k]["terminal_observation"], i[k]["terminal_observation"])
                assert infos[k]["TimeLimit.truncated"] == i[k]["TimeLimit.truncated"]
        assert ends >= 8
        assert not np.array_equal(Sb3VecEnv("walker", 2).reset(), Sb3VecEnv("walker", 2).reset())

    def test_its_algorithms_learn(self) -> None:
        from stable_baselines3 import PPO, SAC  # noqa: PLC0415
        from stable_baselines3.common.vec_env import VecMonitor, VecNormalize  # noqa: PLC0415

        from marathon_rl.adapters.sb3 import Sb3VecEnv  # noqa: PLC0415

        env = VecNormalize(VecMonitor(Sb3VecEnv("hopper", 16, render_mode="rgb_array", width=32, height=24)))
        model = PPO("MlpPolicy", env, n_steps=32, batch_size=128, n_epochs=1, seed=1, device="cpu").learn(1024)
        assert model.num_timesteps == 1024 and len(model.ep_info_buffer) > 0
        assert env.render().shape == (4 * 24, 4 * 32, 3)
        SAC("MlpPolicy", Sb3VecEnv("hopper", 4), learning_starts=20, seed=1, device="cpu").learn(60)

    def test_a_monitor_can_keep_what_a_task_reports(self) -> None:
        from stable_baselines3.common.vec_env import VecMonitor  # noqa: PLC0415

        from marathon_rl.adapters.sb3 import Sb3VecEnv  # noqa: PLC0415

        for id, names in (("Hopper-v5", ("x_position", "z_distance_from_origin")), ("hopper", ("x_position",))):
            native = Sb3VecEnv(id, 3, max_episode_steps=4)
            env, ended = VecMonitor(native, info_keywords=names), 0
            native.seed(1)
            env.reset()
            for _ in range(4):
                x = native._env.get_state()[0][:, 0]
                _, _, dones, infos = env.step(np.zeros((3, *env.action_space.shape), np.float32))
                for i in np.flatnonzero(dones):
                    ended += 1
                    assert set(names) <= set(infos[i]["episode"])
                    # of the state that the episode ended in, not of the next one's start
                    assert abs(infos[i]["x_position"] - x[i]) < 0.1 and infos[i]["diverged"] is False
            assert ended >= 3
            assert [spec.id for spec in env.get_attr("spec")] == [f"marathon_rl/{native.task_spec.id}"] * 3


class TestTorchRl:
    """Without its own dependencies, which are heavy: what is asked for here does without."""

    @pytest.mark.parametrize("id", ["Hopper-v0", "Hopper-v5", "Humanoid-v5"])
    def test_it_makes_environments_by_name(self, id: str) -> None:
        from torchrl.envs import GymEnv, check_env_specs  # noqa: PLC0415

        env = GymEnv(f"marathon_rl/{id}")
        check_env_specs(env)
        assert env.rollout(5, break_when_any_done=False).shape == (5,)
        assert GymEnv(f"marathon_rl/{id}", frame_skip=2).rollout(2).shape == (2,)

    @pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.DISABLED])
    @pytest.mark.parametrize("id", ["Hopper-v0", "Hopper-v5"])
    def test_it_wraps_many_agents(self, id: str, mode: AutoresetMode) -> None:
        from torchrl.envs import GymWrapper  # noqa: PLC0415

        made = {"num_envs": 4, "autoreset_mode": mode, "max_episode_steps": 6, "reward_terms": False}
        env = GymWrapper(gymnasium.make_vec(f"marathon_rl/{id}", **made))
        rollout = env.rollout(20, break_when_any_done=False)
        assert rollout.shape == (4, 20) and rollout["next", "done"].sum() >= 12


class TestPettingZoo:
    @pytest.mark.parametrize("id", IDS)
    def test_its_api_test_passes(self, id: str) -> None:
        from pettingzoo.test import parallel_api_test  # noqa: PLC0415

        from marathon_rl.adapters.pettingzoo import MarathonParallelEnv  # noqa: PLC0415

        with warnings.catch_warnings():
            warnings.simplefilter("error")
            parallel_api_test(MarathonParallelEnv(id, 5, max_episode_steps=100), num_cycles=300)

    def test_its_seed_test_passes(self) -> None:
        from pettingzoo.test import parallel_seed_test  # noqa: PLC0415

        from marathon_rl.adapters.pettingzoo import MarathonParallelEnv  # noqa: PLC0415

        parallel_seed_test(lambda: MarathonParallelEnv("ant", 3), num_cycles=50)

    def test_agents_live_on_without_those_that_ended(self) -> None:
        from marathon_rl.adapters.pettingzoo import MarathonParallelEnv  # noqa: PLC0415

        env = MarathonParallelEnv("hopper", 6, render_mode="rgb_array", width=64, height=32)
        native = marathon_rl.VecEnv("hopper", 6, autoreset="disabled")
        obs, _ = env.reset(seed=3)
        native.reset(seed=3)
        rng, alive = np.random.default_rng(1), np.ones(6, bool)
        assert env.render().shape == (32, 64, 3)
        while env.agents:
            actions = rng.uniform(-1, 1, (6, 4)).astype(np.float32)
            actions[~alive] = 0
            expected, reward, terminated, _ = native.step(actions)
            names = env.agents[:]
            obs, rewards, dead, _, infos = env.step({name: actions[int(name[6:])] for name in names})
            for name in names:
                i = int(name[6:])
                assert np.array_equal(obs[name], expected[i]) and rewards[name] == reward[i]
                assert sum(infos[name]["reward_terms"].values()) == pytest.approx(rewards[name], abs=1e-4)
                assert dead[name] == terminated[i] and infos[name]["diverged"] is False
            alive &= ~terminated
            assert [int(name[6:]) for name in env.agents] == np.flatnonzero(alive).tolist()
        assert env.state().shape == (6, 31)


class TestRslRl:
    CONFIG: dict[str, Any] = {  # noqa: RUF012
        "num_steps_per_env": 16,
        "save_interval": 100,
        "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
        "actor": {
            "class_name": "MLPModel",
            "hidden_dims": [16],
            "distribution_cfg": {"class_name": "GaussianDistribution", "init_std": 0.5},
        },
        "critic": {"class_name": "MLPModel", "hidden_dims": [16]},
        "algorithm": {"class_name": "PPO", "num_learning_epochs": 1, "num_mini_batches": 2},
    }

    def test_its_runner_learns(self) -> None:
        from rsl_rl.runners import OnPolicyRunner  # noqa: PLC0415

        from marathon_rl.adapters.rsl_rl import RslRlEnv  # noqa: PLC0415

        env = RslRlEnv("walker", 32, seed=1)
        runner = OnPolicyRunner(env, self.CONFIG, log_dir=None, device="cpu")
        before = copy.deepcopy(runner.alg.actor.state_dict())
        runner.learn(2, init_at_random_ep_len=True)
        after = runner.alg.actor.state_dict()
        assert runner.current_learning_iteration == 1
        assert all(after[name].isfinite().all() for name in after)
        assert any(not before[name].equal(after[name]) for name in after)

    def test_steps_are_the_native_ones_and_time_outs_are_told(self) -> None:
        import torch  # noqa: PLC0415

        from marathon_rl.adapters.rsl_rl import RslRlEnv  # noqa: PLC0415

        env = RslRlEnv("ant", 20, seed=5, max_episode_steps=10)
        native = marathon_rl.VecEnv("ant", 20, max_episode_steps=10, autoreset="same_step")
        assert np.array_equal(env.get_observations()["policy"], native.reset(seed=5))
        env.episode_length_buf[3] = 6
        for step in range(10):
            actions = torch.full((20, 8), 0.1 * step)
            obs, reward, dones, extras = env.step(actions)
            expected = native.step(actions.numpy())
            same = np.arange(20) != 3
            assert np.array_equal(obs["policy"].numpy()[same], expected[0][same])
            assert np.array_equal(reward.numpy()[same], expected[1][same])
            assert np.array_equal(extras["time_outs"].numpy()[same], expected[3][same])
            assert bool(dones[3]) == (step == 3) or expected[2][3]
        assert "/reward/velocity" in extras["log"]


class TestSkrl:
    def train(self, env: Any) -> None:
        from skrl.agents.torch.ppo import PPO, PPO_CFG  # noqa: PLC0415
        from skrl.memories.torch import RandomMemory  # noqa: PLC0415
        from skrl.trainers.torch import SequentialTrainer  # noqa: PLC0415
        from skrl.utils.model_instantiators.torch import deterministic_model, gaussian_model  # noqa: PLC0415

        network = [{"name": "net", "input": "OBSERVATIONS", "layers": [16], "activations": "elu"}]
        spaces = {"observation_space": env.observation_space, "action_space": env.action_space, "device": env.device}
        models = {
            "policy": gaussian_model(**spaces, network=network, output="ACTIONS"),
            "value": deterministic_model(**spaces, network=network, output="ONE"),
        }
        cfg = PPO_CFG(rollouts=8, learning_epochs=1, mini_batches=1)
        cfg.experiment.write_interval = cfg.experiment.checkpoint_interval = 0
        memory = RandomMemory(memory_size=8, num_envs=env.num_envs, device=env.device)
        agent = PPO(models=models, memory=memory, cfg=cfg, **spaces)
        before = copy.deepcopy(models["policy"].state_dict())
        cfg = {"timesteps": 24, "disable_progressbar": True, "headless": True, "close_environment_at_exit": False}
        SequentialTrainer(env=env, agents=agent, cfg=cfg).train()
        after = models["policy"].state_dict()
        assert all(after[name].isfinite().all() for name in after)
        assert any(not before[name].equal(after[name]) for name in after)

    def test_its_trainer_learns(self) -> None:
        from marathon_rl.adapters.skrl import SkrlEnv  # noqa: PLC0415

        self.train(SkrlEnv("hopper", 8, seed=1))

    def test_it_wraps_the_gymnasium_environment_too(self) -> None:
        from skrl.envs.wrappers.torch import wrap_env  # noqa: PLC0415

        self.train(wrap_env(gymnasium.make_vec("marathon_rl/Hopper-v0", num_envs=4), wrapper="gymnasium"))

    def test_steps_are_the_native_ones(self) -> None:
        import torch  # noqa: PLC0415

        from marathon_rl.adapters.skrl import SkrlEnv  # noqa: PLC0415

        env, native = (
            SkrlEnv("ant", 9, seed=5, max_episode_steps=4),
            marathon_rl.VecEnv("ant", 9, max_episode_steps=4, autoreset="same_step"),
        )
        assert np.array_equal(env.reset()[0], native.reset(seed=5))
        for _ in range(9):
            actions = torch.ones((9, 8)) * 0.3
            obs, reward, terminated, truncated, info = env.step(actions)
            expected = native.step(actions.numpy())
            for x, y in zip((obs, reward, terminated, truncated), expected, strict=True):
                assert np.array_equal(x.reshape(y.shape), y)
            assert np.array_equal(info["final_obs"], native.final_obs) and reward.shape == (9, 1)


def dm_env_case() -> type[unittest.TestCase]:
    from dm_env import test_utils  # noqa: PLC0415

    from marathon_rl.adapters.dm_env import DmEnv  # noqa: PLC0415

    class Case(test_utils.EnvironmentTestMixin, unittest.TestCase):
        def make_object_under_test(self) -> DmEnv:
            return DmEnv("hopper", seed=1, max_episode_steps=15)

        def make_action_sequence(self) -> Any:
            rng = np.random.default_rng(0)
            return (rng.uniform(-1, 1, 4).astype(np.float32) for _ in range(100))

    return Case


class TestDmEnv:
    def test_its_contract_is_kept(self) -> None:
        result = unittest.TestResult()
        unittest.defaultTestLoader.loadTestsFromTestCase(dm_env_case()).run(result)
        assert result.testsRun >= 4 and not result.errors and not result.failures, (result.errors, result.failures)

    def test_ends_tell_whether_to_bootstrap(self) -> None:
        from marathon_rl.adapters.dm_env import DmEnv  # noqa: PLC0415

        env = DmEnv("hopper", seed=3, max_episode_steps=5)
        assert env.reset().first()
        steps = [env.step(np.zeros(4)) for _ in range(6)]
        assert steps[4].last() and steps[4].discount == 1.0 and steps[5].first()
        rng = np.random.default_rng(0)
        env = DmEnv("hopper", seed=3)
        step = env.reset()
        while not step.last():
            step = env.step(rng.uniform(-1, 1, 4))
        assert step.discount == 0.0 and step.reward == -1.0
