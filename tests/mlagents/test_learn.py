"""The unmodified `mlagents-learn` trains on `marathon-player`.

Promises: PPO, SAC, curiosity, several players, resuming and curricula work; a training with the same seed exports the
same bytes; what it learns is real. Runs are short: learning curves are a matter of the studies.
"""

import copy
import pathlib
import subprocess
import sys

import pytest
import yaml
from conftest import PLAYER, free_port
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


def learn(folder, settings, *flags, run="run", agents=16):
    """Runs mlagents-learn in a folder; returns what it printed."""
    path = folder / f"{run}.yaml"
    path.write_text(yaml.safe_dump(settings))
    words = ["-m", "mlagents.trainers.learn", path, f"--env={PLAYER}", f"--run-id={run}", "--seed=1", "--no-graphics"]
    words += [f"--base-port={free_port()}", f"--results-dir={folder}", "--torch-device=cpu", *flags]
    words += ["--env-args", "--spawn-env=Hopper-v0", f"--num-spawn-envs={agents}"]
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, capture_output=True, text=True, timeout=1800, check=False
    )
    text = done.stdout + done.stderr
    assert done.returncode == 0 and "Exported" in text, text[-4000:]
    return text


def curve(folder, tag, run="run"):
    """Values of a statistic that the trainer recorded."""
    events = EventAccumulator(str(folder / run / "Hopper-v0"))
    events.Reload()
    return [event.value for event in events.Scalars(tag)]


def policy(folder, run="run"):
    return (folder / run / "Hopper-v0.onnx").read_bytes()


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
