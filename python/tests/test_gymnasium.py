"""Gymnasium's checks pass without warnings on every task, and many agents behave as Gymnasium's own vector environment
of single ones does. (A warning is an error in all of these tests.)"""

import copy
import pickle
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

import marathon_rl
from marathon_rl import MarathonEnv, MarathonVectorEnv

IDS = marathon_rl.ids()


@pytest.mark.parametrize("id", IDS)
def test_gymnasium_checks_every_task(id: str) -> None:
    env = gymnasium.make(f"marathon_rl/{id}", render_mode="rgb_array", width=64, height=48)
    assert isinstance(env.unwrapped, MarathonEnv)
    if id in gymnasium.registry:
        # Gymnasium's own tasks have unbounded observations, and a pendulum actions up to 3: its checker warns there too
        original = gymnasium.make(id)
        assert env.observation_space == original.observation_space and env.action_space == original.action_space
        warnings.filterwarnings("ignore", ".*A Box observation space (minimum|maximum) value is -?infinity.*")
        warnings.filterwarnings("ignore", ".*recommend using a symmetric and normalized space.*")
    check_env(env.unwrapped)
    # the passive checker and the order enforcer are on
    env.reset(seed=1)
    for _ in range(20):
        obs, reward, _, _, info = env.step(env.action_space.sample())
        assert obs in env.observation_space and obs.dtype == env.observation_space.dtype
        assert sum(info["reward_terms"].values()) == pytest.approx(reward, rel=1e-5, abs=1e-4)
    env.close()


def test_names_of_gymnasium() -> None:
    names = {f"marathon_rl/{id}" for id in IDS}
    assert names <= set(gymnasium.registry)
    env = gymnasium.make("marathon_rl:marathon_rl/Walker2d-v0")
    assert env.spec is not None and env.spec.id == "marathon_rl/Walker2d-v0"
    assert env.spec.make().spec == env.spec
    vector = gymnasium.make_vec("marathon_rl/Walker2d-v1", num_envs=3)
    assert isinstance(vector, MarathonVectorEnv) and gymnasium.make_vec(vector.spec).num_envs == 3
    with pytest.raises(gymnasium.error.NameNotFound, match=r"Hopper-v\d"):
        gymnasium.make("marathon_rl/Hoper-v0")


def test_a_single_environment_is_agent_0_of_a_native_one() -> None:
    env, native = MarathonEnv("ant"), marathon_rl.VecEnv("ant", 1, autoreset="disabled")
    obs, info = env.reset(seed=5)
    assert np.array_equal(obs, native.reset(seed=5)[0]) and info["x_position"] == native.x_position[0]
    rng = np.random.default_rng(0)
    for _ in range(20):
        action = rng.uniform(-1, 1, 8)
        obs, reward, terminated, truncated, info = env.step(action)
        expected = native.step(action[None])
        assert np.array_equal(obs, expected[0][0]) and reward == expected[1][0]
        assert (terminated, truncated) == (expected[2][0], expected[3][0])
        assert info["x_velocity"] == pytest.approx(native.forward[0] / env.dt)
        assert info["x_position"] == native.get_state()[0][0, 0]
    qpos, qvel = env.get_state()
    other = MarathonEnv("ant")
    other.reset()
    np.testing.assert_allclose(other.set_state(qpos, qvel), obs, atol=1e-4)


def test_episodes_without_a_seed_differ() -> None:
    first = [MarathonEnv("hopper").reset()[0] for _ in range(2)]
    assert not np.array_equal(*first)
    first = [MarathonVectorEnv("hopper", 2).reset()[0] for _ in range(2)]
    assert not np.array_equal(*first)


def test_time_limits() -> None:
    for limit in (None, 5):
        env = gymnasium.make("marathon_rl/Hopper-v0", max_episode_steps=limit)
        env.reset(seed=0)
        flags = [env.step(np.zeros(4))[2:4] for _ in range(5)]
        assert flags[-1] == (False, limit == 5)
    env = MarathonEnv("hopper", max_episode_steps=3)
    env.reset(seed=0)
    assert [env.step(np.zeros(4))[3] for _ in range(3)] == [False, False, True]
    vector = gymnasium.make_vec("marathon_rl/Hopper-v0", num_envs=2, max_episode_steps=3)
    vector.reset(seed=0)
    assert [vector.step(np.zeros((2, 4)))[3].tolist() for _ in range(4)] == [[False] * 2] * 2 + [
        [True] * 2,
        [False] * 2,
    ]


def same(a: dict, b: dict, everywhere: np.ndarray) -> bool:
    """Whether infos agree in their masks, and wherever those say that there is something."""
    for key in {key for key in a.keys() | b.keys() if not key.startswith("_")}:
        mask = everywhere & a.get(f"_{key}", False)
        if not np.array_equal(mask, everywhere & b.get(f"_{key}", False)):
            return False
        if not mask.any():
            continue
        x, y = a[key], b[key]
        if isinstance(x, dict):
            agree = same(x, y, mask)
        else:
            agree = all(np.allclose(x[i], y[i], atol=1e-5) for i in np.flatnonzero(mask))
        if not agree:
            return False
    return True


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("id", ["Hopper-v0", "Ant-v1"])
def test_many_agents_behave_as_gymnasiums_vector_of_single_ones(id: str, mode: AutoresetMode) -> None:
    name, n, limit = f"marathon_rl/{id}", 5, 30
    ours = gymnasium.make_vec(name, num_envs=n, autoreset_mode=mode, max_episode_steps=limit)
    theirs = SyncVectorEnv([lambda: gymnasium.make(name, max_episode_steps=limit)] * n, autoreset_mode=mode)
    assert ours.metadata["autoreset_mode"] is mode
    for space in ("observation_space", "action_space", "single_observation_space", "single_action_space"):
        assert getattr(ours, space) == getattr(theirs, space)
    seeds, every = [3, 1, 4, 1, 5], np.ones(n, bool)
    (obs, info), (expected, expected_info) = ours.reset(seed=seeds), theirs.reset(seed=seeds)
    assert np.array_equal(obs, expected) and same(info, expected_info, every)
    assert np.array_equal(obs[1], obs[3]) and not np.array_equal(obs[0], obs[1])
    ours.action_space.seed(0)
    begun = 0
    for _ in range(100):
        actions = ours.action_space.sample()
        x, y = ours.step(actions), theirs.step(actions)
        for a, b in zip(x[:4], y[:4], strict=True):
            assert a.dtype == b.dtype
            np.testing.assert_allclose(a, b, atol=1e-6)
        assert same(x[4], y[4], every)
        ended = x[2] | x[3]
        begun += ended.sum()
        if mode is AutoresetMode.DISABLED and ended.any():
            with pytest.raises(gymnasium.error.ResetNeeded):
                ours.step(actions)
            a, b = (env.reset(options={"reset_mask": ended}) for env in (ours, theirs))
            assert np.array_equal(a[0], b[0]) and same(a[1], b[1], every)
    assert begun > 10
    ours.close()


def test_steps_return_new_arrays_unless_told_otherwise() -> None:
    envs = gymnasium.make_vec("marathon_rl/Hopper-v0", num_envs=4)
    first, _ = envs.reset(seed=1)
    results = [first] + [x for _ in range(3) for x in envs.step(np.full((4, 4), 0.5))[:4]]
    kept = [x.copy() for x in results]
    envs.step(np.zeros((4, 4)))
    assert all(np.array_equal(x, old) for x, old in zip(results, kept, strict=True))
    envs = gymnasium.make_vec("marathon_rl/Hopper-v0", num_envs=4, copy=False)
    first, _ = envs.reset(seed=1)
    assert envs.step(np.zeros((4, 4)))[0] is first


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_gymnasiums_wrappers_work(mode: AutoresetMode) -> None:
    envs = gymnasium.make_vec("marathon_rl/Walker2d-v0", num_envs=6, autoreset_mode=mode, max_episode_steps=20)
    if mode is AutoresetMode.NEXT_STEP:
        envs = NormalizeObservation(envs)
    envs = RecordEpisodeStatistics(envs)
    envs.reset(seed=1)
    lengths = []
    for _ in range(60):
        *_, infos = envs.step(envs.action_space.sample())
        if "episode" in infos:
            lengths += infos["episode"]["l"][infos["_episode"]].tolist()
    assert len(lengths) >= 12 and max(lengths) == 20


def test_an_episode_that_ends_by_nonsense_says_so() -> None:
    nonsense = np.array([0.0, np.nan, 0.0, 0.0], np.float32)
    env = gymnasium.make("marathon_rl/Hopper-v0")
    env.reset(seed=1)
    assert env.step(np.zeros(4, np.float32))[4]["diverged"] is False
    with pytest.warns(UserWarning, match="an action is not finite"):
        obs, reward, terminated, _, info = env.unwrapped.step(nonsense)
    assert info["diverged"] is True and terminated and reward == 0 and not obs.any()
    for mode in AutoresetMode:
        envs = MarathonVectorEnv("hopper", 3, autoreset_mode=mode)
        envs.reset(seed=1)
        infos = envs.step(np.zeros((3, 4)))[4]
        assert infos["diverged"].tolist() == [False] * 3 and infos["_diverged"].all()
        with pytest.warns(UserWarning, match="an action is not finite"):
            _, _, terminated, _, infos = envs.step(np.stack([np.zeros(4), nonsense, np.zeros(4)]))
        assert terminated.tolist() == [False, True, False]
        told = infos["final_info"] if mode is AutoresetMode.SAME_STEP else infos
        assert told["diverged"].tolist() == [False, True, False] and told["_diverged"][1]
        if mode is not AutoresetMode.DISABLED:
            assert not envs.step(np.zeros((3, 4)))[4]["diverged"].any()


def test_infos_without_dictionaries() -> None:
    envs = gymnasium.make_vec("marathon_rl/Hopper-v0", num_envs=2, reward_terms=False, max_episode_steps=2)
    env = gymnasium.make("marathon_rl/Hopper-v5", reward_terms=False)
    assert "reward_terms" not in envs.reset(seed=1)[1] | env.reset(seed=1)[1]
    for _ in range(3):
        assert not any(isinstance(value, dict) for value in envs.step(np.zeros((2, 4)))[4].values())
        info = env.step(np.zeros(3))[4]
        assert not any(isinstance(value, dict) for value in info.values()) and "reward_forward" in info


AGAIN = [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]  # noqa: S301


class Worm(marathon_rl.MarathonAgent):
    """A class in place of a name."""

    mjcf = Path(__file__).parents[2] / "assets/agents/hopper.xml"

    def observations(self) -> np.ndarray:
        return np.concatenate([self.sim.qpos, self.sim.qvel], axis=1)

    def step_reward(self) -> dict[str, np.ndarray]:
        return {"speed": self.sim.qvel[:, 0]}


@pytest.mark.parametrize("task", ["Hopper-v0", "Hopper-v5", Worm])
def test_one_environment_goes_on_from_a_snapshot_or_as_a_copy(task) -> None:
    env = MarathonEnv(task, render_mode="rgb_array", width=32, height=24, max_episode_steps=12)
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset must be called before save"):
        env.save()
    env.reset(seed=3)
    rng = np.random.default_rng(0)
    given = rng.uniform(-0.3, 0.3, (30, *env.action_space.shape)).astype(np.float32)
    for action in given[:5]:
        obs = env.step(action)[0]
    env.render()
    snapshot = env.save()
    others = [again(env) for again in AGAIN]
    loaded = MarathonEnv(task, max_episode_steps=12)
    assert np.array_equal(loaded.load(snapshot), obs) and loaded.save() == snapshot
    others.append(loaded)
    for action in given[5:]:
        want = env.step(action)
        for other in others:
            got = other.step(action)
            assert np.array_equal(got[0], want[0]) and got[1:] == want[1:]
        if want[2] or want[3]:
            first = env.reset()[0]
            assert all(np.array_equal(other.reset()[0], first) for other in others)
    with pytest.raises(ValueError, match="damaged or no snapshot, expected what save returned"):
        loaded.load(snapshot[: len(snapshot) // 2])
    with pytest.raises(ValueError, match="snapshot"):
        MarathonEnv("ant").load(snapshot)


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("task", ["Ant-v1", "Hopper-v5", Worm])
def test_many_agents_go_on_from_a_snapshot_or_as_a_copy(task, mode: AutoresetMode) -> None:
    made = {"autoreset_mode": mode, "max_episode_steps": 7}
    env = MarathonVectorEnv(task, 5, **made)
    env.action_space.seed(1)
    obs, _ = env.reset(seed=[5, 4, 3, 2, 1])
    while not env._ended.any():
        obs = env.step(env.action_space.sample() * 0.3)[0]
    snapshot = env.save()
    others = [again(env) for again in AGAIN]
    others.append(MarathonVectorEnv(task, 5, **made))
    assert np.array_equal(others[-1].load(snapshot), obs) and others[-1].save() == snapshot
    for other in others:
        if mode is AutoresetMode.DISABLED:
            with pytest.raises(gymnasium.error.ResetNeeded):
                other.step(env.action_space.sample())
    for _ in range(20):
        if env._ended.any() and mode is AutoresetMode.DISABLED:
            begun = {"reset_mask": env._ended.copy()}
            first = env.reset(options=begun)[0]
            assert all(np.array_equal(other.reset(options=begun)[0], first) for other in others)
        actions = env.action_space.sample() * 0.3
        want = env.step(actions)
        for other in others:
            got = other.step(actions)
            assert all(np.array_equal(x, y) for x, y in zip(got[:4], want[:4], strict=True))
            assert same(got[4], want[4], np.ones(5, bool))


def test_masks_of_resets_are_checked() -> None:
    envs = MarathonVectorEnv("hopper", 3)
    envs.reset(seed=1)
    for mask in ([1] * 3, np.ones(2, bool), np.ones(3), np.zeros(3, bool)):
        with pytest.raises(ValueError, match="reset_mask"):
            envs.reset(options={"reset_mask": mask})


def test_pictures() -> None:
    env = gymnasium.make("marathon_rl/Hopper-v0", render_mode="rgb_array", width=64, height=48)
    env.reset(seed=1)
    first = env.render()
    assert first.shape == (48, 64, 3) and first.dtype == np.uint8 and first.std() > 10
    for _ in range(10):
        env.step(env.action_space.sample())
    assert not np.array_equal(env.render(), first)
    envs = gymnasium.make_vec("marathon_rl/Hopper-v0", num_envs=2, render_mode="rgb_array", width=32, height=32)
    envs.reset(seed=1)
    assert [frame.shape for frame in envs.render()] == [(32, 32, 3)] * 2
    with pytest.raises(gymnasium.error.Error, match="a window shows one environment"):
        MarathonVectorEnv("hopper", 2, render_mode="human")
    with pytest.raises(gymnasium.error.Error, match="expected one of: 'rgb_array', None"):
        MarathonVectorEnv("hopper", render_mode="ansi")
