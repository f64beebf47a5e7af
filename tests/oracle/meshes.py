"""Random meshes in files of every format, and MuJoCo's models of them.

Reads {"folder": path, "seed": s, "count": n} from standard input, writes meshes and models to the folder, and prints
{"models": [{"path": .., "model": as in compiled_model.py, "meshes": [..], "hulls": [..], "bounds": [..]}]}:
    meshes: vertices and faces by name, without those that have very many
    hulls: of each geom, the corners of its polygons and their normals, or null
    bounds: of each geom, center and half lengths of its box, and the radius around its origin
With {"paths": [..]} it prints the same for these models instead.
"""

import json
import struct
import sys
from pathlib import Path

import mujoco
import numpy as np

from compiled_model import dump

MODES = ["legacy", "exact", "convex", "shell"]
# vertices of a mesh that is printed
LARGEST = 5000
FORMATS = ["stl", "obj", "msh", "inline", "points"]


def globe(rng, rings, columns):
    """A closed surface around the origin, not convex: a globe whose points have random distances."""
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, rings + 2)[1:-1], np.linspace(0, 2 * np.pi, columns, False), indexing="ij")
    points = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1).reshape(-1, 3)
    points = np.vstack([points, [[0, 0, 1], [0, 0, -1]]]) * rng.uniform(0.7, 1.3, (rings * columns + 2, 1))
    faces = []
    for j in range(columns):
        k = (j + 1) % columns
        for i in range(rings - 1):
            a, b, c, d = i * columns + j, i * columns + k, (i + 1) * columns + j, (i + 1) * columns + k
            faces += [[a, c, b], [b, c, d]]
        faces += [[rings * columns, j, k], [rings * columns + 1, (rings - 1) * columns + k, (rings - 1) * columns + j]]
    return points, faces


def prism(rng, edges):
    """A prism over a regular or random polygon, with quads that are flat."""
    angle = np.sort(rng.uniform(0, 2 * np.pi, edges)) if rng.random() < 0.5 else np.arange(edges) * 2 * np.pi / edges
    ring = np.stack([np.cos(angle), np.sin(angle)], -1)
    points = np.vstack([np.c_[ring, np.full(edges, -1)], np.c_[ring, np.full(edges, 1)]])
    faces = []
    for i in range(1, edges - 1):
        faces += [[0, i + 1, i], [edges, edges + i, edges + i + 1]]
    for i in range(edges):
        j = (i + 1) % edges
        faces += [[i, j, edges + j], [i, edges + j, edges + i]]
    return points, faces


def block(rng):
    """A box with points on its sides and edges that are no corners of the hull."""
    points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])]
    extra = np.vstack([np.eye(3), -np.eye(3), [[1, 1, 0.5], [-1, 0.25, 1], [0.1, 0.2, 0.3]]])
    return np.vstack([points, extra]) * rng.uniform(0.5, 2, 3), faces


def shape(rng):
    """Points and faces of a random closed surface."""
    kind = rng.integers(3)
    if kind == 0:
        return globe(rng, rng.integers(2, 8), rng.integers(3, 12))
    return prism(rng, rng.integers(3, 12)) if kind == 1 else block(rng)


def placed(rng, points):
    """The points somewhere else and turned, in single precision."""
    turn = np.zeros(9)
    quat = rng.normal(size=4) if rng.random() < 0.6 else np.array([1.0, 0, 0, 0])
    mujoco.mju_quat2Mat(turn, quat / np.linalg.norm(quat))
    size = 10 ** rng.uniform(-2, 0.3)
    return np.float32(size * (points @ turn.reshape(3, 3).T * rng.uniform(0.5, 1.5, 3) + rng.uniform(-1, 1, 3)))


def text(values):
    return " ".join(str(v) for v in np.asarray(values).ravel().tolist())


def written(folder, name, form, points, faces):
    """Writes a mesh and returns the attributes that read it."""
    path = folder / f"{name}.{form}"
    if form == "stl":
        data = b"".join(struct.pack("<12f2x", 0, 0, 0, *points[f].ravel()) for f in np.array(faces))
        path.write_bytes(bytes(80) + struct.pack("<i", len(faces)) + data)
    elif form == "msh":
        data = np.float32(points).tobytes() + np.int32(faces).tobytes()
        path.write_bytes(struct.pack("<4i", len(points), 0, 0, len(faces)) + data)
    elif form == "obj":
        lines = [f"v {x:.9g} {y:.8f} {z:.7e}" for x, y, z in points.tolist()]
        path.write_text("\n".join(lines + [f"f {a + 1}/1 {b - len(points)} {c + 1}//2" for a, b, c in faces]) + "\n")
    else:
        inline = f'vertex="{text(points)}"'
        return inline if form == "points" else f'{inline} face="{text(faces)}"'
    return f'file="{path.name}"'


def mesh(rng, folder, name):
    """A mesh element."""
    form = str(rng.choice(FORMATS))
    points, faces = shape(rng)
    if form == "points":
        points = rng.normal(size=(rng.integers(4, 60), 3))
    mode = str(rng.choice(MODES))
    attributes = [f'name="{name}"', written(folder, name, form, placed(rng, points), faces), f'inertia="{mode}"']
    if rng.random() < 0.4:
        signs = rng.choice([-1, 1], 3) if rng.random() < 0.5 else np.ones(3)
        attributes.append(f'scale="{text(signs * rng.uniform(0.5, 2, 3))}"')
    if rng.random() < 0.3:
        attributes.append(f'refpos="{text(rng.uniform(-1, 1, 3))}"')
    if rng.random() < 0.3:
        attributes.append(f'refquat="{text(rng.normal(size=4))}"')
    return f"<mesh {' '.join(attributes)}/>"


def geom(rng, mesh_name):
    """A geom of a mesh, or a primitive that is fitted to it."""
    kinds = ["mesh", "mesh", "mesh", "sphere", "capsule", "cylinder", "ellipsoid", "box"]
    attributes = [f'type="{rng.choice(kinds)}" mesh="{mesh_name}" pos="{text(rng.uniform(-1, 1, 3))}"']
    attributes.append(f'euler="{text(rng.uniform(-180, 180, 3))}"')
    if rng.random() < 0.3:
        attributes.append('contype="0" conaffinity="0"')
    if rng.random() < 0.3:
        attributes.append(f'mass="{rng.uniform(0.1, 2)}"')
    if rng.random() < 0.3:
        attributes.append(f'fitscale="{rng.uniform(0.5, 2)}"')
    return f"<geom {' '.join(attributes)}/>"


def model(rng, folder, number):
    """Writes a model with a few meshes."""
    names = [f"m{number}-{i}" for i in range(3)]
    meshes = "".join(mesh(rng, folder, name) for name in names)
    bodies = "".join(f"<body><freejoint/>{''.join(geom(rng, rng.choice(names)) for _ in range(2))}</body>" for _ in range(3))
    fit = "true" if rng.random() < 0.5 else "false"
    path = folder / f"model-{number}.xml"
    path.write_text(
        f'<mujoco><compiler fitaabb="{fit}" boundinertia="1e-12"/><asset>{meshes}</asset><worldbody>{bodies}</worldbody></mujoco>'
    )
    return path


def hull(m, g):
    """Polygons of a geom's hull by the coordinates of their corners."""
    if m.geom_type[g] != mujoco.mjtGeom.mjGEOM_MESH or not (m.geom_contype[g] or m.geom_conaffinity[g]):
        return None
    i = m.geom_dataid[g]
    vertices = m.mesh_vert[m.mesh_vertadr[i] :][: m.mesh_vertnum[i]]
    graph = m.mesh_graph[m.mesh_graphadr[i] :]
    corners = vertices[graph[2 + graph[0] :][: graph[0]]]
    polygons = range(m.mesh_polyadr[i], m.mesh_polyadr[i] + m.mesh_polynum[i])
    outlines = [vertices[m.mesh_polyvert[m.mesh_polyvertadr[p] :][: m.mesh_polyvertnum[p]]] for p in polygons]
    return {
        "corners": corners.tolist(), "polygons": [o.tolist() for o in outlines],
        "normals": [m.mesh_polynormal[p].tolist() for p in polygons],
    }


def described(path):
    """A model and its meshes, or why MuJoCo refuses it."""
    try:
        m = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        return {"path": str(path), "error": str(error)}
    meshes = {}
    for i in range(m.nmesh):
        vertices = m.mesh_vert[m.mesh_vertadr[i] :][: m.mesh_vertnum[i]]
        faces = m.mesh_face[m.mesh_faceadr[i] :][: m.mesh_facenum[i]]
        name = mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_MESH, i)
        if len(vertices) > LARGEST:
            continue
        meshes[name] = {"vertices": vertices.tolist(), "faces": faces.tolist()}
    bounds = [[*m.geom_aabb[g].tolist(), float(m.geom_rbound[g])] for g in range(m.ngeom)]
    hulls = [hull(m, g) for g in range(m.ngeom)]
    return {"path": str(path), "model": dump(m), "meshes": meshes, "hulls": hulls, "bounds": bounds}


def main():
    job = json.load(sys.stdin)
    if "paths" in job:
        paths = job["paths"]
    else:
        rng = np.random.default_rng(job["seed"])
        paths = [model(rng, Path(job["folder"]), number) for number in range(job["count"])]
    json.dump({"models": [described(path) for path in paths]}, sys.stdout, default=lambda value: value.tolist())


if __name__ == "__main__":
    main()
