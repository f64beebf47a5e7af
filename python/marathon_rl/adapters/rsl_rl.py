"""rsl_rl: many agents as tensors."""

from typing import Any

import numpy as np
import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from marathon_rl import _spaces, _tasks
from marathon_rl._tasks import Task


class RslRlEnv(VecEnv):
    """Many agents for rsl_rl's runners.

    Observations are the group "policy", `(num_envs, obs_size)`. Agents whose episode ended are reset within the same
    step; `extras["time_outs"]` marks episodes that ended by time. `extras["log"]` has the means of the reward terms.

        runner = OnPolicyRunner(RslRlEnv("Hopper-v0", 1024), {"obs_groups": {"actor": ["policy"], ...}, ...})
    """

    def __init__(
        self,
        task: Task,
        num_envs: int,
        *,
        seed: int | None = None,
        device: str | torch.device = "cpu",
        max_episode_steps: int | None = None,
        threads: int = 0,
        **options: Any,
    ) -> None:
        """Make an environment and start the first episodes.

        Args:
            task: name of the task, as in `marathon_rl.ids()`, or a `MarathonAgent` class.
            num_envs: number of agents.
            seed: seed of all random streams; None means a random one.
            device: where the tensors go.
            max_episode_steps: steps after which an episode ends by time; None means the task's own number.
            threads: number of threads, as in `VecEnv`.
            **options: arguments of the task, see `marathon_rl.spec(task).options`.
        """
        # episodes are counted here, because runners may set `episode_length_buf`
        self._env = _tasks.vec_env(
            task,
            num_envs,
            threads=threads,
            autoreset="disabled",
            max_episode_steps=_spaces.NEVER,
            copy=True,
            **options,
        )
        self.task_spec = self._env.spec
        self.num_envs = num_envs = self._env.num_envs
        self.num_actions = self.task_spec.act_size
        self.max_episode_length = max_episode_steps or _tasks.max_episode_steps(task, **options)
        self.episode_length_buf = torch.zeros(num_envs, dtype=torch.long, device=device)
        self.device = device
        self.cfg = {"task": self.task_spec.id, "options": options}
        if seed is None:
            seed = int(np.random.SeedSequence().generate_state(1, np.uint64)[0])
        self._obs = self._tensor(self._env.reset(_spaces.native_seed(seed)))

    def _tensor(self, array: Any) -> torch.Tensor:
        # the array is new, so on the processor the tensor can share its memory
        return torch.from_numpy(array).to(self.device)

    def get_observations(self) -> TensorDict:
        """The present observations."""
        return TensorDict({"policy": self._obs}, batch_size=[self.num_envs], device=self.device)

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """Make one decision of every agent; `actions` is `(num_envs, num_actions)`."""
        obs, reward, terminated, _ = self._env.step(actions.detach().cpu().numpy())
        terms = self._env.reward_terms.mean(axis=0).tolist()
        self.episode_length_buf += 1
        failed = self._tensor(terminated)
        time_outs = (self.episode_length_buf >= self.max_episode_length) & ~failed
        dones = failed | time_outs
        if bool(dones.any()):
            obs = self._env.reset(mask=dones.cpu().numpy())
            self.episode_length_buf[dones] = 0
        self._obs = self._tensor(obs)
        log = {f"/reward/{name}": mean for name, mean in zip(self.task_spec.reward_terms, terms, strict=True)}
        return self.get_observations(), self._tensor(reward), dones.long(), {"time_outs": time_outs, "log": log}
