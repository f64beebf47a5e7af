"""Plays Marathon agents in MuJoCo and computes their observations, rewards and terminations in plain Python.

Written from the environments' pages in docs/reference/environments, not from the Rust code. Reads one JSON object from stdin:

    {"agents": [{"id": "Hopper-v0", "xml": "...", "frame_skip": 4,
                 "episodes": [{"qpos": [...], "qvel": [...], "actions": [[...], ...]}, ...]}, ...]}

and prints, in the same nesting, one object {"obs", "reward", "terms", "terminated"} per decision until termination.
"""

import json
import sys

import mujoco
import numpy as np

HOPPER = dict(pelvis="torso", feet={"foot", "calf"}, touch=["foot"])
WALKER = dict(
    pelvis="torso",
    feet={"right_leg", "left_leg", "right_foot", "left_foot"},
    touch=["left_foot", "right_foot"],
)
SOLES = ["left_left_foot", "right_left_foot", "right_right_foot", "left_right_foot"]
HUMANOID = dict(pelvis="butt", feet=set(SOLES) | {"left_shin", "right_shin"}, touch=SOLES)
ANKLES = ["left_ankle_geom", "right_ankle_geom", "third_ankle_geom", "fourth_ankle_geom"]
ANT = dict(pelvis="torso_geom", feet=None, touch=ANKLES)
BODIES = {"Hopper": HOPPER, "Walker2d": WALKER, "Humanoid": HUMANOID, "Ant": ANT}


class Player:
    def __init__(self, agent):
        self.id = agent["id"]
        self.name, self.version = self.id.split("-")
        self.skip = agent["frame_skip"]
        self.m = mujoco.MjModel.from_xml_string(agent["xml"])
        self.d = mujoco.MjData(self.m)
        self.now = mujoco.MjData(self.m)  # readings of the present state
        self.facts = BODIES[self.name]
        mujoco.mj_resetDataKeyframe(self.m, self.now, 0)
        mujoco.mj_forward(self.m, self.now)
        self.spawn = [self.now.xmat[b].reshape(3, 3).copy() for b in range(self.m.nbody)]
        self.pairs = []
        for j in self.m.actuator_trnid[:, 0]:
            body = self.m.jnt_bodyid[j]
            if body not in self.pairs:
                self.pairs.append(body)

    def geom(self, name):
        return mujoco.mj_name2id(self.m, mujoco.mjtObj.mjOBJ_GEOM, name)

    def axis(self, name, world):
        """The body axis that pointed along a world axis at the start."""
        body = self.m.geom_bodyid[self.geom(name)]
        return self.now.xmat[body].reshape(3, 3) @ self.spawn[body].T[:, world]

    def velocity(self, name):
        out = np.zeros(6)
        mujoco.mj_objectVelocity(self.m, self.now, mujoco.mjtObj.mjOBJ_GEOM, self.geom(name), out, 0)
        return out[3:]

    def height(self, name):
        return self.now.geom_xpos[self.geom(name)][2]

    def degrees(self, u, v):
        return np.degrees(np.arccos(np.clip(np.dot(u, v), -1, 1)))

    def forward_degrees(self, name):
        return self.degrees(self.axis(name, 0), [1, 0, 0])

    def up_degrees(self, name):
        return self.degrees(self.axis(name, 2), [0, 0, 1])

    def sideways_degrees(self, name):
        return np.degrees(np.arcsin(np.clip(self.axis(name, 0)[1], -1, 1)))

    def flexion(self, name):
        return (90 - self.degrees(self.axis(name, 0), [0, 0, 1])) / 90

    def episode(self, episode):
        m, d = self.m, self.d
        mujoco.mj_resetData(m, d)
        d.qpos[:], d.qvel[:] = episode["qpos"], episode["qvel"]
        self.bonus, self.last_side = 0.0, None
        self.was_down = [False, False]
        self.low, self.high = [0.0, 0.0], [0.0, 0.0]
        decisions = []
        for action in episode["actions"]:
            self.a = np.clip(action, -1, 1)
            d.ctrl[:] = self.a
            self.stumbled = False
            for _ in range(self.skip):
                mujoco.mj_step(m, d)
                self.touching = {m.geom(max(c.geom1, c.geom2)).name for c in d.contact}
                if self.facts["feet"] is not None:
                    self.stumbled |= not self.touching <= self.facts["feet"]
            self.now.qpos[:], self.now.qvel[:] = d.qpos, d.qvel
            mujoco.mj_fwdPosition(m, self.now)
            mujoco.mj_fwdVelocity(m, self.now)
            decisions.append(self.decision())
            if decisions[-1]["terminated"]:
                break
        return decisions

    def decision(self):
        obs = self.observe()
        if self.name == "Humanoid":
            self.phase()
        terms = [float(t) for t in getattr(self, f"reward_{self.name}_{self.version}".lower())()]
        failed = bool(self.failed())
        terms = [0.0] * len(terms) + [-1.0] if failed else terms + [0.0]
        return dict(obs=obs, reward=sum(terms), terms=terms, terminated=failed)

    def observe(self):
        pelvis = self.facts["pelvis"]
        out = [*self.velocity(pelvis), *self.axis(pelvis, 0), *self.axis(pelvis, 2)]
        if self.name == "Humanoid":
            out += [*self.axis("torso", 0), *self.axis("torso", 2)]
        out += [float(g in self.touching) for g in self.facts["touch"]]
        for child in self.pairs:
            inverse, q = np.zeros(4), np.zeros(4)
            mujoco.mju_negQuat(inverse, self.now.xquat[child])
            mujoco.mju_mulQuat(q, inverse, self.now.xquat[self.m.body_parentid[child]])
            q = -q if q[0] < 0 else q
            out += [q[1], q[2], q[3], q[0]]
        for j in self.m.actuator_trnid[:, 0]:
            out.append(self.d.qvel[self.m.jnt_dofadr[j]] / np.pi)
        if self.name == "Hopper":
            out.append(self.height("foot"))
        elif self.version == "v1":
            extra = {"Walker2d": ["left_foot", "right_foot"], "Humanoid": SOLES, "Ant": ["torso_geom"]}
            out += [self.height(g) for g in extra[self.name]]
        return [float(x) for x in out]

    def failed(self):
        if self.name == "Ant":
            return 0.5 - self.forward_degrees("torso_geom") / 180 < 0.2 or self.up_degrees("torso_geom") > 90
        return self.stumbled

    # rewards of -v0

    def at_limit(self):
        return 0.2 * np.sum(np.abs(self.a) >= 1)

    def reward_hopper_v0(self):
        return [
            self.velocity("torso")[0] / 4,
            0.5 - self.forward_degrees("torso") / 180,
            -0.3 * np.sum(self.a**2),
            -4 * self.at_limit(),
        ]

    def reward_walker2d_v0(self):
        return [
            self.velocity("torso")[0] / 4,
            0.5 - self.forward_degrees("torso") / 180,
            -np.clip(1.1 - self.height("torso"), 0, 1.1),
            -0.1 * np.sum(self.a**2),
        ]

    def reward_ant_v0(self):
        return [self.velocity("torso_geom")[0] / 4, -0.5 * np.sum(self.a**2), -4 * self.at_limit()]

    def reward_humanoid_v0(self):
        def upright(g):
            return 0.5 - self.up_degrees(g) / 180

        def forward(g):
            return 0.5 - self.forward_degrees(g) / 180

        return [
            self.velocity("torso")[0] / 4,
            (upright("torso") + upright("lower_waist") + upright("butt")) / 6,
            forward("torso") / 4 + forward("lower_waist") / 6 + forward("butt") / 6,
            self.bonus,
            -np.clip(1.2 - self.height("torso"), 0, 1.2),
            -min(0.5, self.limbs()),
            -4 * self.at_limit(),
            -0.05 * np.sum(self.paid_actions() ** 2),
        ]

    def limbs(self):
        return (abs(self.sideways_degrees("left_thigh")) + abs(self.sideways_degrees("right_thigh"))) / 180

    def paid_actions(self):
        free = {"right_hip_y", "right_knee", "left_hip_y", "left_knee"}
        return np.array([a for i, a in enumerate(self.a) if self.m.actuator(i).name not in free])

    def phase(self):
        down = [bool(self.touching & set(SOLES[:2])), bool(self.touching & set(SOLES[2:]))]
        flexion = [self.flexion("left_thigh"), self.flexion("right_thigh")]
        changed, self.was_down = down != self.was_down, down
        for side in (0, 1):
            self.low[side] = min(self.low[side], flexion[side])
            self.high[side] = max(self.high[side], flexion[side])
        if all(down):
            self.bonus = 0.0
            self.low, self.high = list(flexion), list(flexion)
        elif not changed:
            self.bonus *= 0.9**self.skip
        else:
            self.bonus = 0.0
            if any(down):
                side = 0 if down[0] else 1
                if not (self.version == "v1" and self.last_side == side):
                    self.bonus = self.high[side] - self.low[side] + 0.1
                self.last_side = side
                self.low[side] = self.high[side] = flexion[side]

    # rewards of -v1

    def speed(self, part, fastest):
        return np.clip(self.velocity(part)[0] / fastest, 0, 1)

    def reward_hopper_v1(self):
        v = 0.7 * self.speed("torso", 8)
        u = np.clip(1 - 2 * self.forward_degrees("torso") / 180, 0, 1)
        e = 1 - np.mean(self.a**2)
        return [v, 0.05 * u, e * (0.25 if v >= 0.25 else v)]

    def reward_walker2d_v1(self):
        v = 0.4 * self.speed("torso", 8)
        u = np.clip(1 - 2 * self.forward_degrees("torso") / 180, 0, 1)
        h = np.clip(1 - np.clip(1.1 - self.height("torso"), 0, 1.1), 0, 1)
        e = 1 - np.mean(self.a**2)
        return [v, 0.05 * u, 0.05 * h, e * (0.4 if v >= 0.4 else v)]

    def reward_ant_v1(self):
        v = 0.7 * self.speed("torso_geom", 8)
        e = 1 - np.mean(self.a**2)
        return [v, e * (0.3 if v >= 0.3 else v)]

    def reward_humanoid_v1(self):
        trunk = ["torso", "lower_waist", "butt"]
        upright = sum((1 - 2 * self.up_degrees(g) / 180) / 3 for g in trunk)
        forward = sum((1 - 2 * self.forward_degrees(g) / 180) / 3 for g in trunk)
        height = 1 - np.clip(1.2 - self.height("torso"), 0, 1.2)
        v = 0.4 * self.speed("torso", 10)
        e = 1 - np.mean(self.paid_actions() ** 2)
        bonuses = [upright, forward, self.bonus, height, 1 - self.limbs()]
        return [v, *(0.02 * np.clip(b, 0, 1) for b in bonuses), e * (0.4 if v >= 0.4 else v)]


def main():
    request = json.load(sys.stdin)
    out = []
    for agent in request["agents"]:
        player = Player(agent)
        out.append([player.episode(e) for e in agent["episodes"]])
    json.dump(out, sys.stdout)


if __name__ == "__main__":
    main()
