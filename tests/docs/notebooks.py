"""Code cells of notebooks as blocks of Python."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

from blocks import Block, MarkupError

_MAGIC = re.compile(r"^(\s*)([%!].*)$", re.MULTILINE)
_MARKER = re.compile(r"\A# test: (skip|long)[\s,:]*(.*)")


def cells(path: Path) -> Iterator[Block]:
    """Code cells of a notebook in their order. `line` is the number of the cell, from 1 and with the cells of text.

    Lines of commands (`!pip ...`) and magics (`%matplotlib ...`) do not run. A cell whose first line is
    `# test: skip, REASON` or `# test: long` is treated like a block of a page.
    """
    for number, cell in enumerate(json.loads(path.read_text("utf-8"))["cells"], 1):
        if cell["cell_type"] != "code":
            continue
        code = "".join(cell["source"])
        marker = _MARKER.match(code)
        if marker and marker[1] == "skip" and not marker[2]:
            raise MarkupError(number, "'test: skip' needs a reason")
        reason = marker[2] if marker and marker[1] == "skip" else None
        if code.startswith("%%"):
            reason = reason or f"the cell is for Jupyter: {code.splitlines()[0]}"
        code = _MAGIC.sub(r"\1pass  # \2", code)
        yield Block(number, "python", code, reason, bool(marker and marker[1] == "long"))
