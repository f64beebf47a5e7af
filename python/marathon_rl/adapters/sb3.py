"""Stable-Baselines3: many agents as one of its vector environments."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from marathon_rl import _native, _spaces, _tasks
from marathon_rl._spaces import FloatArray
from marathon_rl._tasks import Task
from marathon_rl.registration import NAMESPACE


class Sb3VecEnv(VecEnv):
    """Many agents for Stable-Baselines3, stepped together by native threads.

        model = PPO("MlpPolicy", VecMonitor(Sb3VecEnv("Hopper-v0", num_envs=64)))

    The infos of agents whose episode ended have `terminal_observation`, `TimeLimit.truncated`, and what `MarathonEnv`
    reports, such as `x_position`; the others are empty, because a dictionary per agent and step costs more than the
    physics.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        *,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
        threads: int = 0,
        width: int = 480,
        height: int = 480,
        **options: Any,
    ) -> None:
        """Make an environment; the arguments are those of `MarathonVectorEnv`."""
        _spaces.check_render_mode(render_mode, {"render_modes": ["rgb_array"]})
        limit = _spaces.steps_limit(max_episode_steps, None)
        _native._check_size(width, height)
        task = _tasks.known(task)
        self._env = _tasks.vec_env(
            task,
            num_envs,
            threads=threads,
            autoreset="same_step",
            max_episode_steps=limit,
            copy=True,
            dtype=_tasks.dtype(task),
            **options,
        )
        self.task_spec, num_envs = self._env.spec, self._env.num_envs
        self.spec = gymnasium.registry.get(f"{NAMESPACE}/{self.task_spec.id}") if isinstance(task, str) else None
        self._info, self._add_x = _spaces.info_names(self.task_spec)
        self._x: FloatArray | None = None
        self.render_mode = render_mode
        self._renderers: list[_native.Renderer] | None = None
        self._task, self._size, self._options_of_task = task, (width, height), options
        self._actions: FloatArray | None = None
        observations = _spaces.observation_space(self.task_spec)
        self._dtype = observations.dtype
        super().__init__(num_envs, observations, _spaces.action_space(self.task_spec))
        # random, unless `seed` is called
        self._seeds = list(np.random.SeedSequence().generate_state(num_envs).tolist())

    def reset(self) -> VecEnvObs:
        """Start episodes of all agents; agent `i` has the seed `seed + i` of the last call of `seed`."""
        obs = self._env.reset(None if None in self._seeds else [_spaces.native_seed(s) for s in self._seeds])
        self._x = self._env.x_position if self._add_x else None
        self._reset_seeds()
        self._reset_options()
        return self._observed(obs)

    def step_async(self, actions: FloatArray) -> None:
        """Take the actions, `(num_envs, act_size)`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Make the decisions."""
        if self._actions is None:
            raise RuntimeError("step_wait() is called without step_async()")
        env = self._env
        obs, reward, terminated, truncated = env.step(self._actions)
        dones = terminated | truncated
        if env.diverged.any():
            _spaces.warn_of_divergence(self._actions)
        before, self._x = self._x, env.x_position if self._add_x else None
        self._actions = None
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(dones):
            info = infos[i] = dict(zip(self._info, env.info[i].tolist(), strict=True))
            if before is not None:
                distance = float(env.forward[i])
                info["x_position"], info["x_velocity"] = float(before[i]) + distance, distance / self.task_spec.dt
            info["reward_terms"] = dict(zip(self.task_spec.reward_terms, env.reward_terms[i].tolist(), strict=True))
            info["diverged"] = bool(env.diverged[i])
            info["terminal_observation"] = env.final_obs[i].astype(self._dtype)
            info["TimeLimit.truncated"] = bool(truncated[i])
        return self._observed(obs), reward, dones, infos

    def _observed(self, obs: FloatArray) -> FloatArray:
        return obs.astype(self._dtype, copy=False)

    def get_images(self) -> Sequence[FloatArray | None]:
        """Draw every agent by itself: `(height, width, 3)`, uint8."""
        if self.render_mode is None:
            return [None] * self.num_envs
        if self._renderers is None:
            make = (self._task, *self._size)
            self._renderers = [_tasks.renderer(*make, **self._options_of_task) for _ in range(self.num_envs)]
        qpos = self._env.get_state()[0]
        return [r.render(q[None], self.task_spec.dt) for r, q in zip(self._renderers, qpos, strict=True)]

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Attribute of this environment, which all agents share."""
        value = getattr(self, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute for all agents."""
        if indices is not None:
            raise ValueError(f"attribute '{attr_name}' is shared by all agents, expected indices=None")
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Agents are rows of arrays, not objects with methods."""
        raise AttributeError(f"agents have no method '{method_name}'")

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Never: there are no single environments."""
        return [False for _ in self._get_indices(indices)]

    def close(self) -> None:
        """Do nothing: threads and memory go with the object."""
