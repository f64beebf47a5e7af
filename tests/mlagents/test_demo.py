"""A demonstration that `marathon record-demo` wrote is one to ML-Agents: its loader reads it, and GAIL and behavioral
cloning train on it."""

import json
import pathlib
import subprocess

import numpy as np
import pytest
from conftest import MARATHON
from mlagents.trainers.buffer import BufferKey
from mlagents.trainers.demo_loader import demo_to_buffer, load_demonstration
from test_learn import config, curve, learn

ROOT = pathlib.Path(__file__).parents[2]


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    path = tmp_path_factory.mktemp("demo") / "hopper.demo"
    policy = ROOT / "assets" / "policies" / "hopper.safetensors"
    words = [MARATHON, "--json", "record-demo", policy, "--out", path, "--episodes", "3"]
    return path, json.loads(subprocess.check_output(words, text=True))


def test_the_loader_reads_what_was_recorded(demo):
    path, report = demo
    spec, pairs, expected = load_demonstration(str(path))
    assert spec.observation_specs[0].shape == (31,) and spec.action_spec.continuous_size == 4
    # an entry for every decision and one for the end of each episode
    assert len(pairs) == expected == report["decisions"] + 3
    total = sum(pair.agent_info.reward for pair in pairs)
    assert abs(total / 3 - report["return_mean"]) < 0.01 and report["return_mean"] > 700
    ends = [pair.agent_info for pair in pairs if pair.agent_info.done]
    assert [end.max_step_reached for end in ends] == [True] * 3 and pairs[-1].agent_info.done

    _, buffer = demo_to_buffer(str(path), sequence_length=1)
    actions = np.array(buffer[BufferKey.CONTINUOUS_ACTION])
    assert np.abs(actions).max() <= 1 and actions.std() > 0.1


def test_gail_and_behavioral_cloning_train_on_it(demo, tmp_path):
    path, _ = demo
    network = {"hidden_units": 32, "num_layers": 2}
    settings = config(
        hyperparameters={"buffer_size": 1024},
        behavioral_cloning={"demo_path": str(path), "steps": 0, "strength": 0.5},
        reward_signals={
            "extrinsic": {"gamma": 0.99, "strength": 1.0},
            "gail": {"gamma": 0.99, "strength": 0.1, "network_settings": network, "demo_path": str(path)},
        },
    )
    learn(tmp_path, settings)
    assert curve(tmp_path, "Policy/Gail Reward")
    # the discriminator learns to tell the recorded policy from the new one, and cloning gets nearer to it
    for tag in ("Losses/GAIL Loss", "Losses/Pretraining Loss"):
        losses = curve(tmp_path, tag)
        assert losses[-1] < losses[0], (tag, losses)
