"""A trainer in Python tells agents what to do, over ML-Agents' own channel for environment parameters.

Promises: a number holds for all agents from their next decision until it is changed, over the ends of episodes; a sampler
draws for each agent and episode; NaN gives the agents back to their schedules; what is out of range is refused by name and
changes nothing. The agents are rovers of a player that has registered an agent of its own, `examples/own_player.rs`.
"""

import math
import os
import pathlib

import numpy as np
from mlagents_envs.base_env import ActionTuple
from mlagents_envs.side_channel.environment_parameters_channel import EnvironmentParametersChannel

OWN_PLAYER = pathlib.Path(os.environ["OWN_PLAYER"]).resolve()
NAME = "Rover-v0?team=0"
AGENTS = 8


def rovers(launch, *args):
    parameters = EnvironmentParametersChannel()
    flags = ("--spawn-env=Rover-v0", f"--num-spawn-envs={AGENTS}", *args)
    env = launch(*flags, file_name=OWN_PLAYER, seed=7, side_channels=[parameters])
    env.reset()
    return env, parameters


def told(env):
    """Return the command that each rover observes."""
    return env.get_steps(NAME)[0].obs[0][:, 0].copy()


def drive(env, decisions=1):
    """Lets the motors push towards the command, and returns the last step's decisions and ends."""
    for _ in range(decisions):
        seen = env.get_steps(NAME)[0].obs[0]
        action = np.clip(2 * (seen[:, 0] - seen[:, 1]) + 0.1 * seen[:, 0], -1, 1)
        env.set_actions(NAME, ActionTuple(continuous=np.repeat(action[:, None], 2, 1).astype(np.float32)))
        env.step()
    return env.get_steps(NAME)


def test_a_number_holds_from_the_next_decision_on(launch):
    env, parameters = rovers(launch)
    own = told(env)
    assert len(set(own)) == AGENTS and (np.abs(own) <= 2).all()
    parameters.set_float_parameter("command.velocity", 1.5)
    drive(env)
    assert (told(env) == 1.5).all()
    decisions, _ = drive(env, 100)
    np.testing.assert_allclose(decisions.obs[0][:, 1], 1.5, atol=0.15)
    # a reset begins new episodes under the same command
    env.reset()
    assert (told(env) == 1.5).all()
    parameters.set_float_parameter("command.velocity", -1.25)
    env.reset()
    assert (told(env) == -1.25).all()


def test_nan_gives_the_agents_back_to_their_schedules(launch):
    env, parameters = rovers(launch)
    untouched, _ = rovers(launch)
    parameters.set_float_parameter("command.velocity", 0.5)
    drive(env, 20)
    drive(untouched, 20)
    parameters.set_float_parameter("command.velocity", math.nan)
    drive(env)
    drive(untouched)
    # the schedule has gone on meanwhile
    np.testing.assert_array_equal(told(env), told(untouched))
    assert len(set(told(env))) == AGENTS


def test_a_sampler_draws_for_each_agent_and_episode(launch):
    env, parameters = rovers(launch, "--max-episode-steps=5")
    parameters.set_uniform_sampler_parameters("command.velocity", 0.5, 1.0, 3)
    drive(env)
    first = told(env)
    assert len(set(first)) == AGENTS and ((first >= 0.5) & (first <= 1)).all()
    drive(env, 3)
    np.testing.assert_array_equal(told(env), first)
    _, ends = drive(env)
    assert len(ends) == AGENTS
    second = told(env)
    assert not (second == first).any() and ((second >= 0.5) & (second <= 1)).all()


def test_what_cannot_be_told_is_refused_by_name(launch, log):
    env, parameters = rovers(launch)
    parameters.set_float_parameter("command.velocity", 1.0)
    drive(env)
    parameters.set_float_parameter("command.velocity", 2.5)
    parameters.set_float_parameter("command.velocty", 1.0)
    drive(env, 3)
    assert (told(env) == 1).all()
    env.close()
    text = log()
    assert text.count("agent 'Rover-v0': command velocity is 2.5, expected -2 to 2 m/s") == 1
    assert "'command.velocty' has no effect; did you mean 'command.velocity'?" in text
