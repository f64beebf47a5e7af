"""Motions of MJCF models from their reference configurations.

Reads a JSON list of {"text": MJCF, "steps": n, "qvel": [..] or null} from standard input and prints, for each, qpos and qvel
after every ten steps: {"qpos": [[..], ..], "qvel": [[..], ..]}. The model's settings are its own.
"""

import json
import sys

import mujoco


def run(job):
    model = mujoco.MjModel.from_xml_string(job["text"])
    data = mujoco.MjData(model)
    if job.get("qvel"):
        data.qvel[:] = job["qvel"]
    out = {"qpos": [], "qvel": []}
    for step in range(job["steps"]):
        mujoco.mj_step(model, data)
        if step % 10 == 9:
            out["qpos"].append(data.qpos.tolist())
            out["qvel"].append(data.qvel.tolist())
    return out


if __name__ == "__main__":
    json.dump([run(job) for job in json.load(sys.stdin)], sys.stdout)
