"""Reads the help of a command, as clap prints it."""

import os
import re
import subprocess
from dataclasses import dataclass, field
from itertools import takewhile

_SECTION = re.compile(r"^(\w[\w ]*):$")
_DEFAULT = re.compile(r"\s*\[default: ([^\]]*)\]")
_VALUES = re.compile(r"\s*\[possible values: ([^\]]*)\]")


@dataclass
class Entry:
    """A command, argument or option."""

    name: str
    """As it is written, such as `--steps <N>`."""
    text: str = ""
    default: str = ""
    values: list[tuple[str, str]] = field(default_factory=list)
    """Values that an option takes, each with its meaning if it has one."""


@dataclass
class Help:
    """Help of a command."""

    about: str
    usage: str
    sections: dict[str, list[Entry]]
    """Commands, arguments and options by the heading above them."""
    notes: list[list[str]]
    """What follows, in paragraphs of lines."""


def read(program: str, path: tuple[str, ...]) -> Help:
    """Help of a command, such as `("config", "show")`."""
    wide = {**os.environ, "COLUMNS": "100000"}
    done = subprocess.run([program, *path, "--help"], capture_output=True, text=True, check=True, env=wide)
    return parse(done.stdout)


def parse(text: str) -> Help:
    """Take a help text apart."""
    about, _, rest = text.partition("\nUsage: ")
    usage, _, rest = rest.partition("\n")
    lines = rest.split("\n")
    sections: dict[str, list[Entry]] = {}
    while lines:
        while lines and not lines[0].strip():
            lines.pop(0)
        heading = _SECTION.match(lines[0]) if lines else None
        body = list(takewhile(lambda line: not line or line.startswith(" "), lines[1:])) if heading else []
        if not heading or not _lists_entries(heading[1], body):
            break
        sections[heading[1]] = _entries(body)
        lines = lines[1 + len(body) :]
    return Help(about.strip(), usage.strip(), sections, _paragraphs(lines))


def _lists_entries(heading: str, body: list[str]) -> bool:
    """Whether a section has commands, arguments or options, not examples or other text."""
    first = next((line.strip() for line in body if line.strip()), "")
    return heading in ("Commands", "Arguments") or first.startswith("-")


def _entries(body: list[str]) -> list[Entry]:
    """Entries of a section. Their text is in the same line, or in the lines below and further in."""
    entries: list[Entry] = []
    for line in body:
        indent = len(line) - len(line.lstrip())
        value = re.match(r" {10,}- ([\w.-]+)(?:: (.*))?$", line)
        if value and entries:
            entries[-1].values.append((value[1], value[2] or ""))
        elif line.strip() and indent < 10:
            name, _, text = line.strip().partition("  ")
            entries.append(Entry(name, text.strip()))
        elif line.strip() and line.strip() != "Possible values:":
            entries[-1].text = f"{entries[-1].text} {line.strip()}".strip()
    for entry in entries:
        if default := _DEFAULT.search(entry.text):
            entry.default = default[1]
            entry.text = _DEFAULT.sub("", entry.text)
        if values := _VALUES.search(entry.text):
            entry.values = [(value, "") for value in values[1].split(", ")]
            entry.text = _VALUES.sub("", entry.text)
    return entries


def _paragraphs(lines: list[str]) -> list[list[str]]:
    """Groups of lines between empty ones."""
    groups: list[list[str]] = [[]]
    for line in lines:
        if line.strip():
            groups[-1].append(line.rstrip())
        elif groups[-1]:
            groups.append([])
    return [group for group in groups if group]
