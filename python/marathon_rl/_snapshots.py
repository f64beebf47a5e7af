"""Snapshots that hold more than a native environment's: arrays in NumPy's `.npz`, without pickles, with checksums."""

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def pack(task: str, bytes_: bytes, arrays: Mapping[str, Array]) -> bytes:
    """Bytes and arrays of a task as one."""
    file = io.BytesIO()
    named: dict[str, Any] = {"task": np.array(task), "simulation": np.frombuffer(bytes_, np.uint8), **arrays}
    np.savez(file, **named)
    return file.getvalue()


def unpack(snapshot: bytes, task: str, present: Mapping[str, Array]) -> tuple[bytes, dict[str, Array]]:
    """Take apart what `pack` made, of the same task and of arrays like the present ones, which have a row per agent."""
    if not isinstance(snapshot, bytes | bytearray | memoryview):
        raise TypeError(f"snapshot is of type {type(snapshot).__name__}, expected the bytes that save returned")
    damaged = f"snapshot: found {len(snapshot)} bytes that are damaged or no snapshot, expected what save returned"
    try:
        with np.load(io.BytesIO(snapshot), allow_pickle=False) as file:
            if not isinstance(file, np.lib.npyio.NpzFile):
                raise ValueError(damaged)
            saved = {name: file[name] for name in file.files}
    except (EOFError, KeyError, NotImplementedError, OSError, ValueError, zipfile.BadZipFile):
        raise ValueError(damaged) from None
    first = next(iter(present))
    if not {"task", "simulation", first} <= saved.keys() or not saved[first].ndim:
        raise ValueError(damaged)
    found, expected = (str(saved["task"]), len(saved[first])), (task, len(present[first]))
    if found != expected:
        (of, n), (own, num_envs) = found, expected
        raise ValueError(f"snapshot: found {_agents(n)} of '{of}', expected {_agents(num_envs)} of '{own}'")
    for name, array in present.items():
        if name not in saved:
            raise ValueError(f"snapshot: found no array '{name}', expected a snapshot of the same kind of environment")
        other = saved[name]
        if other.shape != array.shape or other.dtype != array.dtype:
            expects = f"{array.dtype} {array.shape}"
            raise ValueError(f"snapshot: {name} is {other.dtype} {other.shape}, expected {expects}")
    return saved["simulation"].tobytes(), {name: saved[name] for name in present}


def _agents(n: int) -> str:
    return f"{n} agent" if n == 1 else f"{n} agents"
