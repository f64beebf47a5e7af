"""Random poses of two geoms and MuJoCo's contacts between them.

Reads a JSON list of jobs from standard input, one per pair of geoms:
    {"geoms": [GEOM, GEOM], "margin": m, "states": n, "seed": s}
    GEOM: {"type": "sphere" | ..., "size": [...]} or {"type": "hfield", "size": [4], "heights": [[...], ...]}
and prints a JSON list with, per job, {"states": [{"geoms": [[position, rotation row by row], ...], "contacts":
[[dist, pos, normal, tangent], ...], "tie": bool, "rough": bool}, ...]}, geoms and contacts in MuJoCo's order.
With "degenerate": true the poses are those without a nearest feature of their own, and numbers without rounding errors.

The poses are mixed: any, barely touching, with parallel or perpendicular axes, and nearly so. A state is a tie if a
displacement of 1e-7 makes the contacts jump (there, rounding decides which features touch), and rough if one of 1e-5
moves them by more than 20 times as much.
"""

import json
import sys

import mujoco
import numpy as np

STATIC = ("plane", "hfield")


def numbers(values):
    return " ".join(repr(float(v)) for v in values)


class Pair:
    def __init__(self, job):
        assets, bodies = "", ""
        for i, geom in enumerate(job["geoms"]):
            margin = f'margin="{job["margin"] if i == 0 else 0}"'
            if geom["type"] == "hfield":
                rows = geom["heights"]
                flat = numbers(h for row in rows for h in row)
                assets = f'<hfield name="h" nrow="{len(rows)}" ncol="{len(rows[0])}" size="{numbers(geom["size"])}" '
                assets = f'<asset>{assets} elevation="{flat}"/></asset>'
                bodies += f'<geom type="hfield" hfield="h" pos="1 2 3" euler="10 20 30" {margin}/>'
            elif geom["type"] == "plane":
                bodies += f'<geom type="plane" size="1 1 1" pos="1 2 3" euler="10 20 30" {margin}/>'
            else:
                size = numbers(geom["size"])
                bodies += f'<body><freejoint/><geom type="{geom["type"]}" size="{size}" {margin}/></body>'
        self.m = mujoco.MjModel.from_xml_string(f"<mujoco>{assets}<worldbody>{bodies}</worldbody></mujoco>")
        # iterative collision functions to the end
        self.m.opt.ccd_iterations, self.m.opt.ccd_tolerance = 1000, 1e-10
        self.d = mujoco.MjData(self.m)
        self.job = job
        if assets:
            rows = np.array(job["geoms"][0]["heights"], dtype=np.float32)
            self.m.hfield_data[:] = rows.ravel()

    def place(self, poses):
        """Puts the geoms at (position, unit quaternion)."""
        slot = 0
        for i, (pos, quat) in enumerate(poses):
            if self.job["geoms"][i]["type"] in STATIC:
                self.m.geom_pos[i], self.m.geom_quat[i] = pos, quat
            else:
                self.d.qpos[7 * slot : 7 * slot + 3], self.d.qpos[7 * slot + 3 : 7 * slot + 7] = pos, quat
                slot += 1
        mujoco.mj_kinematics(self.m, self.d)
        mujoco.mj_comPos(self.m, self.d)

    def contacts(self, poses):
        self.place(poses)
        mujoco.mj_collision(self.m, self.d)
        c = self.d.contact
        return np.hstack([c.dist.reshape(-1, 1), c.pos, c.frame[:, :6]]) if self.d.ncon else np.zeros((0, 10))

    def distance(self, poses):
        self.place(poses)
        return mujoco.mj_geomDistance(self.m, self.d, 0, 1, 10.0, None)


def random_quat(rng):
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def multiply(a, b):
    out = np.zeros(4)
    mujoco.mju_mulQuat(out, a, b)
    return out


def rotate(v, q):
    out = np.zeros(3)
    mujoco.mju_rotVecQuat(out, v, q)
    return out


def turned(rng, q, angle):
    """`q` after a rotation by `angle` about a random axis."""
    axis = rng.normal(size=3)
    axis *= np.sin(angle / 2) / np.linalg.norm(axis)
    return multiply(np.array([np.cos(angle / 2), *axis]), q)


def square(rng):
    """One of the rotations of a cube."""
    q = np.array([1.0, 0, 0, 0])
    for _ in range(4):
        axis = np.eye(3)[rng.integers(3)]
        q = multiply(q, np.array([1.0, *axis]) / np.sqrt(2))
    return q / np.linalg.norm(q)


def reach(geom):
    size = geom["size"]
    if geom["type"] == "capsule":
        return size[0] + size[1]
    return float(np.linalg.norm(size[:2] if geom["type"] == "cylinder" else size))


def sample(rng, job, pair):
    """Poses of both geoms."""
    first, second = job["geoms"]
    margin = job["margin"]
    kind = rng.integers(4)
    base = np.array([1.0, 0, 0, 0]) if rng.integers(3) == 0 else random_quat(rng)
    if kind < 2:
        q2 = random_quat(rng)
    else:
        q2 = turned(rng, multiply(base, square(rng)), rng.choice([0, 1e-5, 1e-3, 0.03]))
    origin = rng.uniform(-0.3, 0.3, size=3)
    if first["type"] == "hfield":
        sx, sy, sz, _ = first["size"]
        local = np.array([rng.uniform(-sx, sx) * 1.05, rng.uniform(-sy, sy) * 1.05, 0.0])
        local[2] = sz * rng.uniform(-0.3, 1.2) + rng.uniform(-0.2, 1.0) * reach(second)
        return [(origin, base), (origin + rotate(local, base), q2)]
    if first["type"] == "plane":
        local = np.array([*rng.uniform(-1, 1, size=2), rng.uniform(-0.5, 1.3) * reach(second)])
        return [(origin, base), (origin + rotate(local, base), q2)]
    # along some direction from the first geom, at a random distance or barely touching
    direction = rng.normal(size=3)
    if kind >= 2:
        direction = direction * 0.2 + rng.choice([-1, 1]) * np.eye(3)[rng.integers(3)] * 2
    direction = rotate(direction / np.linalg.norm(direction), base)
    far = reach(first) + reach(second) + margin
    if rng.integers(3) == 0:
        return [(origin, base), (origin + direction * rng.uniform(0, far), q2)]
    goal = rng.choice([rng.uniform(-0.03, 0), rng.uniform(0, max(margin, 1e-3))])
    near = 0.0
    for _ in range(40):
        middle = 0.5 * (near + far)
        if pair.distance([(origin, base), (origin + direction * middle, q2)]) < goal:
            near = middle
        else:
            far = middle
    return [(origin, base), (origin + direction * far, q2)]


def degenerate(rng, job):
    """Poses whose numbers are sums of few powers of two: coinciding centers, centers on axes, faces, edges and corners."""
    sizes = [s for geom in job["geoms"] for s in geom["size"] if geom["type"] != "plane"]
    places = [0.0, 0.0, *sizes, *(-s for s in sizes), *(sizes[0] + s for s in sizes), 0.03125]
    origin = rng.choice([0.0, 1.0, -0.5], size=3)
    local = rng.choice(places, size=3) * (rng.integers(3, size=3) > 0)
    turns = [np.array(q, dtype=float) for q in [
        (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1), (1, 0, 0, 1), (1, 1, 0, 0), (1, 0, 1, 0), (1, 1, 1, 1), (2, 0, 0, 1),
        (3, 4, 0, 0), (4, 0, 3, 0), (7, 1, 3, 2),
    ]]
    first = turns[0]
    if job["geoms"][0]["type"] not in STATIC and rng.integers(2):
        first = turns[rng.integers(len(turns))]
    second = turns[rng.integers(len(turns))]
    return [(origin, first / np.linalg.norm(first)), (origin + local, second / np.linalg.norm(second))]


def jumps(rng, pair, poses, contacts, nudge, factor):
    """Whether a small displacement moves the contacts by more than `factor` times as much."""
    (p1, q1), (p2, q2) = poses
    for _ in range(6):
        step = rng.normal(size=3)
        nudged = pair.contacts([(p1, q1), (p2 + nudge * step / np.linalg.norm(step), turned(rng, q2, nudge))])
        if nudged.shape != contacts.shape or np.abs(nudged - contacts).max(initial=0) > factor * nudge:
            return True
    return False


def stays(pair, poses, contacts):
    """Whether the contacts are the same elsewhere, where numbers are rounded otherwise."""
    for shift in np.array([[1.0, 2.0, -1.0], [-0.375, 0.125, 0.0], [8.0, -4.0, 16.0], [0.625, 0.5, 0.25]]):
        there = pair.contacts([(pos + shift, quat) for pos, quat in poses])
        if there.shape != contacts.shape:
            return False
        there[:, 1:4] -= shift
        if np.abs(there - contacts).max(initial=0) > 1e-9:
            return False
    return True


def run(job):
    rng = np.random.default_rng(job["seed"])
    pair = Pair(job)
    states = []
    for _ in range(job["states"]):
        poses = degenerate(rng, job) if job.get("degenerate") else sample(rng, job, pair)
        contacts = pair.contacts(poses)
        geoms = [[*pair.d.geom_xpos[i], *pair.d.geom_xmat[i]] for i in range(2)]
        if job.get("degenerate"):
            tie = rough = not stays(pair, poses, contacts)
            states.append({"geoms": geoms, "contacts": contacts.tolist(), "tie": tie, "rough": rough})
            continue
        tie = jumps(rng, pair, poses, contacts, 1e-7, 1e3)
        rough = tie or jumps(rng, pair, poses, contacts, 1e-5, 20)
        states.append({"geoms": geoms, "contacts": contacts.tolist(), "tie": tie, "rough": rough})
    return {"states": states}


if __name__ == "__main__":
    print(json.dumps([run(job) for job in json.load(sys.stdin)]))
