"""Code blocks of Markdown pages, and the comments above them that tell the test what to do."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

RUNS = ("python", "sh", "yaml")
"""Languages that the test runs."""
MISNAMED = {"bash": "sh", "shell": "sh", "console": "sh", "zsh": "sh", "python3": "python", "yml": "yaml"}
"""Languages that look as if the test ran them, and the names to use."""

_FENCE = re.compile(r"^( *(?:[-*+] +|\d+[.)] +)?)(`{3,}|~{3,})\s*([^`]*)$")
_MARKER = re.compile(r"^<!--\s*test:\s*(skip|long|file|task)\b[\s,:]*(.*?)\s*-->$")


class MarkupError(Exception):
    """A page that the test cannot read; the first argument is the line."""

    def __init__(self, line: int, problem: str) -> None:
        super().__init__(line, problem)
        self.line, self.problem = line, problem


@dataclass(frozen=True)
class Block:
    """A fenced block of code."""

    line: int
    """Line of the first line of code in the page, from 1."""
    language: str
    code: str
    skip: str | None = None
    """Reason not to run the block."""
    long: bool = False
    """Takes more than 20 s; runs with --long."""
    file: str | None = None
    """Name of the file in the page's folder that the block is written to."""
    task: str | None = None
    """Task of a configuration."""


def blocks(text: str) -> Iterator[Block]:
    """Fenced blocks of a page in their order. Blocks inside of list items lose the indentation of their fence."""
    lines = text.splitlines()
    markers: dict[str, str] = {}
    number = 0
    while number < len(lines):
        line = lines[number]
        number += 1
        fence = _FENCE.match(line)
        if marker := _MARKER.match(line.strip()):
            markers[marker[1]] = marker[2]
        elif fence:
            first, indent = number, len(fence[1])
            end = re.compile(rf"^ *{re.escape(fence[2][0])}{{{len(fence[2])},}} *$")
            while number < len(lines) and not end.match(lines[number]):
                number += 1
            if number == len(lines):
                raise MarkupError(first, "the fence has no end")
            code = [row[indent:] if not row[:indent].strip() else row for row in lines[first:number]]
            number += 1
            yield _block(first, fence[3], code, markers)
            markers = {}
        elif markers:
            raise MarkupError(number - 1, "a comment 'test: ...' must be directly above a code block")


def _block(first: int, info: str, code: list[str], markers: dict[str, str]) -> Block:
    """Check and return the block whose code begins after line `first`."""
    language = re.split(r"[\s,{]", info.strip(), maxsplit=1)[0].lower()
    if language in MISNAMED:
        raise MarkupError(first, f"the language is '{language}', expected '{MISNAMED[language]}'")
    for name in ("skip", "file", "task"):
        if markers.get(name) == "":
            expected = {"skip": "a reason", "file": "a name", "task": "a task"}[name]
            raise MarkupError(first - 1, f"'test: {name}' needs {expected}")
    return Block(
        line=first + 1,
        language=language,
        code="\n".join(code) + "\n",
        skip=markers.get("skip"),
        long="long" in markers,
        file=markers.get("file"),
        task=markers.get("task"),
    )
