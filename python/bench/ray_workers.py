"""Rollout throughput of Ray's workers: one and two of them in turns, on this machine.

    $ python python/bench/ray_workers.py

A figure is decisions per second of time passed while rollouts are played, messages included; the time in which the
learner learns and the workers wait is not counted. The last line is the median of the ratios of the turns.

Needs `marathon-envs[ray]`.
"""

import argparse
import statistics
import time
from collections.abc import Iterator

import ray

from marathon_envs.ray import Bytes, Workers, train


class Timed(Workers):
    """Workers that measure their rollouts."""

    def begin(self, task: str, config: str) -> int:
        """Begin without times."""
        self.seconds: list[float] = []
        return super().begin(task, config)

    def play(self, orders: Bytes, states: list[Bytes]) -> Iterator[tuple[int, Bytes]]:
        """Play and note the time."""
        start = time.perf_counter()
        yield from super().play(orders, states)
        self.seconds.append(time.perf_counter() - start)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--task", default="Humanoid-v5")
    parser.add_argument("--agents", type=int, default=1024)
    parser.add_argument("--workers", type=int, nargs=2, default=[1, 2], help="numbers to compare (default: 1 2)")
    parser.add_argument("--rollouts", type=int, default=3, help="rollouts of a turn, after one to begin with")
    parser.add_argument("--turns", type=int, default=5)
    args = parser.parse_args()
    ray.init(num_cpus=max(args.workers), include_dashboard=False, log_to_driver=False)
    ratios = []
    for _ in range(args.turns):
        rates = []
        for count in args.workers:
            workers = Timed(count)
            rows: list[float] = []

            def note(row: dict[str, float | None], rows: list[float] = rows) -> bool:
                rows.append(float(row["steps"] or 0))
                return len(rows) <= args.rollouts

            train(args.task, workers=workers, agents=args.agents, callback=note)
            workers.close()
            rates.append(rows[0] / statistics.median(workers.seconds[1:]))
        ratios.append(rates[1] / rates[0])
        shown = ", ".join(f"{n} workers {rate:,.0f}/s" for n, rate in zip(args.workers, rates, strict=True))
        print(f"{args.task}: {shown}, ratio {ratios[-1]:.2f}", flush=True)
    print(f"median ratio {statistics.median(ratios):.2f}")
    ray.shutdown()


if __name__ == "__main__":
    main()
