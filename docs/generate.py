#!/usr/bin/env python3
"""Writes docs/reference/{cli,python,python-modules}.md and docs/images/speed.svg from their sources.

    docs/generate.py --program target/release/marathon            write the pages
    docs/generate.py --program target/release/marathon --check    fail if a page is out of date

The page of the command line comes from `marathon --help`, those of Python from the types and docstrings of the package,
and the chart from the table of the README.
"""

import argparse
import sys
from difflib import unified_diff
from pathlib import Path

from generator import cli_page, python_page, speed_chart

DOCS = Path(__file__).resolve().parent


def difference(path: Path, text: str) -> str:
    """First lines that differ between a page and its new text."""
    old = path.read_text("utf-8") if path.exists() else ""
    name = str(path.relative_to(DOCS.parent))
    return "\n".join(list(unified_diff(old.splitlines(), text.splitlines(), name, f"{name}, new", lineterm=""))[:20])


def main() -> None:
    """Write or check the pages."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="the program `marathon`")
    parser.add_argument("--check", action="store_true", help="fail if a page is out of date")
    options = parser.parse_args()
    package = DOCS.parent / "python/marathon_rl"
    pages = {
        DOCS / "reference/cli.md": cli_page.page(options.program),
        DOCS / "reference/python.md": python_page.page(package),
        DOCS / "reference/python-modules.md": python_page.modules_page(package),
        DOCS / "images/speed.svg": speed_chart.svg(DOCS.parent / "README.md"),
    }
    if not options.check:
        for path, text in pages.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, "utf-8")
        return
    differences = [found for path, text in pages.items() if (found := difference(path, text))]
    if differences:
        sys.exit("\n\n".join([*differences, "out of date; run docs/generate.py --program PATH"]))


if __name__ == "__main__":
    main()
