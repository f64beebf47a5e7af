"""Agents written in Python: helpers with Rust's values, episodes by the native rules, native learning."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from marathon_rl import MarathonAgent, Model, Simulation, VecEnv, train
from marathon_rl._arrays import Streams
from marathon_rl.memory import Average, PhaseBonus

ROOT = Path(__file__).parents[2]
ASSETS = ROOT / "assets" / "agents"


class Hopper(MarathonAgent):
    """Hopper-v0 in Python."""

    mjcf = ASSETS / "hopper.xml"
    feet = ("foot", "calf")
    touch = ("foot",)

    def observations(self) -> list[np.ndarray]:
        return [
            self.linear_velocity("torso"),
            self.forward("torso"),
            self.up("torso"),
            self.touch_sensors(),
            self.joint_rotations(),
            self.joint_velocities(),
            self.height("foot"),
        ]

    def step_reward(self) -> dict[str, np.ndarray]:
        return {
            "velocity": self.velocity("torso"),
            "uprightness": self.forward_bonus("torso"),
            "effort": -0.3 * self.effort(),
            "joints_at_limit": -4.0 * self.joints_at_limit_penalty(),
        }

    def terminate(self) -> np.ndarray:
        return self.terminate_on_non_foot_contact()


class HopperV1(Hopper):
    """Hopper-v1 in Python."""

    def step_reward(self) -> dict[str, np.ndarray]:
        velocity = 0.7 * self.normalized_velocity("torso", 8.0)
        return {
            "velocity": velocity,
            "uprightness": 0.05 * np.clip(self.forward_bonus("torso", max=1.0), 0, 1),
            "effort": (1 - self.effort_mean()) * np.minimum(velocity, 0.25),
        }


class Ant(MarathonAgent):
    """Ant-v0 in Python: a free root."""

    mjcf = ASSETS / "ant.xml"
    frame_skip = 5
    feet = touch = ("left_ankle_geom", "right_ankle_geom", "third_ankle_geom", "fourth_ankle_geom")

    def observations(self) -> list[np.ndarray]:
        torso = "torso_geom"
        seen = [self.linear_velocity(torso), self.forward(torso), self.up(torso)]
        return [*seen, self.touch_sensors(), self.joint_rotations(), self.joint_velocities()]

    def step_reward(self) -> dict[str, np.ndarray]:
        return {
            "velocity": self.velocity("torso_geom"),
            "effort": -0.5 * self.effort(),
            "joints_at_limit": -4.0 * self.joints_at_limit_penalty(),
        }

    def terminate(self) -> np.ndarray:
        return (self.forward_bonus("torso_geom") < 0.2) | (self.up("torso_geom")[:, 2] < 0)


class Humanoid(MarathonAgent):
    """Humanoid-v0 in Python: joints of several axes, memory, nearly every helper."""

    mjcf = ASSETS / "humanoid.xml"
    frame_skip = 5
    touch = ("left_left_foot", "right_left_foot", "right_right_foot", "left_right_foot")
    feet = (*touch, "left_shin", "right_shin")
    memory_size = PhaseBonus.SIZE
    alternate = False
    stride = ("right_hip_y", "right_knee", "left_hip_y", "left_knee")

    def remember(self) -> None:
        touch = self.touch_sensors() > 0
        hips = self.flexion("left_thigh"), self.flexion("right_thigh")
        bonus = PhaseBonus(self.frame_skip, self.alternate)
        bonus.update(self.memory, touch[:, :2].any(1), touch[:, 2:].any(1), *hips)

    def observations(self) -> list[np.ndarray]:
        seen = [self.linear_velocity("butt"), self.forward("butt"), self.up("butt")]
        seen += [self.forward("torso"), self.up("torso"), self.touch_sensors()]
        return [*seen, self.joint_rotations(), self.joint_velocities()]

    def turned_out(self) -> np.ndarray:
        return np.abs(self.left_bonus("left_thigh")) + np.abs(self.right_bonus("right_thigh"))

    def step_reward(self) -> dict[str, np.ndarray]:
        upright = sum(self.upright_bonus(part) for part in ("torso", "lower_waist", "butt"))
        facing = self.forward_bonus("torso") / 4
        facing = facing + self.forward_bonus("lower_waist") / 6 + self.forward_bonus("butt") / 6
        return {
            "velocity": self.velocity("torso"),
            "uprightness": upright / 6,
            "facing": facing,
            "phase": self.memory[:, 0],
            "height": -self.height_penalty("torso", 1.2),
            "limbs": -np.minimum(self.turned_out(), 0.5),
            "joints_at_limit": -4.0 * self.joints_at_limit_penalty(),
            "effort": -0.05 * self.effort(self.stride),
        }

    def terminate(self) -> np.ndarray:
        return self.terminate_on_non_foot_contact()


class HumanoidV1(Humanoid):
    """Humanoid-v1 in Python."""

    alternate = True

    def observations(self) -> list[np.ndarray]:
        return [*super().observations(), *(self.height(sole) for sole in self.touch)]

    def step_reward(self) -> dict[str, np.ndarray]:
        parts = ("torso", "lower_waist", "butt")
        velocity = 0.4 * self.normalized_velocity("torso", 10.0)
        bonuses = {
            "uprightness": sum(self.upright_bonus(part, max=1 / 3) for part in parts),
            "facing": sum(self.forward_bonus(part, max=1 / 3) for part in parts),
            "phase": self.memory[:, 0],
            "height": 1 - self.height_penalty("torso", 1.2),
            "limbs": 1 - self.turned_out(),
        }
        saved = 1 - self.effort_mean(self.stride)
        shares = {name: 0.02 * np.clip(bonus, 0, 1) for name, bonus in bonuses.items()}
        return {"velocity": velocity, **shares, "effort": saved * np.minimum(velocity, 0.4)}


def actions(n: int, act: int, step: int) -> np.ndarray:
    # beyond 1 too: clipping and the joints at their limits belong to the rules
    return np.random.default_rng(step).uniform(-1.2, 1.2, (n, act)).astype(np.float32)


TWINS = [("Hopper-v0", Hopper), ("Hopper-v1", HopperV1), ("Ant-v0", Ant)]
TWINS += [("Humanoid-v0", Humanoid), ("Humanoid-v1", HumanoidV1)]


@pytest.mark.parametrize(("task", "agent"), TWINS)
def test_helpers_have_the_values_of_the_native_ones_along_a_trajectory(task: str, agent: type[MarathonAgent]) -> None:
    n = 40
    native = VecEnv(task, n, autoreset="disabled")
    native.reset(seed=3)
    qpos, qvel = native.get_state()
    if native.spec.nq > native.spec.nv:
        # a free root: one agent faces aside, to be terminated by those that mind
        qpos[0, 3:7] = [np.cos(0.6), 0, 0, np.sin(0.6)]
    native.set_state(qpos, qvel)
    twin = agent.vec_env(n, autoreset="disabled", max_episode_steps=60)
    assert twin.spec.reward_terms == native.spec.reward_terms and twin.spec.action_names == native.spec.action_names
    for name in ("obs_size", "act_size", "dt", "frame_skip", "nq", "nv"):
        assert getattr(twin.spec, name) == getattr(native.spec, name), name
    twin.reset(seed=1)
    np.testing.assert_allclose(twin.set_state(qpos, qvel), native.obs, atol=1e-5)
    x = native.x_position
    assert x is not None
    np.testing.assert_allclose(twin.x_position, x, atol=1e-6)
    fell = np.zeros(n, bool)
    for step in range(60):
        given = actions(n, native.spec.act_size, step)
        obs, reward, terminated, truncated = native.step(given)
        got = twin.step(given)
        np.testing.assert_array_equal(twin.get_state()[0], native.get_state()[0])
        np.testing.assert_allclose(got[0], obs, rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(got[1], reward, atol=2e-5)
        np.testing.assert_allclose(twin.reward_terms, native.reward_terms, rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(twin.forward, native.forward, atol=1e-6)
        assert np.array_equal(got[2], terminated) and not truncated.any()
        assert got[3].all() == (step == 59) or terminated.any()
        fell |= terminated
    assert fell.any()


def test_the_remaining_helpers() -> None:
    agent = Hopper(3)
    agent.action[:] = [[0.5, -1, 0, 0.25]] * 3
    np.testing.assert_allclose(agent.effort_sum(), 1.75)
    np.testing.assert_allclose(agent.effort_sum(["hip"]), 0.75)
    np.testing.assert_allclose(agent.effort(["hip", "waist"]), 0.0625)
    np.testing.assert_allclose(agent.joints_at_limit_penalty(), 0.2)
    assert not agent.joints_at_limit_penalty(["hip"]).any() and not agent.terminate_never().any()
    along = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0]])
    np.testing.assert_allclose(agent.direction_bonus(along, np.array([1.0, 0, 0]), max=2), [2, 0, -2], atol=1e-12)
    memory = np.zeros((1, Average.SIZE))
    means = [Average.update(memory, np.array([float(i)]))[0] for i in range(1, 21)]
    windows = [np.mean(range(max(1, i - 8), i + 1)) for i in range(1, 21)]
    np.testing.assert_allclose(means, windows)


def test_an_episode_may_be_over_although_nothing_has_failed() -> None:
    class Brief(Hopper):
        memory_size = 1

        def remember(self) -> None:
            self.memory += 1

        def terminate(self) -> np.ndarray:
            return self.terminate_never()

        def truncate(self) -> np.ndarray:
            return self.memory[:, 0] >= 5

    env = Brief.vec_env(3, autoreset="same_step")
    env.reset(1)
    for step in range(1, 11):
        _, _, terminated, truncated = env.step(np.zeros((3, 4), np.float32))[:4]
        assert not terminated.any()
        assert (truncated == (step % 5 == 0)).all()


def test_autoreset_modes_tell_the_same_story_as_the_native_ones() -> None:
    n, limit = 20, 25
    envs = {mode: Hopper.vec_env(n, autoreset=mode, max_episode_steps=limit) for mode in ("SAME_STEP", "NextStep")}
    same, following = envs.values()
    assert (same.autoreset, following.autoreset) == ("same_step", "next_step")
    assert np.array_equal(same.reset(seed=5), following.reset(seed=5))
    ended = np.zeros(n, bool)
    for step in range(80):
        given = actions(n, 4, step)
        obs, reward, terminated, truncated = following.step(given)
        if ended.any():
            # the step in which an episode begins has no reward and no end
            assert not (terminated | truncated)[ended].any() and not reward[ended].any()
            assert not following.reward_terms[ended].any() and not following.forward[ended].any()
        ended = terminated | truncated
        assert np.isfinite(obs).all() and np.array_equal(following.final_obs, obs)
    starts = []
    for step in range(60):
        obs, reward, terminated, truncated = same.step(actions(n, 4, step))
        ended = terminated | truncated
        np.testing.assert_allclose(same.reward_terms.sum(1), reward, atol=1e-6)
        assert np.array_equal(obs[~ended], same.final_obs[~ended])
        assert (reward[terminated] == -1).all() and (same.reward_terms[terminated][:, -1] == -1).all()
        starts += list(obs[ended])
    assert len(starts) > n
    assert len(np.unique(np.array(starts), axis=0)) == len(starts), "no two episodes begin alike"


def test_a_life_depends_on_its_seed_alone() -> None:
    many, one = Hopper.vec_env(30, threads=2), Hopper.vec_env(1)
    first = many.reset(seed=9)
    assert np.array_equal(one.reset(seed=9)[0], first[0])
    assert np.array_equal(many.reset(seed=9), first) and not np.array_equal(many.reset(), first)
    each = many.reset(seed=list(range(100, 130)))
    assert np.array_equal(one.reset(seed=107)[0], each[7])
    for step in range(40):
        given = actions(30, 4, step)
        assert np.array_equal(many.step(given)[0][7], one.step(given[7:8])[0][0])
    # with a mask, for the chosen agents alone
    mask = np.arange(30) % 3 == 0
    before = many.obs
    after = many.reset(seed=9, mask=mask)
    assert np.array_equal(after[mask], first[mask]) and np.array_equal(after[~mask], before[~mask])
    with pytest.raises(ValueError, match="first reset must be of all agents"):
        Hopper.vec_env(2).reset(mask=[True, False])


def test_snapshots_continue_exactly() -> None:
    env = Humanoid.vec_env(18, max_episode_steps=30)
    env.reset(seed=2)
    for step in range(25):
        env.step(actions(18, 21, step))
    saved = env.save()

    def future(env: Any) -> list[np.ndarray]:
        return [x for step in range(25, 60) for x in env.step(actions(18, 21, step))]

    want = future(env)
    other = Humanoid.vec_env(18, threads=2, max_episode_steps=30)
    other.load(saved)
    assert all(np.array_equal(a, b) for a, b in zip(want, future(other), strict=True))
    with pytest.raises(ValueError, match="snapshot: found 18 agents of 'Humanoid-v0', expected 17 agents"):
        Humanoid.vec_env(17).load(saved)
    with pytest.raises(ValueError, match="snapshot"):
        other.load(b"something else")


def test_a_broken_state_stays_with_its_agent() -> None:
    env, healthy = Hopper.vec_env(4), Hopper.vec_env(4)
    env.reset(seed=1)
    healthy.reset(seed=1)
    given = actions(4, 4, 0)
    sick = given.copy()
    sick[2, 1] = np.nan
    got, want = env.step(sick), healthy.step(given)
    assert env.diverged.tolist() == [False, False, True, False] and got[2][2] and got[1][2] == 0
    assert not env.final_obs[2].any() and np.isfinite(got[0]).all()
    rest = [0, 1, 3]
    assert all(np.array_equal(a[rest], b[rest]) for a, b in zip(got, want, strict=True))


def variant(**members: Any) -> Callable[[], Any]:
    return type("Variant", (Hopper,), members).vec_env


def test_what_does_not_fit_is_told() -> None:
    wrong = [
        ({"feet": ("foto",)}, "no geom 'foto'; did you mean 'foot'"),
        ({"mjcf": "<mujoco><worldboby/></mujoco>"}, "worldbody"),
        ({"frame_skip": 0}, "frame_skip is 0, expected at least 1"),
        ({"observations": lambda self: self.joint_velocities().T}, r"Variant-v0: observations have the shape \(4, 1\)"),
        ({"observations": lambda self: []}, "need at least one array|observations are empty"),
        ({"step_reward": lambda self: {"v": 1.0}}, r"reward 'v' has the shape \(\), expected \(1,\)"),
        ({"step_reward": lambda self: {}}, "no terms"),
        ({"terminate": lambda self: self.height("foot")}, r"terminate returns float64 \(1,\), expected bool"),
        ({"observations": lambda self: self.effort(["hpi"])}, "no actuator 'hpi'; did you mean 'hip'"),
    ]
    for members, message in wrong:
        with pytest.raises(ValueError, match=message):
            variant(**members)()
    with pytest.raises(ValueError, match=r"agent_reset returns qpos of shape \(7,\), expected \(1, 7\)"):
        variant(agent_reset=lambda self, random: (self.spawn_qpos, self.spawn_qvel))().reset()
    with pytest.raises(TypeError, match="set the class attribute mjcf"):
        MarathonAgent()
    env = Hopper.vec_env(2)
    with pytest.raises(ValueError, match="reset must be called"):
        env.step(np.zeros((2, 4)))
    env.reset()
    with pytest.raises(ValueError, match=r"actions have the shape \(4,\), expected \(2, 4\)"):
        env.step(np.zeros(4))


def test_streams_are_uniform_independent_and_repeatable() -> None:
    n = 4000
    numbers = np.arange(n)
    drawn = Streams(np.full(n, 7), numbers, np.ones(n, int)).uniform(-1, 3, 5)
    assert drawn.shape == (n, 5) and drawn.min() >= -1 and drawn.max() < 3
    assert np.abs(drawn.mean(0) - 1).max() < 0.08 and np.abs(drawn.var(0) - 16 / 12).max() < 0.08
    assert np.abs(np.corrcoef(drawn.T) - np.eye(5)).max() < 0.06
    assert np.array_equal(Streams([7], [11], [1]).uniform(-1, 3, 5)[0], drawn[11])
    others = [Streams([8], [11], [1]), Streams([7], [12], [1]), Streams([7], [11], [2]), Streams([11], [7], [1])]
    assert all(not np.array_equal(other.uniform(-1, 3, 5)[0], drawn[11]) for other in others)
    normal = Streams(numbers).normal(2, 3, 4)
    assert np.abs(normal.mean(0) - 2).max() < 0.2 and np.abs(normal.std(0) - 3).max() < 0.15


def test_a_simulation_reads_what_mujoco_calls_by_the_same_names() -> None:
    model = Model.from_xml_path(ASSETS / "hopper.xml")
    assert model.actuator_names == ["waist", "hip", "knee", "ankle"] and model.nu == 4
    assert model.joint_type[:3] == ["slide", "slide", "hinge"] and model.sensor("foot") == (0, 1)
    sim = Simulation(model, 5, threads=2)
    qpos, qvel = (np.tile(x, (5, 1)) for x in model.keyframe("spawn"))
    sim.reset(qpos, qvel)
    np.testing.assert_allclose(sim.qpos, qpos, atol=1e-6)
    np.testing.assert_allclose(sim.body_velocity[:, model.body("torso")], [[0, 0, 1]] * 5, atol=1e-6)
    assert not sim.touching.any() and sim.touching.dtype == np.bool_
    before = sim.qpos
    with pytest.raises(ValueError, match="read-only"):
        before[0, 0] = 1
    kept = before.copy()
    for _ in range(200):
        assert not sim.step(np.zeros((5, 4)), 4).any()
    assert np.array_equal(before, kept) and not np.array_equal(sim.qpos, kept)
    # it lies on the ground, which carries its weight
    assert sim.touching.any(1).all() and (sim.touched >= sim.touching).all()
    weight = model.body_mass.sum() * 9.81
    np.testing.assert_allclose(sim.normal_force.sum(1), weight, rtol=0.3)
    assert sim.sensors.shape == (5, 1) and sim.geom_pos.shape == (5, len(model.geom_names), 3)
    saved = sim.save()
    mask = np.array([True, False, False, False, False])
    sim.reset(qpos, qvel, mask)
    assert not sim.touching[0].any() and sim.touching[1:].any(1).all()
    sim.load(saved)
    sim.push(np.tile([500, 0, 0], (5, 1)), body="torso", mask=np.arange(5) == 0)
    sim.step(np.zeros((5, 4)))
    assert sim.qvel[0, 0] > sim.qvel[1, 0] + 0.05
    for call, message in [
        (lambda: model.geom("troso"), "no geom 'troso'; did you mean 'torso'"),
        (lambda: model.keyframe("x"), "no keyframe 'x'; known: spawn"),
        (lambda: sim.step(np.zeros((5, 3))), r"ctrl has the shape \(5, 3\), expected \(5, 4\)"),
        (lambda: sim.reset(qpos * np.nan, qvel), "state of agent 0 is not finite"),
        (lambda: sim.push(np.zeros((4, 3)), body=1), r"force has the shape \(4, 3\), expected \(5, 3\)"),
        (lambda: Simulation(model, 4).load(saved), "5 agents, expected 4"),
        (lambda: Simulation(Model.from_xml_path(ASSETS / "ant.xml"), 5).load(saved), "not of model 'ant'"),
        (lambda: Model.from_xml_string("<mujoco>", "mine"), "mine"),
        (lambda: Model.from_xml_path("nowhere.xml"), "nowhere.xml"),
    ]:
        with pytest.raises(ValueError, match=message):
            call()


SETTINGS: dict[str, Any] = {
    "run": {"agents": 48, "horizon": 16},
    "network": {"hidden": [16]},
    "ppo": {"minibatches": 3},
}


def test_the_native_trainer_learns_from_python_with_the_same_bits_for_any_number_of_threads(tmp_path: Path) -> None:
    files = []
    for threads in (1, 3):
        path = tmp_path / f"{threads}.safetensors"
        seen: list[int] = []
        result = train(
            Hopper,
            SETTINGS,
            threads=threads,
            steps=4 * 48 * 16,
            callback=lambda s, seen=seen: seen.append(s["steps"]),
        )
        assert seen == [48 * 16 * i for i in (1, 2, 3, 4)] and result.steps == seen[-1]
        result.policy.save(path)
        # the header tells how long it took and on how many threads; these are the numbers of the policy
        files.append(path.read_bytes()[-2500:])
    assert files[0] == files[1]
    # a false answer ends it
    assert train(Hopper, SETTINGS, callback=lambda s: s["iteration"] < 2).steps == 2 * 48 * 16


def test_what_goes_wrong_in_python_ends_training_with_its_own_exception() -> None:
    class Tired(Hopper):
        decisions = 0

        def terminate(self) -> np.ndarray:
            self.decisions += 1
            if self.decisions > 20:
                raise RuntimeError("enough")
            return self.terminate_never()

    for threads in (1, 2):
        with pytest.raises(RuntimeError, match="enough"):
            train(Tired, SETTINGS, threads=threads)

    def interrupt(_: dict[str, Any]) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(Hopper, SETTINGS, callback=interrupt)
    for config, message in [
        ({"run": {"agents": 40}}, r"config: run.agents: found 40, expected a multiple of 16"),
        ({"ppo": {"lr": -1.0}}, r"config: ppo.lr: found '-1.0', expected a positive number"),
        ({"ppo": {"lrr": 1}}, r"config: ppo.lrr: unknown key; did you mean 'lr'"),
        ({"lr": 1}, r"config: lr: unknown key; did you mean 'ppo.lr'"),
    ]:
        with pytest.raises(ValueError, match=message):
            train(Hopper, config)


def test_the_example_runs(tmp_path: Path) -> None:
    example = ROOT / "examples" / "python" / "custom_agent.py"
    command = [sys.executable, example, "--steps", "300000"]
    run = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True)
    *progress, last = run.stdout.splitlines()
    assert "m/s" in progress[-1] and (tmp_path / "inchworm.safetensors").exists()
    assert last.startswith("the worms creep ") and float(last.split()[3]) > 0.5
