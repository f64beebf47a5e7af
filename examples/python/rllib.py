"""RLlib's PPO on the environments of this package, many agents stepped natively in each of its env runners.

pip install "marathon-rl[rllib]"
python rllib.py --task Hopper-v5 --iterations 20
"""

import argparse
from collections.abc import Sequence

from ray.rllib.algorithms.ppo import PPOConfig

import marathon_rl.ray


def main(words: Sequence[str] | None = None) -> list[float]:
    """Train as a command line says; returns the mean return of each iteration."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--task", default="Hopper-v5")
    parser.add_argument("--iterations", type=int, default=20)
    parser.add_argument("--runners", type=int, default=1, help="processes that step environments")
    parser.add_argument("--agents", type=int, default=64, help="agents in each of them")
    parser.add_argument("--batch", type=int, default=8192, help="decisions per iteration")
    args = parser.parse_args(words)

    marathon_rl.ray.register()
    config = (
        PPOConfig()
        # env_config may have arguments of the task, such as {"ctrl_cost_weight": 0.01}
        .environment(f"marathon_rl/{args.task}")
        .env_runners(
            num_env_runners=args.runners,
            num_envs_per_env_runner=args.agents,
            # without this, RLlib steps its environments one after another
            gym_env_vectorize_mode="vector_entry_point",
        )
        .training(train_batch_size_per_learner=args.batch, minibatch_size=1024, num_epochs=4, lr=3e-4)
    )
    algorithm = config.build_algo()
    returns = []
    for i in range(args.iterations):
        result = algorithm.train()["env_runners"]
        returns.append(result["episode_return_mean"])
        print(f"iteration {i + 1}: {result['num_env_steps_sampled']} steps, return {returns[-1]:.1f}")
    algorithm.stop()
    return returns


if __name__ == "__main__":
    main()
