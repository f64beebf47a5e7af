"""The vector environments are alike: the native one, Gymnasium's, and that of agents written in Python.

They have the same operations with the same signatures and defaults, and masks select the same agents in each."""

import inspect
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from arm import Arm

import marathon_rl
from marathon_rl import CommandRange, MarathonAgent, MarathonVectorEnv, Model, Simulation, VecEnv
from marathon_rl.agent_env import AgentVecEnv

ROWS, COLUMNS = 5, 7
BALL = f"""
<mujoco model="ball">
  <asset><hfield name="hills" nrow="{ROWS}" ncol="{COLUMNS}" size="3 2 1 0.5"/></asset>
  <worldbody>
    <geom name="hills" type="hfield" hfield="hills" contype="0" conaffinity="1"/>
    <body name="ball" pos="0 0 3">
      <freejoint/>
      <geom name="ball" size="0.1" contype="1" conaffinity="0"/>
      <body name="tail" pos="-0.2 0 0">
        <joint name="tail" axis="0 1 0"/>
        <geom name="tail" size="0.05" pos="-0.1 0 0" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="tail" joint="tail"/></actuator>
</mujoco>"""
N = 5
MASK = np.array([False, True, False, False, True])
INPUTS = ("push", "vary", "ground", "set_ground")
OPERATIONS = (*INPUTS, "set_command", "get_state", "set_state", "save", "load", "reset", "step")
PROPERTIES = ("num_envs", "model", "command")


class Ball(MarathonAgent):
    """Falls."""

    mjcf = BALL
    termination_reward = None
    commands = (CommandRange("height", 0, 3, "m"),)

    def observations(self) -> list[np.ndarray]:
        return [self.position("ball"), self.command]

    def step_reward(self) -> dict[str, np.ndarray]:
        return {"height": self.height("ball")}


MAKERS: dict[str, Callable[[], Any]] = {
    "VecEnv": lambda: VecEnv("TerrainWalker2d-v0", N),
    "MarathonVectorEnv": lambda: MarathonVectorEnv("TerrainWalker2d-v0", N),
    "AgentVecEnv": lambda: Ball.vec_env(N),
    "MarathonVectorEnv of a class": lambda: Ball.make_vec(N),
}
COMMANDED: dict[str, Callable[[], Any]] = {
    **{name: make for name, make in MAKERS.items() if "class" in name or name == "AgentVecEnv"},
    "VecEnv": lambda: VecEnv("AntController-v0", N),
    "MarathonVectorEnv": lambda: MarathonVectorEnv("AntController-v0", N),
}


@pytest.fixture(params=MAKERS)
def twins(request: pytest.FixtureRequest) -> tuple[Any, Any]:
    """Two environments at the start of the same episodes."""
    return begun(MAKERS[request.param]), begun(MAKERS[request.param])


def begun(make: Callable[[], Any]) -> Any:
    env = make()
    env.reset(seed=1)
    return env


def states(env: Any, steps: int = 3) -> np.ndarray:
    """Positions and velocities after some steps, (num_envs, nq + nv)."""
    for _ in range(steps):
        env.step(np.zeros((N, env.model.nu), np.float32))
    return np.concatenate(env.get_state(), axis=1)


def differ(a: np.ndarray, b: np.ndarray) -> list[bool]:
    """Rows that are not the same bits."""
    return [not np.array_equal(x, y) for x, y in zip(a, b, strict=True)]


def parameters(function: Callable[..., Any]) -> list[tuple[str, Any, Any]]:
    """Names, kinds and defaults, without the object itself."""
    return [(p.name, p.kind, p.default) for p in inspect.signature(function).parameters.values()][1:]


# ------------------------------------------------------------------------------------------------ names and defaults


@pytest.mark.parametrize("name", OPERATIONS)
def test_operations_have_the_same_signatures(name: str) -> None:
    expected = parameters(getattr(VecEnv, name))
    assert parameters(getattr(AgentVecEnv, name)) == expected
    # Gymnasium's own signature of reset, where a mask is among the options
    if name != "reset":
        assert parameters(getattr(MarathonVectorEnv, name)) == expected
    if name in INPUTS:
        assert parameters(getattr(Simulation, name)) == expected


def test_signatures_are_the_documented_ones() -> None:
    keyword, either = inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    required = inspect.Parameter.empty
    assert parameters(VecEnv.push) == [
        ("force", either, required),
        ("torque", either, None),
        ("body", keyword, required),
        ("mask", keyword, None),
    ]
    assert parameters(VecEnv.vary) == [
        (name, keyword, None) for name in ("mass", "friction", "strength", "gravity", "mask")
    ]
    assert parameters(VecEnv.ground) == [("field", either, 0)]
    assert parameters(VecEnv.set_ground) == [
        ("elevations", either, required),
        ("field", either, 0),
        ("mask", either, None),
    ]
    assert parameters(VecEnv.set_command) == [("command", either, required), ("mask", either, None)]


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_properties_are_the_same(make: Callable[[], Any]) -> None:
    env = begun(make)
    assert all(hasattr(env, name) for name in PROPERTIES)
    assert env.num_envs == N
    assert isinstance(env.model, Model)
    assert env.command.shape[0] == N


def test_everything_of_the_native_environment_is_there_for_agents_in_python() -> None:
    native = {name for name in dir(VecEnv) if not name.startswith("_")}
    assert native <= set(dir(Arm.vec_env(1)))


def test_defaults_are_the_same() -> None:
    native, agents = VecEnv("Hopper-v0"), Arm.vec_env()
    assert native.autoreset == agents.autoreset == "next_step"
    for vector in (MarathonVectorEnv("Hopper-v0"), Arm.make_vec()):
        assert vector.autoreset_mode is vector.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.NEXT_STEP
        assert vector.num_envs == native.num_envs == agents.num_envs == 1
    assert native.threads == VecEnv("Hopper-v0", threads=0).threads
    shared = {"num_envs": 1, "threads": 0, "isa": None, "max_episode_steps": None}
    for made in (VecEnv, AgentVecEnv, MarathonVectorEnv):
        defaults = {p.name: p.default for p in inspect.signature(made).parameters.values()}
        assert {name: defaults[name] for name in shared} == shared, made


@pytest.mark.parametrize(("task", "dtype"), [("Hopper-v5", "float64"), ("Hopper-v0", "float32"), (Arm, "float32")])
def test_the_type_of_observations_is_a_fact_of_the_task(task: Any, dtype: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # it does not depend on the tasks that Gymnasium has
    monkeypatch.delitem(gymnasium.registry, "Hopper-v5")
    native = VecEnv(task, 2) if isinstance(task, str) else task.vec_env(2)
    vector = MarathonVectorEnv(task, 2)
    assert native.dtype == native.spec.dtype == native.reset().dtype == dtype
    assert vector.single_observation_space.dtype == vector.reset(seed=1)[0].dtype == dtype
    if isinstance(task, str):
        assert marathon_rl.spec(task).dtype == dtype
        assert [VecEnv(task, 1, dtype=given).dtype for given in ("float32", "float64")] == ["float32", "float64"]


# ------------------------------------------------------------------------------------------------------------- pushes


def test_a_push_moves_the_agents_of_a_mask(twins: tuple[Any, Any]) -> None:
    env, plain = twins
    force = np.tile([200.0, 0.0, 0.0], (N, 1))
    env.push(force, body=env.model.body_names[1], mask=MASK)
    assert differ(states(env), states(plain)) == MASK.tolist()


def test_a_push_without_a_mask_moves_all_agents_each_by_its_own_force(twins: tuple[Any, Any]) -> None:
    env, plain = twins
    force = np.zeros((N, 3))
    force[MASK, 0] = 200.0
    # an index does what the name does
    env.push(force, body=1)
    pushed = states(env)
    assert differ(pushed, states(plain)) == MASK.tolist()
    again = twins[1]
    again.reset(seed=1)
    again.push(force, body=again.model.body_names[1], mask=MASK)
    assert not any(differ(pushed, states(again)))


def test_a_torque_turns(twins: tuple[Any, Any]) -> None:
    env, plain = twins
    torque = np.tile([0.0, 20.0, 0.0], (N, 1))
    env.push(np.zeros((N, 3)), torque, body=1, mask=MASK.tolist())
    assert differ(states(env), states(plain)) == MASK.tolist()


def test_a_push_ends_with_the_next_one_or_with_the_episode(twins: tuple[Any, Any]) -> None:
    env, plain = twins
    force = np.tile([200.0, 0.0, 0.0], (N, 1))
    env.push(force, body=1)
    env.push(np.zeros((N, 3)), body=1, mask=MASK)
    assert differ(states(env), states(plain)) == (~MASK).tolist()
    for each in twins:
        each.reset(seed=2)
    assert not any(differ(states(env), states(plain)))


# ---------------------------------------------------------------------------------------------------------- constants


def test_constants_of_the_agents_of_a_mask_differ_over_resets(twins: tuple[Any, Any]) -> None:
    env, plain = twins
    gravity = np.tile([0.0, 0.0, -1.62], (N, 1))
    mass = np.full((N, len(env.model.body_names)), 1.25)
    env.vary(gravity=gravity, mass=mass, mask=MASK)
    assert differ(states(env), states(plain)) == MASK.tolist()
    for each in twins:
        each.reset(seed=2)
    assert differ(states(env), states(plain)) == MASK.tolist()
    # omitted constants are those of the model
    env.vary()
    for each in twins:
        each.reset(seed=3)
    assert not any(differ(states(env), states(plain)))


# ------------------------------------------------------------------------------------------------------------- ground


def test_ground_is_set_for_the_agents_of_a_mask(twins: tuple[Any, Any]) -> None:
    env, _ = twins
    before = env.ground()
    rows, columns = int(env.model.hfield_nrow[0]), int(env.model.hfield_ncol[0])
    assert before.shape == (N, rows, columns)
    assert before.dtype == np.float32
    own = np.random.default_rng(1).uniform(0.0, 0.5, before.shape).astype(np.float32)
    env.set_ground(own, mask=MASK)
    np.testing.assert_array_equal(env.ground(), np.where(MASK[:, None, None], own, before))
    # one grid for several agents
    env.set_ground(own[0], 0, ~MASK)
    np.testing.assert_array_equal(env.ground(0), np.where(MASK[:, None, None], own, own[0]))
    env.set_ground(own[3])
    np.testing.assert_array_equal(env.ground(field=0), np.broadcast_to(own[3], before.shape))
    # what is returned is the caller's
    env.ground()[:] = 9.0
    np.testing.assert_array_equal(env.ground(), np.broadcast_to(own[3], before.shape))


# ----------------------------------------------------------------------------------------------------------- commands


@pytest.mark.parametrize("make", COMMANDED.values(), ids=COMMANDED)
def test_commands_are_set_for_the_agents_of_a_mask(make: Callable[[], Any]) -> None:
    env, plain = begun(make), begun(make)
    spec = getattr(env, "task_spec", None) or env.spec
    low, high = np.array([[number.low, number.high] for number in spec.command]).T
    given = np.tile(low + 0.75 * (high - low), (N, 1))
    env.set_command(given, MASK)
    states(env, 1), states(plain, 1)
    np.testing.assert_allclose(env.command[MASK], given[MASK], rtol=1e-6)
    np.testing.assert_array_equal(env.command[~MASK], plain.command[~MASK])
    env.set_command(None)
    for each in (env, plain):
        each.reset(seed=2)
    np.testing.assert_array_equal(env.command, plain.command)


# ---------------------------------------------------------------------------------------------- snapshots and errors


def test_a_snapshot_holds_pushes_constants_and_ground(twins: tuple[Any, Any]) -> None:
    env, other = twins
    env.push(np.tile([50.0, 0.0, 0.0], (N, 1)), body=1, mask=MASK)
    env.vary(gravity=np.tile([0.0, 0.0, -5.0], (N, 1)), mask=~MASK)
    env.set_ground(np.full(env.ground().shape[1:], 0.125), mask=MASK)
    other.load(env.save())
    np.testing.assert_array_equal(other.ground(), env.ground())
    assert not any(differ(states(env), states(other)))


WRONG: list[tuple[Callable[[Any], Any], str]] = [
    (lambda env: env.push(np.zeros(3), body=1), r"force has the shape \(3,\), expected \(5, 3\)"),
    (lambda env: env.push(np.zeros((4, 3)), body=1), r"force has the shape \(4, 3\), expected \(5, 3\)"),
    (lambda env: env.push(np.zeros((5, 3)), np.zeros(3), body=1), r"torque has the shape \(3,\), expected \(5, 3\)"),
    (lambda env: env.push(np.full((5, 3), np.nan), body=1), "agent 0: force is NaN, expected finite numbers"),
    (lambda env: env.push(np.zeros((5, 3)), body=99), r"body is 99, expected less than \d+"),
    (lambda env: env.push(np.zeros((5, 3)), body="nobody"), "the model has no body 'nobody'"),
    (lambda env: env.push(np.zeros((5, 3)), body=1, mask=[True]), r"mask is bool \(1,\), expected a boolean array"),
    (lambda env: env.vary(friction=np.ones(4)), r"friction has the shape \(4,\), expected \(5,\)"),
    (lambda env: env.vary(friction=[1, 1, -1, 1, 1]), "agent 2: friction is -1, expected a factor of 0 or more"),
    (lambda env: env.vary(gravity=np.full((5, 3), np.inf)), "agent 0: gravity is inf, expected finite numbers"),
    (lambda env: env.set_ground(np.zeros((2, 3))), r"elevations have the shape \(2, 3\), expected \(5, \d+, \d+\) or"),
    (lambda env: env.set_ground(env.ground() + np.nan), "elevations have a number that is NaN, expected finite ones"),
    (lambda env: env.set_ground(env.ground(), 1), "field is 1, expected less than 1"),
    (lambda env: env.ground(1), "field is 1, expected less than 1"),
]


def test_errors_are_the_same_and_change_nothing(twins: tuple[Any, Any]) -> None:
    env, plain = twins
    before = env.ground()
    for call, message in WRONG:
        with pytest.raises(ValueError, match=message):
            call(env)
    np.testing.assert_array_equal(env.ground(), before)
    assert not any(differ(states(env), states(plain)))


def test_numbers_of_agents_that_are_not_selected_are_not_checked(twins: tuple[Any, Any]) -> None:
    env, plain = twins
    nothing = np.where(MASK[:, None], 0.0, np.nan) * np.ones((N, 3))
    env.push(nothing, body=1, mask=MASK)
    env.vary(friction=np.where(MASK, 1.0, -1.0), mask=MASK)
    ground = env.ground()
    ground[~MASK] = np.nan
    env.set_ground(ground, mask=MASK)
    assert not any(differ(states(env), states(plain)))


def test_a_simulation_takes_the_same_inputs() -> None:
    sim, plain = (Simulation(Model.from_xml_string(BALL), N) for _ in range(2))
    assert sim.num_envs == len(sim) == N
    sim.push(np.tile([9.0, 0.0, 0.0], (N, 1)), body="ball", mask=MASK)
    sim.vary(gravity=np.zeros((N, 3)), mask=~MASK)
    for each in (sim, plain):
        each.step(np.zeros((N, 1)), 4)
    assert all(differ(sim.qvel, plain.qvel))
    # a push along x leaves the fall alone, and without gravity nothing moves
    np.testing.assert_allclose(sim.qvel[MASK, 2], plain.qvel[MASK, 2], rtol=1e-3)
    np.testing.assert_allclose(sim.qvel[~MASK], 0.0, atol=1e-6)
    hills = np.random.default_rng(2).uniform(0.0, 1.0, (N, ROWS, COLUMNS)).astype(np.float32)
    sim.set_ground(hills)
    np.testing.assert_array_equal(sim.ground(), hills)
    for call, message in WRONG:
        with pytest.raises(ValueError, match=message):
            call(sim)
