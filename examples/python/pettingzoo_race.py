"""A race in PettingZoo: many agents in one world, as in the paper's pictures.

Each agent is a name in the dictionaries that `ParallelEnv` wants, with rewards of its own; who falls leaves the race.
Half of the runners here have learned for the given number of steps, the others for a tenth of it, all with the native
trainer. The winner is who comes farthest.

    pip install ".[pettingzoo]"
    python pettingzoo_race.py                      hoppers, a quarter of a minute
    python pettingzoo_race.py --picture race.png   the field after three seconds (needs pillow)
"""

import argparse
from pathlib import Path

import marathon_rl
from marathon_rl.adapters.pettingzoo import MarathonParallelEnv


def race(task: str, steps: int, runners: int, seconds: float, picture: Path | None) -> None:
    """Train two policies, race them, and print who came how far."""
    old, young = (marathon_rl.train(task, steps=n, seed=1).policy for n in (steps, steps // 10))
    env = MarathonParallelEnv(task, runners, render_mode="rgb_array")
    policies = {name: (young if i % 2 else old) for i, name in enumerate(env.possible_agents)}
    distance = dict.fromkeys(env.possible_agents, 0.0)

    observations, _ = env.reset(seed=3)
    dt = env.task_spec.dt
    for step in range(round(seconds / dt)):
        # drawn actions, or all runners of a kind would run alike
        actions = {name: policies[name](observations[name], rng=step) for name in env.agents}
        observations, _, terminations, _, infos = env.step(actions)
        for name, info in infos.items():
            distance[name] += info["x_velocity"] * dt
        for name in (name for name, fell in terminations.items() if fell):
            print(f"{name} falls after {(step + 1) * dt:.1f} s")
        if picture is not None and step == round(3 / dt):
            from PIL import Image  # noqa: PLC0415 (only who asks for it needs it)

            Image.fromarray(env.render()).save(picture)
        if not env.agents:
            break
    for name in sorted(distance, key=distance.get, reverse=True):
        training = "a tenth" if policies[name] is young else "all"
        print(f"{name}: {distance[name]:6.2f} m after {training} of the training")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--task", default="Hopper-v0")
    parser.add_argument("--steps", type=int, default=4_000_000, help="steps of the longer training")
    parser.add_argument("--runners", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--picture", type=Path)
    race(**vars(parser.parse_args()))
