"""Python's share of a step of many agents.

    python python/bench/overhead.py [--agents 1024] [--json]

Two parts, in microseconds of processor time of the calling thread, medians:

* `gymnasium`: a step of `MarathonVectorEnv` whose native environment is a stand-in that returns the results of an
  earlier step at once. The rest is Python's work per step: infos, types, masks. In "next_step" no episode
  ends, as in most steps; in "same_step", one in a hundred does in every step, as when episodes last for a hundred.
* `native`: a whole step of `VecEnv` with a single agent of the cheapest task: the call, its checks, its nine arrays,
  and the physics of one block of sixteen. So it is more than what the binding adds, which does not depend on the number
  of agents: arrays are handed over, not copied.
"""

import argparse
import json
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

import marathon_rl

TASKS = ("Hopper-v0", "Humanoid-v0", "Hopper-v5", "Humanoid-v5")


class Standin:
    """A native environment that does nothing."""

    def __init__(self, env: marathon_rl.VecEnv, results: tuple[np.ndarray, ...]) -> None:
        self._env, self._results = env, results
        for name in ("spec", "copy", "reward_terms", "info", "forward", "diverged", "final_obs"):
            setattr(self, name, getattr(env, name))
        self.read_info = env.read_info

    @property
    def x_position(self) -> np.ndarray | None:
        """The real one: it is part of what a step asks for."""
        return self._env.x_position

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return what an earlier step returned."""
        del actions
        return self._results


def microseconds(f: Callable[[], Any], repeats: int) -> float:
    """Median of the processor time of a call."""
    times = []
    for _ in range(repeats):
        start = time.thread_time_ns()
        f()
        times.append(time.thread_time_ns() - start)
    return float(np.median(times)) / 1e3


def gymnasium_step(task: str, num_envs: int, mode: AutoresetMode, ends: int, repeats: int = 400) -> float:
    """Measure `MarathonVectorEnv.step` without the native step, in which `ends` episodes end."""
    envs = gymnasium.make_vec(f"marathon_rl/{task}", num_envs=num_envs, autoreset_mode=mode, threads=1)
    envs.reset(seed=1)
    actions = np.zeros(envs.action_space.shape, np.float32)
    obs, reward, terminated, truncated = envs._env.step(actions)
    terminated[:], truncated[:] = np.arange(num_envs) < ends, False
    envs._env = Standin(envs._env, (obs, reward, terminated, truncated))
    return microseconds(lambda: envs.step(actions), repeats)


def native_step(repeats: int = 2000) -> float:
    """Measure a step of `VecEnv` with next to no physics."""
    env = marathon_rl.VecEnv("InvertedPendulum-v5", 1, threads=1, autoreset="same_step", dtype="float32")
    env.reset(1)
    actions = np.zeros((1, 1), np.float32)
    return microseconds(lambda: env.step(actions), repeats)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--agents", type=int, default=1024)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    agents, rows = arguments.agents, []
    for task in TASKS:
        row: dict[str, Any] = {"task": task, "agents": agents}
        row["next_step"] = gymnasium_step(task, agents, AutoresetMode.NEXT_STEP, 0)
        row["same_step"] = gymnasium_step(task, agents, AutoresetMode.SAME_STEP, agents // 100)
        rows.append(row)
    native = native_step()
    if arguments.json:
        print(json.dumps({"gymnasium": rows, "native": native}))
        return
    for row in rows:
        print(f"{row['task']:<12} next_step {row['next_step']:6.1f} us   same_step {row['same_step']:6.1f} us")
    print(f"{'VecEnv':<12} {native:6.1f} us with the physics of one block")


if __name__ == "__main__":
    main()
