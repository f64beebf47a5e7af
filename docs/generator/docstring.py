"""Docstrings as Markdown."""

import ast
import re
from textwrap import dedent

from generator.markdown import block, table

_SECTION = re.compile(r"(Args|Returns|Raises):$")
_ARGUMENT = re.compile(r"(\*{0,2}\w+): (.*)")


def docstring(node: ast.Module | ast.ClassDef | ast.FunctionDef) -> str:
    """Docstring of a definition, or an empty text."""
    return ast.get_docstring(node) or ""


def in_line(text: str) -> str:
    """A docstring in one line."""
    return " ".join(line for line in markdown(text) if line)


def summary(text: str) -> str:
    """First sentence of a docstring."""
    paragraph = " ".join(text.split("\n\n", 1)[0].split())
    return re.split(r"(?<=\.) (?=[A-Z])", _plain(paragraph), maxsplit=1)[0]


def markdown(text: str) -> list[str]:
    """Lines of a docstring with its arguments as a table and its sessions as blocks. Ends with an empty line."""
    lines: list[str] = []
    paragraphs = re.split(r"\n(?:[ \t]*\n)+", text.strip("\n"))
    for paragraph in paragraphs:
        rows = paragraph.split("\n")
        section = _SECTION.match(rows[0])
        if not paragraph.strip():
            continue
        if section and section[1] == "Args":
            lines += table(["argument", "meaning"], _arguments(rows[1:]))
        elif section:
            lines += [f"{section[1]}: {_plain(' '.join(row.strip() for row in rows[1:]))}", ""]
        elif rows[0].strip().startswith((">>> ", "$ ")):
            lines += block("pycon" if rows[0].strip().startswith(">") else "text", dedent(paragraph))
        elif all(row.startswith("    ") for row in rows):
            lines += block("text", dedent(paragraph))
        else:
            lines += [*map(_plain, rows), ""]
    return lines


def _arguments(rows: list[str]) -> list[tuple[str, str]]:
    """Names and meanings of arguments; a meaning may go on in the lines below, further in."""
    pairs: list[tuple[str, str]] = []
    for row in dedent("\n".join(rows)).split("\n"):
        if (found := _ARGUMENT.match(row)) and not row.startswith(" "):
            pairs.append((f"`{found[1]}`", found[2]))
        elif pairs:
            pairs[-1] = (pairs[-1][0], f"{pairs[-1][1]} {row.strip()}")
    return [(name, _plain(text[:1].upper() + text[1:])) for name, text in pairs]


def _plain(text: str) -> str:
    """Text with inline code of one kind."""
    return re.sub(r"``([^`]+)``", r"`\1`", text)
