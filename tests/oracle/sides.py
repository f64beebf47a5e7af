"""The order of the sides of meshes' hulls in MuJoCo.

MuJoCo merges the triangles of a hull to polygons. Qhull and a hash table order the polygons and choose the first corner of
each, so the order depends on the order of a mesh file's triangles. It decides which of several nearly parallel sides
touch, which corners of a flat contact are kept, and the plane of a side that is not exactly flat.
"""

import mujoco
import numpy as np

# distance of two copies of a corner, relative to the size of the hull
NEAR = 1e-5


def polygons(model, mesh):
    """Corners of the polygons of a mesh's hull, as numbers of its vertices."""
    first = model.mesh_polyadr[mesh]
    numbers = range(first, first + model.mesh_polynum[mesh])
    spans = [(model.mesh_polyvertadr[p], model.mesh_polyvertnum[p]) for p in numbers]
    return [model.mesh_polyvert[at : at + n].tolist() for at, n in spans]


def from_corner(polygon, k):
    return polygon[k:] + polygon[:k]


def lowest_first(polygon):
    return tuple(from_corner(polygon, polygon.index(min(polygon))))


def write(model, mesh, order):
    """Writes a mesh's polygons in this order: the former number of each, and its corners."""
    first, vertices = model.mesh_polyadr[mesh], model.mesh_vertadr[mesh]
    normals = model.mesh_polynormal[first : first + len(order)].copy()
    at = model.mesh_polyvertadr[first]
    around = {}
    for k, (former, corners) in enumerate(order):
        model.mesh_polyvertadr[first + k], model.mesh_polyvertnum[first + k] = at, len(corners)
        model.mesh_polyvert[at : at + len(corners)] = corners
        model.mesh_polynormal[first + k] = normals[former]
        at += len(corners)
        for v in corners:
            around.setdefault(v, []).append(k)
    for v, sides in around.items():
        at = model.mesh_polymapadr[vertices + v]
        model.mesh_polymap[at : at + len(sides)] = sides


def merged(vertices):
    """The number of the first vertex at the place of each."""
    first = {}
    return [first.setdefault(tuple(v), i) for i, v in enumerate(vertices.tolist())]


def nearest(vertices, point):
    """The number of the vertex nearest to a point."""
    far = np.abs(vertices - point).max(axis=1)
    if far.min() > NEAR * np.abs(vertices).max():
        raise ValueError(f"MuJoCo's mesh has no vertex at {point}")
    return int(far.argmin())


def order_alike(model, hulls):
    """Orders the polygons of the meshes as in `hulls`, a list of {"mesh": name, "vertices": [..], "polygons": [..]}."""
    for hull in hulls:
        mesh = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_MESH, hull["mesh"])
        first = model.mesh_vertadr[mesh]
        vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float)
        # several vertices may be at one place
        same = merged(vertices)
        corners = [same[nearest(vertices, v)] for v in hull["vertices"]]
        own = polygons(model, mesh)
        number = {lowest_first([same[v] for v in polygon]): k for k, polygon in enumerate(own)}
        order = []
        for polygon in hull["polygons"]:
            outline = [corners[v] for v in polygon]
            k = number.pop(lowest_first(outline), None)
            if k is not None:
                start = [same[v] for v in own[k]].index(outline[0])
                order.append((k, from_corner(own[k], start)))
        # a side that lies on an edge of MuJoCo's grid of directions may be split there
        order += [(k, own[k]) for k in number.values()]
        write(model, mesh, order)


def shuffle(model, rng):
    """Orders all polygons at random."""
    for mesh in range(model.nmesh):
        own = polygons(model, mesh)
        if own:
            starts = [int(rng.integers(len(polygon))) for polygon in own]
            write(model, mesh, [(k, from_corner(own[k], starts[k])) for k in rng.permutation(len(own))])
