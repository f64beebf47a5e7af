#!/usr/bin/env python3
"""Averages the weights of policies that one run has kept, which are near each other: the mean falls less than any of them.

    assets/policies/average.py OUT.safetensors POLICY.safetensors...

The mean has the metadata of the last. Needs no packages.
"""

import array
import json
import struct
import sys


def read(path):
    """Header and numbers of a safetensors file."""
    with open(path, "rb") as file:
        (length,) = struct.unpack("<Q", file.read(8))
        return json.loads(file.read(length)), file.read()


def main(out, *paths):
    files = [read(path) for path in paths]
    header, mean = files[-1][0], bytearray(files[-1][1])
    for name, tensor in header.items():
        if name == "__metadata__":
            continue
        if tensor["dtype"] != "F32":
            sys.exit(f"{paths[-1]}: {name} is {tensor['dtype']}, expected F32")
        rows = []
        for path, (other, data) in zip(paths, files, strict=True):
            if name not in other or other[name]["shape"] != tensor["shape"]:
                sys.exit(f"{path}: {name} is not as in {paths[-1]}, expected policies of one run")
            begin, end = other[name]["data_offsets"]
            rows.append(array.array("f", data[begin:end]))
        begin, end = tensor["data_offsets"]
        mean[begin:end] = array.array("f", (sum(x) / len(x) for x in zip(*rows, strict=True))).tobytes()
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    with open(out, "wb") as file:
        file.write(struct.pack("<Q", len(text)) + text + mean)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
