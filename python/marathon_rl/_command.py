"""The console script `marathon`: the same command as the Rust program."""

import os
import sys
from pathlib import Path

from marathon_rl._native import main as native_main


def main() -> None:
    """Run the command and leave with its exit code."""
    page = Path(__file__).with_name("page")
    if page.is_dir():
        os.environ.setdefault("MARATHON_PAGE", str(page))
    sys.exit(native_main(sys.argv))
