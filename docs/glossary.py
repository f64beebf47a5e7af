#!/usr/bin/env python3
"""Compares the public words of Marathon with the table of docs/glossary.md.

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
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/glossary.md"
KINDS = ["command line", "task option", "configuration", "Python"]
LEFT_OUT = {"self", "cls", "args", "kwargs", "help", "version"}
# a word, one of the kinds above, and the place: a command, a task, a section or a class or function
Found = tuple[str, str, str]


def command_line(program: str, *path: str) -> Iterator[Found]:
    """Commands and long options, from the help of a command and its subcommands."""
    text = subprocess.run([program, *path, "--help"], capture_output=True, text=True, check=True).stdout
    place = " ".join(path) or "marathon"
    for option in re.findall(r"^ +(?:-\w, )?--([a-z][\w-]*)", text, re.MULTILINE):
        yield option, "command line", place
    commands = re.search(r"^Commands:\n((?: .*\n)+)", text, re.MULTILINE)
    for command in re.findall(r"^  ([a-z][\w-]*)", commands[1], re.MULTILINE) if commands else []:
        if command not in LEFT_OUT:
            yield command, "command line", place
            yield from command_line(program, *path, command)


def task_options(tasks: list[dict]) -> Iterator[Found]:
    """Options of tasks, from `marathon list`."""
    for task in tasks:
        for option in task["options"]:
            yield option["name"], "task option", task["id"]


def keys(value: dict, section: str = "the file") -> Iterator[Found]:
    """Keys of a configuration by section. Options of a task and names of roles are no keys."""
    for key, inner in value.items():
        yield key, "configuration", section
        if isinstance(inner, dict) and key not in ("options", "roles"):
            yield from keys(inner, key if section in ("the file", "rewards") else section)


def configuration(program: str, tasks: list[dict]) -> Iterator[Found]:
    """Keys of docs/configs.md (its examples and its reference) and of every task's settings."""
    page = (ROOT / "docs/configs.md").read_text().partition("## Files of ML-Agents")[0]
    for key in re.findall(r"^(?:\* `)?(\w+):(?: |$)", page, re.MULTILINE):
        yield key, "configuration", "the file"
    sections: list[str] = []
    for line in page.partition("<!-- all keys")[2].splitlines():
        name, *cells = [cell.strip("` ") for cell in line.strip("|").split("|")]
        if line.startswith("### "):
            heading = name.strip("# `") if "`, `" not in name and "`" in name else "the file"
        elif name == "key":
            sections = [cell.replace("default", heading) for cell in cells[:-2]]
            parent = "rewards" if "amp" in sections else "the file"
            yield from ((section, "configuration", parent) for section in sections if section != parent)
        elif line.startswith("| `"):
            used = [section for section, cell in zip(sections, cells, strict=False) if cell]
            yield from ((key, "configuration", section) for section in used for key in name.split("."))
    for task in tasks:
        text = subprocess.run([program, "--json", "config", "show", task["id"]], capture_output=True, check=True).stdout
        yield from keys(json.loads(text))


def python(path: Path) -> Iterator[Found]:
    """Public names of a module: classes, functions, methods, parameters, and fields of classes."""

    def function(node: ast.FunctionDef, owner: str) -> Iterator[Found]:
        special = node.name in ("__new__", "__init__", "__call__")
        if node.name.startswith("_") and not special:
            return
        if not special:
            yield node.name, "Python", owner or path.stem
        inputs = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg]
        for parameter in filter(None, inputs):
            yield parameter.arg, "Python", owner or node.name

    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.FunctionDef):
            yield from function(node, "")
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield node.name, "Python", path.stem
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    yield from function(member, node.name)
                elif isinstance(member, ast.AnnAssign) and isinstance(member.target, ast.Name):
                    yield member.target.id, "Python", node.name


def collect(program: str) -> dict[str, dict[str, list[str]]]:
    """All words, with the places of each by kind. `--initialize-from` and `initialize_from` are one word."""
    tasks = json.loads(subprocess.run([program, "--json", "list"], capture_output=True, check=True).stdout)["agents"]
    modules = [p for p in sorted((ROOT / "python/marathon_envs").rglob("*.py*")) if p.suffix in (".py", ".pyi")]
    public = [p for p in modules if p.name == "_native.pyi" or not p.name.startswith("_")]
    words: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    sources = [command_line(program), task_options(tasks), configuration(program, tasks), *map(python, public)]
    for word, kind, place in (found for source in sources for found in source):
        word = word.replace("-", "_")
        if word not in LEFT_OUT and not word.startswith("_") and place not in words[word][kind]:
            words[word][kind].append(place)
    return words


def rows() -> Iterator[tuple[str, str, str]]:
    """Words, meanings and places of the page's table."""
    table = PAGE.read_text().partition("| word | meaning | where |\n|---|---|---|\n")[2]
    for line in filter(None, table.splitlines()):
        word, meaning, where = re.split(r" *(?<!\\)\| *", line.strip("| "))
        yield word.strip("`"), meaning, where


def row(word: str, kinds: dict[str, list[str]], meaning: str = "") -> str:
    """A row of the table. Places are named if there are at most three of a kind."""
    named = {kind: places if len(places) <= 3 and kind != "task option" else [] for kind, places in kinds.items()}
    where = [f"{kind}: {', '.join(named[kind])}" if named[kind] else kind for kind in KINDS if kind in named]
    return f"| `{word}` | {meaning} | {'; '.join(where)} |"


def problems(words: dict[str, dict[str, list[str]]]) -> Iterator[str]:
    """Each word without a row, and each row that is out of date."""
    missing = {(word, kind): places for word, kinds in words.items() for kind, places in kinds.items()}
    lines = list(rows())
    for word, meaning, where in lines:
        for kind, _, named in (entry.partition(": ") for entry in where.split("; ")):
            missing.pop((word, kind), None)
            places = words.get(word, {}).get(kind, [])
            gone = [place for place in named.split(", ") if named and place not in places]
            if not places or gone:
                yield f"{PAGE.name}: `{word}` is not found: {kind} {', '.join(gone)}"
        if not meaning:
            yield f"{PAGE.name}: `{word}` has no meaning"
    for (word, kind), places in sorted(missing.items()):
        yield f"{PAGE.name}: `{word}` has no row: {kind} {', '.join(places)}"
    names = [word.lower() for word, _, _ in lines]
    yield from (f"{PAGE.name}: `{b}` is not in its place: after {a}" for a, b in zip(names, names[1:]) if a > b)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="the program `marathon`")
    parser.add_argument("--check", action="store_true", help="fail if a row is missing or out of date")
    options = parser.parse_args()
    words = collect(options.program)
    if options.check:
        found = list(problems(words))
        sys.exit("\n".join(found) if found else 0)
    known = {word for word, _, _ in rows()}
    print("\n".join(row(word, words[word]) for word in sorted(words, key=str.lower) if word not in known))
