"""Tasks by their names or the paths of models, and `MarathonAgent` classes in place of names."""

import os
from typing import Any

from marathon_rl._native import Renderer, VecEnv, spec
from marathon_rl.agent_env import AgentSpec, AgentVecEnv
from marathon_rl.agents import MarathonAgent

Task = str | os.PathLike[str] | type[MarathonAgent]


def known(task: Task | MarathonAgent) -> str | type[MarathonAgent]:
    """Return a task as its name or its class: of a path its text, of an object its class."""
    if isinstance(task, str):
        return task
    if isinstance(task, os.PathLike):
        return os.fsdecode(task)
    agent = task if isinstance(task, type) else type(task)
    if not (hasattr(agent, "vec_env") and hasattr(agent, "task_id")):
        found = f"the class {agent.__name__}" if isinstance(task, type) else f"of type {agent.__name__}"
        raise TypeError(f"task is {found}, expected a task's name, the path of a model or a MarathonAgent")
    return agent


def vec_env(task: Task, num_envs: int, *, dtype: str = "float32", **options: Any) -> VecEnv | AgentVecEnv:
    """Return many agents of a task. `dtype` is for native tasks; observations of classes are float32."""
    of = known(task)
    return VecEnv(of, num_envs, dtype=dtype, **options) if isinstance(of, str) else of.vec_env(num_envs, **options)


def dtype(task: Task) -> str:
    """Type of the observations: a fact of the task, float64 for Gymnasium's own tasks and float32 for all others."""
    of = known(task)
    return spec(of).dtype if isinstance(of, str) else AgentSpec.dtype


def renderer(task: Task, width: int, height: int, num_envs: int = 1, **options: Any) -> Renderer:
    """Pictures of a task's agents, so many side by side."""
    of = known(task)
    if isinstance(of, str):
        return Renderer(of, width, height, num_envs=num_envs, **options)
    return Renderer.of(of.load_model(), width, height, num_envs=num_envs)


def max_episode_steps(task: Task, **options: Any) -> int:
    """Steps after which a task truncates its episodes."""
    of = known(task)
    return spec(of, **options).max_episode_steps if isinstance(of, str) else of.max_episode_steps
