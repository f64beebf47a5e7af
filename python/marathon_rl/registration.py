"""Registers the tasks with Gymnasium."""

import gymnasium
from gymnasium.envs.registration import registry

from marathon_rl._native import _limits

NAMESPACE = "marathon_rl"


def register() -> None:
    """Register every task as `marathon_rl/<id>`, for `gymnasium.make` and `gymnasium.make_vec`."""
    # no model is compiled here: an import is quick, and an error of a model belongs to its task
    for task, max_episode_steps in _limits():
        name = f"{NAMESPACE}/{task}"
        if name in registry:
            continue
        gymnasium.register(
            id=name,
            entry_point="marathon_rl.env:MarathonEnv",
            vector_entry_point="marathon_rl.vector:MarathonVectorEnv",
            max_episode_steps=max_episode_steps,
            kwargs={"task": task},
        )
        # versions are different tasks here, not older and newer ones: Gymnasium must not call any of them outdated
        registry[name].name = task
        registry[name].version = None
