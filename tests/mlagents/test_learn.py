"""The unmodified `mlagents-learn` trains on `marathon-player`.

Promises: PPO, SAC, curiosity, several players, resuming and curricula work; several roles learn in one run; a training
with the same seed exports the same bytes; what it learns is real. Runs are short: learning curves are a matter of the
studies.
"""

import copy
import json
import pathlib
import subprocess
import sys

import numpy as np
import pytest
import yaml
from conftest import MARATHON, PLAYER, free_port
from contract import best_actions, check
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

ROOT = pathlib.Path(__file__).parents[2]
CONFIG = ROOT / "assets" / "configs" / "hopper-mlagents.yaml"


def config(**changes):
    """The shipped configuration for a short run, with changes of the behavior's settings."""
    whole = yaml.safe_load(CONFIG.read_text())
    behavior = whole["behaviors"]["Hopper-v0"]
    behavior.update(max_steps=4000, summary_freq=1000)
    behavior["hyperparameters"].update(batch_size=256, buffer_size=2048)
    behavior["network_settings"].update(hidden_units=32)
    for key, value in changes.items():
        if isinstance(value, dict) and key in behavior:
            behavior[key].update(value)
        else:
            behavior[key] = value
    return whole


def learn(folder, settings, *flags, run="run", agents=16, task=("--spawn-env=Hopper-v0",)):
    """Runs mlagents-learn in a folder; returns what it printed."""
    path = folder / f"{run}.yaml"
    path.write_text(yaml.safe_dump(settings))
    words = ["-m", "mlagents.trainers.learn", path, f"--env={PLAYER}", f"--run-id={run}", "--seed=1", "--no-graphics"]
    words += [f"--base-port={free_port()}", f"--results-dir={folder}", "--torch-device=cpu", *flags]
    words += ["--env-args", *task, f"--num-spawn-envs={agents}"]
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, capture_output=True, text=True, timeout=1800, check=False
    )
    text = done.stdout + done.stderr
    assert done.returncode == 0 and "Exported" in text, text[-4000:]
    return text


def curve(folder, tag, run="run", behavior="Hopper-v0"):
    """Values of a statistic that the trainer recorded."""
    events = EventAccumulator(str(folder / run / behavior))
    events.Reload()
    return [event.value for event in events.Scalars(tag)]


def policy(folder, run="run", behavior="Hopper-v0"):
    return (folder / run / f"{behavior}.onnx").read_bytes()


@pytest.fixture(scope="module")
def ppo(tmp_path_factory):
    """A run with PPO that others compare with and go on from."""
    folder = tmp_path_factory.mktemp("ppo")
    learn(folder, config(max_steps=24000, summary_freq=4000))
    return folder


def test_ppo_learns(ppo):
    returns = curve(ppo, "Environment/Cumulative Reward")
    assert len(returns) == 6 and returns[-1] > 1.5 * returns[0] > 0, returns
    # what only the player can tell
    distances = curve(ppo, "Hopper-v0/Distance")
    assert len(distances) == len(returns) and distances[-1] > distances[0], distances


def test_the_same_seed_exports_the_same_bytes(tmp_path):
    for run in ("one", "same"):
        learn(tmp_path, config(), run=run)
    assert policy(tmp_path, "one") == policy(tmp_path, "same")


def test_a_run_is_resumed(ppo):
    text = learn(ppo, config(max_steps=28000, summary_freq=4000), "--resume")
    assert "Resuming" in text and "Step: 28000" in text
    # it goes on from what was learned
    returns = curve(ppo, "Environment/Cumulative Reward")
    assert returns[-1] > 0.7 * returns[-2], returns


def test_sac_trains(tmp_path):
    settings = config(max_steps=1500)
    settings["behaviors"]["Hopper-v0"].update(
        trainer_type="sac",
        hyperparameters={"batch_size": 64, "buffer_size": 20000, "buffer_init_steps": 500, "steps_per_update": 16.0},
    )
    learn(tmp_path, settings)
    assert curve(tmp_path, "Losses/Value Loss")


def test_curiosity_trains_with_two_players_of_two_areas(tmp_path):
    curiosity = {"gamma": 0.99, "strength": 0.01, "network_settings": {"hidden_units": 32}}
    extrinsic = {"gamma": 0.99, "strength": 1.0}
    settings = config(reward_signals={"extrinsic": extrinsic, "curiosity": curiosity})
    learn(tmp_path, settings, "--num-envs=2", "--num-areas=2", agents=8)
    assert curve(tmp_path, "Policy/Curiosity Reward")
    logs = [(tmp_path / "run" / "run_logs" / f"Player-{i}.log").read_text() for i in range(2)]
    for i, log in enumerate(logs):
        assert f"seed {1 + i}; areas: 2" in log and "agents: 16;" in log, log


def test_a_curriculum_reaches_the_player(tmp_path):
    settings = config()
    lesson = {"measure": "progress", "behavior": "Hopper-v0", "threshold": 0.4, "require_reset": True}
    sampled = {"sampler_type": "uniform", "sampler_parameters": {"min_value": 8.0, "max_value": 11.0}}
    settings["environment_parameters"] = {
        "gravity": {
            "curriculum": [
                {"name": "light", "completion_criteria": copy.deepcopy(lesson), "value": 5.0},
                {"name": "heavy", "value": sampled},
            ]
        }
    }
    learn(tmp_path, settings)
    assert curve(tmp_path, "Environment/Lesson Number/gravity")[-1] == 1
    log = (tmp_path / "run" / "run_logs" / "Player-0.log").read_text()
    light, heavy = log.index("gravity: Constant(5.0)"), log.index("gravity: Uniform { seed:")
    assert light < heavy and "warning" not in log


def two_roles(first, second, max_steps, **changes):
    """Settings of a role and of another one that decides once in a while."""
    settings = config(max_steps=max_steps, summary_freq=max_steps // 3)
    behaviors = settings["behaviors"]
    behaviors[first] = behaviors.pop("Hopper-v0")
    behaviors[second] = copy.deepcopy(behaviors[first])
    behaviors[second].update(max_steps=max_steps // 80, summary_freq=max_steps // 240)
    behaviors[second]["hyperparameters"].update(batch_size=10, buffer_size=20)
    return {**settings, **changes}


WALKER, BUILDER = "TerrainWalker2d-v0", "TerrainWalker2d-v0.builder"
COURSES = (f"--spawn-env={WALKER}", "--option=course=adversary", "--max-episode-steps=40")
OBEDIENT, COMMANDER = "WalkerController-v0", "WalkerController-v0.commander"
COMMANDED = (f"--spawn-env={OBEDIENT}", "--option=commander=adversary", "--max-episode-steps=250")
MOON = {"environment_parameters": {"gravity": 1.6}}


# who has not learned to walk makes no new meter, but on the moon he stands long enough to be told three times
@pytest.mark.parametrize(
    ("task", "behaviors", "changes", "again", "term", "alone"),
    [
        (COURSES, {WALKER: (69, 6), BUILDER: (19, 1)}, {}, 0, "inverse", "course=bumps"),
        (COMMANDED, {OBEDIENT: (48, 6), COMMANDER: (9, 2)}, MOON, 2, "disobedience", "commander=schedule"),
    ],
    ids=["builder", "commander"],
)
def test_two_roles_learn_in_one_run(tmp_path, task, behaviors, changes, again, term, alone):
    first, second = behaviors
    learn(tmp_path, two_roles(first, second, 8000, **changes), task=task)
    assert "warning" not in (tmp_path / "run" / "run_logs" / "Player-0.log").read_text()
    for behavior, sizes in behaviors.items():
        network = check(tmp_path / "run" / f"{behavior}.onnx", *sizes)
        actions = best_actions(network, np.random.default_rng(1).normal(size=(8, sizes[0])))
        assert actions.shape == (8, sizes[1]) and np.abs(actions).max() <= 1 and actions.std() > 1e-4
        # each has learned, and from its own episodes
        assert curve(tmp_path, "Losses/Policy Loss", behavior=behavior), behavior
    longest = {b: max(curve(tmp_path, "Environment/Episode Length", behavior=b)) for b in behaviors}
    # ML-Agents does not count an episode's last decision
    assert longest[first] > 30 and again - 1 < longest[second] <= again, longest
    # terms of a role's reward are reported under its name
    assert curve(tmp_path, f"{second}/Reward/{term}", behavior=second)
    # the first role's policy plays without an opponent
    words = ["eval", tmp_path / "run" / f"{first}.onnx", "--agent", first, "--option", alone, "--episodes", "4"]
    assert json.loads(subprocess.check_output([MARATHON, "--json", *words], text=True))["episodes"] == 4


def test_roles_export_the_same_bytes_too(tmp_path, monkeypatch):
    # ML-Agents makes the networks in the order of a Python set of the behaviors' names
    monkeypatch.setenv("PYTHONHASHSEED", "1")
    for run in ("one", "same"):
        learn(tmp_path, two_roles(WALKER, BUILDER, 2400), run=run, task=COURSES)
    for behavior in (WALKER, BUILDER):
        assert policy(tmp_path, "one", behavior) == policy(tmp_path, "same", behavior)
