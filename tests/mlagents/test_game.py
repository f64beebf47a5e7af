"""Unmodified `mlagents_envs` drives the game, `marathon-game --mlagents-port`, whose window is on a virtual screen.

Promises: every batch has a decision of every agent, with the bits of `marathon-player`; a reset works at any time; the time
scale and the size of the window are those that Python asks for; the game ends, with exit code 0, when Python closes.

Needs Xvfb, xdotool and a Vulkan device (Debian: xvfb xdotool mesa-vulkan-drivers libvulkan1).
"""

import os
import subprocess
import threading
import time

import numpy as np
import pytest
from conftest import free_port
from mlagents_envs.base_env import ActionTuple
from mlagents_envs.environment import UnityEnvironment
from mlagents_envs.side_channel.engine_configuration_channel import EngineConfigurationChannel

if not os.environ.get("MARATHON_TEST_GAME"):
    pytest.skip("the game is not tested: ./test.sh --all does", allow_module_level=True)

GAME = os.environ["MARATHON_GAME"]
AGENTS = 16
NAME = "Hopper-v0?team=0"
# seconds that a decision simulates
DT = 0.02


@pytest.fixture
def screen():
    """A display that no other program uses."""
    words = ["Xvfb", "-displayfd", "1", "-noreset", "-screen", "0", "1280x720x24", "-nolisten", "tcp"]
    xvfb = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    yield f":{xvfb.stdout.readline().strip()}"
    xvfb.kill()
    xvfb.wait()


@pytest.fixture
def play(screen):
    """Starts the game, and what waits for it on its port: game, env, said = play(seed=3)."""
    opened = []

    def play(**options):
        port = free_port()
        words = [GAME, "hopper", "--agents", str(AGENTS), "--mlagents-port", str(port), "--quality", "low"]
        environ = {**os.environ, "DISPLAY": screen, "NO_COLOR": "1"}
        game = subprocess.Popen(words, env=environ, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        said = []
        threading.Thread(target=lambda: said.extend(game.stdout), daemon=True).start()
        env = UnityEnvironment(file_name=None, base_port=port, timeout_wait=60, **options)
        opened.append((game, env))
        return game, env, said

    yield play
    for game, env in opened:
        if env._loaded:
            env.close()
        game.kill()
        game.wait()


def step(env, random):
    """Random actions of everybody, and what they led to."""
    actions = random.uniform(-1, 1, (AGENTS, 4)).astype(np.float32)
    env.set_actions(NAME, ActionTuple(continuous=actions))
    env.step()
    return env.get_steps(NAME)


def run(env, steps):
    """Observations and rewards of all agents, in a row."""
    env.reset()
    random, numbers = np.random.default_rng(8), []
    for _ in range(steps):
        decisions, ends = step(env, random)
        assert list(decisions.agent_id) == list(range(AGENTS)) and set(ends.agent_id) <= set(range(AGENTS))
        numbers += [decisions.obs[0].ravel(), decisions.reward, ends.reward]
    return np.concatenate(numbers)


def wait_for(what, seconds=60):
    begun = time.monotonic()
    while not (found := what()):
        assert time.monotonic() - begun < seconds, "it has not come"
        time.sleep(0.2)
    return found


def test_all_agents_decide_in_the_window_and_with_the_bits_of_the_player(play, launch):
    game, env, said = play(seed=7)
    seen = run(env, 60)
    assert np.array_equal(run(launch("--spawn-env=Hopper-v0", f"--num-spawn-envs={AGENTS}", seed=7), 60), seen)
    # a reset in the middle: new episodes, no ends
    env.reset()
    decisions, ends = env.get_steps(NAME)
    assert len(decisions) == AGENTS and len(ends) == 0 and not decisions.reward.any()
    wait_for(lambda: any(f"loaded: {AGENTS} of another program" in line for line in said))
    env.close()
    assert game.wait(timeout=60) == 0, "".join(said)
    assert "panicked" not in "".join(said)


def test_the_time_scale_and_the_size_of_the_window_are_obeyed(play, screen):
    engine = EngineConfigurationChannel()
    game, env, said = play(seed=1, side_channels=[engine])
    engine.set_configuration_parameters(width=320, height=200, time_scale=1.0)
    env.reset()
    random = np.random.default_rng(1)

    def seconds(scale):
        engine.set_configuration_parameters(time_scale=scale)
        step(env, random)
        begun = time.monotonic()
        for _ in range(16):
            step(env, random)
        return time.monotonic() - begun

    # a step may have begun before the clock did; how fast it can be at most is the machine's affair
    real, slow, fast = seconds(1.0), seconds(0.1), seconds(50.0)
    assert real > 15 * DT and slow > 15 * 10 * DT and fast < 0.6 * slow, (real, slow, fast)

    def size():
        words = ["xdotool", "search", "--name", "^Marathon$", "getwindowgeometry"]
        done = subprocess.run(words, env={**os.environ, "DISPLAY": screen}, capture_output=True, text=True, check=False)
        return done.stdout.rpartition("Geometry: ")[2].strip()

    wait_for(lambda: size() == "320x200")
    engine.set_configuration_parameters(width=400, height=240)
    env.reset()
    wait_for(lambda: size() == "400x240")
    env.close()
    assert game.wait(timeout=60) == 0, "".join(said)
    assert "window: 320 x 200" in "".join(said) and "panicked" not in "".join(said)
