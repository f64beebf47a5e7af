"""The reference of the command line, from the help of all commands."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from textwrap import dedent

from generator import help_text
from generator.help_text import Entry, Help
from generator.markdown import block, code, table

GROUPS = {
    "Train": ("train", "distill", "average", "config"),
    "Evaluate and show": ("eval", "bench", "render", "play", "list"),
    "Convert": ("export", "import", "record-demo"),
    "Motion clips": ("motion",),
    "Skins": ("skin",),
}
"""Commands by their purpose; others follow under "Other commands"."""
NOT_BUILT = ("play",)
"""Commands of programs of their own, which need not be built: another page describes their options."""
INTRODUCTION = """\
# Command line

<!-- Written by docs/generate.py from `marathon --help`; do not edit. -->

`marathon` trains, evaluates and shows policies. This page lists all commands and options.
`marathon COMMAND --help` prints the same text.
Task names work in any case and without a version: `hopper` means `Hopper-v0`.
A policy is a file, or the folder of a run.
"""
PLAY = """\
`marathon play` starts the program `marathon-game` with the same arguments. [Game](game.md) lists its options and keys.
"""


@dataclass(frozen=True)
class Command:
    """A command and its help."""

    path: tuple[str, ...]
    help: Help


def commands(program: str, path: tuple[str, ...], about: str = "") -> Iterator[Command]:
    """A command and all commands below it."""
    if path[-1:] and path[-1] in NOT_BUILT:
        yield Command(path, Help(about, "", {}, []))
        return
    found = help_text.read(program, path)
    yield Command(path, found)
    for entry in found.sections.get("Commands", []):
        if entry.name != "help":
            yield from commands(program, (*path, entry.name), entry.text)


def page(program: str) -> str:
    """Text of the page."""
    root, *rest = commands(program, ())
    common = {entry.name: entry for entry in root.help.sections["Options"]}
    names = [entry.name for entry in root.help.sections["Commands"] if entry.name != "help"]
    grouped = {name for group in GROUPS.values() for name in group}
    groups = {**GROUPS, "Other commands": tuple(name for name in names if name not in grouped)}
    lines = [INTRODUCTION]
    for title, members in groups.items():
        rows = [(_link(c), _sentence(c.help.about)) for c in rest if c.path[0] in members and not _is_group(c)]
        lines += [f"**{title}**", "", *table(["command", "purpose"], rows)] if rows else []
    lines += ["## Common options", "", "Every command takes `--json` and `--help`.", ""]
    lines += _options(list(common.values()), {})
    lines += _notes(root.help.notes)
    for title, members in groups.items():
        chosen = [c for c in rest if c.path[0] in members]
        lines += [f"## {title}", ""] if chosen else []
        for command in sorted(chosen, key=lambda c: members.index(c.path[0])):
            lines += _command(command, common)
    return "\n".join(lines).rstrip() + "\n"


def _is_group(command: Command) -> bool:
    """Whether a command only holds other commands."""
    return "Commands" in command.help.sections


def _link(command: Command) -> str:
    name = " ".join(("marathon", *command.path))
    return f"[{code(name)}](#{name.replace(' ', '-')})"


def _command(command: Command, common: dict[str, Entry]) -> list[str]:
    """Section of a command."""
    found = command.help
    lines = [f"### {' '.join(('marathon', *command.path))}", "", _sentence(found.about), ""]
    if command.path[-1] in NOT_BUILT:
        return [*lines, PLAY]
    if not _is_group(command):
        lines += block("text", found.usage)
    for heading, entries in found.sections.items():
        if heading == "Commands":
            rows = [(code(e.name), _sentence(e.text)) for e in entries if e.name != "help"]
            lines += table(["command", "purpose"], rows)
        elif heading == "Arguments":
            lines += table(["argument", "meaning", "default"], [_row(entry) for entry in entries])
        else:
            lines += _options(entries, common)
    return lines + _notes(found.notes)


def _options(entries: list[Entry], common: dict[str, Entry]) -> list[str]:
    """Table of options without those of all commands."""
    own = [entry for entry in entries if entry.name not in common]
    return table(["option", "meaning", "default"], [_row(entry) for entry in own])


def _row(entry: Entry) -> tuple[str, str, str]:
    """Name, meaning and default of an option."""
    meaning = _sentence(entry.text)
    if any(text for _, text in entry.values):
        values = [f"{code(name)}: {text[:1].lower()}{text[1:]}" for name, text in entry.values]
        meaning += f" {'; '.join(values)}."
    elif entry.values:
        meaning += f" One of {', '.join(code(name) for name, _ in entry.values)}."
    is_code = re.fullmatch(r"[\w./:+-]+(?: [\d.]+)*", entry.default) and not re.fullmatch(r"all|none", entry.default)
    return code(entry.name), meaning, code(entry.default) if is_code else _marked(entry.default)


def _sentence(text: str) -> str:
    """Text with a full stop, and options in it as code."""
    text = _marked(text.strip())
    return text if not text or text[-1] in ".:!?" else f"{text}."


def _marked(text: str) -> str:
    """Text outside of inline code with options and placeholders as code."""
    parts = re.split(r"(`[^`]*`)", text)
    for i in range(0, len(parts), 2):
        parts[i] = re.sub(r"(?<![\w-])--[a-z][\w-]*(?:[ =][A-Z_]{2,})?|<[^<>]+>", r"`\g<0>`", parts[i])
    return "".join(parts)


def _notes(paragraphs: list[list[str]]) -> list[str]:
    """Text below the options: prose, lists of names with their meanings, and commands."""
    lines: list[str] = []
    for paragraph in paragraphs:
        prose = [line for line in paragraph if not line.startswith(" ")]
        listed = dedent("\n".join(line for line in paragraph if line.startswith(" "))).splitlines()
        if prose:
            lines += [_marked(" ".join(prose)), ""]
        pairs = [re.split(r" {2,}", line, maxsplit=1) for line in listed]
        if listed and all(len(pair) == 2 for pair in pairs):
            heads = ["command", "effect"] if listed[0].startswith("marathon ") else ["name", "meaning"]
            lines += table(heads, [(code(name), _marked(text)) for name, text in pairs])
        elif listed:
            lines += block("text", "\n".join(listed))
    return lines
