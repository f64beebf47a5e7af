"""Variables that an agent keeps from decision to decision, for `MarathonAgent.remember`.

Each helper owns some columns of the agent's memory, which is zero at the start of every episode.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from marathon_rl._arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class PhaseBonus:
    """Bonus for the size of a step, paid at footfall and fading after it: what made the original's humanoid walk.

    The hips' flexion is followed from one footfall of a side to the next; when a foot lands (or the other leaves the
    ground), the bonus is the range of that side's hip plus 0.1. It is 0 while both feet are down or both are in the air
    after a change, and fades by 0.9 per physics step.
    """

    frame_skip: int
    """Physics steps per decision."""
    alternate: bool = False
    """The same side twice in a row earns nothing."""

    SIZE: ClassVar[int] = 8
    """Columns it needs; the first is the bonus."""
    FADE: ClassVar[float] = 0.9
    BASE: ClassVar[float] = 0.1

    def update(
        self,
        memory: FloatArray,
        left_down: BoolArray,
        right_down: BoolArray,
        left_flexion: FloatArray,
        right_flexion: FloatArray,
    ) -> FloatArray:
        """Advance by one decision and return the bonus, `(N,)`.

        `memory` is `(N, 8)`; the other arrays are `(N,)`: whether a foot of a side is down, and the flexion of its hip
        in quarter turns (`MarathonAgent.flexion`).
        """
        bonus, left_was, right_was, left_min, left_max, right_min, right_max, last = memory.T
        changed = (left_down != (left_was > 0.5)) | (right_down != (right_was > 0.5))
        left_was[:], right_was[:] = left_down, right_down
        np.minimum(left_min, left_flexion, out=left_min)
        np.maximum(left_max, left_flexion, out=left_max)
        np.minimum(right_min, right_flexion, out=right_min)
        np.maximum(right_max, right_flexion, out=right_max)

        both = left_down & right_down
        left_step = changed & ~both & left_down
        right_step = changed & ~both & right_down & ~left_down
        # the side that stepped last: 0 none, 1 left, 2 right
        again = (left_step & (last == 1)) | (right_step & (last == 2))
        earned = np.where(left_step, left_max - left_min + self.BASE, 0.0)
        earned = np.where(right_step, right_max - right_min + self.BASE, earned)
        if self.alternate:
            earned = np.where(again, 0.0, earned)
        faded = bonus * self.FADE**self.frame_skip
        bonus[:] = np.where(both, 0.0, np.where(changed, earned, faded))
        last[:] = np.where(left_step, 1.0, np.where(right_step, 2.0, last))

        # a footfall starts the next range from the present flexion
        for side, low, high, flexion in (
            (left_step, left_min, left_max, left_flexion),
            (right_step, right_min, right_max, right_flexion),
        ):
            begun = both | side
            np.copyto(low, flexion, where=begun)
            np.copyto(high, flexion, where=begun)
        paid: FloatArray = bonus.copy()
        return paid


class Average:
    """Mean of the last nine values, fewer at the start of an episode."""

    WINDOW: ClassVar[int] = 9
    """Values that are averaged over."""
    SIZE: ClassVar[int] = WINDOW + 1
    """Columns it needs: the number of values, then the values, newest first."""

    @classmethod
    def update(cls, memory: FloatArray, value: FloatArray) -> FloatArray:
        """Take in one value per agent, `(N,)`, and return the means. `memory` is `(N, 10)`."""
        memory[:, 0] = np.minimum(memory[:, 0] + 1, cls.WINDOW)
        memory[:, 2:] = memory[:, 1:-1].copy()
        memory[:, 1] = value
        mean: FloatArray = memory[:, 1:].sum(1) / memory[:, 0]
        return mean
