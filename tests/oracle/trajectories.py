"""Motions of MJCF models from their reference configurations.

Reads a JSON list of {"text": MJCF, "steps": n, "qvel": [..] or null, "ctrl": [..] or null} from standard input and prints, for
each, qpos, qvel and act, and the sensors, accelerations and actuator forces of these states, after every ten steps:
{"qpos": [[..], ..], "qvel": [[..], ..], "act": [[..], ..], "sensordata": [[..], ..], "qacc": [[..], ..], "qfrc_actuator": [[..], ..]}.
The model's settings are its own.
"""

import json
import sys

import mujoco


def run(job):
    model = mujoco.MjModel.from_xml_string(job["text"])
    data = mujoco.MjData(model)
    if job.get("qvel"):
        data.qvel[:] = job["qvel"]
    if job.get("ctrl"):
        data.ctrl[:] = job["ctrl"]
    there = mujoco.MjData(model)
    out = {"qpos": [], "qvel": [], "act": [], "sensordata": [], "qacc": [], "qfrc_actuator": []}
    for step in range(job["steps"]):
        mujoco.mj_step(model, data)
        if step % 10 == 9:
            out["qpos"].append(data.qpos.tolist())
            out["qvel"].append(data.qvel.tolist())
            out["act"].append(data.act.tolist())
            # the step itself keeps the forces of its start
            there.qpos[:], there.qvel[:], there.ctrl[:], there.act[:] = data.qpos, data.qvel, data.ctrl, data.act
            there.qacc_warmstart[:] = data.qacc_warmstart
            mujoco.mj_forward(model, there)
            out["sensordata"].append(there.sensordata.tolist())
            out["qacc"].append(there.qacc.tolist())
            out["qfrc_actuator"].append(there.qfrc_actuator.tolist())
    return out


if __name__ == "__main__":
    json.dump([run(job) for job in json.load(sys.stdin)], sys.stdout)
