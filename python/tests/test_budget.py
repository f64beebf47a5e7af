"""Numbers of things that cannot be had are errors with the argument's name, before memory is asked for.

They are a `MemoryError` beyond the budget, a `ValueError` beyond all sense. The interpreter goes on."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

import marathon_rl
from marathon_rl import MarathonAgent, MarathonVectorEnv, Model, Renderer, Simulation, VecEnv, train

PENDULUM = """
<mujoco>
  <worldbody><body><joint name="swing" axis="0 1 0"/><geom size="0.1" pos="0 0 -1"/></body></worldbody>
  <actuator><motor joint="swing"/></actuator>
</mujoco>"""


class Pendulum(MarathonAgent):
    """Swings."""

    mjcf = PENDULUM

    def observations(self) -> list[Any]:
        return [self.sim.qpos]

    def step_reward(self) -> dict[str, Any]:
        return {"still": -abs(self.sim.qvel[:, 0])}


def push(body: int) -> None:
    Simulation(Model.from_xml_string(PENDULUM)).push([[0, 0, 0]], body=body)


MAKERS: dict[str, Callable[[int], Any]] = {
    "VecEnv": lambda n: VecEnv("hopper", n),
    "VecEnv of terrains": lambda n: VecEnv("TerrainWalker2d-v0", n),
    "MarathonVectorEnv": lambda n: MarathonVectorEnv("Hopper-v5", n),
    "Simulation": lambda n: Simulation(Model.from_xml_string(PENDULUM), n),
    "MarathonAgent": Pendulum.vec_env,
}


@pytest.mark.parametrize("name", MAKERS)
def test_agents_beyond_the_budget_are_a_memory_error(name: str) -> None:
    make = MAKERS[name]
    with pytest.raises(
        MemoryError, match=r"num_envs is 1000000000, which asks for .* GB; the limit 'agents_memory' is 16 GB"
    ):
        make(10**9)
    for n in (2**32, 2**62, 2**63, 2**64 - 1):
        with pytest.raises(ValueError, match=re.escape(f"is {n}, expected at most 4294967295")):
            make(n)
    for n in (-1, 2**64, 10**30):
        with pytest.raises(ValueError, match=re.escape(f"{n}, expected")):
            make(n)


def test_the_budget_can_be_raised() -> None:
    """And agents beyond the present one take no more than it said."""
    code = (
        "import resource, marathon_rl\n"
        "def peak(): return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024\n"
        "before = peak()\n"
        "try: marathon_rl.VecEnv('Hopper-v5', 40_000, threads=1).reset()\n"
        "except MemoryError as error: print('refused', error)\n"
        "else: print('made', peak() - before)\n"
    )

    def run(limit: str) -> str:
        environ = {**os.environ, "MARATHON_LIMITS": limit}
        return subprocess.run(
            [sys.executable, "-c", code], env=environ, capture_output=True, text=True, check=True
        ).stdout

    assert "the limit 'agents_memory' is 10 MB" in run("agents_memory=10MB")
    made = run("agents_memory=1GB").split()
    assert made[0] == "made"
    asked = re.search(r"asks for ([\d.]+) MB", run("agents_memory=1kB"))
    assert asked is not None
    assert int(made[1]) < 1e6 * float(asked[1]) * 1.2 + 20e6


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: VecEnv("hopper", 1, threads=10**6), "threads is 1000000, expected at most 1024"),
        (lambda: VecEnv("hopper", 1, threads=2**62), "threads is 4611686018427387904, expected at most"),
        (
            lambda: Simulation(Model.from_xml_string(PENDULUM), 1, threads=10**6),
            "threads is 1000000, expected at most 1024",
        ),
        (lambda: Renderer("hopper", 10**9, 10), "image size 1000000000x10 is out of range"),
        (lambda: Renderer("hopper", 2**62, 10), "width is 4611686018427387904, expected at most"),
        (lambda: Renderer("hopper", 10, -1), "height is -1, expected a whole number from 0"),
        (
            lambda: Renderer.of(Model.from_xml_string(PENDULUM), 10, 10, num_envs=2**62),
            "num_envs is 4611686018427387904, expected",
        ),
        (lambda: train("hopper", num_envs=2**62), "num_envs is 4611686018427387904, expected at most"),
        (lambda: train("hopper", threads=2**62), "threads is 4611686018427387904, expected at most"),
        (lambda: VecEnv("hopper", 1, max_episode_steps=-1), "max_episode_steps is -1, expected a whole number"),
        (lambda: push(-1), "body is -1, expected a whole number"),
        (lambda: push(2**62), "body is 4611686018427387904, expected less than 2"),
    ],
)
def test_numbers_beyond_all_sense_are_refused_by_name(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        call()


def test_a_run_that_does_not_fit_is_a_memory_error() -> None:
    with pytest.raises(MemoryError, match="fewer agents"):
        train("hopper", num_envs=32_000_000)


def test_evaluate_refuses_more_episodes_than_make_sense() -> None:
    policy = marathon_rl.train("hopper", num_envs=16, steps=16, threads=1).policy
    with pytest.raises(ValueError, match=r"episodes is 4611686018427387904, expected at most"):
        marathon_rl.evaluate(policy, episodes=2**62)
