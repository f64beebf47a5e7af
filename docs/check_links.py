#!/usr/bin/env python3
"""Checks the built book without a network: links, images and anchors of every page lead somewhere.

    docs/check_links.py                 the book in target/book, as docs/serve.sh --build makes it
    docs/check_links.py FOLDER

Addresses of files in the repository are looked up in this checkout. Other addresses are not checked.
"""

import argparse
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urljoin, urlsplit

ROOT = Path(__file__).resolve().parents[1]
ATTRIBUTES = {"href", "poster", "src"}


@dataclass
class Page(HTMLParser):
    """Anchors and links of a page of HTML."""

    anchors: set[str] = field(default_factory=set)
    links: list[tuple[int, str]] = field(default_factory=list)
    """Line and target of each link."""
    base: str = ""
    """Address that links are relative to, if it is not the page's own."""

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element."""
        for name, value in attrs:
            if value and (name == "id" or (name == "name" and tag == "a")):
                self.anchors.add(value)
            elif value and name == "href" and tag == "base":
                self.base = value
            elif value is not None and name in ATTRIBUTES:
                self.links.append((self.getpos()[0], value.strip()))


@cache
def read(file: Path) -> Page:
    """Parse a page."""
    page = Page()
    page.feed(file.read_text("utf-8"))
    page.close()
    return page


def repository() -> str:
    """Address of the repository."""
    config = tomllib.loads((ROOT / "docs/book.toml").read_text("utf-8"))
    address: str = config["output"]["html"]["git-repository-url"]
    return address.rstrip("/")


def problem(book: Path, file: Path, target: str, address: str) -> str | None:
    """Return why a link of a page leads nowhere."""
    in_repository = re.match(rf"{re.escape(address)}/(blob|tree|raw|edit)/[^/]+/([^#?]*)", target)
    if in_repository:
        kind, name = in_repository[1], unquote(in_repository[2])
        found = (ROOT / name).is_dir() if kind == "tree" else (ROOT / name).is_file()
        return None if found else "the repository has no such file"
    parts = urlsplit(target)
    if parts.scheme or parts.netloc:
        return None
    # the book's folder is the root of its addresses
    here = "/" + file.relative_to(book).as_posix()
    here = here if target.startswith("#") else urljoin(here, read(file).base)
    to = urlsplit(urljoin(here, target))
    goal = book / unquote(to.path).lstrip("/")
    goal = goal / "index.html" if goal.is_dir() else goal
    if not goal.is_file():
        return "there is no such file"
    if not to.fragment or goal.suffix != ".html":
        return None
    return None if unquote(to.fragment) in read(goal).anchors else "there is no such anchor"


def problems(book: Path) -> Iterator[str]:
    """Every link that leads nowhere, with its page and line."""
    address = repository()
    for file in sorted(book.rglob("*.html")):
        for line, target in read(file).links:
            if found := problem(book, file, target, address):
                yield f"{file.relative_to(book)}:{line}: '{target}': {found}"


def main() -> None:
    """Check the book of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("book", nargs="?", type=Path, default=ROOT / "target/book", help="folder of the built book")
    book = parser.parse_args().book.resolve()
    pages = len(list(book.rglob("*.html")))
    if not pages:
        sys.exit(f"{book} has no pages; build the book: docs/serve.sh --build")
    found = list(problems(book))
    print("\n".join([*found, f"{pages} pages, {len(found)} broken links"]))
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
