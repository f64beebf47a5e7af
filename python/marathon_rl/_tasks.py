"""Tasks by their names, and `MarathonAgent` classes in place of names."""

from typing import Any

from marathon_rl._native import Renderer, VecEnv, spec
from marathon_rl.agent_env import AgentSpec, AgentVecEnv
from marathon_rl.agents import MarathonAgent

Task = str | type[MarathonAgent]


def vec_env(task: Task, num_envs: int, *, dtype: str = "float32", **options: Any) -> VecEnv | AgentVecEnv:
    """Return many agents of a task. `dtype` is for native tasks; observations of classes are float32."""
    if isinstance(task, str):
        return VecEnv(task, num_envs, dtype=dtype, **options)
    return task.vec_env(num_envs, **options)


def dtype(task: Task) -> str:
    """Type of the observations: a fact of the task, float64 for Gymnasium's own tasks and float32 for all others."""
    return spec(task).dtype if isinstance(task, str) else AgentSpec.dtype


def renderer(task: Task, width: int, height: int, num_envs: int = 1, **options: Any) -> Renderer:
    """Pictures of a task's agents, so many side by side."""
    if isinstance(task, str):
        return Renderer(task, width, height, num_envs=num_envs, **options)
    return Renderer.of(task.load_model(), width, height, num_envs=num_envs)


def max_episode_steps(task: Task, **options: Any) -> int:
    """Steps after which a task truncates its episodes."""
    return spec(task, **options).max_episode_steps if isinstance(task, str) else task.max_episode_steps
