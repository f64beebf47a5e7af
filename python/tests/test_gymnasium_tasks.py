"""Gymnasium's own tasks can be replaced by ours in a program that uses `gymnasium.make`: the same spaces, keyword
arguments, infos, and the same numbers. (The kernels are compared decision by decision in Rust's tests.)"""

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest

import marathon_rl
from marathon_rl import MarathonEnv, MarathonVectorEnv, VecEnv

IDS = [id for id in marathon_rl.ids() if id in gymnasium.registry]
KEYWORDS = {
    "Hopper-v5": {"ctrl_cost_weight": 0.1, "healthy_z_range": (0.6, float("inf")), "terminate_when_unhealthy": False},
    "Ant-v5": {"exclude_current_positions_from_observation": False, "include_cfrc_ext_in_observation": False},
    "Humanoid-v5": {"include_cinert_in_observation": False, "contact_cost_range": (-np.inf, 5.0)},
    "Walker2d-v5": {"frame_skip": 2},
}


def pair(id: str, **options) -> tuple[gymnasium.Env, gymnasium.Env]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs = gymnasium.make(id, **options)
    # double precision, as there
    return gymnasium.make(f"marathon_rl/{id}", isa="f64", **options), theirs


def test_there_are_eleven() -> None:
    assert len(IDS) == 11


@pytest.mark.parametrize(("id", "options"), [(id, {}) for id in IDS] + list(KEYWORDS.items()))
def test_spaces_infos_and_numbers_are_gymnasiums(id: str, options: dict[str, Any]) -> None:
    ours, theirs = pair(id, **options)
    assert ours.observation_space == theirs.observation_space and ours.action_space == theirs.action_space
    assert ours.metadata["render_fps"] == theirs.metadata["render_fps"]
    assert ours.spec.max_episode_steps == theirs.spec.max_episode_steps
    assert ours.unwrapped.dt == pytest.approx(theirs.unwrapped.dt)
    ours.reset(seed=1)
    theirs.reset(seed=1)
    data = theirs.unwrapped.data
    ours.unwrapped.set_state(data.qpos, data.qvel)
    theirs.action_space.seed(0)
    for _ in range(10):
        action = theirs.action_space.sample()
        expected_obs, expected_reward, expected_terminated, _, expected = theirs.step(action)
        obs, reward, terminated, _, info = ours.step(action)
        assert obs.dtype == expected_obs.dtype == np.float64
        np.testing.assert_allclose(obs, expected_obs, rtol=1e-4, atol=1e-4)
        assert reward == pytest.approx(expected_reward, rel=1e-4, abs=1e-4)
        assert terminated == expected_terminated
        for name in expected.keys() - {"tendon_length", "tendon_velocity"}:
            assert info[name] == pytest.approx(expected[name], rel=1e-3, abs=1e-3), name
        if terminated:
            break


def test_keyword_arguments_are_checked() -> None:
    with pytest.raises(TypeError, match=r"'ctrl_cost_wait'.*did you mean 'ctrl_cost_weight'"):
        MarathonEnv("Hopper-v5", ctrl_cost_wait=1.0)
    with pytest.raises(ValueError, match="healthy_z_range"):
        VecEnv("Hopper-v5", healthy_z_range="high")
    spec = marathon_rl.spec("Hopper-v5", ctrl_cost_weight=2)
    assert spec.options["ctrl_cost_weight"] == 2.0 and spec.options["healthy_z_range"] == (0.7, np.inf)


def test_many_agents_take_them_too() -> None:
    envs = gymnasium.make_vec("marathon_rl/Ant-v5", num_envs=3, exclude_current_positions_from_observation=False)
    assert isinstance(envs, MarathonVectorEnv)
    obs, infos = envs.reset(seed=0)
    assert obs.shape == (3, 107) and obs.dtype == np.float64
    np.testing.assert_allclose(infos["x_position"], obs[:, 0], atol=1e-5)
    *_, infos = envs.step(np.zeros((3, 8)))
    np.testing.assert_array_equal(infos["reward_forward"], infos["reward_terms"]["reward_forward"])
