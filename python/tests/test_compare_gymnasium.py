"""A policy scores the same here and in the installed Gymnasium, and the comparison says when it does not."""

from pathlib import Path

import numpy as np
import pytest

import marathon_rl
from marathon_rl import compare_gymnasium
from marathon_rl.compare_gymnasium import Comparison, Score


@pytest.mark.parametrize("task", ["Hopper-v5", "Walker2d-v5", "InvertedPendulum-v5", "InvertedDoublePendulum-v5"])
def test_both_sides_agree_on_a_policy(task: str) -> None:
    # a feedback that keeps some of them up for a while
    spec = marathon_rl.spec(task)
    gain = np.random.default_rng(3).normal(0, 0.1, (spec.obs_size, spec.act_size))
    verdict = compare_gymnasium.compare(task, lambda obs: np.clip(obs @ gain, -1, 1), episodes=20, here=100)
    assert len(verdict.gymnasium.returns) == 20
    assert verdict.marathon.falls == 100
    assert verdict.gymnasium.falls == 20
    # three times the confidence interval: the seeds are fixed, the draws of the two sides are not the same
    assert abs(verdict.difference) <= 3 * verdict.half_width, str(verdict)


def test_a_trained_policy_is_compared_from_its_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "policy.safetensors"
    marathon_rl.train("InvertedPendulum-v5", steps=200_000, num_envs=64, seed=1).policy.save(path)
    compare_gymnasium.main([str(path), "--episodes", "3", "--here", "16"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "InvertedPendulum-v5"
    assert "(16 episodes" in lines[1]
    assert "(3 episodes" in lines[2]
    assert "confidence interval" in lines[3]


def test_scores_and_comparisons() -> None:
    low, high = Score((1.0, 2.0, 3.0), 1), Score((11.0, 12.0, 13.0), 0)
    assert (low.mean, high.mean) == (2.0, 12.0)
    assert low.half_width == pytest.approx(1.96 / np.sqrt(3))
    assert str(low) == "2 +- 1 (3 episodes, 1 falls)"
    verdict = Comparison("T", low, high)
    assert verdict.difference == 10.0
    assert not verdict.agrees
    assert "10 +- 2: outside" in str(verdict)
    assert Comparison("T", low, low).agrees


def test_one_episode_is_too_few() -> None:
    with pytest.raises(ValueError, match="episodes is 1, expected at least 2"):
        compare_gymnasium.play_here("Hopper-v5", lambda obs: obs[:, :3], 1)
