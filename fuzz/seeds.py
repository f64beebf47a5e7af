#!/usr/bin/env python3
"""Writes seeds for the target `motion`: small files of each format, with a byte before them, in corpus/motion-0 to -4.

Few bytes make a file of a format out of nothing; what is whole can be changed. Needs no packages.
"""

import json
import math
import struct
from pathlib import Path

HERE = Path(__file__).parent
MOTIONS = HERE.parent / "assets/motions"


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


def main():
    """Writes all seeds."""
    for number, seeds in enumerate([clips(), bvh(), deep_mimic(), glb(), mappings()]):
        folder = HERE / f"corpus/motion-{number}"
        folder.mkdir(parents=True, exist_ok=True)
        for i, seed in enumerate(seeds):
            (folder / f"seed-{i}").write_bytes(bytes([number]) + (seed if isinstance(seed, bytes) else seed.encode()))


if __name__ == "__main__":
    main()
