"""Arguments of every kind: what is accepted, and what an error says of the others."""

import copy
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from arm import Arm

import marathon_rl
from marathon_rl import (
    MarathonEnv,
    MarathonVectorEnv,
    Model,
    Renderer,
    Simulation,
    VecEnv,
    evaluate,
    load_policy,
    spec,
    train,
)

ROOT = Path(__file__).parents[2]
HOPPER = ROOT / "assets/policies/hopper.safetensors"
ROBOT = ROOT / "examples/robots/hexapod.xml"
SMALL: dict[str, Any] = {"steps": 512, "threads": 1, "progress": False}
CONFIG = {"run": {"agents": 16, "horizon": 16}, "ppo": {"minibatches": 1, "epochs": 1}}
N = 4


def begun(env: Any) -> Any:
    env.reset(seed=1)
    return env


def refused(kind: type[Exception], message: str, call: Callable[[], Any]) -> None:
    with pytest.raises(kind, match=re.escape(message)):
        call()


# -------------------------------------------------------------------------------------------------------------- import


def test_an_import_compiles_no_model() -> None:
    for limits in ("memory=1kB", "no such limit"):
        code = "import marathon_rl; print(len(marathon_rl.ids())); marathon_rl.VecEnv('Hopper-v0')"
        environ = {**os.environ, "MARATHON_LIMITS": limits}
        done = subprocess.run([sys.executable, "-c", code], env=environ, capture_output=True, text=True, check=False)
        assert done.stdout.strip() == str(len(marathon_rl.ids())), done.stderr
        assert "ValueError" in done.stderr and "MARATHON_LIMITS" in done.stderr, done.stderr


def test_gymnasium_knows_the_time_limits_of_the_tasks() -> None:
    for id in marathon_rl.ids():
        assert gymnasium.spec(f"marathon_rl/{id}").max_episode_steps == spec(id).max_episode_steps


# -------------------------------------------------------------------------------------------------------------- Ctrl-C


def test_ctrl_c_ends_an_evaluation() -> None:
    # in the background of a script, a process ignores Ctrl-C
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    start = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            evaluate(load_policy(HOPPER), 10**6, threads=2)
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - start < 20


def test_a_simulation_takes_so_many_steps_that_ctrl_c_does_not_wait() -> None:
    sim = Simulation(Model.from_xml_path(ROBOT))
    ctrl = np.zeros((1, sim.model.nu))
    sim.step(ctrl, 1000)
    for substeps in (0, 1001, 10**9):
        refused(ValueError, f"substeps is {substeps}, expected 1 to 1000", lambda n=substeps: sim.step(ctrl, n))


# ------------------------------------------------------------------------------------------------------------- numbers


def test_numbers_of_things_may_be_floats_without_a_fraction() -> None:
    assert VecEnv("hopper", 2.0, threads=np.float32(1), max_episode_steps=1e2).spec.max_episode_steps == 100
    for env in (MarathonVectorEnv("hopper", 2.0), Arm.vec_env(np.float64(2)), Arm.make_vec(2.0, max_episode_steps=9.0)):
        assert env.num_envs == 2 and isinstance(env.num_envs, int)
    assert evaluate(load_policy(HOPPER), 3.0)["episodes"] == 3
    assert evaluate(lambda obs: np.zeros((len(obs), 4)), 3.0, task="hopper")["episodes"] == 3
    assert train("hopper", CONFIG, steps=5.12e2, progress=False).steps == 512
    for call in (lambda: VecEnv("hopper", 1.5), lambda: Arm.vec_env(1.5), lambda: train("hopper", num_envs=1.5)):
        refused(ValueError, "num_envs is 1.5, expected a whole number", call)
    refused(ValueError, "steps is inf, expected a whole number", lambda: train("hopper", steps=float("inf")))
    refused(ValueError, "steps is -4, expected a whole number from 0 to", lambda: train("hopper", steps=-4.0))
    refused(TypeError, "steps is of type str, expected a whole number", lambda: train("hopper", steps="1M"))


def test_train_names_the_argument_that_was_meant() -> None:
    for wrong, near in (
        ("total_steps", "steps"),
        ("total_timesteps", "steps"),
        ("agents", "num_envs"),
        ("n_envs", "num_envs"),
        ("thread", "threads"),
        ("call_back", "callback"),
    ):
        message = f"got an unexpected keyword argument '{wrong}'; did you mean '{near}'?"
        refused(TypeError, message, lambda wrong=wrong: train("hopper", **{wrong: 4e6}))
        refused(TypeError, message, lambda wrong=wrong: train(ROBOT, **{wrong: 4e6}))
    # a near option of the task is nearer
    refused(TypeError, "did you mean 'frame_skip'", lambda: train("Hopper-v5", frame_skipp=3))


@pytest.mark.parametrize(
    "make", [lambda: MarathonVectorEnv("hopper", N), lambda: VecEnv("hopper", N), lambda: Arm.vec_env(N)]
)
def test_seeds_are_checked_alike(make: Callable[[], Any]) -> None:
    env = make()
    whole = "expected a whole number"
    for seed, found in ((-1, "-1"), (2**64, f"{2**64}")):
        refused(ValueError, f"seed is {found}, {whole} from 0 to 2**64 - 1", lambda seed=seed: env.reset(seed=seed))
    for seed, found in (("a", "str"), (1.5, "float"), (b"ab", "bytes"), ([1, 2.5, 3, 4], "float")):
        refused(TypeError, f"seed is of type {found}, {whole}", lambda seed=seed: env.reset(seed=seed))
    refused(ValueError, "seed has 2 numbers, expected 4", lambda: env.reset(seed=[1, 2]))
    env.reset(seed=np.int64(3))
    env.reset(seed=(1, None, np.uint64(2**64 - 1), 0))


def test_the_seed_of_one_agent_is_a_number() -> None:
    env = MarathonEnv("hopper")
    refused(TypeError, "seed is of type list, expected a whole number", lambda: env.reset(seed=[1]))
    refused(TypeError, "seed is of type str, expected a whole number", lambda: env.reset(seed="a"))
    refused(ValueError, f"seed is {2**64}, expected a whole number", lambda: env.reset(seed=2**64))


# --------------------------------------------------------------------------------------------------------------- masks

NO_MASKS: list[tuple[Any, str]] = [
    ([0, 1, 2, 3], "int64 (4,)"),
    ([1, 0, 0, 0], "int64 (4,)"),
    ([True, 0, False, False], "int64 (4,)"),
    (np.array([0.0, 0.5, 1.0, -1.0]), "float64 (4,)"),
    (["", "a", "False", "b"], "<U5 (4,)"),
    ([None] * 4, "object (4,)"),
    ([True, False], "bool (2,)"),
    (np.ones((4, 1), bool), "bool (4, 1)"),
    (True, "bool"),
    ("abcd", "str"),
    ([[True], [True, False]], "list"),
]
MASKED: dict[str, Callable[[Any, Any], Any]] = {
    "push": lambda env, mask: env.push(np.zeros((N, 3)), body=1, mask=mask),
    "vary": lambda env, mask: env.vary(friction=np.ones(N), mask=mask),
    "set_ground": lambda env, mask: env.set_ground(env.ground(), mask=mask),
    "set_state": lambda env, mask: env.set_state(*env.get_state(), mask),
}


@pytest.mark.parametrize("make", [VecEnv, MarathonVectorEnv])
def test_masks_are_boolean(make: Any) -> None:
    env, commanded = begun(make("TerrainWalker2d-v0", N)), begun(make("AntController-v0", N))
    command = commanded.command
    calls = [lambda mask, call=call: call(env, mask) for call in MASKED.values()]
    calls.append(lambda mask: commanded.set_command(command, mask))
    calls.append(lambda mask: commanded.set_command(None, mask))
    if make is VecEnv:
        calls.append(lambda mask: env.reset(mask=mask))
    for call in calls:
        for mask, found in NO_MASKS:
            message = f"mask is {found}, expected a boolean array of shape (4,)"
            refused(ValueError, message, lambda call=call, mask=mask: call(mask))
        for mask in (None, [True, False, np.True_, False], (False,) * 4, np.array([True, False] * 4)[::2]):
            call(mask)


def test_masks_of_resets_and_of_classes_are_boolean() -> None:
    env, agents = begun(MarathonVectorEnv("hopper", N)), begun(Arm.vec_env(N))
    for mask, found in NO_MASKS:
        expected = f"is {found}, expected a boolean array of shape (4,)"
        refused(ValueError, f"reset_mask {expected}", lambda mask=mask: env.reset(options={"reset_mask": mask}))
        refused(ValueError, f"mask {expected}", lambda mask=mask: agents.reset(mask=mask))
        refused(ValueError, f"mask {expected}", lambda mask=mask: agents.push(np.zeros((N, 3)), body=1, mask=mask))
    env.reset(options={"reset_mask": [True, False, False, True]})
    refused(ValueError, "reset_mask chooses no agent", lambda: env.reset(options={"reset_mask": [False] * N}))


# --------------------------------------------------------------------------------------------------------------- tasks


def test_the_path_of_a_model_is_a_task() -> None:
    expected = spec(str(ROBOT)).obs_size
    assert spec(ROBOT).obs_size == VecEnv(ROBOT, 2).spec.obs_size == expected
    env = MarathonEnv(ROBOT, render_mode="rgb_array", width=16, height=16)
    assert begun(env).observation_space.shape == (expected,) and env.render().shape == (16, 16, 3)
    many = MarathonVectorEnv(ROBOT, 2)
    assert begun(many).single_observation_space.shape == (expected,)
    assert Renderer(ROBOT, 16, 16).render(env.get_state()[0][None]).shape == (16, 16, 3)
    policy = train(ROBOT, CONFIG, **SMALL).policy
    assert evaluate(policy, 1, task=ROBOT, max_episode_steps=2)["length_mean"] <= 2
    refused(ValueError, "nowhere.xml", lambda: MarathonVectorEnv(Path("nowhere.xml"), 2))


@pytest.mark.parametrize("task", [None, 3, b"hopper"])
def test_other_objects_are_no_tasks(task: Any) -> None:
    found = f"task is of type {type(task).__name__}, expected a task's name"
    calls: list[Callable[[Any], Any]] = [
        MarathonEnv,
        MarathonVectorEnv,
        VecEnv,
        spec,
        Renderer,
    ]
    if task is not None:
        calls += [
            train,
            lambda task: evaluate(load_policy(HOPPER), 1, task=task),
            lambda task: load_policy(HOPPER, task),
        ]
    for call in calls:
        refused(TypeError, found, lambda call=call: call(task))
    refused(TypeError, "task is the class int, expected a task's name", lambda: MarathonEnv(int))


# ------------------------------------------------------------------------------------------------------- configurations


def test_configurations_take_numbers_and_arrays_of_numpy() -> None:
    config = {
        "run": {"agents": np.int64(16), "horizon": np.uint8(16)},
        "ppo": {"lr": np.float32(1e-3), "minibatches": np.array(1), "epochs": 1},
        "network": {"hidden": np.array([8, 12])},
    }
    result = train("hopper", config, **SMALL)
    assert result.policy.meta["hidden"] == [8, 12]
    assert result.policy.meta["training"]["config"]["ppo"]["lr"] == pytest.approx(1e-3)


def test_other_values_of_configurations_are_named() -> None:
    expected = "expected a number, a text, True, False, None, a list or a dictionary"
    for value, found in ((object(), "object"), (1j, "complex"), (np.complex64(1), "complex"), ({1}, "set")):
        message = f"config: ppo.lr: found a value of type {found}, {expected}"
        refused(TypeError, message, lambda value=value: train("hopper", {"ppo": {"lr": value}}, **SMALL))
        refused(TypeError, message, lambda value=value: train("hopper", {"ppo": {"lr": [value]}}, **SMALL))
    refused(
        TypeError,
        "config: ppo: found a key of type int, expected a text",
        lambda: train("hopper", {"ppo": {3: 1}}, **SMALL),
    )
    refused(TypeError, "config: found a key of type int", lambda: train("hopper", {3: 1}, **SMALL))
    circle: dict[str, Any] = {}
    circle["ppo"] = circle
    message = "config: ppo: found a container that contains itself"
    refused(ValueError, message, lambda: train("hopper", circle, **SMALL))
    around: list[Any] = []
    around.append(around)
    message = "config: network.hidden: found a container that contains itself"
    refused(ValueError, message, lambda: train("hopper", {"network": {"hidden": around}}, **SMALL))


def test_a_callback_is_a_function() -> None:
    refused(TypeError, "callback is of type int, expected a function", lambda: train("hopper", callback=3))


def test_results_of_training_can_be_copied(tmp_path: Path) -> None:
    result = train("hopper", CONFIG, out=tmp_path / "run", **SMALL)
    for other in (copy.deepcopy(result), pickle.loads(pickle.dumps(result))):  # noqa: S301
        for name in ("steps", "interrupted", "folder", "evaluation", "summary"):
            assert getattr(other, name) == getattr(result, name)
        assert other.policy.meta == result.policy.meta


# ----------------------------------------------------------------------------------------------------------- snapshots


def test_snapshots_of_other_things_are_named() -> None:
    env, damaged = begun(MarathonVectorEnv("hopper", N)), "snapshot: found 3 bytes that are damaged or no snapshot"
    for each in (env, begun(MarathonEnv("hopper")), begun(Arm.vec_env(N))):
        refused(ValueError, damaged, lambda each=each: each.load(b"abc"))
        refused(TypeError, "snapshot is of type int, expected the bytes", lambda each=each: each.load(3))
    snapshot = env.save()
    for other in (MarathonVectorEnv("hopper", 1), MarathonEnv("hopper")):
        message = "snapshot: found 4 agents of 'Hopper-v0', expected 1 agent of 'Hopper-v0'"
        refused(ValueError, message, lambda other=other: other.load(snapshot))
    message = "snapshot: found 4 agents of 'Hopper-v0', expected 4 agents of 'Walker2d-v0'"
    refused(ValueError, message, lambda: MarathonVectorEnv("Walker2d-v0", N).load(snapshot))
    message = "snapshot: found 4 agents of 'Arm-v0', expected 3 agents of 'Arm-v0'"
    refused(ValueError, message, lambda: Arm.vec_env(3).load(begun(Arm.vec_env(N)).save()))
    refused(ValueError, "damaged or no snapshot", lambda: env.load(snapshot[:-1]))
    env.load(bytearray(snapshot))


# -------------------------------------------------------------------------------------------------------------- others


def test_types_of_numbers_are_those_of_numpy() -> None:
    for dtype in ("float64", np.float64, np.dtype("f8"), float):
        assert VecEnv("hopper", dtype=dtype).dtype == "float64"
    assert VecEnv("Hopper-v5", dtype=np.float32).dtype == "float32"
    refused(ValueError, "dtype is 'int64', expected 'float32' or 'float64'", lambda: VecEnv("hopper", dtype=np.int64))
    refused(TypeError, "dtype is of type object, expected 'float32'", lambda: VecEnv("hopper", dtype=object()))


def test_ports_and_sizes_are_checked_at_once() -> None:
    env = begun(VecEnv("hopper", 2))
    for port in (99999, -1):
        message = f"port is {port}, expected a whole number from 0 to 65535"
        refused(ValueError, message, lambda port=port: env.show(port=port))
    refused(TypeError, "port is of type str, expected a whole number", lambda: env.show(port="80"))
    for make in (MarathonEnv, MarathonVectorEnv):
        refused(ValueError, "image size 0x480 is out of range", lambda make=make: make("hopper", width=0))
        refused(TypeError, "height is of type str", lambda make=make: make("hopper", height="a"))


def test_another_thread_is_named() -> None:
    env = begun(VecEnv("humanoid", 512, threads=1))
    given, errors, stop = np.zeros((512, env.spec.act_size), np.float32), list[str](), threading.Event()

    def play() -> None:
        while not stop.is_set():
            try:
                env.step(given)
            except RuntimeError as error:
                errors.append(str(error))
                stop.set()

    threads = [threading.Thread(target=play) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    expected = "another thread is using this VecEnv, expected one thread at a time: use a threading.Lock or"
    assert errors and all(expected in error for error in errors), errors
    # nothing is broken
    env.step(given)


@pytest.mark.parametrize(
    "make", [lambda: VecEnv("hopper", N), lambda: MarathonVectorEnv("hopper", N), lambda: Arm.vec_env(N)]
)
def test_actions_are_real_numbers(make: Callable[[], Any]) -> None:
    env = begun(make())
    zeros = np.zeros((N, env.task_spec.act_size if isinstance(env, MarathonVectorEnv) else env.spec.act_size))
    for dtype, found in ((complex, "complex128"), (object, "object"), ("U3", "<U3")):
        message = f"actions have the type {found}, expected real numbers"
        refused(TypeError, message, lambda dtype=dtype: env.step(zeros.astype(dtype)))
    message = "actions have the type complex128, expected real numbers"
    refused(TypeError, message, lambda: env.step(zeros.astype(complex).tolist()))
    refused(TypeError, "force has the type complex128", lambda: env.push(np.zeros((N, 3), complex), body=1))
    for values in (None, "abc"):
        with pytest.raises(TypeError, match="actions have the type"):
            env.step(values)
    for values in (zeros.astype(bool), zeros.astype(np.int8), zeros.astype(np.float16), zeros.tolist()):
        env.step(values)


def test_the_action_of_one_agent_is_real_numbers() -> None:
    env = begun(MarathonEnv("hopper"))
    for action in (np.zeros(4, complex), np.zeros(4, object), None):
        with pytest.raises(TypeError, match="actions have the type"):
            env.step(action)
    env.step([0, 0, 0, 0])


def test_paths_of_policies(tmp_path: Path) -> None:
    for path in ("nowhere", tmp_path / "nowhere.onnx", "nowhere.safetensors"):
        with pytest.raises(FileNotFoundError, match="nowhere"):
            load_policy(path)
        with pytest.raises(FileNotFoundError, match="nowhere"):
            evaluate(path)
    assert evaluate(HOPPER, 2) == evaluate(str(HOPPER), 2) == evaluate(load_policy(HOPPER), 2)
    refused(TypeError, "policy is of type int, expected a Policy, a path or a function", lambda: evaluate(3))
