#!/usr/bin/env python3
"""Runs the code blocks of the documentation and the notebooks, page by page, each page in an empty folder.

    tests/docs/run.py --program target/release/marathon --python .venv/bin/python
    tests/docs/run.py docs/tutorials/python.md          only some pages or notebooks
    tests/docs/run.py --long                            also blocks that take minutes

Blocks of a page run in their order: `python` in one process, `sh` with `bash -e`, and `yaml` is read by
`marathon config show TASK --config FILE`. Comments directly above a block:

    <!-- test: skip, REASON -->    does not run
    <!-- test: long -->            runs with --long alone, for at most 600 s; other blocks run for at most 240 s
    <!-- test: file NAME -->       is written to a file of the page's folder; for any language
    <!-- test: task TASK -->       task of a configuration; without, the first one that it names, or the hopper
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from blocks import RUNS, Block, MarkupError, blocks
from executors import PythonSession, Tools, configuration, shell
from notebooks import cells

ROOT = Path(__file__).resolve().parents[2]
LIMIT, LONG_LIMIT = 240.0, 600.0
SLOW = 20.0
"""Seconds after which a block is to have the mark of long ones."""
NOTEBOOK = ".ipynb"


@dataclass
class Report:
    """Results of all pages."""

    failures: list[str] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)
    slow: list[str] = field(default_factory=list)
    """Blocks without a mark that took long."""
    ran: int = 0


def all_pages() -> list[Path]:
    """README, the documentation, the README of the Bevy plugin, and the notebooks."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), ROOT / "crates/bevy_marathon/README.md"]
    return pages + sorted((ROOT / "examples/notebooks").glob(f"*{NOTEBOOK}"))


def given_pages(names: Iterable[Path]) -> list[Path]:
    """Pages by their names; a folder stands for all pages in it."""
    pages: list[Path] = []
    for name in names:
        inside = sorted(p for p in name.rglob("*") if p.suffix in (".md", NOTEBOOK)) if name.is_dir() else [name]
        pages += [page.resolve() for page in inside]
    return pages


def read(page: Path) -> list[Block]:
    """Blocks of a page, or cells of a notebook."""
    return list(cells(page) if page.suffix == NOTEBOOK else blocks(page.read_text("utf-8")))


class Page:
    """Runs the blocks of a page in an empty folder."""

    def __init__(self, name: str, tools: Tools, notebook: bool) -> None:
        """Make the folder."""
        self._name, self._tools, self._notebook = name, tools, notebook
        self._scratch = Path(tempfile.mkdtemp(prefix="marathon-docs-"))
        self._folder = self._scratch / "page"
        self._folder.mkdir()
        self._environment = tools.environment(self._scratch / "bin")
        self._session: PythonSession | None = None

    def run(self, block: Block) -> str | None:
        """Run a block; return the problem."""
        limit = LONG_LIMIT if block.long else LIMIT
        if block.file is not None:
            path = self._folder / block.file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.code)
        if block.language == "yaml":
            return configuration(block, self._folder, self._environment, limit)
        if block.language == "sh" and block.file is None:
            return shell(block, self._folder, self._environment, limit)
        if block.language == "python" and block.file is None:
            return self._python(block, limit)
        return None

    def _python(self, block: Block, limit: float) -> str | None:
        """Run a block in the page's interpreter. Cells of a notebook count their lines from 1 each."""
        self._session = self._session or PythonSession(self._tools.python, self._folder, self._environment)
        name, line = (f"{self._name}:{block.line}", 1) if self._notebook else (self._name, block.line)
        return self._session.run(block.code, name, line, limit)

    def close(self) -> None:
        """End the interpreter and delete the folder."""
        if self._session is not None:
            self._session.release()
        shutil.rmtree(self._scratch, ignore_errors=True)


def run_page(path: Path, tools: Tools, long: bool, report: Report) -> None:
    """Run all blocks of a page and note the results."""
    name = str(path.relative_to(ROOT)) if path.is_relative_to(ROOT) else str(path)
    start, before, left_out = time.monotonic(), len(report.failures), 0
    try:
        chosen = [block for block in read(path) if block.language in RUNS or block.file]
    except MarkupError as error:
        report.failures.append(f"{name}:{error.line}: {error.problem}")
        chosen = []
    page = Page(name, tools, path.suffix == NOTEBOOK)
    try:
        for block in chosen:
            place = f"{name}:{block.line}"
            if block.skip is not None:
                report.skipped.append(f"{place}: {block.skip}")
            elif block.long and not long:
                report.skipped.append(f"{place}: long")
                left_out = left_out or block.line
            else:
                report.ran += 1
                begun = time.monotonic()
                problem = page.run(block)
                seconds = time.monotonic() - begun
                if seconds > SLOW and not block.long:
                    report.slow.append(f"{place}: {seconds:.0f} s")
                if problem and left_out:
                    report.skipped.append(f"{place}: it needs the long block of line {left_out}")
                elif problem:
                    report.failures.append(f"{place}: {block.language}: {problem}")
    finally:
        page.close()
    failed = len(report.failures) > before
    if chosen or failed:
        seconds = time.monotonic() - start
        state = "FAILED" if failed else "ok"
        print(f"{name}: {len(chosen)} blocks, {seconds:.1f} s: {state}", flush=True)


def check_tools(tools: Tools) -> None:
    """End with a message if a program is missing."""
    if not tools.program.is_file():
        sys.exit(f"{tools.program} does not exist; cargo build --release, or --program PATH")
    done = subprocess.run([tools.python, "-c", "import marathon_rl"], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{tools.python} cannot import marathon_rl; pip install ., or --python PATH\n{done.stderr.strip()}")


def main() -> None:
    """Run the pages of the command line and report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="*", type=Path, metavar="PAGE", help="page, notebook or folder [default: all]")
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/marathon", help="the program `marathon`")
    parser.add_argument("--python", type=Path, default=Path(sys.executable), help="interpreter with `marathon_rl`")
    parser.add_argument("--long", action="store_true", help="also run blocks that take minutes")
    options = parser.parse_args()
    tools = Tools(options.program.resolve(), options.python.absolute())
    check_tools(tools)
    report = Report()
    for page in given_pages(options.pages) or all_pages():
        run_page(page, tools, options.long, report)
    for failure in report.failures:
        print(f"\n{failure}")
    for title, entries in (("slow, to be marked as long", report.slow), ("skipped", report.skipped)):
        if entries:
            print("\n  ".join([f"\n{title}:", *entries]))
    print(f"\n{report.ran} blocks ran, {len(report.failures)} failed, {len(report.skipped)} were skipped")
    sys.exit(1 if report.failures else 0)


if __name__ == "__main__":
    main()
