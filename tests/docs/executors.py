"""Processes that run blocks: one interpreter of Python for a page, and a shell or the program for a single block."""

import contextlib
import json
import os
import re
import select
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from blocks import Block

SESSION = Path(__file__).with_name("session.py")
LAST_LINES = 25
"""Lines of output that a report of a failure has at most."""


@dataclass(frozen=True)
class Tools:
    """Programs that pages use."""

    program: Path
    python: Path
    """The interpreter with `marathon_rl`; not resolved, since that of a virtual environment is a link."""

    def environment(self, folder: Path) -> dict[str, str]:
        """Write wrappers of the programs into a folder; return the variables with which commands find them."""
        folder.mkdir()
        # links would hide a virtual environment from its interpreter and the files beside the program from it
        for name, target in (("marathon", self.program), ("python", self.python), ("python3", self.python)):
            path = folder / name
            path.write_text(f'#!/bin/sh\nexec "{target}" "$@"\n')
            path.chmod(0o755)
        paths = [str(folder), str(self.python.parent), os.environ.get("PATH", "")]
        # no windows, and no installations by blocks whose comment is forgotten
        quiet = {"MPLBACKEND": "Agg", "PYTHONDONTWRITEBYTECODE": "1", "PIP_NO_INDEX": "1", "CARGO_NET_OFFLINE": "true"}
        return {**os.environ, **quiet, "PATH": os.pathsep.join(paths)}


def last_lines(text: str) -> str:
    """End of an output. Of lines that overwrite each other, the last one counts."""
    lines = [line.rsplit("\r", 1)[-1] for line in text.strip().splitlines()]
    cut = [f"... {len(lines) - LAST_LINES} lines ..."] if len(lines) > LAST_LINES else []
    return "\n".join([*cut, *lines[-LAST_LINES:]])


def end_group(process: "subprocess.Popen[bytes]") -> None:
    """Kill a process and all that it has started."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def command(words: list[str], folder: Path, environment: dict[str, str], limit: float) -> str | None:
    """Run a command to its end; return the error. Processes that it leaves running are killed."""
    with open(folder.parent / "output.txt", "w+b") as output:
        process = subprocess.Popen(
            words,
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            code = process.wait(limit)
            problem = f"exit code {code}" if code else None
        except subprocess.TimeoutExpired:
            problem = f"not done after {limit:g} s"
        end_group(process)
        output.seek(0)
        text = output.read().decode(errors="replace")
    return problem and f"{problem}\n{last_lines(text)}".rstrip()


def shell(block: Block, folder: Path, environment: dict[str, str], limit: float) -> str | None:
    """Run a block of commands, up to the first one that fails."""
    script = folder.parent / "block.sh"
    script.write_text(block.code)
    return command(["bash", "-e", str(script)], folder, environment, limit)


def task_of(block: Block) -> str:
    """Task for which a configuration is read: that of its comment, the first one that it names, or the hopper."""
    named = re.search(r"^(?:tasks|behaviors):\s*(?:\n\s+|\{\s*)[\"']?([\w.-]+)", block.code, re.MULTILINE)
    return block.task or (named[1] if named else "hopper")


def configuration(block: Block, folder: Path, environment: dict[str, str], limit: float) -> str | None:
    """Have the program read a block as a configuration, or as a recipe if it has stages."""
    file = folder.parent / "block.yaml"
    file.write_text(block.code)
    words = ["marathon", "config", "show", task_of(block), "--config", str(file)]
    if any(line.startswith("stages:") for line in block.code.splitlines()):
        words = ["marathon", "train", str(file), "--list-stages"]
    return command(words, folder, environment, limit)


class PythonSession:
    """An interpreter that runs the blocks of a page one after another."""

    def __init__(self, python: Path, folder: Path, environment: dict[str, str]) -> None:
        """Start the interpreter in a folder."""
        self._folder, self._output = folder, folder.parent / "python.txt"
        self._answers, theirs = os.pipe()
        self._buffer = b""
        self._errors = open(folder.parent / "session.txt", "w+b")  # noqa: SIM115
        self._process = subprocess.Popen(
            [str(python), str(SESSION), str(theirs)],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=self._errors,
            stderr=subprocess.STDOUT,
            pass_fds=[theirs],
            start_new_session=True,
        )
        os.close(theirs)
        self._ended = ""

    def run(self, code: str, name: str, line: int, limit: float) -> str | None:
        """Run a block that begins at a line of a page; return the error."""
        if self._ended:
            return f"not run: {self._ended}"
        self._output.write_bytes(b"")
        order = {"code": code, "file": name, "line": line, "output": str(self._output)}
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(order).encode() + b"\n")
            self._process.stdin.flush()
            answer = self._answer(limit)
        except BrokenPipeError:
            answer = b""
        if answer is None:
            self._ended = f"the interpreter was stopped at line {line}"
            self.close()
            return f"not done after {limit:g} s\n{self._text()}".rstrip()
        if not answer:
            self._ended = f"the interpreter ended at line {line}"
            code_of_exit = self._process.wait()
            return f"the interpreter ended with exit code {code_of_exit}\n{self._text()}".rstrip()
        error: str | None = json.loads(answer)
        return error and f"{self._text()}\n{error}".strip()

    def _answer(self, limit: float) -> bytes | None:
        """One line from the interpreter: empty if it has ended, None if the time is over."""
        deadline = time.monotonic() + limit
        while b"\n" not in self._buffer:
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([self._answers], [], [], left)[0]:
                return None
            received = os.read(self._answers, 65536)
            if not received:
                return b""
            self._buffer += received
        line, _, self._buffer = self._buffer.partition(b"\n")
        return line

    def _text(self) -> str:
        """End of the block's output."""
        self._errors.seek(0)
        own = self._errors.read().decode(errors="replace")
        return last_lines(own + self._output.read_text(errors="replace"))

    def close(self) -> None:
        """End the interpreter."""
        end_group(self._process)

    def release(self) -> None:
        """End the interpreter and close all files."""
        self.close()
        os.close(self._answers)
        if self._process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()
        self._errors.close()
