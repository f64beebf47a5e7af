"""Inverse dynamics of motion clips in MuJoCo.

Reads {"model": path, "states": [[qpos, qvel, qacc], ...]} from stdin and prints {"qfrc_inverse": [[...], ...], "momentum":
[[...], ...]}: the forces of mj_inverse without constraints, and center of mass, its velocity and the angular momentum about it.
"""

import json
import sys

import mujoco
import numpy as np


def main():
    request = json.load(sys.stdin)
    model = mujoco.MjModel.from_xml_path(request["model"])
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    root = model.jnt_bodyid[0]
    forces, momentum = [], []
    for qpos, qvel, qacc in request["states"]:
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos, qvel, qacc
        mujoco.mj_inverse(model, data)
        forces.append(data.qfrc_inverse.tolist())
        mujoco.mj_subtreeVel(model, data)
        parts = [data.subtree_com[root], data.subtree_linvel[root], data.subtree_angmom[root]]
        momentum.append(np.concatenate(parts).tolist())
    json.dump({"qfrc_inverse": forces, "momentum": momentum}, sys.stdout)


main()
