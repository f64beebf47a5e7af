"""Makes marathon_man.glb: a smooth figure with a skeleton, for Marathon Man to wear in the game.

    python assets/skins/make.py            # needs NumPy

Rounded cones about the bones of assets/agents/marathon_man.xml are blended into one surface, which is cut into a mesh by
surface nets. A vertex follows the bones that it is near to. The skeleton rests as the model does, y up, and faces +z.
"""

import json
import pathlib
import struct
import xml.etree.ElementTree

import numpy as np

FOLDER = pathlib.Path(__file__).parent
MODEL = FOLDER.parent / "agents" / "marathon_man.xml"
CELL = 0.0205  # of the grid that the surface is cut with, m
BLEND = 0.022  # radius of the fillet between two parts of a limb, m
SEAM = 0.012  # the same between limbs
SOFT = 0.055  # width over which a vertex goes from one bone to the next, m

# sRGB
SKIN, HAIR, SHIRT, TROUSERS, SHOES, SOLES = "c98f6b", "3b2a20", "c9432f", "2f3b57", "ece6da", "55585f"


def places():
    """World positions of the model's bodies and geoms at rest, where all bodies are unturned."""
    out = {}

    def walk(element, at):
        here = at + np.array([float(x) for x in element.get("pos", "0 0 0").split()])
        out[element.get("name")] = here
        for geom in element.findall("geom"):
            ends = [float(x) for x in geom.get("fromto", geom.get("pos", "0 0 0")).split()]
            for i in range(0, len(ends), 3):
                out[f"{geom.get('name')}.{i // 3}"] = here + np.array(ends[i : i + 3])
        for child in element.findall("body"):
            walk(child, here)

    walk(xml.etree.ElementTree.parse(MODEL).find("worldbody/body"), np.zeros(3))
    return out


P = places()


def at(name, x=0.0, y=0.0, z=0.0):
    return P[name] + np.array([x, y, z])


# bones: name, the one that it hangs from, where it turns
BONES = [
    ("Hips", None, at("butt", 0, 0, 0.03)),
    ("Spine", "Hips", at("butt", 0.0208, 0, 0.0998)),
    ("Chest", "Spine", at("lower_waist", 0, 0, 0.065)),
    ("Neck", "Chest", at("torso", -0.01, 0, 0.09)),
    ("Head", "Neck", at("torso", 0, 0, 0.15)),
]
for side, left in (("Left", "left"), ("Right", "right")):
    BONES += [
        (f"{side}Arm", "Chest", at(f"{left}_upper_arm")),
        (f"{side}ForeArm", f"{side}Arm", at(f"{left}_larm")),
        (f"{side}Hand", f"{side}ForeArm", at(f"{left}_hand.0")),
        (f"{side}UpLeg", "Hips", at(f"{left}_thigh")),
        (f"{side}Leg", f"{side}UpLeg", at(f"{left}_shin")),
        (f"{side}Foot", f"{side}Leg", at(f"{left}_foot")),
    ]
NUMBER = {name: i for i, (name, _, _) in enumerate(BONES)}


def cones():
    """Rounded cones: limb, bone, color, both ends and both radii."""
    out = []

    def add(limbs, bone, color, a, b, ra, rb=None):
        out.append((limbs.split(), bone, color, np.asarray(a, float), np.asarray(b, float), ra, ra if rb is None else rb))

    y = lambda name, width, x=0.0, z=0.0: (at(name, x, -width, z), at(name, x, width, z))
    add("trunk left_leg right_leg", "Hips", TROUSERS, *y("butt", 0.072, 0.005, -0.005), 0.088)
    add("trunk", "Spine", SHIRT, *y("lower_waist", 0.052, 0.004, -0.045), 0.082)
    add("trunk", "Spine", SHIRT, *y("lower_waist", 0.052, 0.006, 0.03), 0.080)
    add("trunk", "Chest", SHIRT, *y("lower_waist", 0.058, 0.008, 0.10), 0.082)
    add("trunk", "Chest", SHIRT, *y("lower_waist", 0.068, 0.009, 0.165), 0.086)
    add("trunk left_arm right_arm", "Chest", SHIRT, *y("torso", 0.085, 0.008, -0.035), 0.091)
    add("trunk left_arm right_arm", "Chest", SHIRT, *y("torso", 0.10, -0.004, 0.045), 0.068)
    add("trunk", "Neck", SKIN, at("torso", -0.014, 0, 0.08), at("torso", -0.008, 0, 0.16), 0.047, 0.040)
    add("trunk", "Head", SKIN, at("torso", 0.0, 0, 0.195), at("torso", 0.0, 0, 0.236), 0.070, 0.081)
    add("trunk", "Head", SKIN, at("torso", 0.034, 0, 0.162), at("torso", 0.034, 0, 0.2), 0.036, 0.05)
    add("trunk", "Head", SKIN, at("torso", 0.078, 0, 0.215), at("torso", 0.096, 0, 0.19), 0.009, 0.013)
    for side, left, s in (("Left", "left", 1), ("Right", "right", -1)):
        arm, leg = f"{left}_arm", f"{left}_leg"
        shoulder, elbow, wrist = at(f"{left}_upper_arm"), at(f"{left}_larm"), at(f"{left}_larm.1")
        add(f"trunk {arm}", "Chest", SHIRT, at("torso", 0, s * 0.08, 0.06), shoulder, 0.062, 0.056)
        middle = 0.45 * elbow + 0.55 * shoulder
        add(arm, f"{side}Arm", SHIRT, shoulder, middle, 0.055, 0.047)
        add(arm, f"{side}Arm", SKIN, middle, elbow, 0.045, 0.038)
        low = 0.3 * wrist + 0.7 * elbow
        add(arm, f"{side}ForeArm", SKIN, elbow, low, 0.037, 0.041)
        add(arm, f"{side}ForeArm", SKIN, low, wrist, 0.040, 0.026)
        hand = at(f"{left}_hand.0")
        way = (hand - elbow) / np.linalg.norm(hand - elbow)
        add(arm, f"{side}Hand", SKIN, hand - 0.01 * way, hand + 0.055 * way, 0.032, 0.024)
        add(arm, f"{side}Hand", SKIN, hand, hand + np.array([0.035, -s * 0.012, -0.035]), 0.018, 0.014)
        hip, knee, ankle = at(f"{left}_thigh"), at(f"{left}_shin"), at(f"{left}_foot")
        add(f"trunk {leg}", f"{side}UpLeg", TROUSERS, hip + [-0.012, s * 0.008, -0.02], hip + [0, 0, -0.2], 0.088, 0.072)
        add(leg, f"{side}UpLeg", TROUSERS, hip + [0, 0, -0.2], knee, 0.071, 0.055)
        calf = knee + [-0.012, 0, -0.12]
        add(leg, f"{side}Leg", TROUSERS, knee, calf, 0.053, 0.057)
        add(leg, f"{side}Leg", TROUSERS, calf, ankle + [-0.004, 0, 0.03], 0.056, 0.042)
        add(leg, f"{side}Foot", SHOES, ankle + [-0.012, 0, 0.0], ankle + [-0.02, 0, -0.045], 0.041, 0.041)
        # inner and outer edge of the shoe, heel to toe; the soles are where the model's are
        add(leg, f"{side}Foot", SHOES, ankle + [-0.03, -s * 0.008, -0.048], ankle + [0.15, -s * 0.012, -0.056], 0.037, 0.029)
        add(leg, f"{side}Foot", SHOES, ankle + [-0.03, s * 0.006, -0.048], ankle + [0.145, s * 0.03, -0.056], 0.037, 0.029)
    return out


CONES = cones()
LIMBS = ["trunk", "left_leg", "right_leg", "left_arm", "right_arm"]


def cone(points, a, b, ra, rb):
    """Distance to a cone with round ends, near enough for a surface."""
    along = b - a
    share = np.clip((points - a) @ along / (along @ along), 0, 1)
    return np.linalg.norm(points - a - share[..., None] * along, axis=-1) - (ra + share * (rb - ra))


def blend(x, y, k):
    h = np.maximum(k - np.abs(x - y), 0) / k
    return np.minimum(x, y) - h * h * h * k / 6


def distance(points):
    """Signed distance to the figure."""
    each = [cone(points, *row[3:]) for row in CONES]
    whole = None
    for limb in LIMBS:
        part = None
        for row, d in zip(CONES, each):
            if limb in row[0]:
                part = d if part is None else blend(part, d, 2 * BLEND)
        whole = part if whole is None else blend(whole, part, 2 * SEAM)
    # shoes are flat below
    return np.maximum(whole, -points[..., 2])


def surface():
    """Vertices and triangles by surface nets."""
    ends = np.array([row[i] + s * 0.12 for row in CONES for i in (3, 4) for s in (-1, 1)])
    low, high = ends.min(0) - 2 * CELL, ends.max(0) + 2 * CELL
    # both sides alike: the middle of a cell lies between them
    half = np.ceil(high[1] / CELL) * CELL
    axes = [np.arange(low[0], high[0], CELL), np.arange(-half, half + CELL / 2, CELL), np.arange(low[2], high[2], CELL)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    field = distance(grid)
    inside = field < 0
    n = np.array(field.shape) - 1
    corners = [np.array([i, j, k]) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    cut = lambda o: tuple(slice(o[i], o[i] + n[i]) for i in range(3))
    count = sum(inside[cut(o)].astype(int) for o in corners)
    cells = np.argwhere((count > 0) & (count < 8))
    number = -np.ones(n, int)
    number[tuple(cells.T)] = np.arange(len(cells))
    # a vertex is the mean of where the cell's edges cross the surface
    total, crossings = np.zeros((len(cells), 3)), np.zeros(len(cells))
    for a in corners:
        for axis in range(3):
            if a[axis]:
                continue
            b = a + np.eye(3, dtype=int)[axis]
            fa, fb = (field[tuple((cells + o).T)] for o in (a, b))
            crosses = (fa < 0) != (fb < 0)
            share = np.where(crosses, fa / np.where(crosses, fa - fb, 1), 0)
            point = cells + a + share[:, None] * np.eye(3)[axis]
            total += np.where(crosses[:, None], point, 0)
            crossings += crosses
    vertices = np.array([axis[0] for axis in axes]) + CELL * total / crossings[:, None]
    triangles = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        step = np.eye(3, dtype=int)
        here = np.argwhere(inside[tuple(slice(0, -1) if i == axis else slice(1, -1) for i in range(3))]
                           != inside[tuple(slice(1, None) if i == axis else slice(1, -1) for i in range(3))])
        here = here + step[u] + step[v]
        quad = np.stack([number[tuple((here - du * step[u] - dv * step[v]).T)] for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1))], 1)
        out = inside[tuple(here.T)]
        quad = np.where(out[:, None], quad, quad[:, ::-1])
        triangles += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]
    triangles = np.concatenate(triangles)
    # onto the surface itself, and its normals
    for _ in range(3):
        vertices = vertices - distance(vertices)[:, None] * gradient(vertices)
    return vertices, gradient(vertices), triangles


def gradient(points):
    e = 1e-3
    steps = [(distance(points + e * d) - distance(points - e * d)) for d in np.eye(3)]
    g = np.stack(steps, -1)
    return g / np.linalg.norm(g, axis=-1, keepdims=True)


def weights(vertices):
    """Up to four bones of each vertex, and their weights in 255ths."""
    near = np.full((len(vertices), len(BONES)), 1e3)
    for row in CONES:
        i = NUMBER[row[1]]
        near[:, i] = np.minimum(near[:, i], cone(vertices, *row[3:]))
    nearest = near.argmin(1)
    linked = np.eye(len(BONES), dtype=bool)
    for name, parent, _ in BONES:
        if parent:
            linked[NUMBER[name], NUMBER[parent]] = linked[NUMBER[parent], NUMBER[name]] = True
    share = np.clip(1 - (near - near.min(1, keepdims=True)) / SOFT, 0, 1) ** 2
    share *= linked[nearest]
    order = np.argsort(-share, axis=1)[:, :4]
    share = np.take_along_axis(share, order, 1)
    whole = np.floor(255 * share / share.sum(1, keepdims=True) + 0.5).astype(int)
    whole[:, 0] += 255 - whole.sum(1)
    # a bone without weight is none
    return np.where(whole > 0, order, 0).astype(np.uint8), whole.astype(np.uint8)


def colors(vertices):
    each = np.stack([cone(vertices, *row[3:]) for row in CONES], 1)
    names = [CONES[i][2] for i in each.argmin(1)]
    head, out = at("torso", 0, 0, 0.215), []
    for name, p in zip(names, vertices):
        d = p - head
        if name == SKIN and d[2] > -0.06 and abs(d[1]) < 0.12 and d[2] > 0.030 + 0.55 * max(d[0], -0.14):
            name = HAIR
        if name == SHOES and p[2] < 0.016:
            name = SOLES
        rgb = np.array([int(name[i : i + 2], 16) / 255 for i in (0, 2, 4)])
        linear = np.where(rgb < 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        out.append([*np.round(255 * linear), 255])
    return np.array(out, np.uint8)


def to_gltf(points):
    """From x forward, z up to z forward, y up."""
    return points[..., [1, 2, 0]].astype(np.float32)


def main():
    vertices, normals, triangles = surface()
    joints, shares = weights(vertices)
    places = to_gltf(np.array([place for _, _, place in BONES]))
    bind = np.tile(np.eye(4, dtype=np.float32), (len(BONES), 1, 1))
    bind[:, 3, :3] = -places  # columns, one after another
    blob, views, accessors = b"", [], []

    def add(array, kind, component, target=None, **more):
        nonlocal blob
        data = np.ascontiguousarray(array).tobytes()
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)} | ({"target": target} if target else {}))
        blob += data + b"\0" * (-len(data) % 4)
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind} | more)
        return len(accessors) - 1

    FLOAT, BYTE, SHORT = 5126, 5121, 5123
    positions = to_gltf(vertices)
    bounds = {"min": positions.min(0).tolist(), "max": positions.max(0).tolist()}
    attributes = {
        "POSITION": add(positions, "VEC3", FLOAT, 34962, **bounds),
        "NORMAL": add(to_gltf(normals), "VEC3", FLOAT, 34962),
        "COLOR_0": add(colors(vertices), "VEC4", BYTE, 34962, normalized=True),
        "JOINTS_0": add(joints, "VEC4", BYTE, 34962),
        "WEIGHTS_0": add(shares, "VEC4", BYTE, 34962, normalized=True),
    }
    indices = add(triangles.astype(np.uint16).reshape(-1), "SCALAR", SHORT, 34963)
    nodes = []
    for i, (name, parent, _) in enumerate(BONES):
        above = places[NUMBER[parent]] if parent else np.zeros(3)
        node = {"name": name, "translation": [round(float(x), 5) for x in places[i] - above]}
        children = [NUMBER[child] for child, of, _ in BONES if of == name]
        nodes.append(node | ({"children": children} if children else {}))
    nodes.append({"name": "marathon_man", "mesh": 0, "skin": 0})
    material = {"name": "cloth", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.75}}
    document = {
        "asset": {"version": "2.0", "generator": "assets/skins/make.py", "copyright": "the Marathon project; MIT OR Apache-2.0"},
        "scene": 0,
        "scenes": [{"name": "marathon_man", "nodes": [0, len(nodes) - 1]}],
        "nodes": nodes,
        "meshes": [{"name": "marathon_man", "primitives": [{"attributes": attributes, "indices": indices, "material": 0}]}],
        "skins": [{"joints": list(range(len(BONES))), "skeleton": 0, "inverseBindMatrices": add(bind.reshape(-1, 16), "MAT4", FLOAT)}],
        "materials": [material],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob
    out = FOLDER / "marathon_man.glb"
    out.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)
    print(f"{out.name}: {len(vertices)} vertices, {len(triangles)} triangles, {out.stat().st_size} bytes")


main()
