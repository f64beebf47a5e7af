"""Tasks by their names, and `MarathonAgent` classes in place of names."""

from typing import Any

from marathon_rl import _spaces
from marathon_rl._native import Renderer, VecEnv, spec
from marathon_rl.agent_env import AgentVecEnv
from marathon_rl.agents import MarathonAgent

Task = str | type[MarathonAgent]


def vec_env(task: Task, num_envs: int, *, dtype: str = "float32", **options: Any) -> VecEnv | AgentVecEnv:
    """Many agents of a task. `dtype` is about native tasks; observations of classes are float32."""
    if isinstance(task, str):
        return VecEnv(task, num_envs, dtype=dtype, **options)
    return task.vec_env(num_envs, **options)


def dtype(task: Task) -> str:
    """Type of the numbers of observations: that of Gymnasium, which has tasks of the same names, or ours."""
    return "float64" if isinstance(task, str) and _spaces.is_gymnasiums(spec(task)) else "float32"


def renderer(task: Task, width: int, height: int, agents: int = 1, **options: Any) -> Renderer:
    """Pictures of a task's agents, so many side by side."""
    if isinstance(task, str):
        return Renderer(task, width, height, agents=agents, **options)
    return Renderer.of(task.load_model(), width, height, agents=agents)


def max_episode_steps(task: Task, **options: Any) -> int:
    """Steps after which a task truncates its episodes."""
    return spec(task, **options).max_episode_steps if isinstance(task, str) else task.max_episode_steps
