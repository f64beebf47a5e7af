"""MJCF's schema as MuJoCo prints it (`mj_printSchema`), as a JSON text."""

import ctypes
import json
import sys
from pathlib import Path

import mujoco

SIZE = 1 << 20

if __name__ == "__main__":
    library = next(Path(mujoco.__file__).parent.glob("*mujoco*.so*"), None) or next(Path(mujoco.__file__).parent.glob("*.dylib"))
    text = ctypes.create_string_buffer(SIZE)
    ctypes.CDLL(str(library)).mj_printSchema(None, text, SIZE, 0, 0)
    json.dump(text.value.decode(), sys.stdout)
