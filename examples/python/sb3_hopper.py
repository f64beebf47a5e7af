"""Stable-Baselines3 on Gymnasium's Hopper-v5, simulated by Marathon.

The task is Gymnasium's: the same spaces, rewards and ends, so what is learned here scores the same there. Only the
simulation is another: `Sb3VecEnv` steps all hoppers at once on native threads, and there are no worker processes.

PPO lives on many steps; 16 hoppers side by side give them. SAC learns from each step again and again, so its time
goes into the networks, and four hoppers are enough.

    pip install ".[sb3]"
    python sb3_hopper.py                       PPO, a million steps: some minutes
    python sb3_hopper.py --algorithm sac --steps 200000
    python sb3_hopper.py --judge Hopper-v5     plays the result in Gymnasium's own, which needs mujoco
"""

import argparse

import gymnasium
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

import marathon_rl  # noqa: F401 (registers the tasks with Gymnasium)
from marathon_rl.adapters.sb3 import Sb3VecEnv

TASK = "Hopper-v5"


def ppo(seed: int) -> BaseAlgorithm:
    """PPO with normalized observations and rewards."""
    env = VecNormalize(VecMonitor(Sb3VecEnv(TASK, num_envs=16)), gamma=0.99)
    settings = {"n_steps": 128, "batch_size": 256, "n_epochs": 5, "learning_rate": 5e-4, "gae_lambda": 0.95}
    return PPO("MlpPolicy", env, **settings, seed=seed, device="cpu")


def sac(seed: int) -> BaseAlgorithm:
    """SAC with its usual settings: one update for each step."""
    env = VecMonitor(Sb3VecEnv(TASK, num_envs=4))
    return SAC("MlpPolicy", env, gradient_steps=-1, learning_starts=400, seed=seed, device="cpu")


def mean_return(model: BaseAlgorithm, task: str, episodes: int) -> float:
    """How the best actions do in a task of Gymnasium's registry."""
    env, normalizer, total = gymnasium.make(task), model.get_vec_normalize_env(), 0.0
    for episode in range(episodes):
        obs, _ = env.reset(seed=episode)
        ended = False
        while not ended:
            obs = obs if normalizer is None else normalizer.normalize_obs(obs)
            obs, reward, terminated, truncated, _ = env.step(model.predict(obs, deterministic=True)[0])
            total += float(reward)
            ended = terminated or truncated
    return total / episodes


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--algorithm", choices=("ppo", "sac"), default="ppo")
    parser.add_argument("--steps", type=int, default=1_000_000, help="steps of all hoppers together")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--judge", default=f"marathon_rl/{TASK}", help="task of Gymnasium's registry to play in")
    arguments = parser.parse_args()
    # networks this small are slower on several threads
    torch.set_num_threads(1)
    learner = {"ppo": ppo, "sac": sac}[arguments.algorithm](arguments.seed)
    print(f"before: return {mean_return(learner, arguments.judge, 10):.1f}")
    learner.learn(arguments.steps)
    print(f"after {arguments.steps:,} steps: return {mean_return(learner, arguments.judge, 10):.1f}")
