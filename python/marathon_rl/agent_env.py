"""Episodes of agents written in Python, with the interface of the native `VecEnv`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt

from marathon_rl import _snapshots
from marathon_rl._arrays import BoolArray, FloatArray, Streams, real_numbers
from marathon_rl._native import CommandRange, Model, Viewer, _count, _mask, _seeds
from marathon_rl.agents import MarathonAgent

LARGEST = 1e6
"""A coordinate or velocity beyond this is a broken simulation, though it may still be finite."""
STORABLE = float(np.finfo(np.float32).max)
"""Observations and rewards may be of any size that the arrays hold."""
TERMINATION_TERM = "termination"
"""Name of the reward term that replaces all others when an agent fails."""
_AUTORESET = {"nextstep": "next_step", "samestep": "same_step", "disabled": "disabled"}
_SAVED = ("memory", "seeds", "numbers", "episodes", "steps", "pending")
_COMMANDS = ("command", "scheduled", "due", "given", "commanded")


@dataclass(frozen=True)
class AgentSpec:
    """Constant facts of a task, those of the native `Spec`."""

    id: str
    summary: str
    obs_size: int
    act_size: int
    action_names: list[str]
    action_low: list[float]
    action_high: list[float]
    dt: float
    frame_skip: int
    max_episode_steps: int
    reward_terms: list[str]
    info: list[str]
    nq: int
    nv: int
    metrics: list[str]
    observations: dict[str, slice]
    command: list[CommandRange]
    options: dict[str, Any]
    """Arguments of the agent's constructor that were given."""
    dtype: ClassVar[Literal["float32"]] = "float32"
    """Type of the observations."""


class AgentVecEnv:
    """Many agents of a `MarathonAgent` class, stepped together, with the interface of the native `VecEnv`.

    Physics runs on native threads without the GIL; the agents' own functions run once per step for all of them. Every
    step returns new arrays. The life of an agent depends on its seed and its number alone.
    """

    copy = True
    dtype = AgentSpec.dtype

    def __init__(
        self,
        agent: type[MarathonAgent],
        num_envs: int = 1,
        *,
        seed: int = 0,
        threads: int = 0,
        isa: Any = None,
        autoreset: str = "next_step",
        max_episode_steps: int | None = None,
        copy: bool = True,
        **options: Any,
    ) -> None:
        """Make an environment with the arguments of `VecEnv`; the options are those of the agent's own constructor.

        Arrays are new at every step, whatever `copy` says.
        """
        num_envs = _count("num_envs", num_envs)
        self._made = {
            "agent": agent,
            "num_envs": num_envs,
            "seed": seed,
            "threads": threads,
            "isa": isa,
            "autoreset": autoreset,
            "max_episode_steps": max_episode_steps,
            **options,
        }
        mode = _AUTORESET.get(autoreset.replace("_", "").lower())
        if mode is None:
            raise ValueError(f"autoreset is '{autoreset}', expected one of 'next_step', 'same_step', 'disabled'")
        given = max_episode_steps
        limit = agent.max_episode_steps if given is None else _count("max_episode_steps", given, limited=False)
        for name, number in (("max_episode_steps", limit), ("frame_skip", agent.frame_skip), ("num_envs", num_envs)):
            if number < 1:
                raise ValueError(f"{name} is {number}, expected at least 1")
        self.autoreset = mode
        self.num_envs = num_envs
        self.agent = agent(num_envs, threads=threads, isa=isa, **options)
        self.threads = self.agent.sim.threads
        self._id = agent.task_id()
        self._terms: list[str] | None = None
        self.memory = self.agent.memory
        self.seeds = np.full(num_envs, _seeds(seed), np.uint64)
        self.numbers = np.arange(num_envs, dtype=np.uint64)
        self.episodes = np.zeros(num_envs, np.uint64)
        self.steps = np.zeros(num_envs, np.int64)
        self.pending = np.zeros(num_envs, np.bool_)
        shape = self.agent.command.shape
        # what the agents' schedule says, when it is asked again, and what a caller says in its place to whom
        self.scheduled, self.due = np.zeros(shape), np.zeros(num_envs, np.int64)
        self.given, self.commanded = np.zeros(shape), np.zeros(num_envs, np.bool_)
        self._ready = False
        self._rehearse()
        model = self.agent.model
        self._clip = agent.controls == "nominal"
        bounds = np.tile([-1.0, 1.0], (model.nu, 1)) if self._clip else model.actuator_range
        self.spec = AgentSpec(
            id=self._id,
            summary=agent.summary(),
            obs_size=self._obs_size,
            act_size=model.nu,
            action_names=model.actuator_names,
            action_low=bounds[:, 0].tolist(),
            action_high=bounds[:, 1].tolist(),
            dt=model.timestep * agent.frame_skip,
            frame_skip=agent.frame_skip,
            max_episode_steps=limit,
            reward_terms=self._rewarded + [TERMINATION_TERM] * (agent.termination_reward is not None),
            info=self._reported,
            metrics=self._metrics(),
            observations=self._parts,
            command=list(agent.commands),
            nq=model.nq,
            nv=model.nv,
            options=options,
        )
        n = num_envs
        self.obs: npt.NDArray[np.float32] = np.zeros((n, self._obs_size), np.float32)
        self.final_obs = self.obs
        self.reward_terms: npt.NDArray[np.float32] = np.zeros((n, len(self.spec.reward_terms)), np.float32)
        self.info: npt.NDArray[np.float32] = np.zeros((n, len(self._reported)), np.float32)
        self.forward: npt.NDArray[np.float32] = np.zeros(n, np.float32)
        self.diverged: BoolArray = np.zeros(n, np.bool_)

    def _metrics(self) -> list[str]:
        """Names of the metrics that there are; who cannot move along x has no "forward"."""
        for name in self.agent.metrics:
            if name != "forward" and name not in self._reported:
                infos = self._reported
                raise ValueError(f"{self._id}: its metric '{name}' is neither 'forward' nor one of its infos {infos}")
        still = self.agent.x_position() is None
        return [name for name in self.agent.metrics if name in self._reported or not still]

    def _rehearse(self) -> None:
        """Let the agents observe and reward once in the spawn pose, to find out how much they do."""
        agent, n = self.agent, self.num_envs
        if agent.model.nu == 0:
            raise ValueError(f"{self._id}: its model has no actuators, expected at least 1")
        self._put(np.tile(agent.spawn_qpos, (n, 1)), np.tile(agent.spawn_qvel, (n, 1)), np.ones(n, np.bool_))
        names = [number.name for number in agent.commands]
        if len(set(names)) < len(names):
            raise ValueError(f"{self._id}: its commands are called {names}, expected names of their own")
        self._obs_size, self._parts = 0, dict[str, slice]()
        self._obs_size = self._observe().shape[1]
        if self._obs_size == 0:
            raise ValueError(f"{self._id}: its observations are empty, expected at least 1 number")
        self._rewarded, self._reported = list(agent.step_reward()), list(agent.info())
        if not self._rewarded:
            raise ValueError(f"{self._id}: its reward has no terms, expected at least 1")
        self._numbers("reward", agent.step_reward(), self._rewarded)
        self._numbers("info", agent.info(), self._reported)
        self._ends()

    # ---------------------------------------------------------------------------------- what the agents say, checked

    def _observe(self) -> FloatArray:
        """Observations, `(N, obs_size)`."""
        said = self.agent.observations()
        n = self.num_envs
        names, parts = ["observation"], list[FloatArray]()
        if isinstance(said, np.ndarray):
            parts = [said]
        elif isinstance(said, Mapping):
            names, parts = list(said), list(said.values())
        else:
            parts = list(said)
        for part in parts:
            if np.ndim(part) not in (1, 2) or len(part) != n:
                found = np.shape(part)
                raise ValueError(f"{self._id}: observations have the shape {found}, expected ({n},) or ({n}, k)")
        obs: FloatArray = np.concatenate([np.reshape(part, (n, -1)) for part in parts], axis=1)
        if self._obs_size and obs.shape[1] != self._obs_size:
            raise ValueError(f"{self._id}: it observes {obs.shape[1]} numbers, but {self._obs_size} at first")
        if not self._obs_size:
            widths = [np.size(part) // n for part in parts] if isinstance(said, Mapping) else [obs.shape[1]]
            ends = np.cumsum([0, *widths]).tolist()
            places = zip(names, ends, ends[1:], strict=False)
            self._parts = {name: slice(start, end, 1) for name, start, end in places if start < end}
        return obs

    def _numbers(self, what: str, said: Mapping[str, FloatArray], names: list[str]) -> FloatArray:
        """Named numbers side by side, `(N, names)`."""
        if list(said) != names:
            raise ValueError(f"{self._id}: its {what} has the names {list(said)}, but {names} at first")
        n = self.num_envs
        for name, numbers in said.items():
            if np.shape(numbers) != (n,):
                raise ValueError(f"{self._id}: {what} '{name}' has the shape {np.shape(numbers)}, expected ({n},)")
        return np.stack(list(said.values()), axis=1) if said else np.zeros((n, 0))

    def _ctrl(self) -> FloatArray:
        """Controls, `(N, nu)`."""
        ctrl = np.asarray(self.agent.ctrl())
        if ctrl.shape != self.agent.action.shape:
            raise ValueError(f"{self._id}: ctrl returns the shape {ctrl.shape}, expected {self.agent.action.shape}")
        return ctrl

    def _ends(self) -> tuple[BoolArray, BoolArray]:
        """Agents that have failed, and those whose episode is over all the same, `(N,)` each."""
        ends = np.asarray(self.agent.terminate()), np.asarray(self.agent.truncate())
        for name, end in zip(("terminate", "truncate"), ends, strict=True):
            if end.shape != (self.num_envs,) or end.dtype != np.bool_:
                found = f"{end.dtype} {end.shape}"
                raise ValueError(f"{self._id}: {name} returns {found}, expected bool ({self.num_envs},)")
        return ends

    # ------------------------------------------------------------------------------------------------------- episodes

    def _put(self, qpos: FloatArray, qvel: FloatArray, mask: BoolArray) -> None:
        """Put agents into states, where their episodes begin."""
        self.agent.sim.reset(qpos, qvel, mask)
        self.agent.action[mask] = 0.0
        self.memory[mask] = 0.0
        self.steps[mask] = 0
        self.pending &= ~mask
        self.agent.command[mask] = self._tell(mask, np.zeros(self.num_envs, np.int64))[mask]

    def _tell(self, mask: BoolArray, steps: npt.NDArray[np.int64]) -> FloatArray:
        """Return the commands in the observations of the agents in a mask, at these steps (0 at a start)."""
        ranges = self.agent.commands
        if not ranges:
            return self.agent.command
        due = mask & ((steps == 0) | (steps >= self.due))
        if due.any():
            streams = Streams(self.seeds[due], self.numbers[due], self.episodes[due], steps[due])
            drawn, holds = self.agent.draw_command(streams, steps[due])
            n, k = len(streams), len(ranges)
            if np.shape(drawn) != (n, k) or np.shape(holds) != (n,):
                found = f"{np.shape(drawn)} and {np.shape(holds)}"
                raise ValueError(f"{self._id}: draw_command returns shapes {found}, expected ({n}, {k}) and ({n},)")
            low, high = np.array([[number.low, number.high] for number in ranges]).T
            self.scheduled[due] = np.clip(drawn, low, high)
            self.due[due] = steps[due] + np.maximum(np.asarray(holds, np.int64), 1)
        return np.where(self.commanded[:, None], self.given, self.scheduled)

    @property
    def model(self) -> Model:
        """The compiled model: names and indices of bodies, actuators and height fields."""
        return self.agent.model

    def push(
        self,
        force: npt.ArrayLike,
        torque: npt.ArrayLike | None = None,
        *,
        body: int | str,
        mask: npt.ArrayLike | None = None,
    ) -> None:
        """Push a body of all agents or those of a mask, as `VecEnv.push`."""
        self.agent.sim.push(force, torque, body=body, mask=mask)

    def vary(
        self,
        *,
        mass: npt.ArrayLike | None = None,
        friction: npt.ArrayLike | None = None,
        strength: npt.ArrayLike | None = None,
        gravity: npt.ArrayLike | None = None,
        mask: npt.ArrayLike | None = None,
    ) -> None:
        """Set constants of all agents or those of a mask, as `VecEnv.vary`."""
        self.agent.sim.vary(mass=mass, friction=friction, strength=strength, gravity=gravity, mask=mask)

    def ground(self, field: int = 0) -> npt.NDArray[np.float32]:
        """Return the ground of each agent, `(N, nrow, ncol)`, as `VecEnv.ground`."""
        return self.agent.sim.ground(field)

    def set_ground(self, elevations: npt.ArrayLike, field: int = 0, mask: npt.ArrayLike | None = None) -> None:
        """Set the ground of all agents or those of a mask. It lasts over resets, until changed."""
        self.agent.sim.set_ground(elevations, field, mask)

    def set_command(self, command: npt.ArrayLike | None, mask: npt.ArrayLike | None = None) -> None:
        """Tell agents what to do, or give them back to their schedule with None, as `VecEnv.set_command`."""
        chosen, ranges = self._mask(mask), self.agent.commands
        if not ranges:
            raise ValueError(f"the agents of {self._id} take no commands, spec.command is empty")
        if command is None:
            self.commanded[chosen] = False
            return
        # a copy: ends of ranges in single precision become the exact ends
        told, expected = np.array(command, float), self.given.shape
        if told.shape != expected:
            raise ValueError(f"command has the shape {told.shape}, expected {expected}")
        for i, number in enumerate(ranges):
            for end, beyond in ((number.low, np.less), (number.high, np.greater)):
                told[beyond(told[:, i], end) & (np.float32(told[:, i]) == np.float32(end)), i] = end
            # NaN is in no range
            wrong = chosen & ~((told[:, i] >= number.low) & (told[:, i] <= number.high))
            if wrong.any():
                agent = int(wrong.argmax())
                found = f"command {number.name} is {told[agent, i]}"
                expects = f"expected {number.low:g} to {number.high:g} {number.unit}"
                raise ValueError(f"agent {agent} of '{self._id}': {found}, {expects}")
        self.given[chosen], self.commanded[chosen] = told[chosen], True

    @property
    def command(self) -> FloatArray:
        """Return the command in each agent's current observation, `(N, len(spec.command))`."""
        return self.agent.command.copy()

    def _begin(self, mask: BoolArray) -> None:
        """Begin new episodes of the agents in a mask."""
        if not mask.any():
            return
        self.episodes[mask] += np.uint64(1)
        random = Streams(self.seeds[mask], self.numbers[mask], self.episodes[mask])
        starts = self.agent.agent_reset(random)
        model, n = self.agent.model, len(random)
        states = []
        expected = (("qpos", model.nq), ("qvel", model.nv), ("memory", self.agent.memory_size))
        for (name, columns), start in zip(expected[: len(starts)], starts, strict=True):
            if np.shape(start) != (n, columns):
                found = np.shape(start)
                raise ValueError(f"{self._id}: agent_reset returns {name} of shape {found}, expected ({n}, {columns})")
            state = np.zeros((self.num_envs, columns))
            state[mask] = start
            states.append(state)
        self._put(states[0], states[1], mask)
        if len(states) == len(expected):
            self.memory[mask] = states[2][mask]

    def _show(self, mask: BoolArray) -> npt.NDArray[np.float32]:
        """Observe those in a mask, whose episodes have just begun; the rows of others stay."""
        obs = self._observe()
        sound = (np.abs(obs) < STORABLE).all(1, keepdims=True)
        shown = np.where(sound, obs, 0.0).astype(np.float32)
        self.obs = shown if mask.all() else np.where(mask[:, None], shown, self.obs)
        self._ready = True
        return self.obs

    def reset(
        self, seed: int | Sequence[int | None] | None = None, mask: npt.ArrayLike | None = None
    ) -> npt.NDArray[np.float32]:
        """Start new episodes and return the observations; seeds and mask as in `VecEnv.reset`."""
        chosen = self._mask(mask)
        if not self._ready and not chosen.all():
            raise ValueError("the first reset must be of all agents; mask has some that are False")
        native = _seeds(seed)
        if native is not None:
            if isinstance(native, int):
                seeds: list[int | None] = [native] * self.num_envs
                streams = np.arange(self.num_envs, dtype=np.uint64)
            else:
                seeds, streams = native, np.zeros(self.num_envs, np.uint64)
            if len(seeds) != self.num_envs:
                raise ValueError(f"seed has {len(seeds)} numbers, expected {self.num_envs}")
            given = chosen & np.array([one is not None for one in seeds])
            self.seeds[given] = np.array([one or 0 for one in seeds], np.uint64)[given]
            self.numbers[given] = streams[given]
            self.episodes[given] = 0
        self._begin(chosen)
        return self._show(chosen)

    def _perceive(self) -> tuple[FloatArray, BoolArray, BoolArray, FloatArray, FloatArray]:
        """Observations, failures, other ends, terms and infos of the decision just made.

        Observed is what to do from now on; rewarded is what the decision was made under.
        """
        agent = self.agent
        present, following = agent.command, self._tell(np.ones(self.num_envs, np.bool_), self.steps + 1)
        agent.command = following
        obs = self._observe()
        agent.command = present
        failed, over = self._ends()
        terms = self._numbers("reward", agent.step_reward(), self._rewarded)
        reported = self._numbers("info", agent.info(), self._reported)
        present[:] = following
        return obs, failed, over, terms, reported

    def step(
        self, actions: npt.ArrayLike
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], BoolArray, BoolArray]:
        """Advance every agent by one decision, as `VecEnv.step`."""
        if not self._ready:
            raise ValueError("reset must be called before the first step")
        agent, given = self.agent, real_numbers("actions", actions, np.float32)
        expected = (self.num_envs, self.spec.act_size)
        if given.shape != expected:
            raise ValueError(f"actions have the shape {given.shape}, expected {expected}")
        finite = np.isfinite(given)
        agent.action[:] = np.where(finite, np.clip(given, -1.0, 1.0) if self._clip else given, 0.0)
        before, begun = agent.x_position(), self.pending.copy()
        broken = agent.sim.step(self._ctrl(), agent.frame_skip)
        agent.remember()
        obs, failed, over, terms, reported = self._perceive()

        # quarantine: nothing that is not a sane number leaves its row
        sound = ~broken & finite.all(1)
        for values, limit in (
            (agent.sim.qpos, LARGEST),
            (agent.sim.qvel, LARGEST),
            (obs, STORABLE),
            (terms, STORABLE),
            (terms.sum(1, keepdims=True), STORABLE),
            (reported, STORABLE),
        ):
            sound &= (np.abs(values) < limit).all(1)
        self.steps += 1
        terminated = (failed | ~sound) & ~begun
        truncated = ((self.steps >= self.spec.max_episode_steps) | over) & ~terminated & ~begun
        self.diverged = ~sound & ~begun
        after = agent.x_position()
        moved = np.zeros(self.num_envs) if before is None or after is None else after - before
        self.forward = np.where(sound & ~begun, moved, 0.0).astype(np.float32)

        price = agent.termination_reward
        counted = sound & ~begun
        shares = np.zeros_like(self.reward_terms)
        if price is None:
            shares[:] = np.where(counted[:, None], terms, 0.0)
        else:
            # a failure costs its own price in place of everything else
            shares[:, :-1] = np.where((counted & ~failed)[:, None], terms, 0.0)
            shares[:, -1] = np.where(counted & failed, price, 0.0)
        self.reward_terms = shares
        self.info = np.where(counted[:, None], reported, 0.0).astype(np.float32)
        reward = shares.sum(1)
        self.final_obs = self.obs = np.where(sound[:, None], obs, 0.0).astype(np.float32)

        ended = terminated | truncated
        if self.autoreset == "next_step":
            self.pending = ended
        elif self.autoreset == "disabled" and self.diverged.any():
            # a broken state is put away at once
            n = self.num_envs
            steps = self.steps.copy()
            self._put(np.tile(agent.spawn_qpos, (n, 1)), np.zeros((n, agent.model.nv)), self.diverged)
            self.steps = steps
        due = ended if self.autoreset == "same_step" else begun
        if due.any():
            self._begin(due)
            self._show(due)
            if self.autoreset == "next_step":
                self.final_obs = self.obs
        return self.obs, reward, terminated, truncated

    def read_info(self) -> npt.NDArray[np.float32]:
        """Return the agents' metrics of their current states, `(N, len(spec.info))`."""
        return self._numbers("info", self.agent.info(), self._reported).astype(np.float32)

    @property
    def x_position(self) -> npt.NDArray[np.float64] | None:
        """Position of each agent's root along x, m, `(N,)`; None if it cannot move along x."""
        return self.agent.x_position()

    def get_state(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """State of every agent, as `VecEnv.get_state`."""
        return self.agent.sim.qpos.copy(), self.agent.sim.qvel.copy()

    def set_state(
        self, qpos: npt.ArrayLike, qvel: npt.ArrayLike, mask: npt.ArrayLike | None = None
    ) -> npt.NDArray[np.float32]:
        """Put agents into states where their episodes begin, as `VecEnv.set_state`."""
        chosen = self._mask(mask)
        self._put(np.asarray(qpos, float), np.asarray(qvel, float), chosen)
        return self._show(chosen)

    def _mask(self, mask: npt.ArrayLike | None) -> BoolArray:
        return np.ones(self.num_envs, np.bool_) if mask is None else _mask(mask, self.num_envs)

    def show(self, *, port: int = 0, page: str | PathLike[str] | None = None) -> Viewer:
        """Raise an error: the viewer takes tasks that Marathon has itself, no Python classes."""
        raise NotImplementedError(f"{self._id} is a Python class; show takes the tasks of `marathon_rl.ids()`")

    def save(self) -> bytes:
        """Everything that the future depends on: NumPy's `.npz`, without pickles."""
        return _snapshots.pack(self._id, self.agent.sim.save(), self._arrays())

    def _arrays(self) -> dict[str, npt.NDArray[Any]]:
        """Return the contents of a snapshot besides the physics, with commands if there are any."""
        named = {name: getattr(self, name) for name in (*_SAVED, *_COMMANDS)}
        named["command"] = self.agent.command
        return named if self.agent.commands else {name: named[name] for name in _SAVED}

    def load(self, snapshot: bytes) -> None:
        """Restore what `save` returned for the same task and number of agents."""
        present = self._arrays()
        simulation, saved = _snapshots.unpack(snapshot, self._id, present)
        self.agent.sim.load(simulation)
        for name, array in present.items():
            array[...] = saved[name]
        self._ready = True

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for a copy: arguments, a snapshot, observations. A copy has only the memory of the agent."""
        return {"made": self._made, "snapshot": self.save() if self._ready else None, "obs": self.obs}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the copy, or go on from a snapshot and its observations."""
        if "made" in state:
            self.__init__(**state["made"])  # type: ignore[misc]
        if state["snapshot"] is not None:
            self.load(state["snapshot"])
            self.obs = np.array(state["obs"], np.float32)

    def __len__(self) -> int:
        """Return the number of agents."""
        return self.num_envs

    def __repr__(self) -> str:
        return f"AgentVecEnv({self._id!r}, num_envs={self.num_envs}, autoreset={self.autoreset!r})"
