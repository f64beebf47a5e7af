"""An agent that takes commands: a rover that learns to drive at a commanded velocity.

`commands` names what it can be told, `draw_command` is its own schedule: a new velocity every one to three seconds. It
learns under that schedule; then a caller's `set_command` goes before it, as a player's gamepad or a planner would.
`../steer_an_agent.rs` is the same rover in Rust.

    python steer_an_agent.py                  learns with the native trainer, some seconds
"""

import argparse
from pathlib import Path

import numpy as np

from marathon_rl import CommandRange, MarathonAgent, Tolerance, train

FASTEST = 2.0


class Rover(MarathonAgent):
    """Two wheels: drive at the commanded velocity."""

    mjcf = Path(__file__).parents[1] / "rover.xml"
    max_episode_steps = 500
    commands = (CommandRange("velocity", -FASTEST, FASTEST, "m/s"),)
    metrics = ("velocity_error",)

    def draw_command(self, random, step):
        velocity = random.uniform(-FASTEST, FASTEST)
        # decisions for which it holds, fifty a second
        return velocity, random.uniform(50, 151)[:, 0].astype(int)

    def observations(self):
        return {
            "command": self.command[:, 0],
            "velocity": self.linear_velocity("chassis"),
            "up": self.up("chassis"),
            "wheels": self.joint_velocities(),
        }

    def error(self):
        return self.linear_velocity("chassis")[:, 0] - self.command[:, 0]

    def step_reward(self):
        return {"tracking": Tolerance.around_zero(1.0)(self.error()), "effort": -0.01 * self.effort()}

    def info(self):
        return {"velocity_error": np.abs(self.error())}

    def terminate(self):
        return self.up("chassis")[:, 2] < 0


def drive(rovers, policy, obs, decisions: int):
    """Drive for some decisions; returns the last observations and the mean of the velocity errors, m/s."""
    errors = []
    for _ in range(decisions):
        obs = rovers.step(policy(obs))[0]
        errors.append(rovers.info[:, rovers.spec.info.index("velocity_error")].mean())
    return obs, np.mean(errors)


def main() -> None:
    """Learn, then drive by schedule and by command."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--steps", type=int, default=600_000, help="decisions of all rovers together")
    policy = train(Rover, {"run": {"agents": 256, "total_steps": parser.parse_args().steps}}).policy
    policy.save("rover.safetensors")

    rovers = Rover.vec_env(16, autoreset="disabled")
    velocity = rovers.spec.observations["velocity"].start
    obs, error = drive(rovers, policy, rovers.reset(seed=1), 450)
    print(f"on their own schedule for 9 s: {error:.2f} m/s off on average")
    for target in (1.5, -1.5):
        rovers.set_command(np.full((16, 1), target))
        obs, _ = drive(rovers, policy, obs, 100)
        print(f"told {target} m/s: {obs[:, velocity].mean():.2f} m/s after 2 s")
    rovers.set_command(None)
    print(f"on their schedule again: {drive(rovers, policy, obs, 450)[1]:.2f} m/s off on average")


if __name__ == "__main__":
    main()
