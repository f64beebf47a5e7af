"""`render_mode="human"`: what the window's program is sent, and what happens without it or after it.

A script stands in for the game here; the game's own tests have its side of the pipe.
"""

import json
import os
import stat
import struct
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from marathon_rl import MarathonEnv

SCRIPT = """#!{python}
import sys
source, out = sys.stdin.buffer, open({log!r}, "wb")
assert sys.argv[1:] == ["--watch-stream"], sys.argv
line = source.readline()
out.write(line)
for _ in range({frames}):
    frame = source.read({size})
    if len(frame) < {size}:
        break
    out.write(frame)
    out.flush()
    sys.stdout.buffer.write(b".")
    sys.stdout.buffer.flush()
sys.exit({code})
"""


def stand_in(folder: Path, monkeypatch: pytest.MonkeyPatch, nq: int, frames: int = 1000, code: int = 0) -> Path:
    """Make the program and return the file in which it keeps what it was sent."""
    log = folder / "sent"
    program = folder / "game"
    program.write_text(
        SCRIPT.format(python=sys.executable, log=str(log), frames=frames, size=8 * (2 + nq), code=code),
        encoding="utf-8",
    )
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("MARATHON_GAME", str(program))
    return log


def test_every_state_is_sent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = stand_in(tmp_path, monkeypatch, nq=7)
    env = gymnasium.make("marathon_rl/Hopper-v0", render_mode="human")
    assert env.metadata["render_modes"] == ["rgb_array", "human"]
    expected, bare = [], env.unwrapped
    assert isinstance(bare, MarathonEnv)
    env.reset(seed=3)
    expected.append((1.0, 0.0, *bare.get_state()[0]))
    for _ in range(5):
        _, reward, *_ = env.step(np.zeros(4, np.float32))
        expected.append((0.0, float(reward), *bare.get_state()[0]))
    assert env.render() is None
    env.close()
    line, _, frames = log.read_bytes().partition(b"\n")
    assert json.loads(line) == {"agent": "Hopper-v0"}
    assert list(struct.iter_unpack("<9d", frames)) == expected


def test_a_closed_window_does_not_stop_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in(tmp_path, monkeypatch, nq=7, frames=2)
    env = MarathonEnv("hopper", render_mode="human")
    env.reset(seed=1)
    for _ in range(4):
        env.step(np.zeros(4, np.float32))
    env.close()
    env.close()


def test_what_is_missing_or_fails_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MARATHON_GAME", str(tmp_path / "nowhere"))
    with pytest.raises(
        gymnasium.error.DependencyNotInstalled, match=r"nowhere.*cargo build --release -p marathon-game"
    ):
        MarathonEnv("hopper", render_mode="human")
    monkeypatch.delenv("MARATHON_GAME")
    monkeypatch.setenv("PATH", os.fspath(tmp_path))
    with pytest.raises(gymnasium.error.DependencyNotInstalled, match="not on the search path"):
        MarathonEnv("hopper", render_mode="human")
    # then Gymnasium is to show pictures itself
    assert MarathonEnv.metadata["render_modes"] == ["rgb_array"]
    stand_in(tmp_path, monkeypatch, nq=7, frames=0, code=1)
    assert MarathonEnv.metadata["render_modes"] == ["rgb_array", "human"]
    env = MarathonEnv("hopper", render_mode="human")
    with pytest.raises(gymnasium.error.Error, match="exit code 1"):
        env.reset(seed=1)
        env.step(np.zeros(4, np.float32))
    env.close()
