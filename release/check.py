#!/usr/bin/env python3
"""Checks products of a release: check.py [--static] [--forbid PATH ...] FILE ...

Every file must have the licenses, and no file may contain one of the forbidden paths, such as the folder of the build.
Wheels must be for the stable interface of Python 3.11. With --static, programs must be for Linux and need no libraries.
"""

import argparse
import struct
import sys
import tarfile
import zipfile
from pathlib import Path


def members(path):
    """Names and contents of an archive."""
    if path.suffix in {".whl", ".zip"}:
        with zipfile.ZipFile(path) as archive:
            for name in archive.namelist():
                yield name, archive.read(name)
    else:
        with tarfile.open(path) as archive:
            for member in archive:
                if member.isfile():
                    yield member.name, archive.extractfile(member).read()


def segments(data):
    """Types of the program headers of a 64-bit ELF file."""
    (start,) = struct.unpack_from("<Q", data, 32)
    size, count = struct.unpack_from("<HH", data, 54)
    return [struct.unpack_from("<I", data, start + i * size)[0] for i in range(count)]


def problems(path, forbidden, static):
    """Sentences about all that is wrong with a product."""
    names = []
    for name, data in members(path):
        names.append(Path(name).name)
        for word in forbidden:
            if word.encode() in data:
                yield f"{name} contains the path {word}"
        if static and "." not in Path(name).name and not name.rpartition("/")[2].startswith("LICENSE"):
            if not data.startswith(b"\x7fELF\x02\x01"):
                yield f"{name} is no program for 64-bit Linux"
            elif 3 in segments(data):  # PT_INTERP
                yield f"{name} is not static: it names a dynamic loader"
    for text in ["LICENSE-MIT", "LICENSE-APACHE"]:
        if text not in names:
            yield f"has no {text}"
    if path.suffix == ".whl" and "-cp311-abi3-" not in path.name:
        yield "is not for the stable interface of Python 3.11 (cp311-abi3)"
    sdist = path.name.startswith("marathon_rl-") and path.name.endswith(".tar.gz")
    if not sdist and "THIRD-PARTY-LICENSES.txt" not in names:
        yield "has no THIRD-PARTY-LICENSES.txt"


def main():
    """Checks the files of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--static", action="store_true")
    parser.add_argument("--forbid", action="append", default=[])
    parser.add_argument("files", nargs="+", type=Path)
    args = parser.parse_args()
    found = [f"{path.name}: {text}" for path in args.files for text in problems(path, args.forbid, args.static)]
    if found:
        sys.exit("\n".join(found))


if __name__ == "__main__":
    main()
