"""Given states of a model in which much touches much, and what MuJoCo makes of them.

Reads {"xml": text, "states": [{"qpos": [...], "qvel": [...], "ctrl": [...], "warm": [...]}]} from standard input and prints
a JSON list with MuJoCo's acceleration and number of contacts in each. `warm` is the acceleration that the solver starts
from; it solves to the end.
"""

import json
import sys

import mujoco
import numpy as np

from converging import solve_to_the_end


def main():
    job = json.load(sys.stdin)
    model = mujoco.MjModel.from_xml_string(job["xml"])
    solve_to_the_end(model.opt)
    data = mujoco.MjData(model)
    answers = []
    for state in job["states"]:
        mujoco.mj_resetData(model, data)
        for name in ("qpos", "qvel", "ctrl"):
            getattr(data, name)[:] = state[name]
        data.qacc_warmstart[:] = state["warm"]
        mujoco.mj_forward(model, data)
        # contacts in the gap exert no force
        contacts = int(np.count_nonzero(data.contact.exclude == 0))
        answers.append({"qacc": data.qacc.tolist(), "contacts": contacts})
    json.dump(answers, sys.stdout)


if __name__ == "__main__":
    main()
