"""skrl: many agents as tensors."""

from typing import Any

import gymnasium
import numpy as np
import torch
from skrl.envs.wrappers.torch.base import Wrapper

from marathon_rl import _spaces, _tasks
from marathon_rl._tasks import Task


class SkrlEnv(Wrapper):
    """Many agents for skrl's trainers, in the form that `skrl`'s `wrap_env` gives to other environments.

    Agents whose episode ended are reset within the same step; `info["final_obs"]` has the observations that the step
    reached, `(num_envs, obs_size)`.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        *,
        seed: int | None = None,
        device: str | torch.device = "cpu",
        max_episode_steps: int | None = None,
        threads: int = 0,
        **options: Any,
    ) -> None:
        """Make an environment; the arguments are those of `RslRlEnv`."""
        limit = _spaces.steps_limit(max_episode_steps, None)
        env = _tasks.vec_env(
            task, num_envs, threads=threads, autoreset="same_step", max_episode_steps=limit, copy=True, **options
        )
        super().__init__(env)
        self.task_spec = env.spec
        self._device = torch.device(device)
        self._observation_space = _spaces.observation_space(self.task_spec)
        self._action_space = _spaces.action_space(self.task_spec)
        self._seed = seed
        self._obs: torch.Tensor | None = None

    def _tensor(self, array: Any) -> torch.Tensor:
        # the array is new, so on the processor the tensor can share its memory
        return torch.from_numpy(array).to(self._device)

    def reset(self) -> tuple[torch.Tensor, dict[str, Any]]:
        """Start the episodes at the first call. Later calls return the current observations, without a reset."""
        if self._obs is None:
            entropy = np.random.SeedSequence().generate_state(1, np.uint64)[0]
            seed = _spaces.native_seed(entropy if self._seed is None else self._seed)
            self._obs = self._tensor(self._env.reset(seed))
        return self._obs, {}

    def step(
        self, actions: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """Make one decision of every agent; rewards and flags are `(num_envs, 1)`."""
        obs, *results = self._env.step(actions.detach().cpu().numpy())
        self._obs = self._tensor(obs)
        reward, terminated, truncated = (self._tensor(x).view(-1, 1) for x in results)
        return self._obs, reward, terminated, truncated, {"final_obs": self._tensor(self._env.final_obs.copy())}

    def state(self) -> None:
        """None: there is no state besides the observations."""
        return

    def render(self, *args: Any, **kwargs: Any) -> None:
        """Nothing: make a Gymnasium environment for pictures."""

    def close(self) -> None:
        """Do nothing: threads and memory go with the object."""

    @property
    def num_envs(self) -> int:
        """Number of agents."""
        return len(self._env)

    @property
    def observation_space(self) -> gymnasium.Space[Any]:
        """Observations of one agent."""
        return self._observation_space

    @property
    def action_space(self) -> gymnasium.Space[Any]:
        """Actions of one agent."""
        return self._action_space
