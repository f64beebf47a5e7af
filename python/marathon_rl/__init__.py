"""Locomotion environments with active ragdolls, stepped by the thousands on an ordinary CPU.

`VecEnv` is the native vector environment: NumPy arrays in, NumPy arrays out, nothing copied, no GIL while it steps.
`ids` lists the tasks, `spec` tells the facts of one.

    >>> import numpy as np, marathon_rl
    >>> env = marathon_rl.VecEnv("Hopper-v0", num_envs=1024)
    >>> obs = env.reset(seed=1)
    >>> obs, reward, terminated, truncated = env.step(np.zeros((1024, 4), np.float32))

The import registers every task with Gymnasium in the namespace `marathon_rl`:

    >>> import gymnasium
    >>> env = gymnasium.make("marathon_rl/Hopper-v0")
    >>> envs = gymnasium.make_vec("marathon_rl/Hopper-v0", num_envs=1024)

`train` is the native trainer, `load_policy` reads what it has learned, `evaluate` tells how good that is:

    >>> result = marathon_rl.train("Hopper-v0", callback=lambda metrics: print(metrics["return_mean"]))
    >>> actions = result.policy(obs)

`MarathonAgent` is what one subclasses to write an agent in Python, `Simulation` the bare physics of a `Model`.
"""

from marathon_rl import registration
from marathon_rl._native import (
    Clip,
    CommandRange,
    Model,
    Policy,
    Renderer,
    Simulation,
    Spec,
    TrainResult,
    VecEnv,
    Viewer,
    __version__,
    ids,
    load_policy,
    spec,
    train,
)
from marathon_rl.agents import MarathonAgent, ResetNoise
from marathon_rl.env import MarathonEnv
from marathon_rl.evaluation import evaluate
from marathon_rl.tolerance import Tolerance
from marathon_rl.vector import MarathonVectorEnv

__all__ = [
    "Clip",
    "CommandRange",
    "MarathonAgent",
    "MarathonEnv",
    "MarathonVectorEnv",
    "Model",
    "Policy",
    "Renderer",
    "ResetNoise",
    "Simulation",
    "Spec",
    "Tolerance",
    "TrainResult",
    "VecEnv",
    "Viewer",
    "__version__",
    "evaluate",
    "ids",
    "load_policy",
    "spec",
    "train",
]

registration.register()
