"""Types of arrays, and random numbers for many agents at once."""

from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


def real_numbers(name: str, values: npt.ArrayLike, dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Return values as an array of a type of numbers; NumPy would drop the imaginary parts of complex ones."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name} have the type {array.dtype}, expected real numbers")
    return array.astype(dtype, copy=False)


_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


def _mix(x: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """Scramble 64-bit numbers one to one: the finalizer of SplitMix64 (Steele, Lea, Flood, 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


class Streams:
    """Random numbers of agents that begin episodes: a row for each, from a stream of its own.

    A stream is a function of an agent's seed, its number and the number of its episode, so that no agent's luck depends
    on another's, and nothing but these three belongs to a snapshot.
    """

    def __init__(self, *keys: npt.ArrayLike) -> None:
        """Streams for keys of three (or any number of) arrays of non-negative integers, `(n,)`."""
        state = np.zeros(np.shape(keys[0]), np.uint64)
        for key in keys:
            state = _mix(state + _GOLDEN + _mix(np.asarray(key, np.uint64) + _GOLDEN))
        self._state = state
        self._drawn = 0

    def __len__(self) -> int:
        """Return the number of agents."""
        return len(self._state)

    def uniform(self, low: npt.ArrayLike = 0.0, high: npt.ArrayLike = 1.0, size: int = 1) -> FloatArray:
        """`size` numbers per agent, uniform in [low, high): `(n, size)`."""
        counter = np.arange(self._drawn + 1, self._drawn + size + 1, dtype=np.uint64)
        self._drawn += size
        bits = _mix(self._state[:, None] + counter * _GOLDEN)
        # 53 bits, exact in float64
        unit: FloatArray = (bits >> np.uint64(11)).astype(np.float64) * 2.0**-53
        start = np.asarray(low, np.float64)
        return np.add(start, unit * np.subtract(high, start))

    def normal(self, mean: npt.ArrayLike = 0.0, deviation: npt.ArrayLike = 1.0, size: int = 1) -> FloatArray:
        """`size` numbers per agent, normally distributed: `(n, size)`."""
        radius = np.sqrt(-2.0 * np.log1p(-self.uniform(size=size)))
        drawn: FloatArray = radius * np.cos(2 * np.pi * self.uniform(size=size))
        return np.add(mean, np.multiply(deviation, drawn))
