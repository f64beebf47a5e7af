"""Kinematics of motion clips in MuJoCo.

Reads {"model": path, "dt": seconds, "frames": [qpos, ...]} from stdin and prints {"xpos": [[...], ...], "xquat": ..., "qvel": ...}:
positions and orientations of all bodies in each frame (mj_kinematics), and for each frame but the first and the last the
velocity that leads from the frame before it to the frame after it in two steps (mj_differentiatePos).
"""

import json
import sys

import mujoco
import numpy as np


def main():
    request = json.load(sys.stdin)
    model = mujoco.MjModel.from_xml_path(request["model"])
    data = mujoco.MjData(model)
    frames = np.array(request["frames"])
    xpos, xquat, qvel = [], [], []
    for qpos in frames:
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        xpos.append(data.xpos.ravel().tolist())
        xquat.append(data.xquat.ravel().tolist())
    for before, after in zip(frames[:-2], frames[2:]):
        velocity = np.zeros(model.nv)
        mujoco.mj_differentiatePos(model, velocity, 2 * request["dt"], before, after)
        qvel.append(velocity.tolist())
    json.dump({"xpos": xpos, "xquat": xquat, "qvel": qvel}, sys.stdout)


main()
