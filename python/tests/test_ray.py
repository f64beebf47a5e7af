"""Training on Ray's workers gives the bits of training without, also when workers are killed on the way; RLlib finds
the environments. On a cluster of several processes on this machine."""

import gc
import importlib
import inspect
import os
import runpy
import signal
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ray
from ray.tune.registry import ENV_CREATOR, _global_registry

import marathon_rl
from marathon_rl.ray import Workers, register, train

EXAMPLES = Path(__file__).parents[2] / "examples" / "python"
# 4096 steps per rollout
SMALL: dict[str, Any] = {"num_envs": 64, "seed": 3, "threads": 1, "steps": 5 * 4096}

# Ray and RLlib warn of their own ways
pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture(scope="module", autouse=True)
def cluster() -> Iterator[None]:
    for attempt in range(3):
        try:
            ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, configure_logging=False)
            break
        except Exception:
            # Ray's processes must be up within 30 s, which a very busy machine does not grant at once
            ray.shutdown()
            if attempt == 2:
                raise
    yield
    ray.shutdown()
    # Ray does not wait for its processes, of which Python would warn
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        gc.collect()


@pytest.fixture(scope="module")
def want() -> marathon_rl.TrainResult:
    return marathon_rl.train("hopper", **SMALL)


def same(a: marathon_rl.TrainResult, b: marathon_rl.TrainResult) -> bool:
    obs = np.random.default_rng(1).normal(size=(64, a.policy.obs_size)).astype(np.float32)
    return a.steps == b.steps and np.array_equal(a.policy(obs), b.policy(obs))


@pytest.mark.parametrize("workers", [1, 2])
def test_workers_do_not_change_the_policy(workers: int, want: marathon_rl.TrainResult) -> None:
    rows: list[dict[str, Any]] = []
    got = train("hopper", workers=workers, callback=rows.append, **SMALL)
    assert same(got, want)
    assert got.evaluation == want.evaluation
    assert [row["iteration"] for row in rows] == [1, 2, 3, 4, 5]


def test_killed_workers_change_nothing(want: marathon_rl.TrainResult) -> None:
    workers = Workers(2)
    killed = []

    def kill(row: dict[str, Any]) -> None:
        # a process of the operating system, and an actor that Ray gives up for good
        if row["iteration"] == 2:
            killed.append(ray.get(workers._actors[0].__ray_call__.remote(lambda _: os.getpid())))
            os.kill(killed[0], signal.SIGKILL)
        if row["iteration"] == 3:
            workers.kill(1)

    got = train("hopper", workers=workers, callback=kill, **SMALL)
    workers.close()
    assert workers.replaced == 2
    assert len(killed) == 1
    assert same(got, want)


def test_a_run_goes_on_with_and_without_workers(tmp_path: Path, want: marathon_rl.TrainResult) -> None:
    stop = {2: tmp_path / "there", 3: tmp_path / "here"}
    for iteration, out in stop.items():
        begin, go_on = (train, marathon_rl.train) if iteration == 2 else (marathon_rl.train, train)
        half = begin("hopper", out=out, callback=lambda row, last=iteration: row["iteration"] < last, **SMALL)
        assert half.interrupted
        assert same(go_on(resume=out), want)


def test_errors_of_a_worker_end_the_run() -> None:
    class Broken(Workers):
        def play(self, orders: Any, states: list[Any]) -> Iterator[tuple[int, Any]]:
            return super().play(orders[:100], states)

    workers = Broken(2)
    with pytest.raises(Exception, match="marathon-orders: header"):
        train("hopper", workers=workers, **SMALL)
    workers.close()
    assert workers.replaced == 0
    with pytest.raises(ValueError, match="count is 0, expected at least 1"):
        Workers(0)


def test_workers_start_from_a_policy_as_a_run_on_one_machine_does(
    tmp_path: Path, want: marathon_rl.TrainResult
) -> None:
    want.policy.save(tmp_path / "first.safetensors")
    short = {**SMALL, "steps": 2 * 4096, "initialize_from": tmp_path / "first.safetensors"}
    assert same(train("hopper", **short), marathon_rl.train("hopper", **short))


def test_it_takes_the_arguments_of_the_native_trainer() -> None:
    native, own = (set(inspect.signature(f).parameters) for f in (marathon_rl.train, train))
    assert native - {"players"} == own - {"workers"}


def pid(actor: Any) -> int:
    return ray.get(actor.__ray_call__.remote(lambda _: os.getpid()))


def test_a_worker_that_stops_answering_is_replaced(want: marathon_rl.TrainResult) -> None:
    # a new process takes seconds to start, longer on a busy machine
    workers = Workers(2, answer_timeout=30)
    stopped = []

    def stop(row: dict[str, Any]) -> None:
        if row["iteration"] == 2:
            stopped.append(pid(workers._actors[0]))
            os.kill(stopped[0], signal.SIGSTOP)

    try:
        got = train("hopper", workers=workers, callback=stop, **SMALL)
    finally:
        workers.close()
    assert workers.replaced == 1
    assert same(got, want)


def test_a_run_whose_workers_do_not_answer_ends_with_an_error(tmp_path: Path) -> None:
    class Stopped(Workers):
        """Workers whose replacements stop, too."""

        begun = False

        def _make(self, i: int, slices: int) -> Any:
            actor = super()._make(i, slices)
            if self.begun:
                os.kill(pid(actor), signal.SIGSTOP)
            return actor

    workers = Stopped(1, answer_timeout=5)

    def stop(row: dict[str, Any]) -> None:
        workers.begun = True
        if row["iteration"] == 2:
            os.kill(pid(workers._actors[0]), signal.SIGSTOP)

    out = tmp_path / "run"
    with pytest.raises(TimeoutError, match="worker 0 of 1 has not answered for 5 s, nor had the one before it"):
        train("hopper", workers=workers, callback=stop, out=out, **SMALL)
    workers.close()
    # the trained policy is saved
    assert marathon_rl.train(resume=out).steps == SMALL["steps"]
    for wrong in (0, -1, float("inf"), float("nan")):
        with pytest.raises(ValueError, match="answer_timeout is"):
            Workers(1, answer_timeout=wrong)


def test_without_ray_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    monkeypatch.delitem(sys.modules, "marathon_rl.ray")
    with pytest.raises(ImportError, match=r"pip install 'marathon-rl\[ray\]'"):
        importlib.import_module("marathon_rl.ray")


def test_the_example_ends_with_the_same_fingerprint_when_a_worker_is_killed() -> None:
    words = ["--task", "Hopper-v5", "--agents", "64", "--steps", str(4 * 4096)]
    main = runpy.run_path(str(EXAMPLES / "ray_train.py"))["main"]
    assert main([*words, "--workers", "1"]) == main([*words, "--workers", "2", "--kill"])


def test_rllib_trains_on_the_environments() -> None:
    main = runpy.run_path(str(EXAMPLES / "rllib.py"))["main"]
    (mean,) = main(["--iterations", "1", "--agents", "16", "--batch", "1024"])
    assert mean > 0


def test_rllib_passes_arguments_on() -> None:
    register()
    create = _global_registry.get(ENV_CREATOR, "marathon_rl/Hopper-v5")
    one, many = create({"ctrl_cost_weight": 0.5}), create({"num_envs": 3})
    assert isinstance(one, marathon_rl.MarathonEnv)
    assert one.task_spec.options["ctrl_cost_weight"] == 0.5
    assert isinstance(many, marathon_rl.MarathonVectorEnv)
    assert many.num_envs == 3
