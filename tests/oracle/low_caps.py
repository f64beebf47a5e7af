"""Results of MuJoCo's solver for models whose cap ends it early, under the models' own settings.

Reads a JSON list of jobs from standard input:
    {"xml": text, "seed": s, "trajectories": n, "steps": k, "home": h}
        states along n trajectories from random states, or one from the first keyframe (or the reference) if `home`
    {"xml": text, "stand": steps}
        the end of a trajectory from there
and prints a JSON list. Of the first kind, {"states": [..]}: each state with the acceleration that the solver starts from
(`warm`), MuJoCo's acceleration, constraint forces, and next state, the iterations it took, and `settled`: the answer does
not depend on rounding. Of the second kind, {"qpos": [..]}, and {"nudged": [[..]]}: the same with masses changed by 1e-6.
"""

import json
import sys

import mujoco
import numpy as np

import dynamics

# size of the random change of the warm start and the velocities, and the largest amplification of it that counts as stable
NUDGE, AMPLIFICATION = 1e-9, 1e3


def put(model, data, state):
    mujoco.mj_resetData(model, data)
    data.qpos[:], data.qvel[:], data.act[:], data.ctrl[:], data.qacc_warmstart[:] = state


def go_home(model, data):
    mujoco.mj_resetData(model, data)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)


def settled(model, data, state, rng):
    """Whether the answer changes no more than in proportion."""
    put(model, data, state)
    mujoco.mj_forward(model, data)
    acc = data.qacc.copy()
    for _ in range(3):
        nudged = [x.copy() for x in state]
        nudged[1] += NUDGE * rng.normal(size=model.nv)
        nudged[4] += NUDGE * rng.normal(size=model.nv)
        put(model, data, nudged)
        mujoco.mj_forward(model, data)
        if np.linalg.norm(data.qacc - acc) > AMPLIFICATION * NUDGE * max(np.linalg.norm(acc), 1):
            return False
    return True


def states(job):
    model = mujoco.MjModel.from_xml_string(job["xml"])
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    rng = np.random.default_rng(job["seed"])
    out = []
    for _ in range(job["trajectories"]):
        go_home(model, data)
        if not job.get("home"):
            q, v, u = dynamics.random_state(model, rng, True, spread=0.05)
            data.qpos[:], data.qvel[:], data.ctrl[:] = q, 0.3 * v, u
        for _ in range(job["steps"]):
            before = [x.copy() for x in (data.qpos, data.qvel, data.act, data.ctrl, data.qacc_warmstart)]
            mujoco.mj_step(model, data)
            if any(w.number for w in data.warning) or np.abs(data.qacc).max() > 1e6:
                break
            put(model, other, before)
            mujoco.mj_forward(model, other)
            out.append({
                "qpos": before[0], "qvel": before[1], "act": before[2], "ctrl": before[3], "warm": before[4],
                "qacc": other.qacc.copy(), "qfrc_constraint": other.qfrc_constraint.copy(),
                "next_qpos": data.qpos.copy(), "next_qvel": data.qvel.copy(),
                "iterations": int(other.solver_niter.max()),
                "settled": settled(model, other, before, rng),
            })
    return {"states": out}


def end(model, steps):
    data = mujoco.MjData(model)
    go_home(model, data)
    for _ in range(steps):
        mujoco.mj_step(model, data)
    return data.qpos.copy()


def stand(job):
    model = mujoco.MjModel.from_xml_string(job["xml"])
    out = {"qpos": end(model, job["stand"]), "nudged": []}
    rng = np.random.default_rng(0)
    for _ in range(4):
        other = mujoco.MjModel.from_xml_string(job["xml"])
        other.body_mass *= 1 + 1e-6 * rng.normal(size=model.nbody)
        out["nudged"].append(end(other, job["stand"]))
    return out


if __name__ == "__main__":
    answers = [stand(job) if "stand" in job else states(job) for job in json.load(sys.stdin)]
    json.dump(answers, sys.stdout, default=lambda x: x.tolist())
