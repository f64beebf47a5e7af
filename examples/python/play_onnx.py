"""From training to a file that plays anywhere: ONNX.

The native trainer learns, `save` writes one file, and ONNX Runtime plays it: no Marathon is needed for that, nor
PyTorch. The network takes raw observations and returns actions in the environment's units, because normalization and
bounds are inside. The file follows the contract of ML-Agents' models, so the names of its inputs and outputs are
theirs.

    pip install onnxruntime
    python play_onnx.py                       trains a hopper, 20 s, and plays hopper.onnx
    python play_onnx.py --network other.onnx  plays a file that is there already
"""

import argparse
from pathlib import Path

import gymnasium
import numpy as np
import onnxruntime

import marathon_rl


def train(task: str, steps: int, file: Path) -> None:
    """Learn a task, and write the policy."""
    result = marathon_rl.train(task, steps=steps, seed=1)
    result.policy.save(file)
    print(f"trained: return {result.evaluation['return_mean']:.1f}, written to {file}")


def play(task: str, file: Path, episodes: int) -> None:
    """Play whole episodes in Gymnasium's interface."""
    network = onnxruntime.InferenceSession(str(file), providers=["CPUExecutionProvider"])
    env = gymnasium.make(f"marathon_rl/{task}")
    returns, difference, ours = [], 0.0, marathon_rl.load_policy(file, task)
    for episode in range(episodes):
        obs, _ = env.reset(seed=episode)
        total, ended = 0.0, False
        while not ended:
            inputs = {"obs_0": obs[None].astype(np.float32)}
            action = network.run(["deterministic_continuous_actions"], inputs)[0][0]
            difference = max(difference, float(np.abs(action - ours(obs)).max()))
            obs, reward, terminated, truncated, _ = env.step(action)
            total += float(reward)
            ended = terminated or truncated
        returns.append(total)
    print(f"played by ONNX Runtime: return {np.mean(returns):.1f}, {len(returns)} episodes")
    print(f"largest difference to the same file played by Marathon: {difference:.1e}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--task", default="Hopper-v0")
    parser.add_argument("--steps", type=int, default=8_000_000, help="steps of all agents together")
    parser.add_argument("--episodes", type=int, default=10)
    parser.add_argument("--network", type=Path)
    arguments = parser.parse_args()
    network = arguments.network or Path(f"{arguments.task.split('-')[0].lower()}.onnx")
    if arguments.network is None:
        train(arguments.task, arguments.steps, network)
    play(arguments.task, network, arguments.episodes)
