#!/usr/bin/env python3
"""Checks the prose of comments and pages: sentences start with a subject, and words of a list do not occur.

Reads all tracked Rust, Markdown and Python files: comments, docstrings, and the text of pages. Code blocks, inline code and
addresses do not count. Prints each sentence with file and line, and fails if there is one.
"""

import ast
import io
import re
import subprocess
import sys
import tokenize
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SKIPPED = {"CHANGELOG.md"}

WORDS = re.compile(
    r"\b(anew|thereof|whoever|somebody|nobody|reckon(s|ed|ing)?|of (its|his|their) own accord|deeds?|cues?|herds?|weather"
    r"|deem(s|ed|ing)?|lest|dear(er|ly)?|hasten(s|ed|ing)?|obeys?|obeyed|obeying|(is|are|was|were) told|bears? that"
    r"|comes? to light|asks? for the truth|he who|that which)\b",
    re.IGNORECASE,
)
OPENING = re.compile(r"(Who|Whoever|Those that|Those who|He who|That which|What)\b")
SENTENCE_END = re.compile(r"(?<=[.!?:;])\s+(?=[A-Z])|(?<=[.!?][\"')])\s+(?=[A-Z])")


def plain(text):
    """The text without inline code, addresses and markup."""
    text = re.sub(r"(`+).+?\1", "X", text)
    text = re.sub(r"!?\[([^\]]*)\](\([^)]*\)|\[[^\]]*\])", r"\1", text)
    return re.sub(r"https?://\S+|<[^>]*>|[*\[\]]|\b_|_\b", "", text)


def paragraphs(lines):
    """Joins lines of Markdown to paragraphs, list items and table cells, each with the number of its first line.

    The first row of a table is a heading and does not count.
    """
    start, parts, fence, in_table = 0, [], None, False
    for number, line in [*lines, (0, "")]:
        text = line.strip()
        marker = re.match(r"`{3,}|~{3,}", text)
        if fence or marker:
            if marker and (fence is None or text == fence):
                fence = None if fence else marker[0]
            text = ""
        table = text.startswith("|")
        item = re.match(r"([-*+>]|#+|\d+[.)])\s+", text)
        if parts and (not text or table or item):
            yield start, " ".join(parts)
            parts = []
        if table and in_table:
            yield from ((number, cell.strip()) for cell in plain(text).split("|"))
        elif text and not table:
            start = start if parts else number
            parts.append(text[item.end() :] if item else text)
            if item and item[1].startswith("#"):
                yield start, parts.pop()
        in_table = table


def rust(source):
    """Blocks of comments, each a list of numbered lines."""
    block, kind = [], None
    for number, line in enumerate(source.splitlines(), 1):
        comment = re.match(r"\s*(//[/!]?)(?!/)\s?(.*)", line)
        if not comment or comment[1] != kind:
            yield block
            block, kind = [], comment and comment[1]
        if comment:
            block.append((number, comment[2]))
    yield block


def python(source):
    """Blocks of comments, and docstrings."""
    block = []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and not token.string.startswith("#!"):
            if block and block[-1][0] + 1 != token.start[0]:
                yield block
                block = []
            block.append((token.start[0], token.string.lstrip("#")))
    yield block
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)) and ast.get_docstring(node):
            yield list(enumerate(ast.get_docstring(node, clean=False).splitlines(), node.body[0].lineno))


READERS = {".rs": rust, ".py": python, ".md": lambda source: [list(enumerate(source.splitlines(), 1))]}


def findings(source, suffix):
    """Line, reason and sentence of all that the check does not accept."""
    for block in READERS[suffix](source):
        for line, paragraph in paragraphs(block):
            for sentence in SENTENCE_END.split(plain(paragraph).strip()):
                opening, word = OPENING.match(sentence), WORDS.search(sentence)
                if opening and not sentence.rstrip("\"')").endswith("?"):
                    yield line, f"opens with '{opening[0]}'", sentence
                elif word:
                    yield line, f"'{word[0]}'", sentence


def main():
    tracked = subprocess.run(["git", "ls-files", "-z", "*.rs", "*.md", "*.py"], cwd=ROOT, capture_output=True, check=True)
    files = [name for name in tracked.stdout.decode().split("\0") if Path(name).name not in SKIPPED and (ROOT / name).is_file()]
    found = [(name, *hit) for name in files for hit in findings((ROOT / name).read_text("utf-8"), Path(name).suffix)]
    for name, line, reason, sentence in found:
        print(f"{name}:{line}: {reason}: {sentence}")
    if found:
        sys.exit(f"{len(found)} sentences to rewrite; CONTRIBUTING.md describes the style")


if __name__ == "__main__":
    main()
