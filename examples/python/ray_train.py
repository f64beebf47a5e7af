"""Training on many processes: Ray's workers play, one learner learns, and the policy has the bits of a run without Ray.

    pip install "marathon-rl[ray]"
    python ray_train.py                           two workers on this machine
    python ray_train.py --kill                    one of them is killed on the way
    python ray_train.py --address 10.0.0.1:6379   on a cluster begun with `ray start`

The last line is a fingerprint of the policy: the same for every number of workers, killed or not.
"""

import argparse
import hashlib
from collections.abc import Sequence

import numpy as np
import ray

from marathon_rl.ray import Workers, train


def main(words: Sequence[str] | None = None) -> str:
    """Train as a command line says; returns the fingerprint."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--task", default="Ant-v5")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--agents", type=int, default=1024, help="many make up for the time that messages take")
    parser.add_argument("--steps", type=int, default=2_000_000)
    parser.add_argument("--address", help="of a cluster; without, Ray starts one on this machine")
    parser.add_argument("--kill", action="store_true", help="kill a worker in the third iteration")
    args = parser.parse_args(words)

    if not ray.is_initialized():
        ray.init(address=args.address)
    workers = Workers(args.workers)

    def report(row: dict[str, float | None]) -> None:
        print(f"{row['steps']:9.0f} steps, return {row['return_mean'] or 0:7.1f}, {row['steps_per_second']:8.0f}/s")
        if args.kill and row["iteration"] == 2:
            workers.kill(0)

    result = train(args.task, workers=workers, num_envs=args.agents, steps=args.steps, seed=1, callback=report)
    workers.close()
    print(f"workers replaced: {workers.replaced}")
    if result.evaluation:
        print(f"return of the best actions: {result.evaluation['return_mean']:.1f}")

    answers = result.policy(np.linspace(-1, 1, 64 * result.policy.obs_size).reshape(64, -1))
    fingerprint = hashlib.sha256(answers.tobytes()).hexdigest()[:16]
    print(f"fingerprint {fingerprint}")
    return fingerprint


if __name__ == "__main__":
    main()
