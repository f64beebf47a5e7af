"""Rewards between 0 and 1: full within bounds, falling off outside of them.

dm_control's `tolerance`, and `Tolerance` of the Rust crate.

>>> import numpy as np
>>> # 1 from 2 m/s on, 0.5 at 1 m/s, falling on to 0 at 0 m/s
>>> speed = Tolerance.at_least(2.0, margin=1.0, sigmoid="linear", value_at_margin=0.5)
>>> speed(np.array([3.0, 1.0, -1.0])).tolist()
[1.0, 0.5, 0.0]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Sigmoid = Literal["gaussian", "hyperbolic", "long_tail", "reciprocal", "cosine", "linear", "quadratic", "tanh_squared"]


@dataclass(frozen=True)
class Tolerance:
    """Full within `bounds`, falling off outside of them."""

    bounds: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest number that is worth 1; they may be infinite."""
    margin: float = 0.0
    """Distance from the bounds at which the value has fallen to `value_at_margin`. If it is 0, everything outside is
    worth 0."""
    sigmoid: Sigmoid = "gaussian"
    """How it falls off."""
    value_at_margin: float = 0.1
    """Between 0 and 1; not 0 itself, unless the sigmoid is linear, quadratic or a cosine."""

    def __post_init__(self) -> None:
        low, high = self.bounds
        if not low <= high:
            raise ValueError(f"bounds are {self.bounds}, expected the lower one first")
        if not 0.0 <= self.margin < math.inf:
            raise ValueError(f"margin is {self.margin}, expected a finite number not below 0")
        if self.sigmoid not in _FALLS:
            raise ValueError(f"sigmoid is {self.sigmoid!r}, expected one of {', '.join(_FALLS)}")
        zero = self.sigmoid in ("cosine", "linear", "quadratic")
        if not (0.0 < self.value_at_margin < 1.0 or (zero and self.value_at_margin == 0.0)):
            least = "from 0 to below 1" if zero else "between 0 and 1"
            raise ValueError(f"value_at_margin is {self.value_at_margin}, expected a number {least}")

    @classmethod
    def at_least(cls, low: float, margin: float, **others: Any) -> Tolerance:
        """Worth 1 from `low` on."""
        return cls(bounds=(low, math.inf), margin=margin, **others)

    @classmethod
    def around_zero(cls, margin: float, **others: Any) -> Tolerance:
        """Worth 1 at 0 alone."""
        return cls(margin=margin, **others)

    def __call__(self, x: ArrayLike) -> NDArray[np.float64]:
        """Worth of numbers, in [0, 1], an array of their shape."""
        x = np.asarray(x, np.float64)
        low, high = self.bounds
        outside = np.maximum(np.maximum(low - x, x - high), 0.0)
        if self.margin == 0.0:
            return np.where(outside > 0.0, 0.0, 1.0)
        return np.asarray(_FALLS[self.sigmoid](outside / self.margin, self.value_at_margin))


def _cosine(d: NDArray[np.float64], v: float) -> NDArray[np.float64]:
    turned = np.minimum(d * (math.acos(2.0 * v - 1.0) / math.pi), 1.0)
    return np.maximum(0.5 + 0.5 * np.cos(math.pi * turned), 0.0)


def _hyperbolic(d: NDArray[np.float64], v: float) -> NDArray[np.float64]:
    # without the overflow of cosh far away
    e = np.exp(-d * math.acosh(1.0 / v))
    return 2.0 * e / (1.0 + e * e)


# value at distance d from the bounds in units of the margin, where it is v at d = 1
_FALLS: dict[str, Any] = {
    "gaussian": lambda d, v: np.exp(d * d * math.log(v)),
    "hyperbolic": _hyperbolic,
    "long_tail": lambda d, v: 1.0 / (d * d * (1.0 / v - 1.0) + 1.0),
    "reciprocal": lambda d, v: 1.0 / (d * (1.0 / v - 1.0) + 1.0),
    "cosine": _cosine,
    "linear": lambda d, v: np.maximum(1.0 - d * (1.0 - v), 0.0),
    "quadratic": lambda d, v: np.maximum(1.0 - d * d * (1.0 - v), 0.0),
    "tanh_squared": lambda d, v: 1.0 - np.tanh(d * math.atanh(math.sqrt(1.0 - v))) ** 2,
}
