"""Agents that take commands, and names of their observations, for classes in Python and for native tasks."""

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest

import marathon_rl
from marathon_rl import CommandRange, MarathonAgent, VecEnv, train
from marathon_rl._arrays import Streams

CART = """
<mujoco model="cart">
  <option timestep="0.01"/>
  <worldbody>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0" damping="1"/>
      <geom name="cart" size="0.1" contype="0" conaffinity="0"/>
      <body name="arm">
        <joint name="arm" axis="0 1 0"/>
        <geom size="0.05" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="rail" joint="rail" gear="20"/></actuator>
</mujoco>"""
N = 5


class Cart(MarathonAgent):
    """Drive at a velocity."""

    mjcf = CART
    frame_skip = 2
    max_episode_steps = 40
    termination_reward = None
    commands = (CommandRange("velocity", -2, 2, "m/s"), CommandRange("brake", 0, 1))
    metrics = ("error",)
    memory_size = 2

    def agent_reset(self, random: Streams) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        n = len(random)
        memory = np.column_stack([np.zeros(n), random.uniform(1, 2)])
        return np.zeros((n, 2)), np.zeros((n, 2)), memory

    def draw_command(self, random: Streams, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        drawn = random.uniform([-2, 0], [2, 1], size=2)
        return drawn, random.uniform(3, 10)[:, 0].astype(int)

    def ctrl(self) -> np.ndarray:
        # half at once, half with the next decision
        ctrl = 0.5 * (self.action + self.memory[:, :1])
        self.memory[:, :1] = self.action
        return ctrl

    def observations(self) -> dict[str, np.ndarray]:
        return {"velocity": self.sim.qvel[:, 0], "command": self.command, "memory": self.memory}

    def step_reward(self) -> dict[str, np.ndarray]:
        return {"tracking": -np.abs(self.sim.qvel[:, 0] - self.command[:, 0])}

    def info(self) -> dict[str, np.ndarray]:
        return {"error": np.abs(self.sim.qvel[:, 0] - self.command[:, 0])}


def actions(decision: int) -> np.ndarray:
    return np.random.default_rng(decision).uniform(-1, 1, (N, 1)).astype(np.float32)


def commanded(obs: np.ndarray) -> np.ndarray:
    return obs[:, 1:3]


def test_a_schedule_is_drawn_observed_and_rewarded() -> None:
    carts = Cart.vec_env(N, seed=3, autoreset="same_step")
    obs, story = carts.reset(seed=3), []
    assert len(np.unique(obs[:, 1])) == N
    for decision in range(100):
        told = commanded(obs).copy()
        assert np.array_equal(told, carts.command.astype(np.float32))
        obs, reward, _, truncated = carts.step(actions(decision))
        # rewarded for the command under which it acted, not for the next one
        expected = -np.abs(carts.final_obs[:, 0] - told[:, 0])
        assert reward == pytest.approx(expected, abs=1e-5)
        assert carts.info[:, 0] == pytest.approx(-expected, abs=1e-5)
        story.append(told[0, 0])
        assert truncated.all() == ((decision + 1) % 40 == 0)
    lengths = np.diff(np.flatnonzero(np.diff(story, prepend=np.nan, append=np.nan)))
    assert lengths.min() >= 1 and lengths.max() <= 9 and len(lengths) > 10


def test_a_caller_goes_before_the_schedule_and_gives_it_back() -> None:
    alone, told = (Cart.vec_env(N, seed=3, threads=t) for t in (1, 2))
    both = alone.reset(seed=3), told.reset(seed=3)
    mask = np.arange(N) == 1
    for decision in range(38):
        if decision == 10:
            told.set_command(np.full((N, 2), 0.5), mask)
        if decision == 20:
            told.set_command(None)
        both = alone.step(actions(decision))[0], told.step(actions(decision))[0]
        a, b = commanded(both[0]), commanded(both[1])
        held = mask & (10 <= decision < 20)
        assert (b[held] == 0.5).all() and np.array_equal(a[~held], b[~held])


def test_what_a_start_draws_is_remembered_and_an_action_passes_through_ctrl() -> None:
    carts = Cart.vec_env(N)
    obs = carts.reset(seed=1)
    drawn = obs[:, 4].copy()
    assert ((drawn >= 1) & (drawn < 2)).all() and len(np.unique(drawn)) == N
    mass = carts.agent.model.body_mass.sum()
    velocity = 0.0
    for action, ctrl in ((1.0, 0.5), (0.0, 0.5), (-1.0, -0.5)):
        obs = carts.step(np.full((N, 1), action, np.float32))[0]
        for _ in range(2):
            velocity = (mass * velocity + 0.01 * 20 * ctrl) / (mass + 0.01)
        assert obs[:, 0] == pytest.approx(np.full(N, velocity), rel=1e-4)
        assert (obs[:, 3] == action).all() and np.array_equal(obs[:, 4], drawn)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env)), None])  # noqa: S301
def test_snapshots_hold_commands(again: Any) -> None:
    carts = Cart.vec_env(N, seed=3)
    carts.reset(seed=3)
    for decision in range(17):
        if decision == 9:
            carts.set_command(np.full((N, 2), 0.25), np.arange(N) < 2)
        carts.step(actions(decision))
    # told, but not observed yet
    carts.set_command(np.full((N, 2), 0.75), np.arange(N) == 4)
    if again:
        other = again(carts)
    else:
        other = Cart.vec_env(N, seed=9, threads=2)
        other.reset()
        other.set_command(np.zeros((N, 2)))
        other.load(carts.save())
    for decision in range(17, 60):
        for a, b in zip(carts.step(actions(decision)), other.step(actions(decision)), strict=True):
            assert np.array_equal(a, b)
    assert (commanded(carts.obs)[4] == 0.75).all()


def test_gymnasium_environments_take_commands() -> None:
    env = Cart.make()
    env.reset(seed=1)
    env.set_command([1.5, 0.5])
    assert env.step(np.zeros(1, np.float32))[0][1:3].tolist() == [1.5, 0.5]
    env.set_command(None)
    assert env.step(np.zeros(1, np.float32))[0][1] != 1.5
    envs = Cart.make_vec(3)
    envs.reset(seed=1)
    envs.set_command(np.full((3, 2), 0.5), np.array([False, True, False]))
    obs = envs.step(np.zeros((3, 1), np.float32))[0]
    assert (obs[:, 1] == 0.5).tolist() == [False, True, False]


def test_the_native_trainer_learns_from_agents_with_commands() -> None:
    config = {"run": {"agents": 16, "horizon": 128, "total_steps": 4_096}}
    result = train(Cart, config, threads=1)
    assert result.steps >= 4_096 and np.isfinite(result.evaluation["return_mean"])


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (np.full((N, 2), 3.0), r"agent 0 of 'Cart-v0': command velocity is 3.0, expected -2 to 2 m/s"),
        (
            np.where(np.arange(N)[:, None] == 2, np.nan, 0.5) * np.ones((1, 2)),
            "agent 2 of 'Cart-v0': command velocity is nan",
        ),
        (np.zeros((N, 1)), r"command has the shape \(5, 1\), expected \(5, 2\)"),
    ],
)
def test_what_cannot_be_told_is_refused(command: np.ndarray, message: str) -> None:
    carts = Cart.vec_env(N)
    carts.reset(seed=1)
    with pytest.raises(ValueError, match=message):
        carts.set_command(command)
    with pytest.raises(ValueError, match="command 'x' is from 1 to 0, expected a range"):
        CommandRange("x", 1, 0)
    for hopper in (VecEnv("Hopper-v0", N), gymnasium.make("marathon_rl/Hopper-v0").unwrapped):
        with pytest.raises(ValueError, match=r"the agents of Hopper-v0 take no commands, spec\.command is empty"):
            hopper.set_command(None)


def test_the_ends_of_ranges_may_be_in_single_precision() -> None:
    """float32, the type of all arrays of the package, has no number for pi/2: the nearest is beyond it."""
    man = VecEnv("MarathonManController-v0", 1)
    man.reset(seed=1)
    turn = [range.name for range in man.spec.command].index("turn")
    for sign in (1, -1):
        command = np.zeros((1, len(man.spec.command)), np.float32)
        command[0, turn] = sign * np.pi / 2
        assert abs(float(command[0, turn])) > np.pi / 2
        man.set_command(command)
        man.step(np.zeros((1, man.spec.act_size)))
        # the agents compute in single precision, so a commanded value can be passed again
        assert man.command[0, turn] == np.float32(sign * np.pi / 2)
        man.set_command(man.command)
        command[0, turn] = np.nextafter(command[0, turn], np.float32(sign * np.inf))
        with pytest.raises(ValueError, match="command turn is"):
            man.set_command(command)

    class Turner(Cart):
        commands = (CommandRange("turn", -np.pi / 2, np.pi / 2, "rad/s"), CommandRange("brake", 0.1, 0.7))

    carts = Turner.vec_env(N)
    carts.reset(seed=1)
    carts.set_command(np.full((N, 2), [np.pi / 2, 0.7], np.float32))
    carts.step(np.zeros((N, 1)))
    # an end whose float32 number lies within the range stays that number
    assert carts.command.tolist() == [[np.pi / 2, float(np.float32(0.7))]] * N
    carts.set_command(np.full((N, 2), [-np.pi / 2, 0.1], np.float32))
    carts.step(np.zeros((N, 1)))
    assert carts.command.tolist() == [[-np.pi / 2, float(np.float32(0.1))]] * N
    with pytest.raises(ValueError, match=r"command brake is 0\.70"):
        carts.set_command(np.full((N, 2), [0.0, 0.70001]))


def test_facts_of_a_class_have_names() -> None:
    spec = Cart.vec_env(2).spec
    assert spec.observations == {"velocity": slice(0, 1, 1), "command": slice(1, 3, 1), "memory": slice(3, 5, 1)}
    assert spec.command == list(Cart.commands) and copy.deepcopy(spec.command) == spec.command
    assert spec.metrics == ["error"] and repr(spec.command[0]) == 'CommandRange("velocity", -2, 2, "m/s")'

    class Twice(Cart):
        commands = (CommandRange("velocity", -2, 2), CommandRange("velocity", 0, 1))

    class Unknown(Cart):
        metrics = ("eror",)

    for wrong, message in ((Twice, "expected names of their own"), (Unknown, "its metric 'eror' is neither 'forward'")):
        with pytest.raises(ValueError, match=message):
            wrong.vec_env(2)


def sizes(id: str) -> dict[str, int]:
    return {name: part.stop - part.start for name, part in marathon_rl.spec(id).observations.items()}


# These tasks of Gymnasium have no `observation_structure`.
UNNAMED = {"InvertedDoublePendulum-v5", "Pusher-v5", "Reacher-v5"}


@pytest.mark.parametrize("id", [id for id in marathon_rl.ids() if id.endswith("-v5") and id not in UNNAMED])
def test_gymnasiums_tasks_name_their_observations_as_gymnasium_does(id: str) -> None:
    structure = gymnasium.make(id).unwrapped.observation_structure  # type: ignore[attr-defined]
    assert sizes(id) == {name: n for name, n in structure.items() if n and name != "skipped_qpos"}


def test_a_part_of_an_observation_is_taken_by_its_name() -> None:
    env = VecEnv("hopper-stand-v0", 2)
    obs = env.reset(seed=1)
    assert obs[:, env.spec.observations["touch"]].tolist() == obs[:, 13:15].tolist()
    hopper = marathon_rl.spec("Hopper-v0")
    assert hopper.observations["touch"] == slice(9, 10, 1) and hopper.metrics == ["forward"] and hopper.command == []
