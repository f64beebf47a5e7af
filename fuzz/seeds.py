#!/usr/bin/env python3
"""Writes seeds for the targets `mesh`, `motion` and `files`: small files of each format, with a byte or two before them, in corpus/mesh,
corpus/motion-0 to -4 and corpus/files-0 to -7.

The fuzzer rarely finds a whole file of a format by itself, but it can change one. The script needs no packages. Networks,
demonstrations, tables and descriptions need the program, in target/release or CARGO_TARGET_DIR.
"""

import json
import math
import os
import re
import struct
import subprocess
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
MOTIONS = HERE.parent / "assets/motions"
POLICIES = HERE.parent / "assets/policies"
PROGRAM = Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target")) / "release/marathon"


def clips():
    """Marathon's own: some frames of clips that ship, and a clip of two joints in each kind of loop."""
    for figure, name in [("marathon_man", "stand"), ("marathon_man", "backflip"), ("walker2d", "walk")]:
        clip = json.loads((MOTIONS / figure / f"{name}.motion").read_text())
        for key, value in clip.items():
            if isinstance(value, list) and len(value) > 4 and key != "joints":
                clip[key] = value[:4]
        yield json.dumps(clip)
    for loop in ["none", "wrap"]:
        small = {"motion": 1, "name": "a", "model": "b", "source": "c", "license": "d", "loop": loop, "dt": 0.1}
        small["joints"] = [["r", "free"], ["h", "hinge"]]
        if loop == "wrap":
            small["cycle"] = [1, 0, 0.5]
        small["frames"] = [[0.1 * i, 0, 1, 1, 0, 0, 0, 0.2 * i] for i in range(3)]
        yield json.dumps(small)


def bvh():
    """A figure of four joints in two orders of channels, one with channels of positions everywhere."""
    for order, frames in [("Zrotation Yrotation Xrotation", 3), ("Xrotation Zrotation Yrotation", 2)]:
        for positions in ["", "Xposition Yposition Zposition "]:
            child = f"CHANNELS {6 if positions else 3} {positions}{order}"
            joints = "".join(
                f"JOINT {name}\n{{\nOFFSET {x} -40 0\n{child}\n" for name, x in [("LeftUpLeg", 9), ("LeftLeg", 0)]
            )
            arm = f"JOINT RightArm\n{{\nOFFSET -20 40 0\n{child}\nEnd Site\n{{\nOFFSET 0 5 0\n}}\n}}\n"
            root = f"ROOT Hips\n{{\nOFFSET 0 90 0\nCHANNELS 6 Xposition Yposition Zposition {order}\n"
            tree = f"{root}{joints}End Site\n{{\nOFFSET 0 -5 0\n}}\n}}\n}}\n{arm}}}\n"
            numbers = 6 + 3 * (6 if positions else 3)
            rows = "\n".join(" ".join(f"{10 * math.sin(i + k):.2f}" for k in range(numbers)) for i in range(frames))
            yield f"HIERARCHY\n{tree}MOTION\nFrames: {frames}\nFrame Time: 0.0333\n{rows}\n"


def deep_mimic():
    """Frames of 44 numbers: a duration, the root, and joints as quaternions or angles."""
    for loop in ["wrap", "none"]:
        frames = []
        for i in range(3):
            half = 0.1 * i
            turn = [math.cos(half), math.sin(half), 0, 0]
            leg, arm = [*turn, -0.5, *turn], [*turn, 0.3]
            frames.append([0.0333, 0.1 * i, 0.9, 0, *turn * 3, *leg, *arm, *leg, *arm])
        yield json.dumps({"Loop": loop, "Frames": frames})


def glb():
    """Three nodes with rotations and translations, in each interpolation."""
    for interpolation in ["LINEAR", "STEP", "CUBICSPLINE"]:
        per_key = 3 if interpolation == "CUBICSPLINE" else 1
        turns = [[math.sin(0.2 * i), 0, 0, math.cos(0.2 * i)] for i in range(3)]
        places = [[0.1 * i, 1, 0] for i in range(3)]
        numbers = [0.0, 0.5, 1.0]
        for keys, width in [(turns, 4), (places, 3)]:
            for key in keys:
                numbers += [0.0] * width + key + [0.0] * width if per_key == 3 else key
        views, accessors, start = [], [], 0
        for width, kind, count in [(1, "SCALAR", 3), (4, "VEC4", 3 * per_key), (3, "VEC3", 3 * per_key)]:
            views.append({"buffer": 0, "byteOffset": start, "byteLength": 4 * width * count})
            accessors.append({"bufferView": len(views) - 1, "componentType": 5126, "count": count, "type": kind})
            start += 4 * width * count
        accessors[0].update(min=[0], max=[1])
        data = struct.pack(f"<{len(numbers)}f", *numbers)
        channels = [(1, "rotation", 1), (2, "rotation", 1), (0, "translation", 2)]
        document = {
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0]}],
            "nodes": [
                {"name": "Hips", "children": [1], "translation": [0, 1, 0]},
                {"name": "LeftUpLeg", "children": [2], "rotation": [0, 0, 0, 1], "translation": [0.1, -0.1, 0]},
                {"name": "LeftLeg", "translation": [0, -0.4, 0], "scale": [1, 1, 1]},
            ],
            "skins": [{"joints": [0, 1, 2]}],
            "buffers": [{"byteLength": len(data)}],
            "bufferViews": views,
            "accessors": accessors,
            "animations": [
                {
                    "name": "move",
                    "samplers": [{"input": 0, "output": output, "interpolation": interpolation} for output in [1, 2]],
                    "channels": [
                        {"sampler": output - 1, "target": {"node": node, "path": path}}
                        for node, path, output in channels
                    ],
                }
            ],
        }
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(data)
        header = struct.pack("<4sII", b"glTF", 2, length)
        yield header + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data


def mappings():
    """Of the figure that the target knows, bodies a and b, and one that ships."""
    part = {"joint": "LeftLeg", "toward": "Hips", "share": 0.5, "rotation": 1, "position": 2, "rest": [1, 0, 0, 0]}
    small = {"mapping": 1, "model": "m", "hips": ["a", "b"], "soles": ["b"], "smooth": 0.5}
    yield json.dumps({**small, "parts": {"a": {"joint": "Hips"}, "b": part}})
    yield json.dumps({**small, "parts": {"a": {"joint": "root"}, "b": {"joint": "left_hip"}}})
    yield (MOTIONS / "mappings/walker2d.json").read_text()


def train(folder):
    """Train a small policy with each algorithm in a folder of its own, if there is the program."""
    for algorithm in ["ppo", "a2c", "acktr", "sac"] if PROGRAM.exists() else []:
        words = ["train", "hopper", "--algo", algorithm, "--agents", "16", "--steps", "640", "--threads", "1"]
        words += ["--set", "network.hidden=[4]", "--out", folder / algorithm]
        subprocess.run([PROGRAM, *words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def policies(runs):
    """Small policies without their checksums, which would refuse every change."""
    for path in [*runs.glob("*/policy.safetensors"), POLICIES / "hopper.safetensors", POLICIES / "TerrainWalker2d.safetensors"]:
        data = path.read_bytes()
        (length,) = struct.unpack("<Q", data[:8])
        header = re.sub(rb',\\"checksum\\":\\"[0-9a-f]{16}\\"', b"", data[8 : 8 + length])
        yield struct.pack("<Q", len(header)) + header + data[8 + length :]


def program(runs, ending, *words):
    """The file that the program writes for a small policy."""
    if PROGRAM.exists():
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / f"seed.{ending}"
            policy = runs / "ppo/policy.safetensors"
            subprocess.run([PROGRAM, words[0], policy, *words[1:], "--out", out], check=True, stdout=subprocess.DEVNULL)
            yield out.read_bytes()


def configurations():
    """Yield the configurations that ship."""
    for path in (HERE.parent / "assets/configs").glob("*.yaml"):
        yield path.read_bytes()


def tables(runs):
    """Rows of small runs."""
    yield from (path.read_bytes() for path in runs.glob("*/progress.csv"))
    yield b"iteration,a\n1,\n2,1\n3,1.5\n"


def castagnoli(data):
    """CRC-32C, masked as TFRecord does."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    crc ^= 0xFFFFFFFF
    return ((crc >> 15 | crc << 17) + 0xA282EAD8) & 0xFFFFFFFF


def events():
    """Records with steps."""
    record = b""
    for step in [1, 4, 9]:
        data = b"\x09" + bytes(8) + bytes([0x10, step]) + b"*\x05\n\x03\n\x01a"
        length = struct.pack("<Q", len(data))
        record += length + struct.pack("<I", castagnoli(length)) + data + struct.pack("<I", castagnoli(data))
    yield record


def descriptions(runs, name):
    """Descriptions of runs or checkpoints without their checksums."""
    for path in runs.glob(f"*/{name}"):
        document = json.loads(path.read_text())
        document.pop("checksum", None)
        yield json.dumps(document, indent=1)


def meshes():
    """A tetrahedron and a cube with quads, in each format and with each rule of inertia."""
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    stl = bytes(80) + struct.pack("<i", 4)
    stl += b"".join(struct.pack("<12f2x", 0, 0, 0, *points[a], *points[b], *points[c]) for a, b, c in faces)
    flat = [x for row in points for x in row], [i for row in faces for i in row]
    msh = struct.pack("<4i12f12i", 4, 0, 0, 4, *flat[0], *flat[1])
    corners = "".join(f"v {x} {y} {z}\n" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1.5))
    quads = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "-7 -3 -1/1 -5//2"]
    obj = (corners + "o cube\n" + "".join(f"f {quad}\n" for quad in quads)).encode()
    for form, data in enumerate([stl, obj, msh]):
        for rule in range(4):
            yield bytes([form, rule]) + data


def main():
    """Writes all seeds."""
    folder = HERE / "corpus/mesh"
    folder.mkdir(parents=True, exist_ok=True)
    for i, seed in enumerate(meshes()):
        (folder / f"seed-{i}").write_bytes(seed)
    write("motion", [clips(), bvh(), deep_mimic(), glb(), mappings()])
    with tempfile.TemporaryDirectory() as folder:
        runs = Path(folder)
        train(runs)
        network, demonstration = program(runs, "onnx", "export"), program(runs, "demo", "record-demo", "--episodes", "1")
        files = [policies(runs), network, configurations(), demonstration, tables(runs), events()]
        write("files", [*files, descriptions(runs, "run.json"), descriptions(runs, "checkpoint/checkpoint.json")])


def write(target, kinds):
    """A folder for each kind."""
    for number, seeds in enumerate(kinds):
        folder = HERE / f"corpus/{target}-{number}"
        folder.mkdir(parents=True, exist_ok=True)
        for i, seed in enumerate(seeds):
            (folder / f"seed-{i}").write_bytes(bytes([number]) + (seed if isinstance(seed, bytes) else seed.encode()))


if __name__ == "__main__":
    main()
