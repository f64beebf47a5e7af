"""World poses of geoms in MuJoCo at random configurations.

Reads {"files": [path, ...], "dm_control": [path inside the package, ...], "count": n, "seed": s} from stdin and prints
{"models": [{"path": ..., "samples": [{"qpos", "geom_xpos", "geom_xmat", "com", "root"}, ...]}, ...]}. `com` is the
center of mass of the first joint's kinematic tree, `root` the position of the first joint's body. Quaternions are left
unnormalized, which MuJoCo allows.
"""

import importlib.util
import json
import os
import sys

import mujoco
import numpy as np


def samples(model, count, rng):
    data = mujoco.MjData(model)
    body = model.jnt_bodyid[0]
    for _ in range(count):
        data.qpos[:] = model.qpos0 + rng.uniform(-1.5, 1.5, model.nq)
        # MuJoCo normalizes quaternions in qpos itself, so the unnormalized one is kept here
        qpos = data.qpos.copy()
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        yield {
            "qpos": qpos.tolist(),
            "geom_xpos": data.geom_xpos.ravel().tolist(),
            "geom_xmat": data.geom_xmat.ravel().tolist(),
            "com": data.subtree_com[model.body_rootid[body]].tolist(),
            "root": data.xpos[body].tolist(),
        }


def main():
    request = json.load(sys.stdin)
    rng = np.random.default_rng(request["seed"])
    package = os.path.dirname(importlib.util.find_spec("dm_control").origin)
    paths = request["files"] + [os.path.join(package, path) for path in request["dm_control"]]
    models = []
    for path in paths:
        model = mujoco.MjModel.from_xml_path(path)
        models.append({"path": path, "samples": list(samples(model, request["count"], rng))})
    json.dump({"models": models}, sys.stdout)


main()
