"""One agent as a Gymnasium environment."""

from os import PathLike
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from marathon_rl import _snapshots, _spaces, _tasks, _window
from marathon_rl._native import Renderer, Viewer, _check_size
from marathon_rl._spaces import FloatArray
from marathon_rl._tasks import Task


class _Metadata:
    """Of `MarathonEnv`: without the game, `gymnasium.make` shows `render_mode="human"` with pygame instead."""

    def __get__(self, env: object, owner: object) -> dict[str, Any]:
        """Return what is so now."""
        return {"render_modes": ["rgb_array", "human"] if _window.find() else ["rgb_array"], "render_fps": 50}


class MarathonEnv(gymnasium.Env[FloatArray, FloatArray]):
    """One agent with a task.

    `gymnasium.make("marathon_rl/Hopper-v0")` makes it with Gymnasium's time limit; on its own, its episodes end only
    where the agent fails, unless `max_episode_steps` is given.

    An observation is `(obs_size,)`; its parts and units are on the task's page in the documentation. An action is
    `(act_size,)`: for Marathon's own tasks, shares of the motors' strengths, clipped to [-1, 1].

    `info` has `reward_terms`, a dictionary of the numbers that add up to the reward; `x_position`, m, and `x_velocity`,
    the mean velocity along +x during the step, m/s, if the agent can move along x; `diverged`; and what else the task
    reports. Gymnasium's own tasks have the terms of the reward under Gymnasium's names, too.

    An action that is not finite, or a simulation that breaks down, ends the episode with reward 0 and an observation of
    zeros; then `diverged` is True.

    `copy.deepcopy` and `pickle` make an environment that goes on as this one does; `save` and `load` do it with bytes.
    """

    metadata: dict[str, Any] = _Metadata()  # type: ignore[assignment]

    def __init__(
        self,
        task: Task,
        *,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
        isa: Any = None,
        width: int = 480,
        height: int = 480,
        reward_terms: bool = True,
        **options: Any,
    ) -> None:
        """Make an environment.

        Args:
            task: name of the task, as in `marathon_rl.ids()`, the path of a model, or a `MarathonAgent` class.
            render_mode: None; "rgb_array" for pictures of `width` x `height` pixels; or "human" for a window of the
                game, with which steps take the time that they simulate. The program `marathon-game` is looked up on
                the search path, or where the environment variable MARATHON_GAME says; if it is not there,
                `gymnasium.make(..., render_mode="human")` shows pictures with pygame.
            max_episode_steps: steps after which an episode is truncated; None means never.
            isa: instruction set, as in `VecEnv`.
            width: width of a picture, pixels.
            height: height of a picture, pixels.
            reward_terms: whether `info` has the dictionary `reward_terms`. There are libraries that take no dictionary
                within the infos.
            **options: arguments of the task, see `marathon_rl.spec(task).options`.
        """
        _spaces.check_render_mode(render_mode, {"render_modes": ["rgb_array", "human"]})
        _check_size(width, height)
        task = _tasks.known(task)
        limit = _spaces.steps_limit(max_episode_steps, _spaces.NEVER)
        self._env = _tasks.vec_env(
            task, 1, threads=1, isa=isa, autoreset="disabled", max_episode_steps=limit, copy=True, **options
        )
        self.task_spec = self._env.spec
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": round(1 / self.dt)}
        self.observation_space = _spaces.observation_space(self.task_spec)
        self.action_space = _spaces.action_space(self.task_spec)
        self._dtype = self.observation_space.dtype
        self._terms, self._nested = self.task_spec.reward_terms, reward_terms
        self._info, self._add_x = _spaces.info_names(self.task_spec)
        self._flat = _spaces.is_gymnasiums(self.task_spec)
        self._task, self._size, self._options = task, (width, height), options
        self._renderer: Renderer | None = None
        # opened before the first episode, so that a missing dependency is reported at once
        self._window = _window.Window(task, self.dt, options) if render_mode == "human" else None
        # for the camera: time, and that of the last picture
        self._seconds = self._drawn = 0.0
        self._seeded = False

    @property
    def dt(self) -> float:
        """Seconds between two steps."""
        return self.task_spec.dt

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Start an episode. A seed gives the episodes of agent 0 of a native environment with that seed."""
        seed = None if seed is None else _spaces.native_seed(seed)
        super().reset(seed=seed)
        if seed is None and not self._seeded:
            seed = int(self.np_random.integers(2**63))
        self._seeded = True
        obs = self._env.reset(seed)
        # far from the last picture, so that the camera jumps to the start
        self._seconds += 2.0
        if self._window is not None:
            self._window.show(self._env.get_state()[0][0], begins=True)
        return obs[0].astype(self._dtype), self._report(self._env.read_info())

    def step(self, action: FloatArray) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Make one decision. An episode that has ended goes on until `reset`."""
        env = self._env
        obs, reward, terminated, truncated = env.step(np.asarray(action)[None])
        self._seconds += self.dt
        if self._window is not None:
            self._window.show(env.get_state()[0][0], begins=False, reward=float(reward[0]))
        info = self._report(env.info)
        if self._add_x and "x_position" in info:
            info["x_velocity"] = float(env.forward[0]) / self.dt
        terms = dict(zip(self._terms, env.reward_terms[0].tolist(), strict=True))
        if self._flat:
            info |= terms
        if self._nested:
            info["reward_terms"] = terms
        info["diverged"] = bool(env.diverged[0])
        if info["diverged"]:
            _spaces.warn_of_divergence(action)
        return obs[0].astype(self._dtype), float(reward[0]), bool(terminated[0]), bool(truncated[0]), info

    def _report(self, info: FloatArray) -> dict[str, Any]:
        report: dict[str, Any] = dict(zip(self._info, info[0].tolist(), strict=True))
        x = self._env.x_position if self._add_x else None
        if x is not None:
            report["x_position"] = float(x[0])
        return report

    def show(self, *, port: int = 0, page: str | PathLike[str] | None = None) -> Viewer:
        """Show the agent in a browser on this computer, as `VecEnv.show`."""
        return self._env.show(port=port, page=page)

    def save(self) -> bytes:
        """Everything that the episodes to come depend on; of wrappers, such as time limits, nothing."""
        if not self._seeded:
            raise gymnasium.error.ResetNeeded("reset must be called before save")
        return _snapshots.pack(self.task_spec.id, self._env.save(), {"obs": self._env.obs})

    def load(self, snapshot: bytes) -> FloatArray:
        """Go on where an environment of the same task was saved; returns the observation to act upon."""
        native, saved = _snapshots.unpack(snapshot, self.task_spec.id, {"obs": self._env.obs})
        self._env.__setstate__({"snapshot": native, "obs": saved["obs"]})
        self._seeded = True
        # the camera jumps
        self._seconds += 2.0
        obs: FloatArray = saved["obs"][0].astype(self._dtype)
        return obs

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for a copy. A copy creates its own renderer; a window cannot be copied."""
        if self._window is not None:
            raise TypeError("an environment with a window cannot be copied or pickled, expected another render_mode")
        return {**self.__dict__, "_renderer": None}

    def set_command(self, command: npt.ArrayLike | None) -> None:
        """Tell the agent what to do, `(len(task_spec.command),)`, in place of its schedule; None gives it back.

        It observes the command at the end of its next step, or at the start of its next episode.
        """
        self._env.set_command(None if command is None else np.asarray(command, float)[None])

    def get_state(self) -> tuple[FloatArray, FloatArray]:
        """`qpos`, `(nq,)`, and `qvel`, `(nv,)`, in MuJoCo's layout, float64."""
        qpos, qvel = self._env.get_state()
        return qpos[0], qvel[0]

    def set_state(self, qpos: FloatArray, qvel: FloatArray) -> FloatArray:
        """Begin an episode in a state; returns its observation."""
        obs: FloatArray = self._env.set_state(np.asarray(qpos)[None], np.asarray(qvel)[None])[0]
        return obs.astype(self._dtype)

    def render(self) -> FloatArray | None:
        """Draw the agent: `(height, width, 3)`, uint8. None without a render mode, or with a window."""
        if self._window is not None:
            return None
        if self.render_mode is None:
            gymnasium.logger.warn("render() does nothing without a render mode; make the environment with 'rgb_array'")
            return None
        if self._renderer is None:
            self._renderer = _tasks.renderer(self._task, *self._size, **self._options)
        elapsed, self._drawn = self._seconds - self._drawn, self._seconds
        return self._renderer.render(self._env.get_state()[0], elapsed)

    def close(self) -> None:
        """Close the window, if there is one. Threads and memory go with the object: until then, it works on."""
        if self._window is not None:
            self._window.close()
            self._window = None
