"""Policies travel both ways: what `mlagents-learn` exported acts the same in `marathon eval`, what `marathon export`
writes has all that Unity's importer asks for."""

import json
import pathlib
import subprocess

import numpy as np
import pytest
from conftest import MARATHON
from contract import best_actions, check
from mlagents.trainers.demo_loader import load_demonstration
from test_learn import config, learn

ROOT = pathlib.Path(__file__).parents[2]


def marathon(*words, code=0):
    done = subprocess.run([MARATHON, "--json", *words], capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    return json.loads(done.stdout)


def decisions(policy, folder):
    """Observations and actions of a policy that plays here, from a recording."""
    demo = folder / "played.demo"
    marathon("record-demo", policy, "--agent", "hopper", "--out", demo, "--episodes", "2")
    _, pairs, _ = load_demonstration(str(demo))
    pairs = [pair for pair in pairs if not pair.agent_info.done]
    obs = np.array([pair.agent_info.observations[0].float_data.data for pair in pairs])
    return obs, np.array([pair.action_info.continuous_actions for pair in pairs])


def sac():
    settings = config(max_steps=1500)
    settings["behaviors"]["Hopper-v0"].update(
        trainer_type="sac",
        hyperparameters={"batch_size": 64, "buffer_size": 20000, "buffer_init_steps": 500, "steps_per_update": 16.0},
    )
    return settings


# the best action of its SAC is the tangent of what it writes as such
@pytest.mark.parametrize(
    ("settings", "finish"), [(config(max_steps=3000), np.array), (sac(), np.tanh)], ids=["ppo", "sac"]
)
def test_what_mlagents_exported_plays_here(tmp_path, settings, finish):
    learn(tmp_path, settings)
    file = tmp_path / "run" / "Hopper-v0.onnx"
    runner = check(file, 31, 4)
    assert marathon("eval", file, "--agent", "hopper", "--episodes", "4")["episodes"] == 4
    obs, actions = decisions(file, tmp_path)
    np.testing.assert_allclose(actions, finish(best_actions(runner, obs)), atol=1e-5)
    assert actions.std() > 1e-3


def test_memory_is_refused_by_name(tmp_path):
    learn(tmp_path, config(max_steps=1500, network_settings={"memory": {"memory_size": 16, "sequence_length": 16}}))
    error = marathon("eval", tmp_path / "run" / "Hopper-v0.onnx", "--agent", "hopper", code=1)["error"]
    assert "Hopper-v0.onnx" in error and "recurrent_in" in error, error


@pytest.mark.parametrize(
    ("name", "sizes"), [("hopper", (31, 4)), ("walker2d", (41, 6)), ("ant", (53, 8)), ("humanoid", (88, 21))]
)
def test_what_marathon_exports_is_what_unity_asks_for(tmp_path, name, sizes):
    policy = ROOT / "assets" / "policies" / f"{name}.safetensors"
    file = tmp_path / f"{name}.onnx"
    marathon("export", policy, "--out", file)
    runner = check(file, *sizes)
    if name == "hopper":
        obs, actions = decisions(policy, tmp_path)
        np.testing.assert_allclose(actions, best_actions(runner, obs), atol=1e-5)
