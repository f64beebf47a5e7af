"""Agents written in Python in the place of a task's name: trained, resumed with the same bits, evaluated, loaded."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arm import Arm

from marathon_envs import evaluate, load_policy, train


class Leg(Arm):
    """It sees less."""

    def observations(self) -> list[np.ndarray]:
        return [self.joint_velocities()]


# 64 agents make 2048 steps per iteration
CONFIG = {
    "behaviors": {
        "Arm": {
            "trainer_type": "ppo",
            "hyperparameters": {"batch_size": 512, "buffer_size": 2048, "num_epoch": 4, "learning_rate": 3e-3},
            "network_settings": {"normalize": True, "hidden_units": 16, "num_layers": 1},
            "reward_signals": {"extrinsic": {"gamma": 0.9}},
            "max_steps": 40_960,
            "time_horizon": 32,
            "marathon": {"agents": 64},
        }
    }
}


def played(policy: Any, episodes: int) -> float:
    """Mean return of whole episodes, played by hand."""
    arms = Arm.vec_env(episodes, autoreset="disabled")
    obs, total = arms.reset(seed=1_000_003), 0.0
    for _ in range(Arm.max_episode_steps):
        obs, reward, *_ = arms.step(policy(obs))
        total += float(reward.astype(float).mean())
    return total


def test_a_class_is_trained_as_a_task_is(tmp_path: Path) -> None:
    rows: list[dict[str, Any]] = []
    result = train(Arm, CONFIG, seed=1, out=tmp_path / "run", callback=rows.append)
    assert result.steps == 40_960 and [row["steps"] for row in rows][:2] == [2048, 4096]
    assert {"return_mean", "reward/height", "reward/effort"} <= rows[-1].keys()
    # hanging arms have about 0, lifted ones nearly 80
    assert result.evaluation is not None and result.evaluation["return_mean"] > 40
    assert result.evaluation["episodes"] == 100 and result.policy.task == "Arm-v0"
    assert {"policy.safetensors", "progress.csv", "summary.json"} <= {
        file.name for file in (tmp_path / "run").iterdir()
    }
    policy = load_policy(tmp_path / "run", Arm)
    numbers = evaluate(policy, 48, task=Arm)
    assert numbers["return_mean"] == pytest.approx(played(policy, 48), abs=1e-3) and numbers["length_mean"] == 40
    assert evaluate(policy, 48, task=Arm, threads=1) == numbers
    # a number of episodes that is no whole number of blocks
    assert evaluate(policy, 5, task=Arm())["return_mean"] == pytest.approx(played(policy, 5), abs=1e-3)


def test_a_run_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    obs = Arm.vec_env(40).reset(seed=3)
    settings = {"seed": 5, "steps": 8192, "threads": 2}
    whole = train(Arm, CONFIG, out=tmp_path / "whole", **settings).policy
    part = train(Arm, CONFIG, out=tmp_path / "part", **settings, callback=lambda row: row["iteration"] < 2)
    assert part.interrupted and part.steps == 4096
    assert not np.array_equal(part.policy(obs), whole(obs))
    # without the class, nobody knows the task
    with pytest.raises(ValueError, match="agent 'Arm-v0' does not exist"):
        train(resume=tmp_path / "part")
    with pytest.raises(ValueError, match=r"agent: found Arm-v0, expected Leg-v0"):
        train(Leg, resume=tmp_path / "part")
    rest = train(Arm, resume=tmp_path / "part")
    assert rest.steps == 8192 and np.array_equal(rest.policy(obs), whole(obs))


def test_learn_goes_on_from_a_checkpoint_with_the_same_bits(tmp_path: Path) -> None:
    settings: dict[str, Any] = {"agents": 32, "horizon": 16, "minibatches": 2, "actor_hidden": [8], "seed": 2}
    obs, total = Arm.vec_env(40).reset(seed=3), 4 * 32 * 16
    Arm.learn(tmp_path / "whole", **settings, total_steps=total)
    first = {"checkpoint": tmp_path / "checkpoint", "callback": lambda stats: stats["iteration"] < 2}
    assert Arm.learn(tmp_path / "part", **settings, **first, total_steps=total)["iteration"] == 2
    assert not np.array_equal(load_policy(tmp_path / "part")(obs), load_policy(tmp_path / "whole")(obs))
    stats = Arm.learn(tmp_path / "part", **settings, checkpoint=tmp_path / "checkpoint", total_steps=total)
    assert stats["iteration"] == 4 and stats["steps"] == total
    assert np.array_equal(load_policy(tmp_path / "part")(obs), load_policy(tmp_path / "whole")(obs))

    # what was learned until Ctrl-C is there
    def interrupt(_: dict[str, Any]) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Arm.learn(tmp_path / "x", **settings, total_steps=total, checkpoint=tmp_path / "other", callback=interrupt)
    assert Arm.learn(tmp_path / "x", **settings, total_steps=total, checkpoint=tmp_path / "other")["iteration"] == 4
    assert np.array_equal(load_policy(tmp_path / "x")(obs), load_policy(tmp_path / "whole")(obs))
    with pytest.raises(ValueError, match="Leg-v0"):
        Leg.learn(tmp_path / "x", **settings, checkpoint=tmp_path / "checkpoint")


def test_policies_of_classes_are_loaded(tmp_path: Path) -> None:
    Arm.learn(tmp_path / "arm.safetensors", agents=16, total_steps=1)
    obs = Arm.vec_env(3).reset(seed=1)
    policy = load_policy(tmp_path / "arm.safetensors")
    assert policy.task == "Arm-v0" and (policy.obs_size, policy.act_size, policy.dt) == (4, 1, 0.05)
    policy.save(tmp_path / "arm.onnx")
    for name in ("arm.safetensors", "arm.onnx"):
        for task in (None, Arm, Arm(), Arm.vec_env(2).agent):
            np.testing.assert_allclose(load_policy(tmp_path / name, task)(obs), policy(obs), atol=1e-6)
    with pytest.raises(ValueError, match="found Arm-v0, expected Leg-v0"):
        load_policy(tmp_path / "arm.safetensors", Leg)
    with pytest.raises(ValueError, match="expected one observation of 1 numbers, as Leg-v0 has"):
        load_policy(tmp_path / "arm.onnx", Leg)
    with pytest.raises(ValueError, match="agent 'Arm-v0' does not exist"):
        evaluate(policy, 2)
    with pytest.raises(ValueError, match="agent is for Arm-v0, expected Leg-v0"):
        evaluate(policy, 2, task=Leg)


def test_what_goes_wrong_in_python_is_what_is_raised(tmp_path: Path) -> None:
    class Tired(Arm):
        decisions = 0

        def terminate(self) -> np.ndarray:
            type(self).decisions += 1
            if self.decisions > 20:
                raise RuntimeError("enough")
            return self.terminate_never()

    class Headless(Arm):
        mjcf = "nowhere.xml"

    for threads in (1, 2):
        Tired.decisions = 0
        with pytest.raises(RuntimeError, match="enough"):
            train(Tired, {"behaviors": {"Tired": CONFIG["behaviors"]["Arm"]}}, threads=threads)
    Arm.learn(tmp_path / "policy", agents=16, total_steps=1)
    with pytest.raises(RuntimeError, match="enough"):
        evaluate(load_policy(tmp_path / "policy"), 2, task=type("Arm", (Tired,), {}))
    with pytest.raises(ValueError, match=r"nowhere\.xml"):
        train(Headless)
    for wrong in (5, object):
        with pytest.raises(TypeError, match="expected a task's name or a MarathonAgent class"):
            train(wrong)
    with pytest.raises(ValueError, match="Leg"):
        train(Leg, CONFIG)
    assert not (tmp_path / "runs").exists()
