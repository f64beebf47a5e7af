"""Plays policies of Gymnasium's tasks here and in the installed Gymnasium, side by side.

The tasks of the same names agree with Gymnasium's, so a policy should score the same on both sides:

    $ python -m marathon_rl.compare_gymnasium runs/Hopper-v5-1
    Hopper-v5
      marathon   3622 +- 0 (100 episodes, 0 falls)
      gymnasium  3622 +- 1 (20 episodes, 0 falls)
      difference    0 +- 1: within the confidence interval

Needs `gymnasium[mujoco]`.
"""

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from marathon_rl._native import VecEnv, load_policy

Array = npt.NDArray[Any]
Act = Callable[[Array], Array]
"""Actions, `(n, act_size)`, for observations, `(n, obs_size)`."""

# two-sided 95% of the normal distribution
_Z = 1.96


@dataclass(frozen=True)
class Score:
    """Results of a policy in some episodes."""

    returns: tuple[float, ...]
    """Undiscounted sum of the rewards of each episode."""
    falls: int
    """Episodes that ended in a terminal state."""

    @property
    def mean(self) -> float:
        """Mean return."""
        return float(np.mean(self.returns))

    @property
    def half_width(self) -> float:
        """Half the 95% confidence interval of the mean return."""
        return _Z * float(np.std(self.returns, ddof=1)) / math.sqrt(len(self.returns))

    def __str__(self) -> str:
        return f"{self.mean:.0f} +- {self.half_width:.0f} ({len(self.returns)} episodes, {self.falls} falls)"


@dataclass(frozen=True)
class Comparison:
    """Scores of one policy on both sides."""

    task: str
    """Name of the task, such as `Hopper-v5`."""
    marathon: Score
    """Here."""
    gymnasium: Score
    """In the installed Gymnasium."""

    @property
    def difference(self) -> float:
        """Mean return in Gymnasium minus that here."""
        return self.gymnasium.mean - self.marathon.mean

    @property
    def half_width(self) -> float:
        """Half the 95% confidence interval of the difference."""
        return math.hypot(self.marathon.half_width, self.gymnasium.half_width)

    @property
    def agrees(self) -> bool:
        """Whether the difference is within its confidence interval."""
        return abs(self.difference) <= self.half_width

    def __str__(self) -> str:
        verdict = "within" if self.agrees else "outside"
        return (
            f"{self.task}\n  marathon   {self.marathon}\n  gymnasium  {self.gymnasium}\n"
            f"  difference {self.difference:.0f} +- {self.half_width:.0f}: {verdict} the confidence interval"
        )


def play_here(task: str, act: Act, episodes: int = 100, *, seed: int = 1, **options: Any) -> Score:
    """Play `episodes` episodes of a task of this package, all at once; `options` are arguments of the task."""
    _check(episodes)
    env = VecEnv(task, episodes, seed=seed, autoreset="same_step", dtype="float32", **options)
    obs = env.reset()
    returns, falls = np.zeros(episodes), 0
    going = np.ones(episodes, np.bool_)
    while going.any():
        obs, reward, terminated, truncated = env.step(np.asarray(act(obs), np.float32))
        # only an agent's first episode counts
        returns[going] += reward[going]
        falls += int(np.count_nonzero(terminated & going))
        going &= ~(terminated | truncated)
    return Score(tuple(returns.tolist()), falls)


def play_gymnasium(task: str, act: Act, episodes: int = 20, *, seed: int = 1, **options: Any) -> Score:
    """Play `episodes` episodes of a task of the installed Gymnasium, seeded with `seed`, `seed + 1` and so on."""
    _check(episodes)
    envs = [gymnasium.make(task, **options) for _ in range(episodes)]
    try:
        obs = [env.reset(seed=seed + i)[0] for i, env in enumerate(envs)]
        returns, falls = [0.0] * episodes, 0
        going = list(range(episodes))
        while going:
            actions = act(np.stack([obs[i] for i in going]))
            ended = set()
            for i, action in zip(going, actions, strict=True):
                obs[i], reward, terminated, truncated, _ = envs[i].step(action)
                returns[i] += float(reward)
                falls += bool(terminated)
                if terminated or truncated:
                    ended.add(i)
            going = [i for i in going if i not in ended]
    finally:
        for env in envs:
            env.close()
    return Score(tuple(returns), falls)


def compare(task: str, act: Act, episodes: int = 20, *, here: int = 100, seed: int = 1) -> Comparison:
    """Play one policy on both sides.

    Args:
        task: a task that both have, such as `Hopper-v5`.
        act: the policy, a function of observations `(n, obs_size)` that returns actions `(n, act_size)`; a
            `marathon_rl.Policy` is one.
        episodes: episodes in Gymnasium.
        here: episodes here, which cost little.
        seed: of the starts.
    """
    return Comparison(task, play_here(task, act, here, seed=seed), play_gymnasium(task, act, episodes, seed=seed))


def _check(episodes: int) -> None:
    if episodes < 2:
        raise ValueError(f"episodes is {episodes}, expected at least 2: a confidence interval needs them")


def main(words: Sequence[str] | None = None) -> None:
    """Compare the policies of a command line."""
    parser = argparse.ArgumentParser(
        "python -m marathon_rl.compare_gymnasium", description=str(__doc__).splitlines()[0]
    )
    parser.add_argument("policies", nargs="+", metavar="POLICY", help="a policy file, or the folder of a run")
    parser.add_argument("--episodes", type=int, default=20, help="episodes in Gymnasium (default: 20)")
    parser.add_argument("--here", type=int, default=100, help="episodes here (default: 100)")
    parser.add_argument("--seed", type=int, default=1, help="of the starts (default: 1)")
    args = parser.parse_args(words)
    for path in args.policies:
        policy = load_policy(path)
        print(compare(policy.task, policy, args.episodes, here=args.here, seed=args.seed))


if __name__ == "__main__":
    main()
