#!/usr/bin/env python3
"""Lists files that published crates include from outside of their folder, which `cargo package` would leave out.

Modules that only documentation tests compile do not count: the registry does not compile them.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

DOCTESTS = re.compile(r"^#\[cfg\([^\n]*\bdoctest\b[^\n]*\)\]\nmod \w+ \{\n.*?^\}\n", re.MULTILINE | re.DOTALL)
INCLUDE = re.compile(r'\binclude(?:_str|_bytes)?!\(\s*(?:concat!\(\s*)?"([^"]+)"')


def main():
    """Prints one line per place, and fails if there is one."""
    words = ["cargo", "metadata", "--no-deps", "--offline", "--format-version", "1"]
    metadata = json.loads(subprocess.run(words, capture_output=True, check=True).stdout)
    found = []
    for package in metadata["packages"]:
        if package["publish"] == []:
            continue
        folder = Path(package["manifest_path"]).parent
        for file in sorted((folder / "src").rglob("*.rs")):
            # the lines keep their numbers
            text = DOCTESTS.sub(lambda found: "\n" * found[0].count("\n"), file.read_text("utf-8"))
            for number, line in enumerate(text.splitlines(), 1):
                for path in INCLUDE.findall(line):
                    if not (file.parent / path).resolve().is_relative_to(folder):
                        found.append(f"{file.relative_to(metadata['workspace_root'])}:{number}: {path}")
    if found:
        print("\n".join(found))
        sys.exit(f"{len(found)} files are outside of the crate that includes them; crates.io would not have them")


if __name__ == "__main__":
    main()
