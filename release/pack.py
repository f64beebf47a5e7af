#!/usr/bin/env python3
"""Packs files into an archive, the same bytes for the same files: pack.py ARCHIVE SOURCE=NAME ...

ARCHIVE ends in .tar.gz or .zip, and its name without this ending is the folder inside. NAME is a path in that folder.
All entries have the time of SOURCE_DATE_EPOCH.
"""

import gzip
import io
import os
import sys
import tarfile
import time
import zipfile
from pathlib import Path


def mode(source):
    """Permissions of an entry."""
    return 0o755 if os.access(source, os.X_OK) and source.suffix in {"", ".exe", ".sh"} else 0o644


def tar(out, entries, when):
    """Writes a .tar.gz."""
    with gzip.GzipFile("", "wb", mtime=when, fileobj=out) as packed, tarfile.open(fileobj=packed, mode="w") as archive:
        for name, source in entries:
            data = source.read_bytes()
            info = tarfile.TarInfo(name)
            info.size, info.mtime, info.mode = len(data), when, mode(source)
            archive.addfile(info, io.BytesIO(data))


def pack_zip(out, entries, when):
    """Writes a .zip."""
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, source in entries:
            info = zipfile.ZipInfo(name, time.gmtime(when)[:6])
            info.compress_type, info.external_attr = zipfile.ZIP_DEFLATED, mode(source) << 16
            archive.writestr(info, source.read_bytes())


def main(target, *pairs):
    """Writes the archive under a temporary name, and renames it."""
    target, when = Path(target), int(os.environ["SOURCE_DATE_EPOCH"])
    zipped = target.suffix == ".zip"
    folder = target.name.removesuffix(".zip" if zipped else ".tar.gz")
    split = (pair.rsplit("=", 1) for pair in pairs)
    entries = sorted((f"{folder}/{name}", Path(source)) for source, name in split)
    part = target.with_name(target.name + ".part")
    with part.open("wb") as out:
        (pack_zip if zipped else tar)(out, entries, when)
    part.replace(target)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
