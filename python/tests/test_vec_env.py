"""The native vector environment: the same bits as Rust's, arrays that are not copied, no GIL while it steps."""

import copy
import inspect
import os
import pickle
import re
import select
import signal
import threading
import time

import numpy as np
import pytest

import marathon_rl
from marathon_rl import VecEnv

IDS = marathon_rl.ids()


def actions(env: VecEnv, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (env.num_envs, env.spec.act_size)).astype(np.float32)


@pytest.mark.parametrize("id", IDS)
def test_shapes_types_and_rewards(id: str) -> None:
    env = VecEnv(id, 37, threads=2, autoreset="same_step")
    spec = env.spec
    assert (spec.id, env.num_envs, len(env), env.threads) == (id, 37, 37, 2)
    assert spec.dtype == ("float64" if id.endswith("-v5") else "float32")
    assert spec.id == marathon_rl.spec(id).id and len(spec.action_names) == spec.act_size
    assert env.reset(seed=3).shape == (37, spec.obs_size)
    for step in range(30):
        obs, reward, terminated, truncated = env.step(actions(env, step))
        assert obs.shape == (37, spec.obs_size) and obs.dtype == env.dtype == spec.dtype and np.isfinite(obs).all()
        assert reward.shape == terminated.shape == truncated.shape == (37,)
        assert reward.dtype == np.float32 and terminated.dtype == truncated.dtype == np.bool_
        assert env.reward_terms.shape == (37, len(spec.reward_terms))
        np.testing.assert_allclose(env.reward_terms.sum(1), reward, atol=1e-4)
        assert env.forward.shape == env.diverged.shape == (37,) and not env.diverged.any()


def test_arrays_are_the_environments_own_unless_copies_are_asked_for() -> None:
    env = VecEnv("hopper", 5)
    first = env.reset(seed=1)
    before = first.copy()
    again, reward, *_ = env.step(actions(env))
    assert again is first and again is env.obs and not np.array_equal(first, before)
    assert env.step(actions(env))[1] is reward

    env = VecEnv("hopper", 5, copy=True)
    first = env.reset(seed=1)
    kept = [(x, x.copy()) for x in (*env.step(actions(env)), first, env.reward_terms, env.forward)]
    for _ in range(3):
        env.step(actions(env))
        env.reset(mask=[True, False, False, False, True])
    assert all(np.array_equal(x, old) for x, old in kept)


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_observations_in_64_bits_are_those_in_32(mode: str) -> None:
    narrow, wide = (
        VecEnv("hopper", 21, autoreset=mode, copy=c, dtype=d) for c, d in ((False, "float32"), (True, "float64"))
    )
    assert (narrow.dtype, wide.dtype) == ("float32", "float64")
    assert np.array_equal(narrow.reset(seed=2), wide.reset(seed=2))
    ended = 0
    for step in range(60):
        given = actions(narrow, step)
        (a, *others), (b, *rest) = narrow.step(given), wide.step(given)
        assert (a.dtype, b.dtype, wide.final_obs.dtype) == (np.float32, np.float64, np.float64)
        assert np.array_equal(a, b) and np.array_equal(narrow.final_obs, wide.final_obs)
        assert all(np.array_equal(x, y) for x, y in zip(others, rest, strict=True))
        ended += others[1].sum()
    assert ended
    mask = np.arange(21) % 3 == 0
    assert np.array_equal(narrow.reset(mask=mask), wide.reset(mask=mask))
    state = narrow.get_state()
    assert np.array_equal(narrow.set_state(*state, mask), wide.set_state(*state, mask))
    with pytest.raises(ValueError, match="dtype is 'float16', expected 'float32' or 'float64'"):
        VecEnv("hopper", 1, dtype="float16")


def test_results_do_not_depend_on_threads_copies_layout_or_type_of_the_actions() -> None:
    a, b = VecEnv("ant", 50, seed=5, threads=1), VecEnv("ant", 50, seed=5, threads=2, copy=True)
    a.reset()
    b.reset()
    for step in range(40):
        given = actions(a, step)
        x = a.step(given)
        y = b.step([given.astype(np.float64), given.T.copy().T, given.tolist()][step % 3])
        assert all(np.array_equal(p, q) for p, q in zip(x, y, strict=True))


def test_the_same_seed_gives_the_same_lives() -> None:
    env = VecEnv("walker", 20)
    first = env.reset(seed=9).copy()
    assert not np.array_equal(env.reset(), first)
    assert np.array_equal(env.reset(seed=9), first)
    assert not np.array_equal(env.reset(seed=10), first)
    alone = VecEnv("walker", 1)
    each = env.reset(seed=list(range(100, 120)))
    assert all(np.array_equal(each[i], alone.reset(seed=100 + i)[0]) for i in range(20))
    # with a mask, the seed is for the chosen agents alone
    mask = np.arange(20) % 3 == 0
    before = each.copy()
    after = env.reset(seed=9, mask=mask)
    assert np.array_equal(after[mask], first[mask]) and np.array_equal(after[~mask], before[~mask])


def test_autoreset_modes() -> None:
    envs = {mode: VecEnv("hopper", 16, seed=1, autoreset=mode, max_episode_steps=7) for mode in MODES}
    assert [env.autoreset for env in envs.values()] == list(MODES)
    for env in envs.values():
        env.reset()
        for step in range(6):
            _, _, terminated, truncated = env.step(actions(env, step) * 0.1)
            assert not truncated.any() and not terminated.any()
        _, _, _, truncated = env.step(actions(env, 6) * 0.1)
        assert truncated.all() and env.spec.max_episode_steps == 7
    same, following, disabled = envs.values()
    assert np.array_equal(same.final_obs, disabled.obs) and np.array_equal(following.obs, disabled.obs)
    # the step after the end starts the next episode, or goes on with the old one
    obs, reward, terminated, truncated = following.step(actions(following, 7))
    assert np.array_equal(obs, same.obs) and not reward.any() and not truncated.any() and not terminated.any()
    assert disabled.step(actions(disabled, 7) * 0.1)[3].all()
    assert np.array_equal(disabled.reset(mask=np.ones(16, bool)), same.obs)


MODES = ("same_step", "next_step", "disabled")


def test_a_snapshot_continues_with_the_same_bits() -> None:
    env = VecEnv("humanoid", 18, seed=2, autoreset="next_step", max_episode_steps=9)
    env.reset()
    for step in range(9):
        env.step(actions(env, step))
    snapshot = env.save()
    assert isinstance(snapshot, bytes)
    story = [[x.copy() for x in env.step(actions(env, step))] for step in range(9, 20)]
    other = VecEnv("humanoid", 18, seed=77, autoreset="next_step", max_episode_steps=9, threads=2)
    other.load(snapshot)
    for step, expected in enumerate(story, 9):
        assert all(np.array_equal(x, y) for x, y in zip(other.step(actions(env, step)), expected, strict=True))
    with pytest.raises(ValueError, match="snapshot"):
        VecEnv("humanoid", 17).load(snapshot)
    with pytest.raises(ValueError, match="snapshot"):
        other.load(snapshot[:-1])


def test_states_can_be_read_and_written() -> None:
    env = VecEnv("ant", 17, seed=4)
    first = env.reset().copy()
    qpos, qvel = env.get_state()
    assert qpos.shape == (17, env.spec.nq) and qvel.shape == (17, env.spec.nv) and qpos.dtype == np.float64
    np.testing.assert_array_equal(env.x_position, qpos[:, 0])
    story = [env.step(actions(env, step))[0].copy() for step in range(5)]
    np.testing.assert_allclose(env.x_position, env.get_state()[0][:, 0])
    assert np.array_equal(env.set_state(qpos, qvel), first)
    assert all(np.array_equal(env.step(actions(env, step))[0], obs) for step, obs in enumerate(story))
    # a mask chooses agents
    mask = np.zeros(17, bool)
    mask[16] = True
    obs = env.set_state(qpos, qvel, mask)
    assert np.array_equal(obs[16], first[16]) and np.array_equal(obs[:16], story[-1][:16])


def test_other_threads_run_while_it_steps() -> None:
    env = VecEnv("humanoid", 512, threads=1)
    env.reset()
    given, turns, done = actions(env), 0, threading.Event()

    def play() -> None:
        for _ in range(10):
            env.step(given)
        done.set()

    thread = threading.Thread(target=play)
    thread.start()
    while not done.is_set():
        turns += 1
        time.sleep(1e-4)
    thread.join()
    # with the GIL held, there would be one turn per step
    assert turns > 50


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: VecEnv("hoper"), "agent 'hoper' does not exist; did you mean 'Hopper-v0'"),
        (lambda: VecEnv("hopper", 0), "num_envs is 0, expected at least 1"),
        (lambda: VecEnv("hopper", isa="mmx"), "unknown instruction set 'mmx'; expected one of"),
        (lambda: VecEnv("hopper", autoreset="never"), "autoreset is 'never', expected one of"),
        (lambda: VecEnv("hopper", max_episode_steps=0), "max_episode_steps is 0, expected at least 1"),
        (lambda: VecEnv("hopper").step(np.zeros((1, 4))), "reset must be called before the first step"),
        (lambda: ready().step(np.zeros((3, 4))), r"actions have the shape \(3, 4\), expected \(2, 4\)"),
        (lambda: ready().step(np.zeros(4)), r"actions have the shape \(4,\), expected \(2, 4\)"),
        (lambda: ready().step([[0, 0, 0, 0], [0, 0]]), "inhomogeneous"),
        (lambda: ready().reset(mask=[True]), r"mask is bool \(1,\), expected a boolean array of shape \(2,\)"),
        (lambda: ready().reset(mask=True), r"mask is bool, expected a boolean array of shape \(2,\)"),
        (lambda: ready().reset(seed=-1), r"seed is -1, expected a whole number from 0 to 2\*\*64 - 1"),
        (lambda: ready().reset(seed=[1, -2]), "seed is -2, expected a whole number"),
        (lambda: VecEnv("hopper", -1), "num_envs is -1, expected a whole number"),
        (lambda: VecEnv("hopper", threads=-1), "threads is -1, expected a whole number"),
        (lambda: VecEnv("hopper", seed=2**64), f"seed is {2**64}, expected a whole number"),
        (
            lambda: VecEnv("Hopper-v5", reset_noise_scale=-1),
            "option reset_noise_scale is -1, expected a finite number, 0 or more",
        ),
        (
            lambda: VecEnv("Hopper-v5", healthy_z_range=(2, 1)),
            r"option healthy_z_range is \(2, 1\), expected two numbers, the lower one first",
        ),
        (lambda: ready().reset(seed=[1]), "seed has 1 numbers, expected 2"),
        (
            lambda: ready().set_state(np.zeros((2, 7)), np.zeros((2, 1))),
            r"qvel has the shape \(2, 1\), expected \(2, 7\)",
        ),
        (lambda: ready().set_state(np.zeros(7), np.zeros(7)), r"qpos has the shape \(7,\), expected \(2, 7\)"),
        (lambda: ready().set_state(np.full((2, 7), np.nan), np.zeros((2, 7))), "the state of agent 0 is not finite"),
        (
            lambda: marathon_rl.Renderer("hopper", 8, 8).render(np.zeros(7)),
            r"qpos has the shape \(7,\), expected \(1, 7\)",
        ),
        (lambda: VecEnv("hopper", 2).reset(mask=[True, False]), "the first reset must be of all agents"),
    ],
)
def test_errors_say_what_was_found_and_what_was_expected(wrong, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        wrong()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: ready().reset(seed="3"), "seed is of type str, expected a whole number"),
        (lambda: ready().reset(seed=1.5), "seed is of type float, expected a whole number"),
        (lambda: VecEnv("hopper", "2"), "num_envs is of type str, expected a whole number"),
        (
            lambda: VecEnv("Hopper-v5", default_camera_config={}),
            "unexpected keyword argument 'default_camera_config': agent 'Hopper-v5' takes no option",
        ),
        (
            lambda: VecEnv("Hopper-v5", ctrl_cost_weight={}),
            "option ctrl_cost_weight is of type dict, expected a number",
        ),
    ],
)
def test_arguments_of_a_wrong_type_are_named(wrong, message: str) -> None:
    with pytest.raises(TypeError, match=re.escape(message)):
        wrong()


def test_gymnasiums_names_work_too() -> None:
    assert VecEnv("marathon_rl/Hopper-v0").spec.id == marathon_rl.spec("marathon_rl/Hopper-v0").id == "Hopper-v0"


def test_a_damaged_snapshot_is_refused() -> None:
    env = ready()
    snapshot = bytearray(env.save())
    for at in range(0, len(snapshot), 7):
        snapshot[at] ^= 4
        with pytest.raises(ValueError, match="snapshot"):
            env.load(bytes(snapshot))
        snapshot[at] ^= 4
    env.load(bytes(snapshot))


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("again", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])  # noqa: S301
def test_a_copy_goes_on_as_the_original_does(again, dtype: str) -> None:
    made = {"threads": 2, "autoreset": "next_step", "max_episode_steps": 9, "dtype": dtype, "isa": "f32", "copy": True}
    env = VecEnv("Hopper-v5", 18, seed=2, reset_noise_scale=0.1, **made)
    fresh = again(env)
    assert np.array_equal(fresh.reset(), env.reset())
    for step in range(5):
        env.step(actions(env, step))
    other = again(env)
    assert np.array_equal(other.obs, env.obs) and other.obs.dtype == dtype
    assert other.spec.options == env.spec.options and other.spec.options["reset_noise_scale"] == 0.1
    assert (other.threads, other.autoreset, other.spec.max_episode_steps, other.copy) == (2, "next_step", 9, True)
    for step in range(5, 20):
        for x, y in zip(env.step(actions(env, step)), other.step(actions(env, step)), strict=True):
            assert np.array_equal(x, y)


def test_agents_can_differ_and_be_pushed() -> None:
    env, plain = VecEnv("hopper", 4, autoreset="disabled"), VecEnv("hopper", 4, autoreset="disabled")
    model = env.model
    assert model.body_names[0] == "world" and model.nu == 4 and env.model is model
    strength = np.ones((4, 4))
    strength[1] = 0.1
    gravity = np.tile([0.0, 0.0, -9.81], (4, 1))
    gravity[2, 2] = -1.62
    env.vary(strength=strength, gravity=gravity, mask=[False, True, True, True])
    for each in (env, plain):
        each.reset(seed=1)
    env.push(np.tile([80, 0, 0], (4, 1)), body="torso", mask=np.arange(4) == 3)
    snapshot = env.save()
    given = actions(env)
    for _ in range(4):
        obs, expected = env.step(given)[0].copy(), plain.step(given)[0]
    assert np.array_equal(obs[0], expected[0])
    assert not any(np.array_equal(obs[i], expected[i]) for i in (1, 2, 3))
    plain.load(snapshot)
    for _ in range(4):
        again = plain.step(given)[0]
    assert np.array_equal(again, obs), "a snapshot holds all of it"
    before, push = env.save(), np.zeros((4, 3))
    for wrong, message in [
        (lambda: env.vary(mass=np.ones(4)), r"mass has the shape \(4,\), expected \(4, \d+\)"),
        (lambda: env.vary(friction=[1, 1, -1, 1]), "agent 2: friction is -1, expected a factor of 0 or more"),
        (lambda: env.push((1, 0, 0), body=1), r"force has the shape \(3,\), expected \(4, 3\)"),
        (lambda: env.push(push, np.zeros((4, 2)), body=1), r"torque has the shape \(4, 2\), expected \(4, 3\)"),
        (lambda: env.push(push, push + np.nan, body=1), "agent 0: torque is NaN, expected finite numbers"),
        (lambda: env.push(push, body=99), "body is 99, expected less than 6"),
        (lambda: env.push(push, body=-1), "body is -1, expected a whole number"),
        (lambda: env.push(push, body="troso"), "the model has no body 'troso'; did you mean 'torso'"),
        (lambda: env.set_ground([[0.0]]), "field is 0, but the model has no height fields"),
    ]:
        with pytest.raises(ValueError, match=message):
            wrong()
    assert env.save() == before, "nothing is half done"


def test_facts_can_be_copied() -> None:
    for facts in (VecEnv("Hopper-v5", max_episode_steps=7, frame_skip=2).spec, marathon_rl.spec("ant")):
        for other in (copy.deepcopy(facts), pickle.loads(pickle.dumps(facts))):  # noqa: S301
            names = [name for name in dir(facts) if not name.startswith("_")]
            assert len(names) > 10 and all(getattr(other, name) == getattr(facts, name) for name in names)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_forked_process_steps_with_threads_of_its_own() -> None:
    env = VecEnv("hopper", 64, threads=2)
    env.reset(seed=1)
    given = actions(env)
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(writer, env.step(given)[1].tobytes())
        os._exit(0)
    os.close(writer)
    try:
        # the threads of the parent are not there: a child that waits for them does so for ever
        assert select.select([reader], [], [], 60)[0], "the child hangs"
        rewards = np.frombuffer(os.read(reader, 1 << 16), np.float32)
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(reader)
    assert np.array_equal(rewards, env.step(given)[1]) and rewards.any()


def test_everything_is_explained_in_pythons_terms() -> None:
    explained = 0
    for name in marathon_rl.__all__:
        thing = getattr(marathon_rl, name)
        members = [thing] if callable(thing) else []
        if getattr(thing, "__module__", "") == "marathon_rl" and isinstance(thing, type):
            members += [getattr(thing, member) for member in dir(thing) if not member.startswith("_")]
        for member in members:
            text = inspect.getdoc(member)
            assert text, f"{name}: {member} has no documentation"
            assert "](" not in text and "[`" not in text and "::" not in text, f"{name}: {text}"
            explained += 1
    assert explained > 100


def ready() -> VecEnv:
    env = VecEnv("hopper", 2)
    env.reset()
    return env


def test_an_action_that_is_not_finite_ends_its_own_agent_only() -> None:
    env = ready()
    given = actions(env)
    given[1, 2] = np.nan
    _, reward, terminated, _ = env.step(given)
    assert terminated.tolist() == [False, True] and env.diverged.tolist() == [False, True] and reward[1] == 0


def test_copies_are_new_while_somebody_keeps_them_and_reused_after() -> None:
    env = VecEnv("hopper", 20, copy=True)
    env.reset(seed=1)
    actions = np.full((20, 4), 0.3, np.float32)
    # what is kept, a view of one row included, stays as it was
    kept = [env.step(actions)[0][3] for _ in range(4)]
    first = [row.copy() for row in kept]
    addresses = [env.step(actions)[0].ctypes.data for _ in range(40)]
    assert all(np.array_equal(a, b) for a, b in zip(kept, first, strict=True))
    assert not np.array_equal(kept[0], kept[1])
    assert len(set(addresses[10:])) <= 3
    # an array that was made read-only is not written to again
    frozen = env.step(actions)[0]
    frozen.flags.writeable = False
    del frozen
    for _ in range(3):
        env.step(actions)
