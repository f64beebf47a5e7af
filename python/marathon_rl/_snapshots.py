"""Snapshots that hold more than a native environment's: arrays in NumPy's `.npz`, without pickles, with checksums."""

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def pack(bytes_: bytes, arrays: Mapping[str, Array]) -> bytes:
    """Bytes and arrays as one."""
    file = io.BytesIO()
    named: dict[str, Any] = {"simulation": np.frombuffer(bytes_, np.uint8), **arrays}
    np.savez(file, **named)
    return file.getvalue()


def unpack(snapshot: bytes, what: str, present: Mapping[str, Array]) -> tuple[bytes, dict[str, Array]]:
    """Take apart what `pack` made, of arrays like the present ones; `what` the snapshot is of is for errors."""
    try:
        with np.load(io.BytesIO(snapshot), allow_pickle=False) as file:
            if not isinstance(file, np.lib.npyio.NpzFile):
                raise ValueError("it is a single array")
            saved = {name: file[name] for name in ("simulation", *present)}
    except (EOFError, KeyError, NotImplementedError, OSError, ValueError, zipfile.BadZipFile) as error:
        raise ValueError(f"snapshot: it is damaged, or not one of {what}: {error}") from None
    for name, array in present.items():
        found = saved[name]
        if found.shape != array.shape or found.dtype != array.dtype:
            expected = f"{array.dtype} {array.shape}"
            raise ValueError(f"snapshot: {name} is {found.dtype} {found.shape}, expected {expected}")
    return saved.pop("simulation").tobytes(), saved
