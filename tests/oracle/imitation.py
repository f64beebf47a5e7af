"""Plays Marathon Man, or another figure, in MuJoCo beside a motion clip and computes observations, rewards and terminations in plain Python.

Written from docs/reference/environments/marathon-man.md and in-style.md, not from the Rust code. Reads one JSON object from stdin:

    {"cases": [{"figure": "marathon_man", "xml": "...", "frame_skip": 5, "control": "pd", "action_scale": 0.5, "max_target": 1.0, "reward": "deepmimic", "distance": 0.5,
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

WEIGHTS = {"abdomen": 0.5, "hip": 0.5, "knee": 0.3, "ankle": 0.2, "shoulder": 0.3, "elbow": 0.2}
# DeepMimic's weights of hip, knee, ankle, shoulder and elbow
LEG, ARM = 0.5 + 0.3 + 0.2, 0.3 + 0.2
UPPER = ["torso", "head", "butt", "lower_waist", "upper_waist"]
FIGURES = {
    "marathon_man": {
        "root": "butt",
        "parts": [
            *UPPER, "right_thigh", "right_shin", "right_right_foot", "left_thigh", "left_shin", "left_left_foot",
            "right_upper_arm", "right_larm", "right_hand", "left_upper_arm", "left_larm", "left_hand",
        ],
        "ends": ["right_right_foot", "left_left_foot", "right_hand", "left_hand"],
        "trunk": UPPER,
        "touch": None,
        "qpos": 7,
        "qvel": 6,
        "total": 1 + 0.5 + 2 * (LEG + ARM),
    },
    "humanoid": {
        "root": "butt",
        "parts": [
            *UPPER, "right_thigh", "right_shin", "right_right_foot", "left_thigh", "left_shin", "left_left_foot",
            "right_larm", "right_hand", "left_larm", "left_hand",
        ],
        "ends": ["right_right_foot", "left_left_foot", "right_hand", "left_hand"],
        "trunk": UPPER,
        "touch": ["left_left_foot", "right_left_foot", "right_right_foot", "left_right_foot"],
        "qpos": 7,
        "qvel": 6,
        "total": 1 + 0.5 + 2 * (LEG + ARM),
    },
    "walker2d": {
        "root": "torso",
        "parts": ["torso", "right_thigh", "right_leg", "right_foot", "left_thigh", "left_leg", "left_foot"],
        "ends": ["right_foot", "left_foot"],
        "trunk": ["torso"],
        "touch": ["left_foot", "right_foot"],
        "qpos": 3,
        "qvel": 3,
        "total": 1 + 2 * LEG,
    },
}  # fmt: skip


class Figure:
    """A pose with its velocities."""

    def __init__(self, model, figure, qpos, qvel):
        self.m, self.d = model, mujoco.MjData(model)
        self.d.qpos[:], self.d.qvel[:] = qpos, qvel
        mujoco.mj_fwdPosition(model, self.d)
        mujoco.mj_fwdVelocity(model, self.d)
        mujoco.mj_subtreeVel(model, self.d)
        self.q, self.v = self.d.qpos[figure["qpos"] :], self.d.qvel[figure["qvel"] :]
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
    figure = FIGURES[case["figure"]]
    root, parts, hinges = figure["root"], figure["parts"], range(model.njnt)[-model.nu :]
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = episode["qpos"], episode["qvel"]
    spawn = Figure(model, figure, model.key_qpos[0] if model.nkey else model.qpos0, np.zeros(model.nv))
    clip = [Figure(model, figure, row["qpos"], row["qvel"]) for row in episode["clip"]]
    joint_of = [model.joint(model.actuator_trnid[i, 0]) for i in range(model.nu)]
    decisions = []
    for t, action in enumerate(episode["actions"]):
        action = np.clip(action, -1, 1)
        for i, joint in enumerate(joint_of):
            data.ctrl[i] = action[i]
            if case["control"] == "pd":
                target = clip[t + 1].d.qpos[joint.qposadr[0]] + 0.1 * clip[t + 1].d.qvel[joint.dofadr[0]]
                target += case["action_scale"] * action[i]
                data.ctrl[i] = np.clip(target, -case["max_target"], case["max_target"])
        fallen = False
        for _ in range(case["frame_skip"]):
            mujoco.mj_step(model, data)
            for c in data.contact:
                pair = {model.geom(c.geom1).name, model.geom(c.geom2).name}
                fallen |= "floor" in pair and bool(pair & set(figure["trunk"]))
        # the paper's figures have sensors that see contacts, Marathon Man's feel forces
        down = {model.geom(max(c.geom1, c.geom2)).name for c in data.contact}
        felt = np.array([name in down for name in figure["touch"]]) if figure["touch"] else data.sensordata > 0
        me, row = Figure(model, figure, data.qpos, data.qvel), episode["clip"][t + 1]
        now, after = clip[t + 1], clip[t + 2]
        level = Rotation.from_euler("z", -row["facing"])
        spin, speed = me.velocity(root)
        turn = 2 * np.pi * row["phase"]
        obs = [np.sin(turn), np.cos(turn), np.sin(2 * turn), np.cos(2 * turn), me.at(root)[2]]
        # what points forward and up where the figure spawns
        forward, _, up = (me.axes(root) @ spawn.axes(root).T).T
        for v in [forward, up, speed, spin]:
            obs += list(level.apply(v))
        obs += [*me.q, *me.v, *felt.astype(float), *level.apply(now.at(root) - me.at(root)), *(after.q - me.q)]
        for ahead in case["future"]:
            later = clip[t + 1 + ahead]
            axes = later.axes(root)
            obs += [*level.apply(later.at(root) - me.at(root)), *level.apply(axes[:, 0]), *level.apply(axes[:, 2])]
            obs += [*(later.q - me.q)]

        gap = me.at(root) - now.at(root)
        apart = {p: me.at(p) - now.at(p) for p in parts}
        if case["reward"] == "deepmimic":
            names, total = [model.joint(j).name for j in hinges], figure["total"]
            weights = np.array([next(w for k, w in WEIGHTS.items() if k in name) for name in names])
            clip_spin, clip_speed = now.velocity(root)
            turned, slip, spun = angle(me.axes(root), now.axes(root)), speed - clip_speed, spin - clip_spin
            ends = [apart[p] - np.array([gap[0], gap[1], 0]) for p in figure["ends"]]
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
            ends = [apart[p] - gap for p in [*figure["ends"], "torso"]]
            velocity, position = me.com_velocity - now.com_velocity, me.com - now.com
            distances = [
                sum((angle(me.axes(p), now.axes(p)) / np.pi) ** 2 for p in parts),
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
