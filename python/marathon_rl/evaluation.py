"""How good a policy is: whole episodes of a native policy, or of any function from observations to actions."""

from collections.abc import Callable
from os import PathLike
from typing import Any

import numpy as np
import numpy.typing as npt

from marathon_rl import _native, _tasks
from marathon_rl._native import Policy, _count, load_policy
from marathon_rl._tasks import Task
from marathon_rl.agents import MarathonAgent

# most agents that play side by side, and the default seed: those of the native evaluation
MOST_AGENTS = 1024
SEED = 1_000_003


def evaluate(
    policy: Policy | str | PathLike[str] | Callable[[npt.NDArray[np.float32]], npt.ArrayLike],
    episodes: int = 100,
    *,
    task: Task | MarathonAgent | None = None,
    seed: int = SEED,
    threads: int = 0,
    **options: Any,
) -> dict[str, float]:
    """Play whole episodes with a policy's best actions, or with those of a function.

    Agents play side by side, and each plays a number of episodes that is fixed before the start: to count whatever ends
    first would favor short episodes.

    Args:
        policy: a `Policy`, the path of one for `load_policy`, or a function from observations, `(n, obs_size)`,
            float32, to actions, `(n, act_size)`, in the units of the task.
        episodes: number of episodes.
        task: name of the task, the path of a model or a `MarathonAgent` class; without, it is the policy's own. A
            function has none. An object of the class stands for the class.
        seed: seed of the environments.
        threads: number of threads; 0 means one per processor core. The result does not depend on it.
        **options: options of the task, and `max_episode_steps`. Those of a task with a name that are not given are the
            ones that the policy was trained with.

    Returns:
        `return_mean`, `return_std`, `return_min`, `return_max`, `length_mean` (decisions), `distance_mean` (m),
        `speed_mean` (m/s), `falls`, `diverged` and `episodes`.
    """
    if isinstance(policy, str | PathLike):
        policy = load_policy(policy)
    of = None if task is None else _tasks.known(task)
    native = isinstance(of, str | None) and "max_episode_steps" not in options
    if isinstance(policy, Policy) and (native or not options):
        return _native.evaluate(policy, episodes, task=of, seed=seed, threads=threads, **options)
    if not callable(policy):
        raise TypeError(f"policy is of type {type(policy).__name__}, expected a Policy, a path or a function")
    episodes = _count("episodes", episodes)
    if episodes < 1:
        raise ValueError(f"episodes is {episodes}, expected at least 1")
    if of is None:
        if not isinstance(policy, Policy):
            raise TypeError("task is missing: a function does not tell which task it is for")
        of = policy.task
        options = {**policy.options, **options}
    num_envs = min(episodes, MOST_AGENTS)
    env = _tasks.vec_env(of, num_envs, threads=threads, autoreset="same_step", **options)
    # agent i plays episodes i, i + num_envs, ...
    quota = np.arange(episodes - 1, episodes - 1 - num_envs, -1) // num_envs + 1
    total, length, distance = np.zeros((3, num_envs))
    played: list[list[tuple[float, float, float, bool, bool]]] = [[] for _ in range(num_envs)]
    missing, obs = episodes, env.reset(seed)
    while missing:
        obs, reward, terminated, truncated = env.step(policy(obs))
        total += reward
        length += 1
        distance += env.forward
        for i in np.flatnonzero(terminated | truncated):
            if len(played[i]) < quota[i]:
                played[i].append((total[i], length[i], distance[i], bool(terminated[i]), bool(env.diverged[i])))
                missing -= 1
            total[i] = length[i] = distance[i] = 0
    returns, lengths, distances, falls, diverged = np.array([one for each in played for one in each], float).T
    return {
        "episodes": episodes,
        "return_mean": float(returns.mean()),
        "return_std": float(returns.std()),
        "return_min": float(returns.min()),
        "return_max": float(returns.max()),
        "length_mean": float(lengths.mean()),
        "distance_mean": float(distances.mean()),
        "speed_mean": float((distances / (lengths * env.spec.dt)).mean()),
        "falls": int(falls.sum()),
        "diverged": int(diverged.sum()),
    }
