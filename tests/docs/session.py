"""Runs blocks of Python one after another in one process. The interpreter of the package executes this file.

Each line of the standard input is a JSON object with `code`, `file`, `line` and `output`, the file that receives the
output. For each one, the process writes a line to the file descriptor of its first argument: an error with its place in
the page, or null. Only the standard library is used.
"""

import importlib
import json
import linecache
import os
import sys
import traceback
import types
from typing import Any


def _display(*values: object, **_: object) -> None:
    """Print values in place of showing them in a notebook."""
    print(*map(repr, values))


class _Shown:
    """Stands for an image, a video or a page that a notebook shows."""

    def __init__(self, *values: object, **named: object) -> None:
        self.values, self.named = values, named


def _without_ipython() -> None:
    """Make `IPython.display` importable where IPython is not installed."""
    try:
        importlib.import_module("IPython.display")
    except ImportError:
        package, display = types.ModuleType("IPython"), types.ModuleType("IPython.display")
        display.__dict__.update(dict.fromkeys(("Image", "Video", "HTML", "Markdown", "SVG"), _Shown))
        display.__dict__.update(display=_display, clear_output=_display)
        package.__dict__.update(display=display, get_ipython=lambda: None)
        sys.modules.update({"IPython": package, "IPython.display": display})


def _error(file: str, error: BaseException) -> str:
    """Lines of the traceback from the page on."""
    frames = traceback.extract_tb(error.__traceback__)
    start = next((i for i, frame in enumerate(frames) if frame.filename == file), 0)
    lines = traceback.format_list(frames[start:]) if frames else []
    return "".join([*lines, *traceback.format_exception_only(error)])


def _run(code: str, file: str, line: int, names: dict[str, Any]) -> str | None:
    """Run a block whose first line is `line` of the page; return the error."""
    # lines of the page so far, for tracebacks and `inspect.getsource`
    before = linecache.getlines(file)
    lines = [*before, *["\n"] * (line - 1 - len(before)), *code.splitlines(keepends=True)]
    linecache.cache[file] = (sum(map(len, lines)), None, lines, file)
    try:
        exec(compile("\n" * (line - 1) + code, file, "exec"), names)
    except SystemExit as ended:
        return None if ended.code in (None, 0) else _error(file, ended)
    except BaseException as error:
        return _error(file, error)
    return None


def main() -> None:
    """Serve blocks until the input ends."""
    answers = os.fdopen(int(sys.argv[1]), "w")
    orders = os.fdopen(os.dup(0), "r")
    empty = os.open(os.devnull, os.O_RDONLY)
    os.dup2(empty, 0)
    sys.argv = [""]
    sys.path[0] = ""
    page = types.ModuleType("__main__")
    sys.modules["__main__"] = page
    page.__dict__["display"] = _display
    _without_ipython()
    for order in orders:
        block = json.loads(order)
        output = os.open(block["output"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)
        os.close(output)
        error = _run(block["code"], block["file"], block["line"], page.__dict__)
        sys.stdout.flush()
        sys.stderr.flush()
        print(json.dumps(error), file=answers, flush=True)


if __name__ == "__main__":
    main()
