#!/usr/bin/env python3
"""Compares the public words of Marathon with the table of docs/reference/glossary.md.

    docs/glossary.py --program target/release/marathon            print the rows that are missing
    docs/glossary.py --program target/release/marathon --check    fail if a row is missing or out of date

Words are commands and long options of the command line, options of tasks, keys of configurations, and names of classes,
functions, methods and parameters in Python. Names that start with an underscore are private.
"""

import argparse
import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

from generator import help_text

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/reference/glossary.md"
LEFT_OUT = {"self", "cls", "args", "kwargs", "help", "version"}
# a word, its kind (command line, task option, configuration or Python), and its command, task, section or class
Found = tuple[str, str, str]


def output(*command: str) -> str:
    """Output of a program."""
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def command_line(program: str, *path: str) -> Iterator[Found]:
    """Commands and long options, from the help of a command and its subcommands."""
    sections = help_text.read(program, path).sections
    commands = [entry.name for entry in sections.get("Commands", [])]
    names = [entry.name for entries in sections.values() for entry in entries]
    options = [long[1] for name in names if (long := re.match(r"(?:-\w, )?--([a-z][\w-]*)", name))]
    for word in [*commands, *options]:
        yield word, "command line", " ".join(path) or "marathon"
    for command in commands:
        # the game is a program of its own, which need not be built: its source has the options
        if command != "help":
            yield from game_options("Args") if command == "play" else command_line(program, *path, command)


def game_options(struct: str) -> Iterator[Found]:
    """Long options of `marathon play`: fields of a struct, and of those that it flattens."""
    files = [ROOT / "crates/game/src/app/cli.rs", *sorted((ROOT / "crates/runs/src").glob("*.rs"))]
    code = re.sub(r"^ *///.*\n", "", "".join(path.read_text() for path in files), flags=re.MULTILINE)
    body = code.partition(f"pub struct {struct} {{\n")[2].partition("\n}")[0]
    for attributes, field, kind in re.findall(r"((?:^ {4}[^p].*\n)+) {4}pub (\w+): (\w+)", body, re.MULTILINE):
        if "flatten" in attributes:
            yield from game_options(kind)
        elif long := re.search(r'\blong\b(?: = "([\w-]+)")?', attributes):
            yield long[1] or field, "command line", "play"


def keys(value: dict, section: str = "the file") -> Iterator[Found]:
    """Keys of a configuration by section. Options of a task and names of roles are no keys."""
    for key, inner in value.items():
        yield key, "configuration", section
        if isinstance(inner, dict) and key not in ("options", "roles"):
            yield from keys(inner, key if section in ("the file", "rewards") else section)


def configuration(program: str) -> Iterator[Found]:
    """Keys of docs/reference/configs.md (its examples and its reference, which a test holds complete) and of a task."""
    page = (ROOT / "docs/reference/configs.md").read_text().partition("## Files of ML-Agents")[0]
    for key in re.findall(r"^(?:\* `)?(\w+):(?: |$)", page, re.MULTILINE):
        yield key, "configuration", "the file"
    sections: list[str] = []
    for line in page.partition("<!-- all keys")[2].splitlines():
        name, *cells = [cell.strip("` ") for cell in line.strip("|").split("|")]
        if line.startswith("### "):
            heading = name.strip("# `") if line.count("`") == 2 else "the file"
        elif name == "key":
            sections = [cell.replace("default", heading) for cell in cells[:-2]]
        elif line.startswith("| `"):
            for section in (section for section, cell in zip(sections, cells, strict=False) if cell):
                if section != "the file":
                    yield section, "configuration", "rewards" if "amp" in sections else "the file"
                yield from ((key, "configuration", section) for key in name.split("."))
    yield from keys(json.loads(output(program, "--json", "config", "show", "Hopper-v0")))


def python(nodes: list[ast.stmt], owner: str, of_class: bool = False) -> Iterator[Found]:
    """Public names of a module or class: classes, functions, methods, parameters, and fields."""
    for node in nodes:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield node.name, "Python", owner
            yield from python(node.body, node.name, True)
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            yield node.target.id, "Python", owner
        elif isinstance(node, ast.FunctionDef) and re.match(r"[^_]|__(new|init|call)__", node.name):
            yield node.name, "Python", owner
            inputs = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg]
            yield from ((entry.arg, "Python", owner if of_class else node.name) for entry in inputs if entry)


def collect(program: str) -> dict[str, dict[str, list[str]]]:
    """All words, with the places of each by kind. `--initialize-from` and `initialize_from` are one word."""
    tasks = json.loads(output(program, "--json", "list"))["agents"]
    options = ((option["name"], "task option", task["id"]) for task in tasks for option in task["options"])
    files = [ROOT / "python/marathon_rl/_native.pyi", *sorted((ROOT / "python/marathon_rl").rglob("[!_]*.py"))]
    modules = [python(ast.parse(f.read_text()).body, f.stem.replace("_native", "marathon_rl")) for f in files]
    words: dict[str, dict[str, list[str]]] = {}
    for source in [command_line(program), options, configuration(program), *modules]:
        for name, kind, place in source:
            if name not in LEFT_OUT and not name.startswith("_"):
                places = words.setdefault(name.replace("-", "_"), {}).setdefault(kind, [])
                places += [place] if place not in places else []
    return words


def rows() -> list[list[str]]:
    """Word, meaning and place of each row of the page's table."""
    table = PAGE.read_text().partition("| word | meaning | where |\n|---|---|---|\n")[2]
    return [[cell.strip("` ") for cell in line.strip("|").split(" | ")] for line in filter(None, table.splitlines())]


def problems(words: dict[str, dict[str, list[str]]]) -> Iterator[str]:
    """Each word without a row, and each row that is out of date."""
    missing = {(word, kind): places for word, kinds in words.items() for kind, places in kinds.items()}
    for word, meaning, where in rows():
        for kind, _, named in (entry.partition(": ") for entry in where.split("; ")):
            missing.pop((word, kind), None)
            places = words.get(word, {}).get(kind, [])
            if not places or (named and not set(named.split(", ")) <= set(places)):
                yield f"`{word}` is in the glossary, but not found there: {kind} {named}"
        yield from [] if meaning else [f"`{word}` has no meaning in the glossary"]
    for (word, kind), places in sorted(missing.items()):
        yield f"`{word}` is not in the glossary: {kind} {', '.join(places)}"
    names = [word.lower() for word, _, _ in rows()]
    yield from (f"`{b}` is out of order after `{a}`" for a, b in pairwise(names) if a > b)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="the program `marathon`")
    parser.add_argument("--check", action="store_true", help="fail if a row is missing or out of date")
    options = parser.parse_args()
    words = collect(options.program)
    if options.check:
        sys.exit("\n".join(problems(words)) or 0)
    for word in sorted(words.keys() - {word for word, _, _ in rows()}, key=str.lower):
        few = {kind: len(at) <= 3 and kind != "task option" for kind, at in words[word].items()}
        where = "; ".join(f"{kind}: {', '.join(at)}" if few[kind] else kind for kind, at in words[word].items())
        print(f"| `{word}` |  | {where} |")
