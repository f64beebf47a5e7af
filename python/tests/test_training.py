"""The native trainer from Python: the same bits as the command's, stopped by callbacks and Ctrl-C, resumed exactly."""

import copy
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from arm import Arm

import marathon_rl
from marathon_rl import MarathonEnv, Policy, evaluate, load_policy, train

ROOT = Path(__file__).parents[2]
# 64 agents make 4096 steps per iteration
SMALL = {"num_envs": 64, "seed": 3, "threads": 2}
CONFIG = {
    "run": {"agents": 64, "horizon": 64, "total_steps": 8192},
    "network": {"hidden": [16], "activation": "elu"},
    "ppo": {"epochs": 2, "minibatches": 4},
}
FOREIGN = {
    "behaviors": {
        "Hopper": {
            "trainer_type": "ppo",
            "hyperparameters": {"batch_size": 1024, "buffer_size": 4096},
            "network_settings": {"normalize": True, "hidden_units": 16, "num_layers": 1},
            "max_steps": 4096,
            "threaded": True,
        }
    }
}


@pytest.fixture
def obs() -> np.ndarray:
    env = marathon_rl.VecEnv("hopper", 40)
    return env.reset(seed=8).copy()


def command(folder: Path, *words: str) -> str:
    """The console script, as pip makes it."""
    code = "import sys; from marathon_rl._command import main; sys.argv[0] = 'marathon'; main()"
    done = subprocess.run([sys.executable, "-c", code, *words], cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout


def test_the_same_seed_gives_the_same_policy_here_and_by_the_command(tmp_path: Path, obs: np.ndarray) -> None:
    rows = []
    result = train("hopper", steps=12_288, callback=rows.append, **SMALL)
    assert not result.interrupted and result.steps == 12_288 and result.folder is None
    assert [row["iteration"] for row in rows] == [1, 2, 3] and rows[-1]["steps"] == 12_288
    assert {"return_mean", "kl", "steps_per_second", "reward/velocity"} <= rows[0].keys()
    assert result.evaluation["episodes"] == 100 == result.policy.meta["evaluation"]["episodes"]
    assert result.summary["seed"] == 3
    words = ["train", "hopper", "--steps", "12288", "--agents", "64", "--seed", "3", "--out", "run"]
    command(tmp_path, *words)
    assert np.array_equal(load_policy(tmp_path / "run")(obs), result.policy(obs))
    assert not np.array_equal(train("hopper", steps=12_288, **{**SMALL, "seed": 4}).policy(obs), result.policy(obs))


def test_configurations() -> None:
    result = train("hopper", CONFIG)
    assert result.policy.meta["hidden"] == [16] and result.policy.meta["activation"] == "elu"
    config = result.policy.meta["training"]["config"]
    assert config["ppo"]["epochs"] == 2
    # the preset holds for what is left out
    assert config["ppo"]["action_std"]["min"] == {"from": 0.42, "to": 0.01}
    result = train("hopper", ROOT / "assets/configs/hopper-fast.yaml", steps=100, num_envs=16)
    assert result.policy.meta["hidden"] == [32, 32]
    with pytest.raises(ValueError, match=r"config: ppo\.epoch: unknown key; did you mean 'epochs'"):
        train("hopper", {"ppo": {"epoch": 2}})


def test_configurations_of_ml_agents_are_imported_with_notes() -> None:
    with pytest.warns(UserWarning, match="behaviors.Hopper.threaded has no effect"):
        result = train("hopper", FOREIGN)
    assert result.steps == 4096 and result.policy.meta["activation"] == "swish"
    wrong = {"behaviors": {"Hopper": {**FOREIGN["behaviors"]["Hopper"], "time_horizn": 3}}}
    with pytest.raises(ValueError, match=r"config: behaviors.Hopper.time_horizn: .*time_horizon"):
        train("hopper", wrong)


def test_what_is_wrong_is_said_in_pythons_terms(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="config is of type int, expected a path or a dictionary"):
        train("hopper", 5)
    with pytest.raises(ValueError, match="seed is -1, expected a whole number"):
        train("hopper", seed=-1)
    with pytest.raises(ValueError, match="threads is -2, expected a whole number"):
        evaluate(load_policy(ROOT / "assets/policies/hopper.safetensors"), threads=-2)
    folder = tmp_path / "run"
    train("hopper", steps=4096, out=folder, **SMALL)
    for wrong, message in [
        (lambda: train("hopper", steps=4096, out=folder), f"out {folder} already holds a run.* by train(resume="),
        (lambda: train(resume=folder), "the run is complete with 4,096 steps; .* such as steps=8_192"),
        (lambda: train(resume=folder, steps=100), "steps is 100, but 4,096 steps are done"),
        (lambda: train(resume=tmp_path), "resume"),
    ]:
        with pytest.raises((ValueError, OSError)) as raised:
            wrong()
        text = str(raised.value)
        assert re.search(re.escape(message).replace(r"\.\*", ".*"), text) and "--" not in text and "`" not in text, text


def test_any_function_can_be_evaluated() -> None:
    policy = load_policy(ROOT / "assets/policies/hopper.safetensors")
    for episodes in (5, 40):
        native, ours = evaluate(policy, episodes), evaluate(policy.__call__, episodes, task="hopper")
        assert native.keys() == ours.keys()
        assert all(ours[name] == pytest.approx(native[name], rel=1e-9) for name in native)
    # more episodes than agents, arguments of the task, a class in place of a name
    native = evaluate(policy, 1030, task="hopper", max_episode_steps=3)
    assert (native["episodes"], native["length_mean"], native["falls"]) == (1030, 3, 0)
    assert evaluate(lambda obs: np.zeros((len(obs), 1)), 3, task=Arm)["length_mean"] == Arm.max_episode_steps
    broken = evaluate(lambda obs: np.full((len(obs), 3), np.nan), 4, task="Hopper-v5", frame_skip=2)
    assert (broken["diverged"], broken["falls"], broken["length_mean"], broken["return_mean"]) == (4, 4, 1, 0)
    for wrong, message in [
        (lambda: evaluate(lambda obs: obs), "task is missing"),
        (lambda: evaluate(3, task="hopper"), "policy is of type int, expected a Policy, a path or a function"),
    ]:
        with pytest.raises(TypeError, match=message):
            wrong()
    with pytest.raises(ValueError, match=r"actions have the shape \(2, 31\), expected \(2, 4\)"):
        evaluate(lambda obs: obs, 2, task="hopper")


def test_policies_can_be_copied(obs: np.ndarray) -> None:
    policy = load_policy(ROOT / "assets/policies/hopper.safetensors")
    for other in (copy.deepcopy(policy), pickle.loads(pickle.dumps(policy))):  # noqa: S301
        assert np.array_equal(other(obs), policy(obs)) and other.meta == policy.meta


@pytest.mark.parametrize("answer", [None, 0, True, "no", np.True_])
def test_only_false_stops(answer: object) -> None:
    seen = []
    result = train("hopper", steps=8192, callback=lambda row: seen.append(row) or answer, **SMALL)
    assert len(seen) == 2 and not result.interrupted
    seen.clear()
    config = {"run": {"agents": 16, "horizon": 16, "total_steps": 512}, "ppo": {"minibatches": 1, "epochs": 1}}
    train(Arm, config, callback=lambda row: seen.append(row) or answer)
    assert len(seen) == 2
    for no in (False, np.False_):
        seen.clear()
        assert train("hopper", steps=8192, callback=lambda row, no=no: seen.append(row) or no, **SMALL).interrupted
        assert train(Arm, config, callback=lambda row, no=no: seen.append(row) or no).interrupted
        assert len(seen) == 2


def test_what_is_wrong_is_said() -> None:
    with pytest.raises(ValueError, match="did you mean 'Hopper-v0'"):
        train("hoper")
    with pytest.raises(ValueError, match="num_envs is 17, expected a multiple of 16, such as 16"):
        train("hopper", num_envs=17)
    with pytest.raises(ValueError, match="task is missing"):
        train()
    with pytest.raises(ValueError, match="config is for new runs, not for one that resume continues"):
        train("hopper", CONFIG, resume="runs/hopper-1")
    with pytest.raises(ValueError, match="seed is for new runs"):
        train(resume="runs/hopper-1", seed=1)
    with pytest.raises(ValueError, match="num_envs is for new runs"):
        train(resume="runs/hopper-1", num_envs=16)
    with pytest.raises(ValueError, match="stepps is for new runs"):
        train(resume="runs/hopper-1", stepps=1)
    with pytest.raises(TypeError, match="unexpected keyword argument 'agents'"):
        train("hopper", agents=16)
    with pytest.raises(FileNotFoundError, match="no such file"):
        load_policy("nowhere.safetensors")


def test_a_callback_can_stop(tmp_path: Path) -> None:
    result = train("hopper", callback=lambda row: row["iteration"] < 2, out=tmp_path / "run", **SMALL)
    assert result.interrupted and result.steps == 8192 and result.evaluation is None
    assert result.folder == tmp_path / "run" and (tmp_path / "run/policy.safetensors").exists()

    def fail(row: dict[str, float | None]) -> None:
        raise RuntimeError("the callback's own")

    with pytest.raises(RuntimeError, match="the callback's own"):
        train("hopper", callback=fail, **SMALL)


def test_ctrl_c_ends_training_and_a_resumed_run_is_as_if_nothing_had_happened(tmp_path: Path, obs: np.ndarray) -> None:
    rows = []

    def interrupt(row: dict[str, float | None]) -> None:
        rows.append(row)
        if row["iteration"] == 2:
            os.kill(os.getpid(), signal.SIGINT)

    # in the background of a script, a process ignores Ctrl-C
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    with pytest.raises(KeyboardInterrupt):
        train("hopper", steps=16_384, callback=interrupt, out=tmp_path / "run", **SMALL)
    signal.signal(signal.SIGINT, before)
    assert 2 <= len(rows) <= 3
    result = train(resume=tmp_path / "run")
    assert not result.interrupted and result.steps == 16_384
    whole = train("hopper", steps=16_384, **SMALL)
    assert np.array_equal(result.policy(obs), whole.policy(obs))
    assert (tmp_path / "run/progress.csv").read_text().count("\n") == 5
    with pytest.raises(ValueError, match="the run is complete"):
        train(resume=tmp_path / "run")


def test_other_threads_run_while_it_trains() -> None:
    turns, done = 0, threading.Event()
    thread = threading.Thread(target=lambda: (train("hopper", steps=65_536, **SMALL), done.set()))
    thread.start()
    while not done.wait(1e-4):
        turns += 1
    thread.join()
    assert turns > 20


def test_policies_are_functions_of_arrays(tmp_path: Path, obs: np.ndarray) -> None:
    policy = load_policy(ROOT / "assets/policies/hopper.safetensors")
    assert isinstance(policy, Policy) and (policy.task, policy.obs_size, policy.act_size) == ("Hopper-v0", 31, 4)
    actions = policy(obs)
    assert actions.shape == (40, 4) and actions.dtype == np.float32 and np.abs(actions).max() <= 1
    # one observation, any batch, any type: the same bits
    assert np.array_equal(policy(obs[17]), actions[17]) and policy(obs[17]).shape == (4,)
    assert np.array_equal(policy(np.tile(obs, (30, 1)).astype(np.float64))[-40:], actions)
    assert policy(obs[:0]).shape == (0, 4)
    # drawn actions come from the seed, and scatter about the best ones
    drawn = policy(obs, rng=1)
    assert np.array_equal(policy(obs, rng=np.random.default_rng(1)), drawn) and not np.array_equal(drawn, actions)
    assert not np.array_equal(policy(obs, rng=2), drawn)
    many = np.mean([policy(obs[:1], rng=seed) for seed in range(400)], axis=0)
    inside = np.abs(actions[0]) < 0.5
    assert np.abs(many[0] - actions[0])[inside].max(initial=0) < 0.05
    policy.save(tmp_path / "copy.safetensors")
    assert np.array_equal(load_policy(tmp_path / "copy.safetensors")(obs), actions)
    for wrong in (obs[:, :30], obs[None], np.float32(1)):
        with pytest.raises(ValueError, match=r"expected \(31,\) or \(n, 31\)"):
            policy(wrong)


def test_evaluation_agrees_with_playing_by_hand() -> None:
    policy = load_policy(ROOT / "assets/policies/hopper.safetensors")
    result = evaluate(policy, 20, seed=5)
    assert result == evaluate(policy, 20, seed=5, threads=1) and result["episodes"] == 20
    env, total, ended = MarathonEnv("hopper", max_episode_steps=1000), 0.0, False
    obs, _ = env.reset(seed=1)
    while not ended:
        obs, reward, terminated, truncated, _ = env.step(policy(obs))
        total, ended = total + reward, terminated or truncated
    assert result["return_min"] - 20 < total < result["return_max"] + 20


def test_the_command_comes_with_the_package(tmp_path: Path) -> None:
    assert "Hopper-v0" in command(tmp_path, "list") and "marathon 0" in command(tmp_path, "--version")


def test_a_run_may_start_from_a_policy(tmp_path: Path) -> None:
    """It acts as the policy did at first: a run that has only filled its statistics is no different yet."""
    first = train("hopper", steps=200_000, seed=1, threads=1, out=tmp_path / "first")
    again = train("hopper", steps=8_192, seed=2, threads=1, initialize_from=tmp_path / "first")
    fresh = train("hopper", steps=8_192, seed=2, threads=1)
    assert first.evaluation is not None and again.evaluation is not None and fresh.evaluation is not None
    assert again.evaluation["return_mean"] > 2 * fresh.evaluation["return_mean"]
    assert again.evaluation["return_mean"] > 0.3 * first.evaluation["return_mean"]
    with pytest.raises(ValueError, match="initialize_from is for new runs"):
        train(resume=tmp_path / "first", initialize_from=tmp_path / "first")


def test_progress_is_shown_unless_it_is_not_wanted(capfd: pytest.CaptureFixture[str]) -> None:
    config = copy.deepcopy(FOREIGN)
    config["behaviors"]["Hopper"]["summary_freq"] = 1024
    # it has no effect, which is a warning
    del config["behaviors"]["Hopper"]["threaded"]
    train("Hopper-v0", config, seed=3, threads=2)
    text = capfd.readouterr().err
    assert "4,096 of 4,096 steps" in text, text
    train("Hopper-v0", config, seed=3, threads=2, progress=False)
    assert capfd.readouterr() == ("", "")
