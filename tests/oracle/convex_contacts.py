"""Random poses of two convex shapes and the contacts that MuJoCo's defaults find between them.

Reads a JSON list of jobs from standard input, one per pair of geoms:
    {"geoms": [GEOM, GEOM], "margin": m, "multiccd": bool, "states": n, "seed": s}
    GEOM: as in contacts.py, or {"type": "mesh", "vertices": [[x, y, z], ...]}
and prints a JSON list with, per job, {"meshes": MESHES, "states": [STATE, ...]}. A mesh's frame is not that of the file:
MESHES has, per geom, null or its compiled {"vertices": [...], "polygons": [[index, ...], ...], "normals": [...]}. All
vertices of a mesh should be corners of its hull. STATE: {"geoms": [[position, rotation row by row], ...],
"contacts": [[dist, pos, normal], ...], "ambiguous": bool}, geoms and contacts in MuJoCo's order.

A state is ambiguous if displacements of 1e-9 change the number of contacts, or move a distance or a position by more than
1e-5, or a normal by more than 2e-2: there, rounding decides.
"""

import json
import sys

import mujoco
import numpy as np

import contacts
from contacts import numbers, random_quat, turned

NUDGE = 1e-9


class Pair(contacts.Pair):
    def __init__(self, job):
        assets, bodies = "", ""
        for i, geom in enumerate(job["geoms"]):
            margin = f'margin="{job["margin"] if i == 0 else 0}"'
            kind = geom["type"]
            if kind == "hfield":
                rows = geom["heights"]
                flat = numbers(h for row in rows for h in row)
                size = numbers(geom["size"])
                assets += f'<hfield name="h" nrow="{len(rows)}" ncol="{len(rows[0])}" size="{size}" elevation="{flat}"/>'
                bodies += f'<geom type="hfield" hfield="h" pos="1 2 3" euler="10 20 30" {margin}/>'
            elif kind == "plane":
                bodies += f'<geom type="plane" size="1 1 1" pos="1 2 3" euler="10 20 30" {margin}/>'
            elif kind == "mesh":
                flat = numbers(x for v in geom["vertices"] for x in v)
                assets += f'<mesh name="m{i}" vertex="{flat}"/>'
                bodies += f'<body><freejoint/><geom type="mesh" mesh="m{i}" {margin}/></body>'
            else:
                bodies += f'<body><freejoint/><geom type="{kind}" size="{numbers(geom["size"])}" {margin}/></body>'
        flag = "enable" if job.get("multiccd", True) else "disable"
        self.m = mujoco.MjModel.from_xml_string(
            f'<mujoco><option><flag multiccd="{flag}"/></option><asset>{assets}</asset>'
            f"<worldbody>{bodies}</worldbody></mujoco>"
        )
        self.d = mujoco.MjData(self.m)
        self.job = job
        for geom in job["geoms"]:
            if geom["type"] == "hfield":
                self.m.hfield_data[:] = np.array(geom["heights"], dtype=np.float32).ravel()

    def mesh(self, i):
        """The compiled hull of geom `i`."""
        m, k = self.m, self.m.geom_dataid[i]
        if self.job["geoms"][i]["type"] != "mesh":
            return None
        vertices = m.mesh_vert[m.mesh_vertadr[k] : m.mesh_vertadr[k] + m.mesh_vertnum[k]]
        polygons = []
        for p in range(m.mesh_polyadr[k], m.mesh_polyadr[k] + m.mesh_polynum[k]):
            start = m.mesh_polyvertadr[p]
            polygons.append(m.mesh_polyvert[start : start + m.mesh_polyvertnum[p]].tolist())
        normals = m.mesh_polynormal[m.mesh_polyadr[k] : m.mesh_polyadr[k] + m.mesh_polynum[k]]
        return {"vertices": vertices.astype(float).tolist(), "polygons": polygons, "normals": normals.tolist()}


def reach(pair, i):
    if pair.job["geoms"][i]["type"] == "mesh":
        return float(pair.m.geom_rbound[i])
    return contacts.reach(pair.job["geoms"][i])


def sample(rng, pair):
    """Poses of both geoms: any, apart by less than the margin, or touching with a small depth."""
    job = pair.job
    first = job["geoms"][0]["type"]
    base = np.array([1.0, 0, 0, 0]) if rng.integers(3) == 0 else random_quat(rng)
    # turns that are almost square, and angles at which faces and edges are no longer parallel
    if rng.integers(2):
        q2 = random_quat(rng)
    else:
        q2 = turned(rng, contacts.multiply(base, contacts.square(rng)), rng.choice([1e-6, 1e-3, 0.03, 0.08, 0.1]))
    origin = rng.uniform(-0.3, 0.3, size=3)
    second = reach(pair, 1)
    if first == "hfield":
        sx, sy, sz, _ = job["geoms"][0]["size"]
        local = np.array([rng.uniform(-sx, sx), rng.uniform(-sy, sy), sz * rng.uniform(-0.1, 1.2) + rng.uniform(0, 1) * second])
        return [(origin, base), (origin + contacts.rotate(local, base), q2)]
    if first == "plane":
        local = np.array([*rng.uniform(-1, 1, size=2), rng.uniform(-0.2, 1.1) * second])
        return [(origin, base), (origin + contacts.rotate(local, base), q2)]
    direction = rng.normal(size=3)
    if rng.integers(2):
        direction = direction * 0.2 + rng.choice([-1, 1]) * np.eye(3)[rng.integers(3)] * 2
    direction = contacts.rotate(direction / np.linalg.norm(direction), base)
    far = reach(pair, 0) + second + job["margin"] + 1e-3
    deep = -(10 ** rng.uniform(-5, -1.5))
    goal = deep if job["margin"] == 0 or rng.integers(2) else job["margin"] * rng.uniform(0, 1)
    near = 0.0
    for _ in range(40):
        middle = 0.5 * (near + far)
        if pair.distance([(origin, base), (origin + direction * middle, q2)]) < goal:
            near = middle
        else:
            far = middle
    return [(origin, base), (origin + direction * far, q2)]


def is_ambiguous(rng, pair, poses, found):
    (p1, q1), (p2, q2) = poses
    for _ in range(8):
        step = rng.normal(size=3)
        nudged = pair.contacts([(p1, q1), (p2 + NUDGE * step / np.linalg.norm(step), turned(rng, q2, NUDGE))])
        if nudged.shape != found.shape:
            return True
        change = np.abs(nudged - found)
        if change[:, :4].max(initial=0) > 1e-5 or change[:, 4:7].max(initial=0) > 2e-2:
            return True
    return False


def run(job):
    rng = np.random.default_rng(job["seed"])
    pair = Pair(job)
    states = []
    for _ in range(job["states"]):
        poses = sample(rng, pair)
        found = pair.contacts(poses)
        geoms = [[*pair.d.geom_xpos[i], *pair.d.geom_xmat[i]] for i in range(2)]
        ambiguous = is_ambiguous(rng, pair, poses, found)
        states.append({"geoms": geoms, "contacts": found[:, :7].tolist(), "ambiguous": ambiguous})
    return {"meshes": [pair.mesh(0), pair.mesh(1)], "states": states}


if __name__ == "__main__":
    print(json.dumps([run(job) for job in json.load(sys.stdin)]))
