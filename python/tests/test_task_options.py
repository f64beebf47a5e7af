"""Arguments of tasks: environments, runs and policies play the same task, and clips may be files."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import marathon_rl
from marathon_rl import Clip, Model, VecEnv, evaluate, load_policy, spec, train

WALK = Path(__file__).parents[2] / "assets" / "motions" / "marathon_man" / "walk.motion"
SMALL = {"num_envs": 16, "seed": 5, "steps": 512, "threads": 1}


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A shipped clip in a file of another name."""
    path = tmp_path / "mine.motion"
    path.write_bytes(WALK.read_bytes())
    return path


def test_an_environment_follows_a_file(mine: Path) -> None:
    env, shipped = VecEnv("MarathonMan-v0", 3, clip=mine), VecEnv("MarathonMan-v0", 3, clip="walk")
    np.testing.assert_array_equal(env.reset(seed=2), shipped.reset(seed=2))
    assert env.spec.options["clip"] == Clip.load(mine)
    assert env.spec.options["clip"].name == "mine.motion"
    with pytest.raises(ValueError, match=r"no such file.*did you mean '.*mine\.motion'"):
        VecEnv("MarathonMan-v0", clip=mine.with_name("mime.motion"))


def test_a_policy_plays_the_task_it_was_trained_for(mine: Path, tmp_path: Path) -> None:
    result = train("MarathonMan-v0", clip=mine, future=1, out=tmp_path / "run", **SMALL)
    shipped = train("MarathonMan-v0", clip="walk", future=1, **SMALL)
    mine.unlink()
    assert result.summary["options"]["clip"] == "mine.motion"
    policy = load_policy(tmp_path / "run")
    assert policy.obs_size == 119
    assert policy.meta["options"]["future"] == 1
    own = evaluate(policy, 16)
    again = pickle.loads(pickle.dumps(policy))  # noqa: S301
    assert own == evaluate(shipped.policy, 16) == evaluate(again, 16)
    assert own == evaluate(policy, 16, start="adaptive")
    assert own != evaluate(policy, 16, start="first")
    with pytest.warns(UserWarning, match="the schedules span the new length"):
        longer = train(resume=tmp_path / "run", steps=1024)
    assert longer.steps == 1024


def test_a_clip_is_a_value(tmp_path: Path) -> None:
    model = Model.from_xml_path(WALK.parents[2] / "agents" / "marathon_man.xml")
    shipped = Clip.load(WALK)
    mine = Clip(model, shipped.qpos, shipped.dt, name="mine", cycle=shipped.cycle)
    assert (mine.name, mine.duration) == ("mine.motion", shipped.duration)
    assert mine != shipped
    mine.save(tmp_path / "mine.motion")
    assert Clip.load(tmp_path / "mine.motion") == mine == pickle.loads(pickle.dumps(mine))  # noqa: S301
    with pytest.raises(ValueError, match="frames: found 1, expected two or more"):
        Clip(model, shipped.qpos[:1], shipped.dt)

    # two clips of one name, side by side
    run = Clip.load(WALK.with_name("run.motion"))
    other = Clip(model, run.qpos, run.dt, name="mine", cycle=run.cycle)
    envs = [VecEnv("MarathonMan-v0", 3, clip=clip) for clip in (mine, other)]
    for env, name in zip(envs, ["walk", "run"], strict=True):
        np.testing.assert_array_equal(env.reset(seed=2), VecEnv("MarathonMan-v0", 3, clip=name).reset(seed=2))
    # what a task says of its options makes it again, in another process, too
    both = spec("MarathonMan-v0", clip=[mine, "kick", other]).options["clip"]
    assert [clip if isinstance(clip, str) else clip.name for clip in both] == ["mine.motion", "kick", "mine-2.motion"]
    again = pickle.loads(pickle.dumps(envs[1]))  # noqa: S301
    np.testing.assert_array_equal(again.reset(seed=3), envs[1].reset(seed=3))
    policy = train("MarathonMan-v0", clip=mine, **SMALL).policy
    mine_again = VecEnv(policy.task, 3, **{**policy.options, "clip": mine})
    np.testing.assert_array_equal(VecEnv(policy.task, 3, **policy.options).reset(seed=2), mine_again.reset(seed=2))


def test_wrong_arguments_are_refused_by_name() -> None:
    with pytest.raises(TypeError, match="clip"):
        train("MarathonMan-v0", clp="walk", **SMALL)
    with pytest.raises(ValueError, match="did you mean 'run'"):
        marathon_rl.spec("MarathonMan-v0", clip="runn")
