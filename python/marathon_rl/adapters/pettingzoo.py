"""PettingZoo: many agents in one world."""

from typing import Any

import gymnasium
import numpy as np
from pettingzoo import ParallelEnv

from marathon_rl import _native, _spaces, _tasks
from marathon_rl._spaces import FloatArray
from marathon_rl._tasks import Task

PerAgent = dict[str, Any]


class MarathonParallelEnv(ParallelEnv[str, FloatArray, FloatArray]):
    """Many agents of one kind that run side by side, each for its own reward.

    Agents are called `agent_0`, `agent_1`, ...; one whose episode has ended leaves `agents` until `reset`. `render`
    draws all of them in one picture.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int = 2,
        *,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
        threads: int = 0,
        width: int = 640,
        height: int = 360,
        **options: Any,
    ) -> None:
        """Make an environment; the arguments are those of `MarathonVectorEnv`."""
        limit = _spaces.steps_limit(max_episode_steps, None)
        _native._check_size(width, height)
        self._env = _tasks.vec_env(
            task, num_envs, threads=threads, autoreset="disabled", max_episode_steps=limit, copy=True, **options
        )
        self.task_spec, num_envs = self._env.spec, self._env.num_envs
        self.metadata = {
            "name": self.task_spec.id.lower().replace("-", "_"),
            "render_modes": ["rgb_array"],
            "render_fps": round(1 / self.task_spec.dt),
            "is_parallelizable": True,
        }
        _spaces.check_render_mode(render_mode, self.metadata)
        self.render_mode = render_mode
        self.possible_agents = [f"agent_{i}" for i in range(num_envs)]
        self.agents: list[str] = []
        self._row = {name: i for i, name in enumerate(self.possible_agents)}
        self.observation_spaces: dict[str, gymnasium.Space[Any]] = {
            name: _spaces.observation_space(self.task_spec) for name in self.possible_agents
        }
        self.action_spaces: dict[str, gymnasium.Space[Any]] = {
            name: _spaces.action_space(self.task_spec) for name in self.possible_agents
        }
        self._dtype = next(iter(self.observation_spaces.values())).dtype
        self._actions = np.zeros((num_envs, self.task_spec.act_size), np.float32)
        self._task, self._size, self._options = task, (width, height), options
        self._renderer: _native.Renderer | None = None
        self._seconds = self._drawn = 0.0
        self._seed: int | None = int(np.random.SeedSequence().generate_state(1, np.uint64)[0])

    def observation_space(self, agent: str) -> gymnasium.Space[Any]:
        """Observations of an agent, `(obs_size,)`."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space[Any]:
        """Actions of an agent, `(act_size,)`."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, FloatArray], dict[str, PerAgent]]:
        """Start an episode of every agent. A seed is for all of them together."""
        seed, self._seed = (self._seed if seed is None else _spaces.native_seed(seed)), None
        obs = self._env.reset(seed).astype(self._dtype, copy=False)
        self.agents = self.possible_agents[:]
        self._seconds += 2.0
        return dict(zip(self.agents, obs, strict=True)), {name: {} for name in self.agents}

    def step(
        self, actions: dict[str, FloatArray]
    ) -> tuple[dict[str, FloatArray], dict[str, float], dict[str, bool], dict[str, bool], dict[str, PerAgent]]:
        """Make one decision of every agent that has not finished."""
        env, rows = self._env, [self._row[name] for name in self.agents]
        self._actions[:] = 0
        for name, i in zip(self.agents, rows, strict=True):
            self._actions[i] = actions[name]
        obs, reward, terminated, truncated = env.step(self._actions)
        obs = obs.astype(self._dtype, copy=False)
        self._seconds += self.task_spec.dt

        def of_each(values: Any) -> dict[str, Any]:
            return {name: values[i] for name, i in zip(self.agents, rows, strict=True)}

        terms, speeds = env.reward_terms.tolist(), (env.forward.astype(np.float64) / self.task_spec.dt).tolist()
        names = self.task_spec.reward_terms
        broken = env.diverged.tolist()
        infos = {
            name: {
                "x_velocity": speeds[i],
                "reward_terms": dict(zip(names, terms[i], strict=True)),
                "diverged": broken[i],
            }
            for name, i in zip(self.agents, rows, strict=True)
        }
        flags = of_each(terminated.tolist()), of_each(truncated.tolist())
        results = of_each(obs), of_each(reward.tolist()), *flags, infos
        self.agents = [name for name in self.agents if not (flags[0][name] or flags[1][name])]
        return results

    def state(self) -> FloatArray:
        """Return the observations of all agents, `(num_envs, obs_size)`."""
        return self._env.obs.astype(self._dtype)

    def render(self) -> FloatArray | None:
        """Draw all agents in one picture: `(height, width, 3)`, uint8; None without a render mode."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() does nothing without a render mode; make the environment with 'rgb_array'")
            return None
        if self._renderer is None:
            num_envs = len(self.possible_agents)
            self._renderer = _tasks.renderer(self._task, *self._size, num_envs, **self._options)
        elapsed, self._drawn = self._seconds - self._drawn, self._seconds
        return self._renderer.render(self._env.get_state()[0], elapsed)

    def close(self) -> None:
        """Do nothing: threads and memory go with the object."""
