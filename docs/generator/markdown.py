"""Pieces of Markdown."""

import re
from collections import Counter
from collections.abc import Sequence


def cell(text: str) -> str:
    """Text for a cell of a table."""
    return re.sub(r"\s+", " ", text).strip().replace("|", r"\|")


def code(text: str) -> str:
    """Inline code. Empty for an empty text."""
    return f"`` {text} ``" if "`" in text else f"`{text}`" if text else ""


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """A table and an empty line; columns without entries are left out."""
    filled = [i for i in range(len(heads)) if any(row[i] for row in rows)]
    lines = ["| " + " | ".join(heads[i] for i in filled) + " |", "|" + "---|" * len(filled)]
    lines += ["| " + " | ".join(cell(row[i]) for i in filled) + " |" for row in rows]
    return [*lines, ""] if rows else []


def block(language: str, text: str) -> list[str]:
    """A block of code and an empty line."""
    return [f"```{language}", *text.strip("\n").split("\n"), "```", ""]


def anchor(title: str) -> str:
    """Anchor of a heading, as GitHub and mdBook make it."""
    return re.sub(r"[^\w-]", "", title.lower().replace(" ", "-"))


class Anchors:
    """Anchors of a page: headings of the same text have numbers."""

    def __init__(self, title: str) -> None:
        """Begin with the title of the page."""
        self._count = Counter([anchor(title)])

    def add(self, title: str) -> str:
        """Take in the next heading and return its anchor."""
        name = anchor(title)
        number = self._count[name]
        self._count[name] += 1
        return f"{name}-{number}" if number else name
