"""Rollout throughput of Ray's workers: one and two of them in turns, on this machine.

    $ python python/bench/ray_workers.py

A figure is decisions per second while rollouts are played, messages included; the time in which the learner learns and
the workers wait is not counted. `passed` is by time passed. `free` is what it would be with a free processor for each
worker, from the processor time that the rollouts took: that of the busiest worker and, one after the other, of the
learner's process; it is what to look at where others use the machine. The last line has the medians of the ratios.

Needs `marathon-rl[ray]`.
"""

import argparse
import statistics
import time
from collections.abc import Iterator

import ray

from marathon_rl.ray import Bytes, Workers, train


class Timed(Workers):
    """Workers that measure their rollouts."""

    def begin(self, task: str, config: str) -> int:
        """Begin without times."""
        self.seconds: list[tuple[float, float]] = []
        return super().begin(task, config)

    def play(self, orders: Bytes, states: list[Bytes]) -> Iterator[tuple[int, Bytes]]:
        """Play and note the time passed, and the time that free processors would take."""
        start, own, theirs = time.perf_counter(), time.process_time(), self.processor_times()
        yield from super().play(orders, states)
        passed, own = time.perf_counter() - start, time.process_time() - own
        # actors are made by the first rollout
        used = [after - before for before, after in zip(theirs, self.processor_times(), strict=False)]
        self.seconds.append((passed, own + max(used, default=0)))

    def processor_times(self) -> list[float]:
        """Seconds that each actor has used."""
        return ray.get([actor.__ray_call__.remote(lambda _: time.process_time()) for actor in self._actors])


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
    ratios: list[list[float]] = []
    for _ in range(args.turns):
        rates: list[list[float]] = []
        for count in args.workers:
            workers = Timed(count)
            rows: list[float] = []

            def note(row: dict[str, float | None], rows: list[float] = rows) -> bool:
                rows.append(float(row["steps"] or 0))
                return len(rows) <= args.rollouts

            train(args.task, workers=workers, num_envs=args.agents, callback=note)
            workers.close()
            # the first rollout has the making of the actors in it
            rates.append([rows[0] / statistics.median(s) for s in zip(*workers.seconds[1:], strict=True)])
        ratios.append([two / one for one, two in zip(*rates, strict=True)])
        for n, (passed, free) in zip(args.workers, rates, strict=True):
            print(f"{args.task}, {n} workers: passed {passed:,.0f}/s, free {free:,.0f}/s", flush=True)
    passed, free = (statistics.median(r) for r in zip(*ratios, strict=True))
    print(f"ratio {args.workers[1]} to {args.workers[0]}: passed {passed:.2f}, free {free:.2f}")
    ray.shutdown()


if __name__ == "__main__":
    main()
