"""Many agents as a Gymnasium vector environment."""

from collections.abc import Sequence
from os import PathLike
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from marathon_rl import _snapshots, _spaces, _tasks
from marathon_rl._native import Model, Renderer, Viewer, _check_size, _mask, _seeds
from marathon_rl._spaces import BoolArray, FloatArray
from marathon_rl._tasks import Task

Infos = dict[str, Any]


class MarathonVectorEnv(VectorEnv[FloatArray, FloatArray, FloatArray]):
    """Many agents with a task, stepped together by native threads.

    `gymnasium.make_vec("marathon_rl/Hopper-v0", num_envs=1024)` makes it. Spaces and infos are those of
    `MarathonEnv`, batched as Gymnasium batches them: `infos["x_velocity"]` is an array with a number for each agent,
    and `infos["_x_velocity"]` tells for which agents there is one.

    All three autoreset modes of Gymnasium work. With `SAME_STEP`, `infos["final_obs"]` and `infos["final_info"]` belong
    to the episodes that ended. With `DISABLED`, ended episodes are reset by `reset(options={"reset_mask": mask})`.

    An action that is not finite, or a simulation that breaks down, ends the episode of its agent; `infos["diverged"]`
    says which.

    A seed is for all agents together: agent `i` has random streams of its own, made of the seed and `i`. A list of
    seeds makes agent `i` live as a `MarathonEnv` with the seed `seeds[i]`.

    `copy.deepcopy` and `pickle` make an environment that goes on as this one does; `save` and `load` do it with bytes.
    `close` is Gymnasium's: threads and memory go with the object, which works on until then.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": ["rgb_array"],
        "render_fps": 50,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
        threads: int = 0,
        isa: Any = None,
        copy: bool = True,
        width: int = 480,
        height: int = 480,
        reward_terms: bool = True,
        **options: Any,
    ) -> None:
        """Make an environment.

        Args:
            task: name of the task, as in `marathon_rl.ids()`, the path of a model, or a `MarathonAgent` class.
            num_envs: number of agents.
            autoreset_mode: handling of agents whose episode ended.
            render_mode: None, or "rgb_array" for pictures of `width` x `height` pixels, one for each agent.
            max_episode_steps: steps after which an episode is truncated; None means the task's own number, -1 never.
            threads: number of threads, as in `VecEnv`.
            isa: instruction set, as in `VecEnv`.
            copy: whether every step returns new arrays. Without, observations, terminations and truncations are
                overwritten by the next step: faster, for code that uses them up before.
            width: width of a picture, pixels.
            height: height of a picture, pixels.
            reward_terms: whether `infos` have the dictionary `reward_terms`. There are libraries that take no
                dictionary within the infos.
            **options: arguments of the task, see `marathon_rl.spec(task).options`.
        """
        _spaces.check_render_mode(render_mode, self.metadata)
        _check_size(width, height)
        task = _tasks.known(task)
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self._env = _tasks.vec_env(
            task,
            num_envs,
            threads=threads,
            isa=isa,
            autoreset=self.autoreset_mode.value,
            max_episode_steps=_spaces.steps_limit(max_episode_steps, None),
            copy=copy,
            dtype=_tasks.dtype(task),
            **options,
        )
        self.task_spec = self._env.spec
        self.num_envs = num_envs = self._env.num_envs
        self.render_mode = render_mode
        self.metadata = {
            **self.metadata,
            "autoreset_mode": self.autoreset_mode,
            "render_fps": round(1 / self.task_spec.dt),
        }
        self.single_observation_space = _spaces.observation_space(self.task_spec)
        self.single_action_space = _spaces.action_space(self.task_spec)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._dtype = self.single_observation_space.dtype
        info, self._add_x = _spaces.info_names(self.task_spec)
        # names in infos, of the numbers and of the masks
        self._terms = [(name, f"_{name}") for name in self.task_spec.reward_terms]
        self._info = [(name, f"_{name}") for name in info]
        self._flat, self._nested = _spaces.is_gymnasiums(self.task_spec), reward_terms
        self._task, self._size, self._options = task, (width, height), options
        self._renderers: list[Renderer] | None = None
        # for the cameras: time of each agent, and of its last picture
        self._seconds, self._drawn = np.zeros(num_envs), np.zeros(num_envs)
        self._seeded = False
        # agents whose last step ended their episode
        self._ended = np.zeros(num_envs, np.bool_)
        self._x: FloatArray | None = None

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, Infos]:
        """Start episodes of all agents, or of those in `options["reset_mask"]`, a boolean array `(num_envs,)`."""
        mask, native = self._reset_mask(options), _seeds(seed)
        if native is None and not self._seeded:
            native = int(self.np_random.integers(2**63))
        elif isinstance(native, int):
            super().reset(seed=native)
        self._seeded = True
        obs = self._env.reset(native, mask)
        begun = np.ones(self.num_envs, np.bool_) if mask is None else mask.copy()
        self._ended &= ~begun
        self._jump(begun)
        self._x = self._env.x_position if self._add_x else None
        return self._observed(obs), self._report(self._env.read_info(), self._x, begun)

    def _reset_mask(self, options: dict[str, Any] | None) -> BoolArray | None:
        if options is None or "reset_mask" not in options:
            return None
        mask = _mask(options["reset_mask"], self.num_envs, "reset_mask")
        if not mask.any():
            raise ValueError("reset_mask chooses no agent, expected at least one")
        return mask

    def step(self, actions: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray, Infos]:
        """Make one decision of every agent; `actions` is `(num_envs, act_size)`."""
        env, mode, begun = self._env, self.autoreset_mode, self._ended
        if mode is AutoresetMode.DISABLED and begun.any():
            raise gymnasium.error.ResetNeeded(
                f"the episodes of agents {np.flatnonzero(begun).tolist()} have ended; "
                "reset them with reset(options={'reset_mask': ...})"
            )
        obs, reward, terminated, truncated = env.step(actions)
        ended = self._ended = terminated | truncated
        diverged = env.diverged if env.copy else env.diverged.copy()
        if diverged.any():
            _spaces.warn_of_divergence(actions)
        before, self._x = self._x, env.x_position if self._add_x else None
        if self.render_mode is not None:
            self._seconds += self.task_spec.dt
            self._jump(ended)

        rewards, going_on, (rows,) = reward.astype(np.float64), ~ended, ended.nonzero()
        every = ended | going_on
        terms = env.reward_terms if env.copy else env.reward_terms.copy()
        info = env.info
        # float64 before anything else, as Gymnasium's single environments have it
        distance = env.forward.astype(np.float64)
        if mode is not AutoresetMode.SAME_STEP or not rows.size:
            # those that begin an episode in this step have not acted
            acted = ~begun if mode is AutoresetMode.NEXT_STEP else every
            infos = self._report(info, self._x, every)
            self._add_step(infos, terms, distance, diverged, acted)
            return self._observed(obs), rewards, terminated, truncated, infos

        # infos of agents whose episode ended describe its end; the others describe the next start
        last_x = None if before is None else _only(rows, before + distance)
        final = self._report(_only(rows, info) if self._info else info, last_x, ended)
        self._add_step(final, _only(rows, terms), _only(rows, distance), diverged, ended)
        infos = self._report(env.read_info() if self._info else info, self._x, every)
        self._add_step(infos, _without(rows, terms), _without(rows, distance), np.zeros_like(diverged), going_on)
        # None where there is none
        infos["final_obs"] = last_obs = np.empty(self.num_envs, dtype=object)
        for i, last in zip(rows.tolist(), env.final_obs.take(rows, 0).astype(self._dtype, copy=False), strict=True):
            last_obs[i] = last
        infos["final_info"] = final
        infos["_final_obs"] = infos["_final_info"] = ended.copy()
        return self._observed(obs), rewards, terminated, truncated, infos

    def _observed(self, obs: FloatArray) -> FloatArray:
        return obs.astype(self._dtype, copy=False)

    def _jump(self, agents: BoolArray) -> None:
        """Make the cameras of agents jump to where they are next."""
        self._seconds[agents] += 2.0

    def _report(self, info: FloatArray, x: FloatArray | None, mask: BoolArray) -> Infos:
        """Return the metrics of a state for the agents in `mask`."""
        infos: Infos = {}
        # all columns at once, as Gymnasium's type of numbers
        for (name, which), numbers in zip(self._info, info.astype(np.float64).T, strict=True):
            infos[name], infos[which] = numbers, mask
        if x is not None:
            infos["x_position"], infos["_x_position"] = x.copy(), mask
        return infos

    def _add_step(
        self, infos: Infos, terms: FloatArray, distance: FloatArray, diverged: BoolArray, mask: BoolArray
    ) -> None:
        """Add what a step tells of the agents in `mask`."""
        shares: Infos = {}
        for (name, which), numbers in zip(self._terms, terms.T, strict=True):
            shares[name], shares[which] = numbers, mask
        if self._flat:
            infos |= shares
        if self._nested:
            infos["reward_terms"], infos["_reward_terms"] = shares, mask
        infos["diverged"], infos["_diverged"] = diverged, mask
        if self._x is not None:
            infos["x_velocity"], infos["_x_velocity"] = distance / self.task_spec.dt, mask

    @property
    def model(self) -> Model:
        """The compiled model: names and indices of bodies, actuators and height fields."""
        return self._env.model

    @property
    def command(self) -> FloatArray:
        """Command in each agent's current observation, `(num_envs, len(task_spec.command))`, a new array."""
        return self._env.command

    def set_command(self, command: npt.ArrayLike | None, mask: npt.ArrayLike | None = None) -> None:
        """Set the commands of all agents or those of a mask, as `VecEnv.set_command`. None returns to the schedule."""
        self._env.set_command(command, mask)

    def push(
        self,
        force: npt.ArrayLike,
        torque: npt.ArrayLike | None = None,
        *,
        body: int | str,
        mask: npt.ArrayLike | None = None,
    ) -> None:
        """Push a body of all agents or those of a mask, as `VecEnv.push`."""
        self._env.push(force, torque, body=body, mask=mask)

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
        self._env.vary(mass=mass, friction=friction, strength=strength, gravity=gravity, mask=mask)

    def ground(self, field: int = 0) -> npt.NDArray[np.float32]:
        """Return the ground of each agent, `(num_envs, nrow, ncol)`, as `VecEnv.ground`."""
        return self._env.ground(field)

    def set_ground(self, elevations: npt.ArrayLike, field: int = 0, mask: npt.ArrayLike | None = None) -> None:
        """Set the ground of all agents or those of a mask, as `VecEnv.set_ground`."""
        self._env.set_ground(elevations, field, mask)

    def show(self, *, port: int = 0, page: str | PathLike[str] | None = None) -> Viewer:
        """Show up to 16 agents in a browser on this computer, as `VecEnv.show`."""
        return self._env.show(port=port, page=page)

    def save(self) -> bytes:
        """Everything that the episodes to come depend on; of wrappers, nothing."""
        if not self._seeded:
            raise gymnasium.error.ResetNeeded("reset must be called before save")
        return _snapshots.pack(self.task_spec.id, self._env.save(), {"obs": self._env.obs, "ended": self._ended})

    def load(self, snapshot: bytes) -> FloatArray:
        """Go on where an environment of the same task and number of agents was saved; returns the observations."""
        env = self._env
        native, saved = _snapshots.unpack(snapshot, self.task_spec.id, {"obs": env.obs, "ended": self._ended})
        env.__setstate__({"snapshot": native, "obs": saved["obs"]})
        self._ended, self._seeded = saved["ended"], True
        self._x = env.x_position if self._add_x else None
        self._jump(np.ones(self.num_envs, np.bool_))
        return self._observed(saved["obs"])

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for a copy; a copy creates its own renderers."""
        return {**self.__dict__, "_renderers": None}

    def get_state(self) -> tuple[FloatArray, FloatArray]:
        """`qpos`, `(num_envs, nq)`, and `qvel`, `(num_envs, nv)`, in MuJoCo's layout, float64."""
        return self._env.get_state()

    def set_state(self, qpos: FloatArray, qvel: FloatArray, mask: BoolArray | None = None) -> FloatArray:
        """Begin episodes of all agents, or of those in a mask, in states; returns the observations."""
        obs = self._env.set_state(qpos, qvel, mask)
        self._ended &= False if mask is None else ~_mask(mask, self.num_envs)
        self._x = self._env.x_position if self._add_x else None
        return self._observed(obs)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Value or result of an attribute, for each agent: as Gymnasium's other vector environments have it."""
        value = getattr(self, name)
        value = value(*args, **kwargs) if callable(value) else value
        if isinstance(value, tuple) and len(value) == self.num_envs:
            return value
        return (value,) * self.num_envs

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Value of an attribute, for each agent."""
        return self.call(name)

    def render(self) -> tuple[FloatArray, ...] | None:
        """Draw every agent by itself: `(height, width, 3)`, uint8, for each; None without a render mode."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() does nothing without a render mode; make the environment with 'rgb_array'")
            return None
        if self._renderers is None:
            self._renderers = [_tasks.renderer(self._task, *self._size, **self._options) for _ in range(self.num_envs)]
        elapsed = self._seconds - self._drawn
        self._drawn = self._seconds.copy()
        qpos = self._env.get_state()[0]
        drawn = zip(self._renderers, qpos, elapsed, strict=True)
        return tuple(renderer.render(q[None], float(t)) for renderer, q, t in drawn)


def _only(rows: FloatArray, values: FloatArray) -> FloatArray:
    """Values of some rows, zeros elsewhere."""
    kept = np.zeros(values.shape, values.dtype)
    # faster than `values[rows]`
    kept[rows] = values.take(rows, 0)
    return kept


def _without(rows: FloatArray, values: FloatArray) -> FloatArray:
    """Values with zeros in some rows."""
    kept = values.copy()
    kept[rows] = 0
    return kept
