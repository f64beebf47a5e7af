"""A browser can watch an environment that Python steps."""

import json
import os
import struct
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from arm import Arm

import marathon_rl

SCENE, FRAME, GROUND = 1, 2, 4


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """Return a folder with a page."""
    (tmp_path / "index.html").write_text("<p>the page")
    return tmp_path


def messages(url):
    """Yield the messages of a viewer: kind and content."""
    address, token = url.split("/#/live?token=")
    with urllib.request.urlopen(f"{address}/live?token={token}", timeout=30) as stream:
        end = time.monotonic() + 30
        while head := stream.read(5):
            # the server says every two seconds that it is there
            assert time.monotonic() < end, "the message does not come"
            length, kind = struct.unpack("<IB", head)
            yield kind, stream.read(length)


def of_kind(stream, kind):
    """Return the content of the next message of a kind."""
    return next(content for found, content in stream if found == kind)


def test_steps_are_shown(page):
    """The first 16 agents are shown, with the poses that they have."""
    env = marathon_rl.VecEnv("Hopper-v0", num_envs=20)
    env.reset(seed=1)
    viewer = env.show(page=page)
    stream = messages(viewer.url)
    scene = json.loads(of_kind(stream, SCENE))
    assert scene["agents"] == 16
    first = of_kind(stream, FRAME)
    assert viewer.watched
    rng, frame = np.random.default_rng(0), first
    while struct.unpack_from("<d", frame)[0] < 0.5:
        # at most 60 frames a second
        time.sleep(0.02)
        env.step(rng.uniform(-1, 1, (20, env.spec.act_size)).astype(np.float32))
        frame = of_kind(stream, FRAME)
    shown = np.frombuffer(frame, "<f4", offset=8 + 16 * 4)
    matrices = shown.reshape(-1, 16, 16)[-len(scene["model"]["bodies"]) :]
    # the trunk stands where the state has it
    env_x = env.get_state()[0][:16, 0]
    assert np.allclose(matrices[1, :, 12], env_x, atol=0.2)
    assert not np.array_equal(np.frombuffer(first, "<f4", offset=8 + 16 * 4), shown)
    viewer.close()
    assert not viewer.watched
    env.step(np.zeros((20, env.spec.act_size), np.float32))


def test_new_episodes_are_told(page):
    """The end of an episode changes its number."""
    env = marathon_rl.VecEnv("Hopper-v0", num_envs=2, autoreset="same_step", max_episode_steps=5)
    env.reset(seed=1)
    viewer = env.show(page=page)
    stream = messages(viewer.url)
    before = struct.unpack_from("<2I", of_kind(stream, FRAME), 8)
    for _ in range(5):
        # at most 60 frames a second
        time.sleep(0.02)
        env.step(np.zeros((2, env.spec.act_size), np.float32))
    after = before
    while not all(b > a for a, b in zip(before, after, strict=True)):
        after = struct.unpack_from("<2I", of_kind(stream, FRAME), 8)
    viewer.close()


def test_grounds_and_wrappers(page):
    """Courses show their ground, and Gymnasium's interfaces have `show` too."""
    env = gymnasium.make_vec("marathon_rl/TerrainWalker2d-v0", num_envs=2)
    env.reset(seed=1)
    viewer = env.unwrapped.show(page=page)
    scene_fields = []
    for kind, content in messages(viewer.url):
        if kind == SCENE:
            scene_fields = json.loads(content)["model"]["fields"]
        if kind == GROUND:
            assert len(content) == 8 + 4 * scene_fields[0]["rows"] * scene_fields[0]["cols"]
            break
    viewer.close()
    one = gymnasium.make("marathon_rl/Hopper-v0").unwrapped
    one.reset(seed=1)
    assert "<iframe" in one.show(page=page)._repr_html_()


def test_errors(tmp_path):
    """A folder without the page and a taken port are errors."""
    env = marathon_rl.VecEnv("Hopper-v0")
    env.reset()
    with pytest.raises(ValueError, match=r"no index\.html"):
        env.show(page=tmp_path)
    (tmp_path / "index.html").write_text("")
    first = env.show(page=tmp_path)
    port = int(first.url.split(":")[2].split("/")[0])
    with pytest.raises(ValueError, match=f"port {port} cannot be used"):
        marathon_rl.VecEnv("Hopper-v0").show(page=tmp_path, port=port)
    first.close()
    with pytest.raises(urllib.error.URLError):
        next(messages(first.url))


def test_python_classes_cannot_be_shown():
    """An agent that is a Python class says so."""
    env = Arm.make().unwrapped
    env.reset(seed=1)
    with pytest.raises(NotImplementedError, match="Python class"):
        env.show()


def test_a_package_with_a_page_offers_it_to_the_command(tmp_path):
    """Wheels of a release hold the page, which the source tree does not."""
    package = tmp_path / "marathon_rl"
    package.mkdir()
    for part in Path(marathon_rl.__file__).parent.iterdir():
        if part.name != "page":
            (package / part.name).symlink_to(part)
    (package / "page").mkdir()
    (package / "page/index.html").write_text("<p>the page")
    environment = {name: value for name, value in os.environ.items() if name != "MARATHON_PAGE"}
    code = "import os; from marathon_rl import _native; _native.main(['marathon', '--version']); "
    told = subprocess.run(
        [sys.executable, "-c", code + "print(os.environ['MARATHON_PAGE'])"],
        env={**environment, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.stdout.splitlines()[-1:] == [str(package / "page")], told.stderr
