"""The console script `marathon`: the same command as the Rust program."""

import sys

from marathon_rl._native import main as native_main


def main() -> None:
    """Run the command and leave with its exit code."""
    sys.exit(native_main(sys.argv))
