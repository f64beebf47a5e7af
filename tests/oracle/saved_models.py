"""Models as MuJoCo saves them: the text that it writes, and what it compiles to.

Reads a JSON list of paths from standard input and prints, for each, {"saved": text, "model": as compiled_model.py prints it},
or null where MuJoCo does not load the file. The files of a saved model are beside the original.
"""

import json
import sys
import warnings
from pathlib import Path

import mujoco

import compiled_model


def run(path):
    try:
        spec = mujoco.MjSpec.from_file(path)
        spec.compile()
        saved = spec.to_xml()
        again = mujoco.MjSpec.from_string(saved)
        again.modelfiledir = str(Path(path).parent)
        model = again.compile()
    except ValueError:
        return None
    try:
        return {"saved": saved, "model": compiled_model.dump(model)}
    except (KeyError, IndexError):
        # it uses a feature that Marathon refuses
        return {"saved": saved, "model": None}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    json.dump([run(path) for path in json.load(sys.stdin)], sys.stdout, default=compiled_model.plain)
