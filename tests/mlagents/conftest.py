"""Fixtures of the tests: the player, ports that no other test uses, environments that are always closed."""

import os
import pathlib
import socket

import pytest
from mlagents_envs.environment import UnityEnvironment
from mlagents_envs.registry import default_registry

# importing mlagents_envs.envs goes through all registered environments, which lie in the network
default_registry.clear()

PLAYER = pathlib.Path(os.environ["MARATHON_PLAYER"]).resolve()
MARATHON = pathlib.Path(os.environ["MARATHON"]).resolve()


def free_port():
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


@pytest.fixture
def launch(tmp_path):
    """Starts environments: launch("--spawn-env=Hopper-v0", seed=1)."""
    opened = []

    def launch(*args, file_name=PLAYER, base_port=None, **options):
        env = UnityEnvironment(
            file_name=str(file_name),
            base_port=base_port or free_port(),
            additional_args=list(args),
            log_folder=str(tmp_path),
            timeout_wait=30,
            no_graphics=True,
            **options,
        )
        opened.append(env)
        return env

    yield launch
    for env in opened:
        if env._loaded:
            env.close()


@pytest.fixture
def log(tmp_path):
    """Log of a worker's player."""
    return lambda worker=0: (tmp_path / f"Player-{worker}.log").read_text()
