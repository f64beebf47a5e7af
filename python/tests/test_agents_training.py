"""Agents written in Python in the place of a task's name: trained, resumed with the same bits, evaluated, loaded."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arm import Arm

from marathon_rl import evaluate, load_policy, train


class Leg(Arm):
    """It sees less."""

    def observations(self) -> list[np.ndarray]:
        return [self.joint_velocities()]


class Weighted(Arm):
    """Its constructor takes an option."""

    def __init__(self, num_envs: int = 1, *, weight: float = 1.0, **options: Any) -> None:
        super().__init__(num_envs, **options)
        self.weight = weight

    def step_reward(self) -> dict[str, np.ndarray]:
        return {"height": self.weight * (self.height("arm") / 0.15 + 1)}


# 64 agents make 2048 steps per iteration
CONFIG = {
    "run": {"agents": 64, "horizon": 32, "total_steps": 40_960},
    "network": {"hidden": [16]},
    "rewards": {"task": {"gamma": 0.9}},
    "ppo": {"epochs": 4, "minibatches": 4, "lr": 3e-3, "value_lr": 3e-3},
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
    # without the class, the task is unknown
    with pytest.raises(ValueError, match="agent 'Arm-v0' does not exist"):
        train(resume=tmp_path / "part")
    with pytest.raises(ValueError, match=r"agent: found Arm-v0, expected Leg-v0"):
        train(Leg, resume=tmp_path / "part")
    rest = train(Arm, resume=tmp_path / "part")
    assert rest.steps == 8192 and np.array_equal(rest.policy(obs), whole(obs))


def test_what_is_learned_until_ctrl_c_is_there(tmp_path: Path) -> None:
    obs = Arm.vec_env(40).reset(seed=3)
    settings: dict[str, Any] = {"seed": 2, "steps": 8192}
    whole = train(Arm, CONFIG, **settings).policy

    def interrupt(_: dict[str, Any]) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(Arm, CONFIG, out=tmp_path / "run", callback=interrupt, **settings)
    assert not np.array_equal(load_policy(tmp_path / "run")(obs), whole(obs))
    assert np.array_equal(train(Arm, resume=tmp_path / "run").policy(obs), whole(obs))


def test_policies_of_classes_are_loaded(tmp_path: Path) -> None:
    train(Arm, {"run": {"agents": 16, "total_steps": 1}}).policy.save(tmp_path / "arm.safetensors")
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


def test_a_class_takes_options_as_keywords() -> None:
    assert Weighted.vec_env(2, weight=3).agent.weight == 3
    settings: dict[str, Any] = {"steps": 2048, "seed": 1}
    # nothing is paid for nothing, whatever the arms do
    nothing = train(Weighted, CONFIG, weight=0, **settings)
    assert nothing.evaluation is not None and nothing.evaluation["return_mean"] == 0
    assert evaluate(nothing.policy, 16, task=Weighted)["return_mean"] != 0
    assert evaluate(nothing.policy, 16, task=Weighted, weight=0)["return_mean"] == 0
    # an object stands for its class
    obs = Arm.vec_env(40).reset(seed=3)
    by_class, by_object = (train(task, CONFIG, **settings).policy(obs) for task in (Arm, Arm()))
    assert np.array_equal(by_class, by_object)
    with pytest.raises(TypeError, match="weihgt"):
        train(Weighted, CONFIG, weihgt=0, **settings)


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
            train(Tired, CONFIG, threads=threads)
    train(Arm, steps=1, num_envs=16).policy.save(tmp_path / "policy.safetensors")
    with pytest.raises(RuntimeError, match="enough"):
        evaluate(load_policy(tmp_path / "policy.safetensors"), 2, task=type("Arm", (Tired,), {}))
    with pytest.raises(ValueError, match=r"nowhere\.xml"):
        train(Headless)
    for wrong, found in ((5, "of type int"), (object, "the class object")):
        with pytest.raises(TypeError, match=f"task is {found}, expected a task's name, .* or a MarathonAgent"):
            train(wrong)
    with pytest.raises(ValueError, match="Leg"):
        train(Leg, {"behaviors": {"Arm": {"max_steps": 1}}})
    assert not (tmp_path / "runs").exists()
