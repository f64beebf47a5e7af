"""Unmodified `mlagents_envs` drives `marathon-player`.

Promises: every batch has a decision of every agent, ends of episodes come beside them with their true kind, a reset
works at any time, side channels work both ways, every environment can be served, each role of a task is a behavior of
its own, and a player that cannot go on says why in its log and leaves at once.
"""

import json
import pathlib
import subprocess
import sys
import time
import uuid

import numpy as np
import onnx
import pytest
from conftest import MARATHON, PLAYER, free_port
from contract import best_actions
from mlagents_envs.base_env import ActionTuple
from mlagents_envs.environment import UnityEnvironment
from mlagents_envs.exception import UnityEnvironmentException
from mlagents_envs.side_channel.engine_configuration_channel import EngineConfigurationChannel
from mlagents_envs.side_channel.environment_parameters_channel import EnvironmentParametersChannel
from mlagents_envs.side_channel.float_properties_channel import FloatPropertiesChannel
from mlagents_envs.side_channel.stats_side_channel import StatsSideChannel
from onnx.reference import ReferenceEvaluator

ROOT = pathlib.Path(__file__).parents[2]
HOPPERS = ("--spawn-env=Hopper-v0", "--num-spawn-envs=16")
NAME = "Hopper-v0?team=0"
COURSES = ("--spawn-env=TerrainWalker2d-v0", "--option=course=adversary", "--num-spawn-envs=8")
RUNNER, BUILDER = "TerrainWalker2d-v0?team=0", "TerrainWalker2d-v0.builder?team=0"


def act(env, name, random):
    """Random actions of everybody, and what they led to."""
    decisions, _ = env.get_steps(name)
    size = env.behavior_specs[name].action_spec.continuous_size
    actions = random.uniform(-1, 1, (len(decisions), size)).astype(np.float32)
    env.set_actions(name, ActionTuple(continuous=actions))
    env.step()
    return env.get_steps(name)


def sizes(env, name):
    spec = env.behavior_specs[name]
    return spec.observation_specs[0].shape[0], spec.action_spec.continuous_size


@pytest.mark.parametrize(
    ("agent", "expected"),
    [
        ("Hopper-v0", (31, 4)),
        ("Walker2d-v0", (41, 6)),
        ("Humanoid-v0", (88, 21)),
        ("Ant-v0", (53, 8)),
        ("Ant-v1", (54, 8)),
    ],
)
def test_sizes_are_the_documented_ones(launch, agent, expected):
    env = launch(f"--spawn-env={agent}", "--num-spawn-envs=3")
    env.reset()
    assert list(env.behavior_specs) == [f"{agent}?team=0"]
    assert sizes(env, f"{agent}?team=0") == expected


def test_every_registered_environment_can_be_served(launch):
    listed = json.loads(subprocess.check_output([MARATHON, "--json", "list"], text=True))
    agents = [agent["id"] for agent in listed["agents"]]
    assert len(agents) >= 17
    env = launch(*[flag for agent in agents for flag in (f"--spawn-env={agent}", "--num-spawn-envs=2")])
    env.reset()
    assert set(env.behavior_specs) == {f"{agent}?team=0" for agent in agents}
    random = np.random.default_rng(1)
    for _ in range(3):
        for name, spec in env.behavior_specs.items():
            actions = random.uniform(-1, 1, (2, spec.action_spec.continuous_size)).astype(np.float32)
            env.set_actions(name, ActionTuple(continuous=actions))
        env.step()
        for name in env.behavior_specs:
            decisions, _ = env.get_steps(name)
            assert len(decisions) == 2 and np.isfinite(decisions.obs[0]).all() and np.isfinite(decisions.reward).all()


def test_every_batch_has_all_decisions_and_ends_are_of_the_right_kind(launch):
    env = launch(*HOPPERS, "--max-episode-steps=60", seed=3)
    env.reset()
    random = np.random.default_rng(3)
    age, falls, late = np.zeros(16, int), 0, 0
    for _ in range(150):
        decisions, ends = act(env, NAME, random)
        assert list(decisions.agent_id) == list(range(16))
        age += 1
        for i, agent in enumerate(ends.agent_id):
            # a time-out takes exactly its time, a fall less
            assert ends.interrupted[i] == (age[agent] == 60), (agent, age[agent])
            assert ends.interrupted[i] or ends.reward[i] == -1
            falls, late = falls + (not ends.interrupted[i]), late + ends.interrupted[i]
            # the old episode's reward stays with the old episode, and its last observation is not the new one's first
            assert decisions[agent].reward == 0
            assert not np.array_equal(ends[agent].obs[0], decisions[agent].obs[0])
            age[agent] = 0
    assert falls > 5
    # agents at rest stand for a second
    env.reset()
    for _ in range(60):
        env.set_actions(NAME, ActionTuple(continuous=np.zeros((16, 4), np.float32)))
        env.step()
        late += sum(env.get_steps(NAME)[1].interrupted)
    assert late > 0


def test_a_reset_in_the_middle_begins_new_episodes_without_ends(launch):
    env = launch(*HOPPERS, seed=4)
    env.reset()
    first = env.get_steps(NAME)[0].obs[0].copy()
    random = np.random.default_rng(4)
    for _ in range(5):
        act(env, NAME, random)
    env.reset()
    decisions, ends = env.get_steps(NAME)
    assert len(decisions) == 16 and len(ends) == 0 and not decisions.reward.any()
    # new episodes: near the first ones, but not the same
    assert not np.array_equal(decisions.obs[0], first) and np.abs(decisions.obs[0] - first).max() < 1.5


def run(env, steps=30):
    env.reset()
    random = np.random.default_rng(0)
    batches = [act(env, NAME, random) for _ in range(steps)]
    return np.concatenate([np.concatenate([d.obs[0].ravel(), d.reward]) for d, _ in batches])


def test_the_same_seed_gives_the_same_bits(launch):
    one, same, other = (run(launch(*HOPPERS, seed=seed)) for seed in (7, 7, 8))
    assert np.array_equal(one, same) and not np.array_equal(one, other)


def test_actions_beyond_the_bounds_are_clamped(launch):
    env = launch("--spawn-env=HalfCheetah-v5", "--num-spawn-envs=2", seed=1)
    env.reset()
    (name,) = env.behavior_specs
    env.set_actions(name, ActionTuple(continuous=np.array([[1.0] * 6, [9.0] * 6], np.float32)))
    env.step()
    rewards = env.get_steps(name)[0].reward
    # the same cost of control: what differs is the start
    assert np.isfinite(rewards).all() and abs(rewards[0] - rewards[1]) < 2


def test_side_channels_go_both_ways(launch, log):
    engine, parameters, stats = EngineConfigurationChannel(), EnvironmentParametersChannel(), StatsSideChannel()
    unknown = FloatPropertiesChannel(uuid.uuid4())
    env = launch(*HOPPERS, seed=5, side_channels=[engine, parameters, stats, unknown])
    engine.set_configuration_parameters(width=320, height=200, time_scale=20)
    unknown.set_property("whatever", 1.0)
    parameters.set_float_parameter("gravity", 3.7)
    parameters.set_uniform_sampler_parameters("mass", 0.8, 1.2, 11)
    parameters.set_float_parameter("gravty", 1.0)
    env.reset()
    random = np.random.default_rng(5)
    for _ in range(100):
        act(env, NAME, random)
    got = stats.get_and_reset_stats()
    terms = [key for key in got if key.startswith("Hopper-v0/Reward/")]
    assert {"Hopper-v0/Distance", "Hopper-v0/Speed"} <= set(got) and len(terms) > 2
    text = log()
    assert "Resolution(320, 200)" in text and "TimeScale(20.0)" in text
    assert "'gravty' has no effect; did you mean 'gravity'?" in text
    assert text.count("a side channel that this player does not know is ignored") == 1


def fall(env):
    """Vertical accelerations of humanoids at rest in the air, from the velocity among their observations."""
    name = "Humanoid-v5?team=0"
    env.reset()
    before = env.get_steps(name)[0].obs[0].copy()
    env.set_actions(name, ActionTuple(continuous=np.zeros((4, 17), np.float32)))
    env.step()
    # 22 positions come first; a decision is 0.015 s
    return (env.get_steps(name)[0].obs[0] - before)[:, 24] / 0.015


def test_parameters_change_the_physics_of_each_agent(launch):
    parameters = EnvironmentParametersChannel()
    env = launch("--spawn-env=Humanoid-v5", "--num-spawn-envs=4", seed=6, side_channels=[parameters])
    assert np.allclose(fall(env), -9.81, atol=0.2)
    parameters.set_float_parameter("gravity", 2.0)
    assert np.allclose(fall(env), -2.0, atol=0.2)
    # drawn for each agent and each episode
    parameters.set_uniform_sampler_parameters("gravity", 1.0, 9.0, 3)
    drawn = np.concatenate([fall(env) for _ in range(5)])
    assert np.ptp(drawn) > 4 and (drawn > -9.2).all() and (drawn < -0.8).all()
    assert len(np.unique(drawn.round(3))) == 20


def test_parameters_change_the_task_in_the_middle_of_episodes(launch, log):
    parameters = EnvironmentParametersChannel()
    env = launch("--spawn-env=HalfCheetah-v5", "--num-spawn-envs=4", seed=6, side_channels=[parameters])
    env.reset()
    (name,) = env.behavior_specs
    still = ActionTuple(continuous=np.zeros((4, 6), np.float32))

    def step():
        env.set_actions(name, still)
        env.step()
        return env.get_steps(name)

    for _ in range(3):
        assert len(step()[1]) == 0
    # episodes go on, five decisions long
    parameters.set_float_parameter("max_episode_steps", 5)
    assert len(step()[1]) == 0
    assert list(step()[1].interrupted) == [True] * 4
    parameters.set_float_parameter("forward_reward_weight", 1000.0)
    assert np.abs(step()[0].reward).max() > 1
    assert "warning" not in log()


@pytest.fixture(scope="module")
def walker(tmp_path_factory):
    """A walker that runs over what a builder builds: actions for observations."""
    file = tmp_path_factory.mktemp("walker") / "walker.onnx"
    policy = ROOT / "assets" / "policies" / "TerrainWalker2d.safetensors"
    subprocess.run([MARATHON, "export", policy, "--out", file], check=True, capture_output=True)
    runner = ReferenceEvaluator(onnx.load(file))
    return lambda obs: best_actions(runner, obs)


def run_over(env, walker, ground):
    """A decision of all runners, and of the builders that are asked, which build ground[their number]."""
    seen, asked = env.get_steps(RUNNER)[0], env.get_steps(BUILDER)[0]
    env.set_actions(RUNNER, ActionTuple(continuous=walker(seen.obs[0])))
    env.set_actions(BUILDER, ActionTuple(continuous=ground[asked.agent_id - 8].reshape(-1, 1)))
    env.step()


def test_roles_are_behaviors_of_their_own(launch, walker):
    env = launch(*COURSES, "--max-episode-steps=300", seed=2)
    env.reset()
    assert set(env.behavior_specs) == {RUNNER, BUILDER}
    assert sizes(env, RUNNER) == (69, 6) and sizes(env, BUILDER) == (19, 1)
    # ground that falls or rises, tenths of the difficulty, which is a half
    ground = np.array([-0.6, -0.4, -0.2, -0.1, 0.1, 0.2, 0.3, 0.4], np.float32)
    sums, ends, decisions, fresh = np.zeros((2, 8)), 0, 0, np.ones(8, bool)
    meters = np.zeros(8, int)
    for _ in range(650):
        runners, fallen = env.get_steps(RUNNER)
        builders, over = env.get_steps(BUILDER)
        assert list(runners.agent_id) == list(range(8)) and set(builders.agent_id) <= set(range(8, 16))
        # where an episode ends, it ends for both, in the same way, and what one lost is what the other got
        assert list(over.agent_id - 8) == list(fallen.agent_id) and list(over.interrupted) == list(fallen.interrupted)
        for role, steps in enumerate((fallen, over)):
            np.add.at(sums[role], steps.agent_id - 8 * role, steps.reward)
        for agent in fallen.agent_id:
            assert abs(sums[0, agent]) > 1 and abs(sums[:, agent].sum()) < 1e-3, sums[:, agent]
            fresh[agent], meters[agent], ends = True, 0, ends + 1
            sums[:, agent] = 0
        for role, steps in enumerate((runners, builders)):
            np.add.at(sums[role], steps.agent_id - 8 * role, steps.reward)
        # at the start, and then when the runner has made a new meter
        assert set(np.flatnonzero(fresh)) <= set(builders.agent_id - 8)
        for agent, obs in zip(builders.agent_id - 8, builders.obs[0], strict=True):
            assert obs[18] == 0
            if not fresh[agent]:
                decisions, meters[agent] = decisions + 1, meters[agent] + 1
                # the last step, and, while the runner is on the level ground of the start, what has been built in all
                assert abs(obs[17] - 0.5 * ground[agent]) < 1e-5
                if meters[agent] <= 3:
                    assert abs(obs[11] - meters[agent] * 0.5 * ground[agent]) < 1e-5, (agent, meters[agent], obs)
        fresh[:] = False
        run_over(env, walker, ground)
    assert ends >= 16 and 50 < decisions < 650, (ends, decisions)


def test_a_reset_lets_all_roles_decide(launch, walker):
    env = launch(*COURSES, seed=3)
    env.reset()
    for _ in range(10):
        run_over(env, walker, np.zeros(8, np.float32))
    assert len(env.get_steps(RUNNER)[0]) == 8 and len(env.get_steps(BUILDER)[0]) == 0
    env.reset()
    for name in (RUNNER, BUILDER):
        decisions, ends = env.get_steps(name)
        assert len(decisions) == 8 and len(ends) == 0 and not decisions.reward.any()


def test_a_commander_decides_every_hundred_decisions(launch):
    env = launch("--spawn-env=WalkerController-v0", "--option=commander=adversary", "--num-spawn-envs=16", seed=4)
    env.reset()
    walker, commander = env.behavior_specs
    assert (walker, commander) == ("WalkerController-v0?team=0", "WalkerController-v0.commander?team=0")
    assert sizes(env, walker) == (48, 6) and env.behavior_specs[commander].action_spec.continuous_size == 2
    age, at_hundreds = np.zeros(16, int), 0
    for _ in range(250):
        asked = env.get_steps(commander)[0]
        assert list(asked.agent_id - 16) == list(np.flatnonzero(age % 100 == 0))
        at_hundreds += np.count_nonzero(age[asked.agent_id - 16])
        env.step()
        age += 1
        age[env.get_steps(walker)[1].agent_id] = 0
    assert at_hundreds > 0


def test_several_workers_and_areas_have_lives_of_their_own(launch, log):
    port = free_port()
    envs = [launch(*HOPPERS, base_port=port, worker_id=i, seed=9 + i, num_areas=2) for i in range(2)]
    for env in envs:
        env.reset()
    first, second = (env.get_steps(NAME)[0] for env in envs)
    assert len(first) == len(second) == 32 and len(np.unique(first.obs[0], axis=0)) == 32
    assert not np.array_equal(first.obs[0], second.obs[0])
    assert "seed 9; areas: 2" in log(0) and "seed 10; areas: 2" in log(1)


def test_closing_takes_less_than_a_second_and_leaves_nobody_behind(launch, log):
    env = launch(*HOPPERS)
    env.reset()
    process, begun = env._process, time.monotonic()
    env.close()
    assert time.monotonic() - begun < 1 and process.returncode == 0
    assert log().endswith("the trainer has closed\n")


@pytest.mark.parametrize("name", ["hopper.x86_64", "run.sh", "plain"])
def test_players_start_under_every_name_that_mlagents_takes(launch, tmp_path, name):
    path = tmp_path / name
    if name.endswith(".sh"):
        path.write_text(f'#!/bin/sh\nexec "{PLAYER}" "$@"\n')
        path.chmod(0o755)
    else:
        path.symlink_to(PLAYER)
    env = launch("--num-spawn-envs=1", file_name=path)
    env.reset()
    assert len(env.get_steps(NAME)[0]) == 1


def test_a_trainer_that_waits_on_a_port_is_found():
    port = free_port()
    words = [PLAYER, "--mlagents-port", str(port), *HOPPERS]
    player = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    # the player is there first, and waits
    time.sleep(0.5)
    env = UnityEnvironment(file_name=None, base_port=port, timeout_wait=30)
    env.reset()
    assert len(env.get_steps(NAME)[0]) == 16
    env.close()
    _, errors = player.communicate(timeout=5)
    assert player.returncode == 0 and "the trainer has closed" in errors


def test_a_trainer_that_dies_ends_the_player_with_an_error():
    port = free_port()
    code = f"""
import os
from mlagents_envs.environment import UnityEnvironment
env = UnityEnvironment(file_name=None, base_port={port}, timeout_wait=30)
env.reset()
os._exit(9)
"""
    trainer = subprocess.Popen([sys.executable, "-c", code])
    words = [PLAYER, "--mlagents-port", str(port), *HOPPERS]
    player = subprocess.run(words, stderr=subprocess.PIPE, text=True, timeout=60, check=False)
    assert trainer.wait(timeout=10) == 9
    assert player.returncode == 1 and "the trainer is gone" in player.stderr


def test_messages_over_the_limit_are_refused(launch, log):
    with pytest.raises(UnityEnvironmentException):
        launch("--spawn-env=Humanoid-v0", "--num-spawn-envs=12000").reset()
    text = log()
    assert "12000 agents of Humanoid-v0?team=0 are too many" in text and "ML-Agents accepts 4194304" in text
    most = int(text.split("use at most ")[1].split()[0])
    assert 4000 < most < 12000


def test_what_cannot_be_served_is_told():
    def fails(*words, code=1):
        done = subprocess.run([PLAYER, *words], capture_output=True, text=True, timeout=20, check=False)
        assert done.returncode == code and not done.stdout, done
        return done.stderr

    port = str(free_port())
    assert "did you mean 'Hopper-v0'?" in fails("--mlagents-port", port, "--spawn-env=Hoper-v0")
    assert "no trainer listens on port" in fails("--mlagents-port", port, "--connect-timeout=0")
    assert "takes no option 'colour'" in fails("--mlagents-port", port, "--option=colour=1")
    assert "two behaviors are called 'Hopper-v0'" in fails("--mlagents-port", port, *HOPPERS, *HOPPERS)
    taken = (*COURSES, "--spawn-env=Hopper-v0", "--behavior-name=TerrainWalker2d-v0.builder")
    assert "two behaviors are called 'TerrainWalker2d-v0.builder'" in fails("--mlagents-port", port, *taken)
    assert "--mlagents-port is missing" in fails(code=2)
    assert "did you mean '--num-spawn-envs'?" in fails("--mlagents-port", port, "--num-spawn-env=1", code=2)


def test_gym_wrapper(launch):
    from mlagents_envs.envs.unity_gym_env import UnityToGymWrapper

    env = UnityToGymWrapper(launch("--spawn-env=Hopper-v0", "--num-spawn-envs=1", "--max-episode-steps=30", seed=1))
    assert env.observation_space.shape == (31,) and env.action_space.shape == (4,)
    for _ in range(3):
        obs, steps, done = env.reset(), 0, False
        while not done:
            assert env.observation_space.contains(obs)
            obs, reward, done, info = env.step(env.action_space.sample())
            steps += 1
        assert 0 < steps <= 30 and (reward == -1 or info["step"].interrupted[0])


def test_parallel_wrapper_sees_every_end(launch):
    from mlagents_envs.envs.unity_parallel_env import UnityParallelEnv

    env = UnityParallelEnv(launch(*HOPPERS, "--max-episode-steps=20", "--fresh-agent-ids", seed=2))
    env.reset()
    ends, decisions = 0, 0
    for _ in range(60):
        # one action of each living agent; those that have ended are taken leave of
        actions = {agent: np.zeros(4) for agent in env.agents}
        observations, rewards, dones, _ = env.step(actions)
        ends += sum(dones.values())
        decisions += sum(not done for done in dones.values())
        assert all(np.shape(observations[agent]) == (31,) and np.isfinite(rewards[agent]) for agent in dones)
    assert decisions == 60 * 16 and ends >= 3 * 16
    env.close()


def test_aec_wrapper_goes_round_all_agents(launch):
    from mlagents_envs.envs.unity_aec_env import UnityAECEnv

    env = UnityAECEnv(launch(*HOPPERS, "--max-episode-steps=5", "--fresh-agent-ids", seed=2))
    env.reset()
    agents, ends = set(), 0
    for _ in range(16 * 12):
        agents.add(env.agent_selection)
        _, _, done, _ = env.last()
        ends += done
        env.step(None if done else np.zeros(4))
    assert ends >= 16 and len(agents) >= 32
    env.close()
