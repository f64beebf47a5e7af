"""Agents written in Python as Gymnasium environments, and learned by Stable-Baselines3."""

import gymnasium
import numpy as np
import pytest
from arm import Arm
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env as check_env_sb3
from stable_baselines3.common.vec_env import DummyVecEnv


def test_the_checkers_pass() -> None:
    # Gymnasium's warns of an environment that it did not make itself
    gymnasium.register("Checked-v0", entry_point="marathon_rl.env:MarathonEnv", kwargs={"task": Arm})
    check_env(gymnasium.make("Checked-v0", render_mode="rgb_array", width=64, height=48).unwrapped)
    del gymnasium.registry["Checked-v0"]
    env = Arm.make(render_mode="rgb_array", width=64, height=48)
    check_env_sb3(env)
    picture = env.render()
    assert picture is not None and picture.shape == (48, 64, 3) and picture.std() > 0
    obs, info = env.reset(seed=3)
    assert obs in env.observation_space and "angle" in info
    _, reward, _, _, info = env.step(np.array([1.0]))
    assert sum(info["reward_terms"].values()) == pytest.approx(reward, abs=1e-6) and info["angle"] != 0
    ends = [env.step(np.array([1.0]))[2:4] for _ in range(39)]
    assert ends[-2:] == [(False, False), (False, True)]


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_many_agents_behave_as_gymnasiums_vector_of_single_ones(mode: AutoresetMode) -> None:
    n = 3
    ours = Arm.make_vec(n, autoreset_mode=mode)
    theirs = SyncVectorEnv([Arm.make] * n, autoreset_mode=mode)
    assert ours.single_observation_space == theirs.single_observation_space
    assert ours.action_space == theirs.action_space and ours.metadata["autoreset_mode"] == mode
    first, second = ours.reset(seed=[1, 2, 3]), theirs.reset(seed=[1, 2, 3])
    assert np.array_equal(first[0], second[0])
    rng = np.random.default_rng(0)
    for _ in range(100):
        given = rng.uniform(-1, 1, (n, 1)).astype(np.float32)
        first, second = ours.step(given), theirs.step(given)
        for a, b in zip(first[:4], second[:4], strict=True):
            np.testing.assert_allclose(a, b, atol=1e-6)
        assert first[0].dtype == np.float32 and first[1].dtype == np.float64
        assert ("final_obs" in first[4]) == ("final_obs" in second[4])
        if mode is AutoresetMode.DISABLED and first[3].any():
            mask = {"reset_mask": first[3]}
            np.testing.assert_allclose(ours.reset(options=mask)[0], theirs.reset(options=mask)[0], atol=1e-6)


def test_a_class_can_be_registered() -> None:
    gymnasium.register("Arm-v0", entry_point="marathon_rl.env:MarathonEnv", kwargs={"task": Arm}, max_episode_steps=7)
    env = gymnasium.make("Arm-v0")
    env.reset(seed=1)
    assert [env.step(np.zeros(1))[3] for _ in range(7)][-1]
    assert env.unwrapped.task_spec.summary == "Lift the arm."
    del gymnasium.registry["Arm-v0"]


def test_stable_baselines3_learns_it() -> None:
    """From an arm that hangs to one that is lifted; held upright, it has nearly 80."""

    def lifted(model: PPO) -> float:
        arms = Arm.vec_env(16, autoreset="disabled")
        obs = arms.reset(seed=5)
        total = 0.0
        for _ in range(Arm.max_episode_steps):
            obs, reward, *_ = arms.step(model.predict(obs, deterministic=True)[0])
            total += float(reward.mean())
        return total

    envs = DummyVecEnv([Arm.make] * 8)
    settings = {"n_steps": 80, "batch_size": 160, "learning_rate": 3e-3, "gamma": 0.9, "seed": 1, "device": "cpu"}
    model = PPO("MlpPolicy", envs, policy_kwargs={"net_arch": [16]}, **settings)
    before = lifted(model)
    model.learn(6400)
    assert lifted(model) > before + 20
