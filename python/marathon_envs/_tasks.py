"""Tasks by their names, and `MarathonAgent` classes in place of names."""

from typing import Any

from marathon_envs._native import Renderer, VecEnv
from marathon_envs.agent_env import AgentVecEnv
from marathon_envs.agents import MarathonAgent

Task = str | type[MarathonAgent]


def vec_env(task: Task, num_envs: int, **options: Any) -> VecEnv | AgentVecEnv:
    """Many agents of a task."""
    return VecEnv(task, num_envs, **options) if isinstance(task, str) else task.vec_env(num_envs, **options)


def renderer(task: Task, width: int, height: int, **options: Any) -> Renderer:
    """Pictures of a task's agents."""
    if isinstance(task, str):
        return Renderer(task, width, height, **options)
    return Renderer.of(task.load_model(), width, height)
