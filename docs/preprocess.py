#!/usr/bin/env python3
"""Preprocessor of mdBook: links to files that are not in the book become addresses of the repository.

The pages link to files of the repository by relative paths, such as `../crates/learn/src/lib.rs`, which work on GitHub
and in editors. The book has no such files. mdBook calls this script while it builds the book, see `book.toml`.
"""

import json
import re
import sys
from collections.abc import Iterator
from os import path
from pathlib import Path, PurePosixPath
from typing import Any

BRANCH = "main"
MEDIA = {".gif", ".jpeg", ".jpg", ".mp4", ".png", ".svg", ".webm", ".webp"}
"""Files that pages show; their addresses are those of the bytes."""
SOURCES = {".md", ".py", ".sh", ".toml"}
"""Files in the folder of the documentation that the book lacks, if they are not among its pages."""

Chapter = dict[str, Any]

_FENCE = re.compile(r"^ *(?:[-*+] +|\d+[.)] +)?(`{3,}|~{3,})")
# inline code; or the target of a link, of a definition, or of an attribute
_TARGET = re.compile(
    r"(?P<code>(?P<ticks>`+)(?!`).+?(?<!`)(?P=ticks)(?!`))"
    r"|(?P<before>\]\(<?|^ {0,3}\[[^\]]+\]: *<?|\b(?:href|src|poster)=\")(?P<target>[^\s()<>\"]+)"
)


class Links:
    """Addresses of what the book does not have."""

    def __init__(self, docs: Path, pages: set[str], repository: str) -> None:
        """Take the folder of the documentation, its pages in the book, and the address of the repository."""
        self._docs, self._pages, self._repository = docs, pages, repository.rstrip("/")

    def rewritten(self, target: str, page: str) -> str:
        """Return what a link in a page leads to in the book."""
        file, hash_sign, anchor = target.partition("#")
        if not file or file.startswith("/") or re.match(r"[a-z][a-z0-9+.-]*:", file, re.IGNORECASE):
            return target
        inside = path.normpath(path.join(path.dirname(page), file))
        if self._in_book(inside):
            return target
        in_repository = PurePosixPath(path.normpath(path.join(self._docs.name, inside)))
        if in_repository.parts[:1] == ("..",):
            raise ValueError(f"docs/{page}: '{target}' leads out of the repository")
        kind = "raw" if in_repository.suffix.lower() in MEDIA else "blob"
        kind = "tree" if (self._docs / inside).is_dir() else kind
        return f"{self._repository}/{kind}/{BRANCH}/{in_repository}{hash_sign}{anchor}"

    def _in_book(self, inside: str) -> bool:
        """Whether the book has a file of the folder of the documentation."""
        if inside in self._pages:
            return True
        leaves = PurePosixPath(inside).parts[0] == ".."
        return not leaves and PurePosixPath(inside).suffix not in SOURCES and not (self._docs / inside).is_dir()

    def page(self, text: str, page: str) -> str:
        """Return the text of a page with its links rewritten; blocks of code stay."""

        def replace(found: re.Match[str]) -> str:
            return found[0] if found["code"] else found["before"] + self.rewritten(found["target"], page)

        lines, fence = [], ""
        for line in text.split("\n"):
            marker = _FENCE.match(line)
            if fence:
                fence = "" if line.strip().startswith(fence) and not line.strip().strip(fence[0]) else fence
            elif marker:
                fence = marker[1]
            else:
                lines.append(_TARGET.sub(replace, line))
                continue
            lines.append(line)
        return "\n".join(lines)


def chapters(items: list[Any]) -> Iterator[Chapter]:
    """All chapters that are pages, with those inside of others."""
    for item in items:
        if isinstance(item, dict) and "Chapter" in item:
            chapter = item["Chapter"]
            if chapter["path"]:
                yield chapter
            yield from chapters(chapter["sub_items"])


def main() -> None:
    """Rewrite the book of the standard input, or answer whether a renderer is supported."""
    if sys.argv[1:2] == ["supports"]:
        sys.exit(0 if sys.argv[2:] == ["html"] else 1)
    context, book = json.load(sys.stdin)
    config = context["config"]
    docs = (Path(context["root"]) / config["book"].get("src", "src")).resolve()
    pages = list(chapters(book["items"]))
    repository = config["output"]["html"]["git-repository-url"]
    links = Links(docs, {chapter["path"] for chapter in pages}, repository)
    for chapter in pages:
        chapter["content"] = links.page(chapter["content"], chapter["source_path"] or chapter["path"])
    json.dump(book, sys.stdout)


if __name__ == "__main__":
    main()
