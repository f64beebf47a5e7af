"""Decisions per processor second of the vector environments: Marathon, EnvPool and Gymnasium in turns, in one run.

    $ python python/bench/throughput.py --against envpool,gymnasium

Every side takes random actions, uniform within their bounds, and resets agents at the end of their episodes. The sides
take turns, and a figure is the median of their rounds. Processor time is that of all threads of the process. `of 2
threads` is the throughput of two threads, in time passed, by that of one.

Needs `gymnasium[mujoco]` and `envpool` for their parts.
"""

import argparse
import importlib.util
import json
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

import marathon_rl

TASKS = ["Hopper-v5", "Walker2d-v5", "Ant-v5", "Humanoid-v5"]
# rows of actions that are drawn beforehand
DRAWN = 64
# a turn looks at the clock whenever the agents together have made so many decisions
CHUNK = 4096
# agents of the others: EnvPool is faster with many, Gymnasium is not
ENVPOOL_AGENTS = 256
GYMNASIUM_AGENTS = 16


@dataclass
class Side:
    """One of those that take turns."""

    name: str
    num_envs: int
    step: Callable[[np.ndarray], Any]
    actions: np.ndarray
    rates: list[float]
    walls: list[float]

    def round(self, seconds: float) -> None:
        """Step for some processor seconds."""
        steps, wall, cpu = 0, time.perf_counter(), time.process_time()
        while (used := time.process_time() - cpu) < seconds:
            for _ in range(max(CHUNK // self.num_envs, 1)):
                self.step(self.actions[steps % DRAWN])
                steps += 1
        self.rates.append(steps * self.num_envs / used)
        self.walls.append(steps * self.num_envs / (time.perf_counter() - wall))


def marathon(task: str, num_envs: int, threads: int) -> Side:
    """Ours."""
    env = marathon_rl.VecEnv(task, num_envs, threads=threads, autoreset="same_step", dtype="float32")
    env.reset(seed=1)
    name = "marathon" if threads == 1 else f"marathon, {threads} threads"
    return Side(name, num_envs, env.step, actions(task, num_envs, np.float32), [], [])


def envpool(task: str, num_envs: int = ENVPOOL_AGENTS) -> Side:
    """EnvPool, on one thread of its own."""
    import envpool as package  # noqa: PLC0415

    env = package.make_gymnasium(task, num_envs=num_envs, num_threads=1, seed=1)
    env.reset()
    return Side("envpool", num_envs, env.step, actions(task, num_envs, np.float64), [], [])


def gymnasium_sync(task: str, num_envs: int = GYMNASIUM_AGENTS) -> Side:
    """Gymnasium's vector environment in one process."""
    env = gymnasium.make_vec(task, num_envs, vectorization_mode="sync")
    env.reset(seed=1)
    return Side("gymnasium", num_envs, env.step, actions(task, num_envs, np.float32), [], [])


def actions(task: str, num_envs: int, dtype: type) -> np.ndarray:
    """Rows of random actions."""
    spec = marathon_rl.spec(task)
    shape = (DRAWN, num_envs, spec.act_size)
    return np.random.default_rng(1).uniform(spec.action_low, spec.action_high, shape).astype(dtype)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--against", default="", metavar="NAMES", help="envpool, gymnasium, or both with a comma")
    parser.add_argument("--task", action="append", choices=TASKS, help="only this one; may be repeated")
    parser.add_argument("--agents", type=int, default=1024, help="agents of ours (default: 1024)")
    parser.add_argument("--rounds", type=int, default=7, help="turns of each side (default: 7)")
    parser.add_argument("--seconds", type=float, default=0.5, help="processor seconds of a turn (default: 0.5)")
    parser.add_argument("--json", action="store_true", help="print JSON")
    args = parser.parse_args()
    against = {"envpool": envpool, "gymnasium": gymnasium_sync}
    names = [name for name in args.against.split(",") if name]
    for name in names:
        if name not in against:
            parser.error(f"--against has '{name}', expected some of: {', '.join(against)}")
        if importlib.util.find_spec(name) is None:
            parser.error(f"--against has '{name}', which {sys.executable} lacks: pip install {name}")

    table = []
    for task in args.task or TASKS:
        ours = marathon(task, args.agents, 1)
        twice = marathon(task, args.agents, 2)
        sides = [ours, twice, *(against[name](task) for name in names)]
        for side in sides:
            side.round(args.seconds / 2)
            side.rates.clear()
            side.walls.clear()
        for _ in range(args.rounds):
            for side in sides:
                side.round(args.seconds)
        rates = {side.name: statistics.median(side.rates) for side in sides}
        row: dict[str, Any] = {"task": task, "steps_per_cpu_second": {k: round(v) for k, v in rates.items()}}
        row["ratio"] = {name: round(rates["marathon"] / rates[name], 1) for name in names}
        pairs = zip(twice.walls, ours.walls, strict=True)
        row["of_2_threads"] = round(statistics.median(two / one for two, one in pairs), 2)
        table.append(row)
        if not args.json:
            print(line(row), flush=True)
    if args.json:
        print(json.dumps(table, indent=1))


def line(row: dict[str, Any]) -> str:
    """A row as text."""
    rates = ", ".join(f"{name} {rate:,}" for name, rate in row["steps_per_cpu_second"].items())
    ratios = "".join(f", {ratio} x {name}" for name, ratio in row["ratio"].items())
    return f"{row['task']}: steps per processor second: {rates}{ratios}; of 2 threads {row['of_2_threads']}"


if __name__ == "__main__":
    main()
