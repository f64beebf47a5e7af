"""A creature of one's own in Python: an inchworm that learns to creep.

An agent is an MJCF file (`../inchworm.xml`) and a class: what it observes, what it is rewarded for, when it has failed.
One object is all agents, so every function is a few lines of NumPy over arrays with a row per agent. The class goes
wherever a task's name goes. `../custom_agent.rs` is the same worm in Rust.

    python custom_agent.py                    learns with the native trainer, some seconds
    python custom_agent.py --trainer sb3      with Stable-Baselines3, some minutes
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

from marathon_rl import MarathonAgent, train


class Inchworm(MarathonAgent):
    """Two motors, no legs: creep forward."""

    mjcf = Path(__file__).parents[1] / "inchworm.xml"
    max_episode_steps = 500
    feet = touch = ("head", "tail", "middle")  # a worm lies on the ground

    def observations(self):
        return {
            "velocity": self.linear_velocity("middle"),
            "forward": self.forward("middle"),
            "touch": self.touch_sensors(),
            "joint_rotations": self.joint_rotations(),
            "joint_velocities": self.joint_velocities(),
            "head_height": self.height("head"),
        }

    def step_reward(self):
        return {"velocity": 4 * self.velocity("middle"), "effort": -0.05 * self.effort()}

    def terminate(self):
        return self.up("middle")[:, 2] < 0  # on its back


def learn_natively(steps: int) -> Callable[[np.ndarray], np.ndarray]:
    """Train natively; returns the best actions as a function of the observations."""

    def show(row: dict) -> None:
        if row["episodes"]:
            print(f"{row['steps']:9,.0f} steps, return {row['return_mean']:6.2f}, {row['speed_mean']:.3f} m/s")

    policy = train(Inchworm, {"run": {"agents": 256, "total_steps": steps}}, callback=show).policy
    policy.save("inchworm.safetensors")
    return policy


def learn_with_sb3(steps: int) -> Callable[[np.ndarray], np.ndarray]:
    """The same with Stable-Baselines3's PPO."""
    from stable_baselines3 import PPO  # noqa: PLC0415 (only who asks for it needs it)
    from stable_baselines3.common.vec_env import DummyVecEnv  # noqa: PLC0415

    envs = DummyVecEnv([Inchworm.make for _ in range(8)])
    model = PPO("MlpPolicy", envs, n_steps=256, verbose=1, device="cpu").learn(steps)
    return lambda obs: model.predict(obs, deterministic=True)[0]


def distance(policy: Callable[[np.ndarray], np.ndarray]) -> float:
    """How far worms creep in an episode, m."""
    worms = Inchworm.vec_env(16, autoreset="disabled")
    obs = worms.reset(seed=1)
    start = worms.x_position
    for _ in range(Inchworm.max_episode_steps):
        obs = worms.step(policy(obs))[0]
    return float(np.mean(worms.x_position - start))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--trainer", choices=("native", "sb3"), default="native")
    parser.add_argument("--steps", type=int, default=1_000_000, help="decisions of all worms together")
    arguments = parser.parse_args()
    learn = learn_natively if arguments.trainer == "native" else learn_with_sb3
    print(f"the worms creep {distance(learn(arguments.steps)):.2f} m in 10 s")
