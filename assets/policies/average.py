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
    """A safetensors file: its beginning as it is, the header in it, and the numbers behind."""
    with open(path, "rb") as file:
        data = file.read()
    begin = 8 + struct.unpack("<Q", data[:8])[0]
    return data[:begin], json.loads(data[8:begin]), data[begin:]


def main(out, *paths):
    files = [read(path) for path in paths]
    beginning, header, last = files[-1]
    mean = bytearray(last)
    for name, tensor in header.items():
        if name == "__metadata__":
            continue
        if tensor["dtype"] != "F32":
            sys.exit(f"{paths[-1]}: {name} is {tensor['dtype']}, expected F32")
        rows = []
        for path, (_, other, data) in zip(paths, files, strict=True):
            if name not in other or other[name]["shape"] != tensor["shape"]:
                sys.exit(f"{path}: {name} is not as in {paths[-1]}, expected policies of one run")
            begin, end = other[name]["data_offsets"]
            rows.append(array.array("f", data[begin:end]))
        begin, end = tensor["data_offsets"]
        mean[begin:end] = array.array("f", (sum(x) / len(x) for x in zip(*rows, strict=True))).tobytes()
    with open(out, "wb") as file:
        file.write(beginning + mean)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
