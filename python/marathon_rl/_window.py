"""The window of `render_mode="human"`: the program `marathon-game`, which is sent every state through a pipe."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

if TYPE_CHECKING:
    from marathon_rl._arrays import FloatArray
    from marathon_rl._tasks import Task

#: Environment variable that names the program.
VARIABLE = "MARATHON_GAME"
PROGRAM = "marathon-game"


def find() -> str | None:
    """Path of the game, if it is there: what `MARATHON_GAME` names, or what is on the search path."""
    return shutil.which(os.environ.get(VARIABLE) or PROGRAM)


def program() -> str:
    """Path of the game; an error that says how to build it if it is not there."""
    found = find()
    if found is None:
        named = os.environ.get(VARIABLE)
        where = f"{VARIABLE} is {named!r}, where no program is" if named else f"{PROGRAM} is not on the search path"
        raise gymnasium.error.DependencyNotInstalled(
            f"render_mode='human' opens a window of the game, but {where}. Build it in Marathon's repository (about 15 "
            f"minutes, once): cargo build --release -p {PROGRAM}; then put target/release on PATH or set {VARIABLE}. "
            "Without it, pygame does: gymnasium.wrappers.HumanRendering(gymnasium.make(..., render_mode='rgb_array'))"
        )
    return found


def _about(task: Task, dt: float, options: dict[str, Any]) -> dict[str, Any]:
    """Return the description of a task for the game: its name, its model file, or the model of a class."""
    if isinstance(task, str | os.PathLike):
        file = Path(options.get("xml_file") or task)
        is_model = file.suffix.lower() == ".xml" and file.is_file()
        return {"file": str(file.resolve()), "dt": dt} if is_model else {"agent": os.fsdecode(task)}
    source = os.fspath(task.mjcf)
    if source.lstrip().startswith("<"):
        return {"model": source, "dt": dt}
    return {"file": str(Path(source).resolve()), "dt": dt}


class Window:
    """A window onto one environment. Showing a state takes as long as a step does in the world."""

    def __init__(self, task: Task, dt: float, options: dict[str, Any]) -> None:
        """Open the window. `options` are those of the task."""
        self._game = subprocess.Popen(
            [program(), "--watch-stream"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
        )
        self._open = True
        self._write(json.dumps(_about(task, dt, options)).encode() + b"\n")

    def show(self, qpos: FloatArray, *, begins: bool, reward: float = 0.0) -> None:
        """Show a state and wait for its time; nothing happens once the window has been closed."""
        self._write(np.concatenate(([float(begins), reward], qpos)).astype("<f8").tobytes())
        if self._open and self._game.stdout is not None and not self._game.stdout.read(1):
            self._closed()

    def _write(self, data: bytes) -> None:
        if not self._open or self._game.stdin is None:
            return
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._game.stdin.write(rest) or 0 :]
        except (BrokenPipeError, ConnectionResetError):
            self._closed()

    def _closed(self) -> None:
        """Take in that the window is gone: an error if it failed; the game has explained it on its standard error."""
        self._open = False
        if self._game.wait() != 0:
            raise gymnasium.error.Error(
                f"the game could not show the environment (exit code {self._game.returncode}); it says why above"
            )

    def close(self) -> None:
        """Close the window."""
        self._open = False
        for pipe in (self._game.stdin, self._game.stdout):
            if pipe is not None:
                pipe.close()
        try:
            self._game.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self._game.kill()
            self._game.wait()
