"""Spaces of a task, and what else one agent and many have in common."""

from typing import Any, cast

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from marathon_rl._native import Spec, _seeds
from marathon_rl.agent_env import AgentSpec

FloatArray = npt.NDArray[Any]
BoolArray = npt.NDArray[np.bool_]

# coordinates and velocities beyond this size end an episode as diverged; observations stay below it
LARGEST = 1e6

# number of steps that no episode reaches
NEVER = 2**63 - 1


def is_gymnasiums(spec: Spec | AgentSpec) -> bool:
    """Whether the task is one of Gymnasium's own: its spaces and infos are as there."""
    return spec.dtype == "float64"


def observation_space(spec: Spec | AgentSpec) -> spaces.Box:
    """Single observations, `(obs_size,)`."""
    if is_gymnasiums(spec):
        return spaces.Box(-np.inf, np.inf, (spec.obs_size,), np.float64)
    return spaces.Box(-LARGEST, LARGEST, (spec.obs_size,), np.float32)


def action_space(spec: Spec | AgentSpec) -> spaces.Box:
    """Single actions, `(act_size,)`."""
    return spaces.Box(np.array(spec.action_low, np.float32), np.array(spec.action_high, np.float32))


def info_names(spec: Spec | AgentSpec) -> tuple[list[str], bool]:
    """Names of the numbers that the task reports, and whether the position and velocity along x are to be added."""
    return spec.info, "x_position" not in spec.info


def warn_of_divergence(actions: Any) -> None:
    """Tell, as often as Python's filters let it through, why episodes end for no reason that an observation shows."""
    if np.isfinite(np.asarray(actions, np.float32)).all():
        gymnasium.logger.warn("a simulation broke down: its episode ends, info['diverged'] is True")
    else:
        gymnasium.logger.warn("an action is not finite: its agent's episode ends, info['diverged'] is True")


def native_seed(seed: Any) -> int:
    """Check the seed of one agent."""
    # as one of many, so that an error does not offer a sequence
    (checked,) = cast("list[int]", _seeds([seed]))
    return checked


def steps_limit(max_episode_steps: int | None, default: int | None) -> int | None:
    """Number of steps for the native environment; Gymnasium's -1 means that episodes never end by time."""
    if max_episode_steps is None:
        return default
    return NEVER if max_episode_steps < 0 else max_episode_steps


def check_render_mode(render_mode: str | None, metadata: dict[str, Any]) -> None:
    """Refuse what cannot be drawn."""
    known = (*metadata["render_modes"], None)
    if render_mode == "human" and "human" not in known:
        raise gymnasium.error.Error(
            "render_mode is 'human', expected 'rgb_array' or None; a window shows one environment: "
            "gymnasium.make(..., render_mode='human')"
        )
    if render_mode not in known:
        expected = ", ".join(repr(mode) for mode in known)
        raise gymnasium.error.Error(f"render_mode is {render_mode!r}, expected one of: {expected}")
