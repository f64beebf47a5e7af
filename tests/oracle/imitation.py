"""Plays Marathon Man in MuJoCo beside a motion clip and computes observations, rewards and terminations in plain Python.

Written from docs/environments/marathon-man.md, not from the Rust code. Reads one JSON object from stdin:

    {"cases": [{"xml": "...", "frame_skip": 5, "control": "pd", "reach": 0.5, "reward": "deepmimic", "distance": 0.5,
                "episodes": [{"qpos": [...], "qvel": [...], "actions": [[...], ...],
                              "clip": [{"qpos": [...], "qvel": [...], "phase": 0.1, "facing": 0.0}, ...]}, ...]}, ...]}

with one entry of the clip per decision from the start on, and two more than decisions. Prints, in the same nesting, one
object {"obs", "terms", "info", "terminated"} per decision until termination.
"""

import json
import sys

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

PARTS = [
    "butt", "lower_waist", "torso", "upper_waist", "head", "right_thigh", "right_shin", "right_right_foot", "left_thigh",
    "left_shin", "left_left_foot", "right_upper_arm", "right_larm", "right_hand", "left_upper_arm", "left_larm", "left_hand",
]  # fmt: skip
FEET_AND_HANDS = ["right_right_foot", "left_left_foot", "right_hand", "left_hand"]
TRUNK = ["torso", "head", "butt", "lower_waist", "upper_waist"]
WEIGHTS = {"abdomen": 0.5, "hip": 0.5, "knee": 0.3, "ankle": 0.2, "shoulder": 0.3, "elbow": 0.2}


class Figure:
    """A pose with its velocities."""

    def __init__(self, model, qpos, qvel):
        self.m, self.d = model, mujoco.MjData(model)
        self.d.qpos[:], self.d.qvel[:] = qpos, qvel
        mujoco.mj_fwdPosition(model, self.d)
        mujoco.mj_fwdVelocity(model, self.d)
        mujoco.mj_subtreeVel(model, self.d)
        self.q, self.v = self.d.qpos[7:], self.d.qvel[6:]
        self.com, self.com_velocity = self.d.subtree_com[1], self.d.subtree_linvel[1]

    def at(self, part):
        return self.d.geom_xpos[self.m.geom(part).id]

    def axes(self, part):
        return self.d.xmat[self.m.geom_bodyid[self.m.geom(part).id]].reshape(3, 3)

    def velocity(self, part):
        """Angular, then linear."""
        out = np.zeros(6)
        mujoco.mj_objectVelocity(self.m, self.d, mujoco.mjtObj.mjOBJ_GEOM, self.m.geom(part).id, out, 0)
        return out[:3], out[3:]

    def soles(self):
        """Touch sites within a centimeter of the ground."""
        heights = [self.d.site_xpos[i][2] for i in range(self.m.nsite)]
        return np.array([z < self.m.site_size[i][0] + 0.01 for i, z in enumerate(heights)])


def angle(a, b):
    return Rotation.from_matrix(a @ b.T).magnitude()


def play(case, model, episode):
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = episode["qpos"], episode["qvel"]
    clip = [Figure(model, row["qpos"], row["qvel"]) for row in episode["clip"]]
    joint_of = [model.joint(model.actuator_trnid[i, 0]) for i in range(model.nu)]
    decisions = []
    for t, action in enumerate(episode["actions"]):
        action = np.clip(action, -1, 1)
        for i, joint in enumerate(joint_of):
            data.ctrl[i] = action[i]
            if case["control"] == "pd":
                target = clip[t + 1].d.qpos[joint.qposadr[0]] + 0.1 * clip[t + 1].d.qvel[joint.dofadr[0]]
                data.ctrl[i] = target + case["reach"] * action[i]
        fallen = False
        for _ in range(case["frame_skip"]):
            mujoco.mj_step(model, data)
            for c in data.contact:
                pair = {model.geom(c.geom1).name, model.geom(c.geom2).name}
                fallen |= "floor" in pair and bool(pair & set(TRUNK))
        felt = data.sensordata > 0
        me, row = Figure(model, data.qpos, data.qvel), episode["clip"][t + 1]
        now, after = clip[t + 1], clip[t + 2]
        level = Rotation.from_euler("z", -row["facing"])
        spin, speed = me.velocity("butt")
        turn = 2 * np.pi * row["phase"]
        obs = [np.sin(turn), np.cos(turn), np.sin(2 * turn), np.cos(2 * turn), me.at("butt")[2]]
        for v in [me.axes("butt")[:, 0], me.axes("butt")[:, 2], speed, spin]:
            obs += list(level.apply(v))
        obs += [*me.q, *me.v, *felt.astype(float), *level.apply(now.at("butt") - me.at("butt")), *(after.q - me.q)]
        for ahead in case["future"]:
            later = clip[t + 1 + ahead]
            axes = later.axes("butt")
            obs += [*level.apply(later.at("butt") - me.at("butt")), *level.apply(axes[:, 0]), *level.apply(axes[:, 2])]
            obs += [*(later.q - me.q)]

        gap = me.at("butt") - now.at("butt")
        apart = {p: me.at(p) - now.at(p) for p in PARTS}
        if case["reward"] == "deepmimic":
            weights = np.array([next(w for k, w in WEIGHTS.items() if k in model.joint(j + 1).name) for j in range(21)])
            total = 1 + 0.5 + 2 * (0.5 + 0.3 + 0.2 + 0.3 + 0.2)
            clip_spin, clip_speed = now.velocity("butt")
            turned, slip, spun = angle(me.axes("butt"), now.axes("butt")), speed - clip_speed, spin - clip_spin
            ends = [apart[p] - np.array([gap[0], gap[1], 0]) for p in FEET_AND_HANDS]
            drift = me.com_velocity - now.com_velocity
            errors = [
                (turned**2 + weights @ (me.q - now.q) ** 2) / total,
                (spun @ spun + weights @ (me.v - now.v) ** 2) / total,
                np.mean([e @ e for e in ends]),
                gap @ gap + 0.1 * turned**2 + 0.01 * slip @ slip + 0.001 * spun @ spun,
                0.1 * drift @ drift,
            ]
            scales = [(0.5, 2), (0.05, 0.1), (0.15, 10), (0.2, 5), (0.1, 10)]
            terms = [w * np.exp(-k * e) for (w, k), e in zip(scales, errors)]
            far = np.mean([np.linalg.norm(x) for x in apart.values()]) > case["distance"]
        else:
            ends = [apart[p] - gap for p in [*FEET_AND_HANDS, "torso"]]
            velocity, position = me.com_velocity - now.com_velocity, me.com - now.com
            distances = [
                sum((angle(me.axes(p), now.axes(p)) / np.pi) ** 2 for p in PARTS),
                velocity @ velocity,
                sum(e @ e for e in ends),
                position @ position,
            ]
            shares = [(0.585, 17), (0.09, 3), (0.135, 8), (0.09, 5)]
            terms = [w * (max(n - d, 0) / n) ** n for (w, n), d in zip(shares, distances)]
            terms.append(0.09 * np.mean(felt == now.soles()))
            far = sum(terms) < 0.334
            terms.append(0.09 * (1 - np.mean(np.abs(action) >= 1)))
        relative = [np.linalg.norm(x - gap) for x in apart.values()]
        info = [np.mean(np.abs(me.q - now.q)), np.mean(relative), row["phase"]]
        numbers = [[float(x) for x in xs] for xs in (obs, terms, info)]
        decisions.append(dict(zip(("obs", "terms", "info"), numbers), far=bool(far), fallen=bool(fallen)))
        if far or fallen:
            break
    return decisions


def main():
    out = []
    for case in json.load(sys.stdin)["cases"]:
        model = mujoco.MjModel.from_xml_string(case["xml"])
        out.append([play(case, model, episode) for episode in case["episodes"]])
    json.dump(out, sys.stdout)


main()
