"""The examples do what their first lines say, with small budgets. (`test_agents.py` runs that of a custom agent.)"""

import re
import subprocess
import sys
from pathlib import Path

import onnx
import pytest
from PIL import Image

EXAMPLES = Path(__file__).parents[2] / "examples/python"


def run(folder: Path, name: str, *words: str) -> list[str]:
    command = [sys.executable, "-W", "error::UserWarning:marathon_rl", EXAMPLES / f"{name}.py", *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def number(pattern: str, line: str) -> float:
    found = re.search(pattern, line)
    assert found is not None, line
    return float(found[1].replace(",", ""))


@pytest.mark.parametrize(("algorithm", "steps", "gain"), [("ppo", 40_960, 60), ("sac", 2_600, 40)])
def test_stable_baselines3_learns_hopper_v5(algorithm: str, steps: int, gain: float, tmp_path: Path) -> None:
    before, after = run(tmp_path, "sb3_hopper", "--algorithm", algorithm, "--steps", str(steps))
    assert number(r"after ([\d,]+) steps", after) == steps
    assert number(r"return ([-\d.]+)", after) > number(r"return ([-\d.]+)", before) + gain


def test_what_it_learns_plays_in_gymnasiums_own_task(tmp_path: Path) -> None:
    words = ("--steps", "2048", "--seed", "3")
    ours = run(tmp_path, "sb3_hopper", *words)
    theirs = run(tmp_path, "sb3_hopper", *words, "--judge", "Hopper-v5")
    for a, b in zip(ours, theirs, strict=True):
        # other starts, the same task
        x, y = number(r"return ([-\d.]+)", a), number(r"return ([-\d.]+)", b)
        assert x == pytest.approx(y, rel=0.5)


def test_ppo_in_one_file_learns(tmp_path: Path) -> None:
    lines = run(tmp_path, "cleanrl_ppo", "--steps", "120000")
    returns = [number(r"return +([-\d.]+)", line) for line in lines]
    assert number(r"^ *([\d,]+) steps", lines[-1]) > 100_000
    # at first, falls and their price
    assert returns[0] < -5 and returns[-1] > 5


def test_a_rover_learns_to_follow_its_schedule_and_its_caller(tmp_path: Path) -> None:
    lines = run(tmp_path, "steer_an_agent")
    assert number(r": ([-\d.]+) m/s off", lines[0]) < 0.5 and number(r": ([-\d.]+) m/s off", lines[3]) < 0.5
    for line, target in zip(lines[1:3], (1.5, -1.5), strict=True):
        assert number(r"m/s: ([-\d.]+) m/s after", line) == pytest.approx(target, abs=0.4)


def test_hoppers_race_in_one_world(tmp_path: Path) -> None:
    words = ("--steps", "600000", "--runners", "4", "--seconds", "4", "--picture", "race.png")
    lines = run(tmp_path, "pettingzoo_race", *words)
    table = [line for line in lines if " m after " in line]
    assert len(table) == 4 and sorted(line[:7] for line in table) == [f"agent_{i}" for i in range(4)]
    farthest = {
        kind: max(number(r": +([-\d.]+) m", x) for x in table if kind in x) for kind in ("after all", "a tenth")
    }
    assert farthest["after all"] > farthest["a tenth"] and farthest["after all"] > 0.3
    with Image.open(tmp_path / "race.png") as picture:
        assert picture.size == (640, 360)


def test_a_policy_is_exported_and_played_by_onnx_runtime(tmp_path: Path) -> None:
    trained, played, difference = run(tmp_path, "play_onnx", "--steps", "600000", "--episodes", "4")
    onnx.checker.check_model(onnx.load(tmp_path / "hopper.onnx"))
    assert number(r"return ([-\d.]+)", trained) > 20
    assert number(r"return ([-\d.]+)", played) == pytest.approx(number(r"return ([-\d.]+)", trained), rel=0.5)
    assert number(r": ([-\d.e]+)$", difference) < 1e-5
    again = run(tmp_path, "play_onnx", "--network", "hopper.onnx", "--episodes", "4")
    assert again[0] == played
