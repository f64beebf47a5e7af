#!/usr/bin/env python3
"""Prints the licenses of all crates that a program contains: licenses.py PACKAGE TARGET [FEATURE ...]."""

import json
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

TEXT = re.compile(r"(un)?licen[sc]e|copying|copyright|notice|ofl|ufl", re.IGNORECASE)
CODE = {".rs", ".py", ".toml", ".json"}


def cargo(*words):
    """Output of Cargo."""
    return subprocess.run(["cargo", *words], capture_output=True, check=True, text=True).stdout


def texts(folder):
    """License files of a crate."""
    for path in sorted(folder.rglob("*")):
        below = path.relative_to(folder)
        if path.is_file() and TEXT.match(path.name) and path.suffix not in CODE and "tests" not in below.parts:
            yield path.read_text("utf-8", errors="replace").strip().replace("\r\n", "\n")


def main(package, target, *features):
    """Prints each text once, below the names of its crates."""
    chosen = ["--locked", "--package", package, "--target", target, "--features", ",".join(features)]
    # one line per crate: `name v1.2.3 (more)`
    lines = cargo("tree", *chosen, "--edges", "normal", "--prefix", "none", "--format", "{p}").splitlines()
    used = {tuple(line.split()[:2]) for line in lines if line.strip()}
    crates = json.loads(cargo("metadata", "--locked", "--format-version", "1", "--filter-platform", target))["packages"]
    holders, without, ours = defaultdict(list), [], 0
    for crate in sorted(crates, key=lambda crate: (crate["name"], crate["version"])):
        if (crate["name"], f"v{crate['version']}") not in used:
            continue
        folder = Path(crate["manifest_path"]).parent
        found = list(texts(folder))
        ours += crate["source"] is None
        title = f"{crate['name']} {crate['version']} ({crate['license'] or 'see its text'})"
        for text in dict.fromkeys(found):
            holders[text].append(title)
        if not found:
            without.append(f"{title} {crate['repository'] or ''}".rstrip())
    if ours == 0:
        sys.exit(f"licenses.py: no crate of the workspace among the {len(used)} of {package}")
    print(f"This file has the licenses of the crates that {package} is built from.")
    if without:
        print("\nThese crates ship no license file, only the name of a license:\n")
        print("\n".join(f"  {line}" for line in without))
    for text, titles in sorted(holders.items(), key=lambda pair: pair[1]):
        print("\n" + "=" * 80 + "\n")
        print("\n".join(titles), end="\n\n")
        print(text)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
