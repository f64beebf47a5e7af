"""dm_env: one agent in DeepMind's interface."""

from typing import Any

import dm_env
import numpy as np
from dm_env import specs

from marathon_rl import _spaces, _tasks
from marathon_rl._spaces import FloatArray
from marathon_rl._tasks import Task


class DmEnv(dm_env.Environment):
    """One agent with a task.

    The discount of the last step is 0 where the agent failed, and 1 where the episode ended by time.
    """

    def __init__(
        self, task: Task, *, seed: int | None = None, max_episode_steps: int | None = None, **options: Any
    ) -> None:
        """Make an environment.

        Args:
            task: name of the task, as in `marathon_rl.ids()`, or a `MarathonAgent` class.
            seed: seed of the episodes; None means a random one.
            max_episode_steps: steps after which an episode ends by time; None means the task's own number, -1 never.
            **options: arguments of the task, see `marathon_rl.spec(task).options`.
        """
        limit = _spaces.steps_limit(max_episode_steps, None)
        self._env = _tasks.vec_env(
            task, 1, threads=1, autoreset="disabled", max_episode_steps=limit, copy=True, **options
        )
        self.task_spec = self._env.spec
        self._dtype = _spaces.observation_space(self.task_spec).dtype
        entropy = np.random.SeedSequence().generate_state(1, np.uint64)[0]
        self._seed: int | None = _spaces.native_seed(entropy if seed is None else seed)
        self._ended = True

    def reset(self) -> dm_env.TimeStep:
        """Start an episode."""
        obs = self._env.reset(self._seed)
        self._seed, self._ended = None, False
        return dm_env.restart(self._observation(obs))

    def step(self, action: FloatArray) -> dm_env.TimeStep:
        """Make one decision; start an episode if the last one has ended."""
        if self._ended:
            return self.reset()
        obs, reward, terminated, truncated = self._env.step(np.asarray(action, np.float32)[None])
        observation, number = self._observation(obs), float(reward[0])
        self._ended = bool(terminated[0] or truncated[0])
        if terminated[0]:
            return dm_env.termination(number, observation)
        if truncated[0]:
            return dm_env.truncation(number, observation)
        return dm_env.transition(number, observation)

    def _observation(self, obs: FloatArray) -> FloatArray:
        observation: FloatArray = obs[0].astype(self._dtype)
        return observation

    def observation_spec(self) -> specs.Array:
        """`(obs_size,)`."""
        return specs.Array((self.task_spec.obs_size,), self._dtype, name="observation")

    def action_spec(self) -> specs.BoundedArray:
        """`(act_size,)`, between `task_spec.action_low` and `task_spec.action_high`."""
        low, high = self.task_spec.action_low, self.task_spec.action_high
        return specs.BoundedArray((self.task_spec.act_size,), np.float32, low, high, name="action")
