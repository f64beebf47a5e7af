"""Agents written in Python: subclass `MarathonAgent`.

One object is a number of agents of one kind, and every function of it is about all of them: it returns arrays with a
row per agent. The names and values of the helpers are those of the Rust library (and of the original's
`MarathonAgent`); angles are compared by the angle itself, so a bonus falls linearly from full at 0 to its negative at
180 degrees. World axes: +x forward, +y left, +z up; SI units.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from marathon_rl._arrays import BoolArray, FloatArray, Streams
from marathon_rl._joints import JointRotations
from marathon_rl._native import CommandRange, Model, Simulation

if TYPE_CHECKING:
    from marathon_rl.agent_env import AgentVecEnv
    from marathon_rl.env import MarathonEnv
    from marathon_rl.vector import MarathonVectorEnv

MAX_SPEED = 4.0
"""Speed in m/s that `MarathonAgent.velocity` calls 1."""
AT_LIMIT_PENALTY = 0.2
"""Penalty per joint driven at its limit."""


@dataclass(frozen=True)
class ResetNoise:
    """How far the start of an episode strays from the spawn pose: half widths of uniform distributions around zero."""

    joint_position: float = 0.01
    """Actuated joints, rad or m; the result is clamped to the joint's range."""
    joint_velocity: float = 0.1
    """Actuated joints, rad/s or m/s."""
    root_velocity: float = 0.025
    """Linear velocity of the root (a free joint, or unactuated slides), m/s."""


class _Part(NamedTuple):
    """A geom, the body it belongs to, and the axes of that body that pointed forward and up in the spawn pose."""

    geom: int
    body: int
    forward: FloatArray
    up: FloatArray


class MarathonAgent:
    """A number of agents with a task.

    Override `observations`, `step_reward` and `terminate`, and `agent_reset` for a start of your own. `make` and
    `make_vec` turn a subclass into Gymnasium environments. *Parts* are geoms of the model, by name.
    """

    mjcf: ClassVar[str | PathLike[str]]
    """The model: a path, or MJCF text. A keyframe named `spawn`, if there is one, is how episodes start."""
    frame_skip: ClassVar[int] = 4
    """Physics steps per decision."""
    max_episode_steps: ClassVar[int] = 1000
    """Decisions after which an episode is truncated."""
    feet: ClassVar[Sequence[str]] = ()
    """Geoms that may touch the ground."""
    touch: ClassVar[Sequence[str]] = ()
    """Geoms with a touch sensor."""
    reset_noise: ClassVar[ResetNoise] = ResetNoise()
    """Randomness of the start."""
    termination_reward: ClassVar[float | None] = -1.0
    """Reward of a decision in which an agent failed, in place of all other terms; None: the terms count on."""
    controls: ClassVar[Literal["nominal", "raw"]] = "nominal"
    """Meaning of an action. "nominal": a number in [-1, 1] per actuator, clipped. "raw": the actuator's control in its
    own units, within its `ctrlrange` but not clipped: the agent sees and pays for what was asked for, while the physics
    clamps what acts."""
    commands: ClassVar[Sequence[CommandRange]] = ()
    """Commands that the agents take, a number each; see `draw_command`."""
    metrics: ClassVar[Sequence[str]] = ("forward",)
    """Numbers that tell, decision by decision, how well the task is done: names out of `info`, and "forward"."""
    memory_size: ClassVar[int] = 0
    """Number of variables that an agent keeps from decision to decision, see `remember`."""

    def __init__(self, num_envs: int = 1, *, threads: int = 0, isa: Any = None) -> None:
        """Load the model and put all agents into the spawn pose. `threads` and `isa` are those of `Simulation`."""
        self.model = self.load_model()
        self.sim = Simulation(self.model, num_envs, threads=threads, isa=isa)
        self.num_envs = num_envs = self.sim.num_envs
        self.action: FloatArray = np.zeros((num_envs, self.model.nu))
        """Actions of the last decision, as `controls` says, `(N, nu)`; zero at the start of an episode."""
        self.memory: FloatArray = np.zeros((num_envs, self.memory_size))
        """The agents' own variables, `(N, memory_size)`; at the start of an episode zero, or from `agent_reset`."""
        self.command: FloatArray = np.zeros((num_envs, len(self.commands)))
        """Commands of the agents, `(N, len(commands))`.

        In `observations` it is what to do from now on, elsewhere what the decision was made under.
        """
        self._anatomy()

    def _anatomy(self) -> None:
        """Resolve names to indices, once."""
        model = self.model
        if "spawn" in model.keyframe_names:
            self.spawn_qpos, self.spawn_qvel = model.keyframe("spawn")
        else:
            self.spawn_qpos, self.spawn_qvel = model.qpos0, np.zeros(model.nv)
        still = Simulation(model, 1, threads=1, isa="f64")
        still.reset(self.spawn_qpos[None], np.zeros((1, model.nv)))
        self._spawn_axes = still.body_axes[0]
        self._parts: dict[str, _Part] = {}
        self._touch = [model.geom(name) for name in self.touch]
        feet = {model.geom(name) for name in self.feet}
        moves = model.body_weld[model.geom_body] != 0
        self._not_feet = [g for g in range(len(moves)) if moves[g] and g not in feet]
        self._actuator_names = model.actuator_names
        self._counted: dict[tuple[str, ...], BoolArray] = {}

        self._motors = model.actuator_joint[model.actuator_joint >= 0]
        kinds = np.array(model.joint_type, dtype=object)
        rotates = np.isin(kinds, ("hinge", "ball"))
        self._motor_dofs = model.joint_dof[self._motors]
        self._motor_scale = np.where(rotates[self._motors], 1 / np.pi, 1.0)
        self._rotations = JointRotations(model, [int(j) for j in self._motors if rotates[j]])

        # where the reset makes noise: actuated joints with one coordinate, and the root's linear velocity
        scalar = np.isin(kinds, ("hinge", "slide"))
        self._noisy = np.array(list(dict.fromkeys(int(j) for j in self._motors if scalar[j])), int)
        driven = set(self._noisy.tolist())
        root: list[int] = []
        along_x: list[tuple[int, float]] = []
        first_root = model.body_root[model.joint_body[0]] if len(kinds) else 0
        for joint, kind in enumerate(kinds):
            dof, qpos = int(model.joint_dof[joint]), int(model.joint_qpos[joint])
            if kind == "free":
                root += range(dof, dof + 3)
                if model.body_root[model.joint_body[joint]] == first_root:
                    along_x.append((qpos, 1.0))
            elif kind == "slide" and joint not in driven:
                root.append(dof)
                if model.joint_axis[joint, 0] != 0:
                    along_x.append((qpos, float(model.joint_axis[joint, 0])))
        self._root_dofs = root
        self._along_x = along_x

    # ------------------------------------------------------------------------------------------------ to be overridden

    def agent_reset(self, random: Streams) -> tuple[FloatArray, FloatArray] | tuple[FloatArray, FloatArray, FloatArray]:
        """Return the states in which `len(random)` agents begin episodes: `qpos`, `(n, nq)`, and `qvel`, `(n, nv)`.

        A third array, `(n, memory_size)`, is what their memory begins with.

        Random numbers come from `random`, row by row from each agent's own stream. This one is the spawn pose and
        velocity with `reset_noise`.
        """
        noise, n = self.reset_noise, len(random)
        qpos, qvel = np.tile(self.spawn_qpos, (n, 1)), np.tile(self.spawn_qvel, (n, 1))
        joints = self._noisy
        at, dof = self.model.joint_qpos[joints], self.model.joint_dof[joints]
        low, high = self.model.joint_range[joints].T
        spread = noise.joint_position
        qpos[:, at] = np.clip(qpos[:, at] + random.uniform(-spread, spread, len(joints)), low, high)
        qvel[:, dof] += random.uniform(-noise.joint_velocity, noise.joint_velocity, len(joints))
        qvel[:, self._root_dofs] += random.uniform(-noise.root_velocity, noise.root_velocity, len(self._root_dofs))
        return qpos, qvel

    def draw_command(self, random: Streams, step: npt.NDArray[np.int64]) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return commands for `len(random)` agents, `(n, len(commands))`, and their number of decisions, `(n,)`.

        It is the agents' own schedule, asked at the start of an episode and whenever a command has run out; `step`,
        `(n,)`, is the number of each agent's observation in its episode. Random numbers come from `random`, row by row
        from a stream that belongs to the agent, its episode and its step. A caller's `set_command` goes before it.
        This one: the values nearest to 0, for ever.
        """
        nearest = [min(max(0.0, number.low), number.high) for number in self.commands]
        return np.tile(nearest, (len(random), 1)), np.full(len(random), 2**62)

    def ctrl(self) -> FloatArray:
        """Return the controls of the actuators until the next decision, `(N, nu)`. This one: the actions.

        It is called once per decision, before the physics: the place of scaling, delays and targets of servos.
        """
        return self.action

    def remember(self) -> None:
        """Update `memory`, once per decision, before `observations` and `step_reward` read it."""

    def observations(self) -> FloatArray | Sequence[FloatArray] | Mapping[str, FloatArray]:
        """Return what the agents see: `(N, obs_size)`, or arrays `(N,)` and `(N, k)` to be laid side by side.

        The keys of a dictionary are the names in `spec.observations`.

        It may be called more than once for a state, and changes nothing.
        """
        raise NotImplementedError(f"{type(self).__name__} does not define observations")

    def step_reward(self) -> Mapping[str, FloatArray]:
        """Return the terms of the reward of the decision just made by name, `(N,)` each; the reward is their sum."""
        raise NotImplementedError(f"{type(self).__name__} does not define step_reward")

    def terminate(self) -> BoolArray:
        """Return which agents have failed, `(N,)`. This one: none."""
        return self.terminate_never()

    def truncate(self) -> BoolArray:
        """Return which agents end their episode before the time limit without failure, `(N,)`: by default, none."""
        return self.terminate_never()

    def info(self) -> Mapping[str, FloatArray]:
        """Return numbers that are neither observed nor rewarded by name, `(N,)` each: for logs. This one: none."""
        return {}

    # ------------------------------------------------------------------------------------------------------ perception

    def _part(self, name: str) -> _Part:
        if name not in self._parts:
            geom = self.model.geom(name)
            body = int(self.model.geom_body[geom])
            # a world axis in body coordinates: that component of each body axis
            axes = self._spawn_axes[body]
            self._parts[name] = _Part(geom, body, axes[:, 0].copy(), axes[:, 2].copy())
        return self._parts[name]

    def position(self, part: str) -> FloatArray:
        """Position of a part's center, m, `(N, 3)`."""
        return self.sim.geom_pos[:, self._part(part).geom]

    def linear_velocity(self, part: str) -> FloatArray:
        """Velocity of a part's center, m/s, `(N, 3)`."""
        return self.sim.geom_velocity[:, self._part(part).geom]

    def forward(self, part: str) -> FloatArray:
        """The axis of a part that pointed forward (+x) in the spawn pose, `(N, 3)`."""
        found = self._part(part)
        axis: FloatArray = found.forward @ self.sim.body_axes[:, found.body]
        return axis

    def up(self, part: str) -> FloatArray:
        """The axis of a part that pointed up (+z) in the spawn pose, `(N, 3)`."""
        found = self._part(part)
        axis: FloatArray = found.up @ self.sim.body_axes[:, found.body]
        return axis

    def touch_sensors(self) -> FloatArray:
        """1 for each geom of `touch` that touches the ground, else 0, `(N, len(touch))`."""
        return self.sim.touching[:, self._touch].astype(float)

    def joint_rotations(self) -> FloatArray:
        """Orientation of the parent as seen from the child for each actuated pair of bodies, `(N, 4 * pairs)`.

        Quaternions x y z w with w >= 0, in the order of the actuators. A joint with several axes is one pair.
        """
        return self._rotations(self.sim.qpos)

    def joint_velocities(self) -> FloatArray:
        """Velocity of the joint that each motor drives: half turns per second for hinges, m/s for slides, `(N, nu)`."""
        return self.sim.qvel[:, self._motor_dofs] * self._motor_scale

    def ground_height(self, x: FloatArray | float, y: FloatArray | float) -> FloatArray:
        """Height of the ground at places of the world, m: of planes, and of height fields that lie level.

        `x` and `y`, m, are `(N,)` or `(N, k)`, or numbers, and so is the result: `(N,)`, or `(N, k)`. Every agent has
        its own ground. Beyond all of it, the height is that of the nearest place; 0 if the model has none.
        """
        x, y = np.broadcast_arrays(x, y)
        shape = x.shape or (self.num_envs,)
        rows = shape if len(shape) == 2 else (shape[0], 1)
        x, y = (np.broadcast_to(places, shape).reshape(rows) for places in (x, y))
        return self.sim.ground_height(x, y).reshape(shape)

    def heading(self, part: str) -> FloatArray:
        """Which way a part's forward axis points along the ground, `(N, 2)`: cosine and sine of the angle from +x.

        Of an axis that points straight up or down, that of +x.
        """
        x, y, _ = self.forward(part).T
        length = np.hypot(x, y)
        level = length > 1e-6
        scale = np.where(level, length, 1.0)
        return np.stack([np.where(level, x / scale, 1.0), np.where(level, y / scale, 0.0)], 1)

    def height_scan(self, part: str, points: Sequence[tuple[float, float]] | FloatArray) -> FloatArray:
        """How far the ground is above a part's center, m, mostly negative, `(N, len(points))`.

        The points are `(ahead, left)` of the center, m, by the part's `heading`.
        """
        ahead, left = np.reshape(np.asarray(points, float), (-1, 2)).T
        center, heading = self.position(part), self.heading(part)
        cosine, sine = heading[:, :1], heading[:, 1:]
        x = center[:, :1] + cosine * ahead - sine * left
        y = center[:, 1:2] + sine * ahead + cosine * left
        return self.ground_height(x, y) - center[:, 2:]

    # -------------------------------------------------------------------------------------------------- helper library

    def velocity(self, part: str) -> FloatArray:
        """Forward velocity of a part in units of 4 m/s (`GetVelocity`)."""
        return self.linear_velocity(part)[:, 0] / MAX_SPEED

    def normalized_velocity(self, part: str, fastest: float) -> FloatArray:
        """Forward velocity over `fastest` (m/s), clamped to [0, 1]: that of the `-v1` agents."""
        return np.clip(self.linear_velocity(part)[:, 0] / fastest, 0.0, 1.0)

    def direction_bonus(self, axis: FloatArray, direction: FloatArray, max: float = 0.5) -> FloatArray:
        """`max` where vectors, `(N, 3)` or `(3,)`, coincide, falling with the angle to `-max` (`GetDirectionBonus`)."""
        return max - angle(axis, direction) * (2 * max / np.pi)

    def forward_bonus(self, part: str, max: float = 0.5) -> FloatArray:
        """Direction bonus of a part's forward axis to +x: sees pitch and yaw, not roll (`GetForwardBonus`)."""
        return self.direction_bonus(self.forward(part), np.array([1.0, 0.0, 0.0]), max)

    def upright_bonus(self, part: str, max: float = 0.5) -> FloatArray:
        """Direction bonus of a part's up axis to +z: sees pitch and roll, not yaw (`GetUprightBonus`)."""
        return self.direction_bonus(self.up(part), np.array([0.0, 0.0, 1.0]), max)

    def left_bonus(self, part: str) -> FloatArray:
        """Angle by which a part's forward axis points out of the sagittal plane to the left, over 180 degrees."""
        x, y, z = self.forward(part).T
        bonus: FloatArray = np.arctan2(y, np.hypot(x, z)) / np.pi
        return bonus

    def right_bonus(self, part: str) -> FloatArray:
        """The negative of `left_bonus` (`GetRightBonus`)."""
        return -self.left_bonus(part)

    def flexion(self, part: str) -> FloatArray:
        """How far a part's forward axis points above the horizon, in quarter turns: for a thigh, the hip's flexion."""
        x, y, z = self.forward(part).T
        flexion: FloatArray = np.arctan2(z, np.hypot(x, y)) * (2 / np.pi)
        return flexion

    def height(self, part: str) -> FloatArray:
        """Height of a part's center, m (`GetHeight`)."""
        return self.position(part)[:, 2]

    def height_penalty(self, part: str, height: float) -> FloatArray:
        """How far a part is below `height`, clamped to [0, height] (`GetHeightPenality`)."""
        return np.clip(height - self.height(part), 0.0, height)

    def effort(self, ignore: Sequence[str] = ()) -> FloatArray:
        """Sum of squared actions, except those of the motors in `ignore` (`GetEffort`)."""
        effort: FloatArray = np.square(self._actions(ignore)).sum(1)
        return effort

    def effort_mean(self, ignore: Sequence[str] = ()) -> FloatArray:
        """Mean of squared actions, except those of the motors in `ignore`."""
        return self.effort(ignore) / max(1, int(self._counts(ignore).sum()))

    def effort_sum(self, ignore: Sequence[str] = ()) -> FloatArray:
        """Sum of the actions' absolute values, except those of the motors in `ignore` (`GetEffortSum`)."""
        effort: FloatArray = np.abs(self._actions(ignore)).sum(1)
        return effort

    def joints_at_limit_penalty(self, ignore: Sequence[str] = ()) -> FloatArray:
        """0.2 per motor driven with full action, except those in `ignore` (`GetJointsAtLimitPenality`).

        As in the original, it is the action that is tested, not the joint's angle.
        """
        driven: FloatArray = np.count_nonzero(np.abs(self._actions(ignore)) >= 1.0, axis=1) * AT_LIMIT_PENALTY
        return driven

    def terminate_never(self) -> BoolArray:
        """No agent (`TerminateNever`)."""
        return np.zeros(self.num_envs, np.bool_)

    def terminate_on_non_foot_contact(self) -> BoolArray:
        """Where a geom that is not of `feet` touched the ground in the decision (`TerminateOnNonFootHitTerrain`)."""
        hit: BoolArray = np.any(self.sim.touched[:, self._not_feet], axis=1)
        return hit

    def _counts(self, ignore: Sequence[str]) -> BoolArray:
        """Motors that are not ignored."""
        key = tuple(ignore)
        if key not in self._counted:
            counted = np.ones(self.model.nu, np.bool_)
            counted[[self.model.actuator(name) for name in key]] = False
            self._counted[key] = counted
        return self._counted[key]

    def _actions(self, ignore: Sequence[str]) -> FloatArray:
        return self.action if not ignore else self.action[:, self._counts(ignore)]

    # ------------------------------------------------------------------------------------------------- as environments

    def x_position(self) -> FloatArray | None:
        """Position of the agents' roots along x, m, `(N,)`; None if they cannot move along x."""
        if not self._along_x:
            return None
        qpos, columns, shares = self.sim.qpos, [q for q, _ in self._along_x], [s for _, s in self._along_x]
        x: FloatArray = qpos[:, columns] @ np.array(shares)
        return x

    @classmethod
    def load_model(cls) -> Model:
        """Read and compile the model."""
        source = getattr(cls, "mjcf", None)
        if source is None:
            raise TypeError(f"{cls.__name__} has no model: set the class attribute mjcf to a path or MJCF text")
        text = fspath(source)
        is_text = text.lstrip().startswith("<")
        return Model.from_xml_string(text, cls.__name__) if is_text else Model.from_xml_path(text)

    @classmethod
    def task_id(cls) -> str:
        """Name of the task: the class's own, with a version."""
        return f"{cls.__name__}-v0"

    @classmethod
    def summary(cls) -> str:
        """First line of the class's documentation."""
        return (inspect.getdoc(cls) or "").partition("\n")[0]

    @classmethod
    def vec_env(cls, num_envs: int = 1, **options: Any) -> AgentVecEnv:
        """Many agents with the interface of the native `VecEnv`; the options are its own."""
        from marathon_rl.agent_env import AgentVecEnv  # noqa: PLC0415 (it imports this module)

        return AgentVecEnv(cls, num_envs, **options)

    @classmethod
    def make(cls, **options: Any) -> MarathonEnv:
        """One agent as a Gymnasium environment; the options are those of `MarathonEnv`.

        As `gymnasium.make` would, it truncates episodes after `max_episode_steps`.
        """
        from marathon_rl.env import MarathonEnv  # noqa: PLC0415

        return MarathonEnv(cls, **{"max_episode_steps": cls.max_episode_steps, **options})

    @classmethod
    def make_vec(cls, num_envs: int = 1, **options: Any) -> MarathonVectorEnv:
        """Many agents as a Gymnasium vector environment; the options are those of `MarathonVectorEnv`."""
        from marathon_rl.vector import MarathonVectorEnv  # noqa: PLC0415

        return MarathonVectorEnv(cls, num_envs, **options)


def angle(a: FloatArray, b: FloatArray) -> FloatArray:
    """Angle between vectors, `(..., 3)`, rad: exact where an arc cosine loses half of its digits."""
    cross = np.cross(a, b)
    dot = (a * b).sum(-1)
    between: FloatArray = np.arctan2(np.sqrt(np.square(cross).sum(-1)), dot)
    return between
