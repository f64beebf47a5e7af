"""Gymnasium's MuJoCo tasks, played from given states with given actions.

Reads a JSON list of jobs from standard input:
    {"id": "Hopper-v5", "kwargs": {...}, "converge": bool, "alone": bool,
     "episodes": [{"qpos": [...], "qvel": [...], "actions": [[...], ...]}, ...],
     "resets": n, "returns": {"episodes": n, "scale": x}}
and prints for each
    {"spec": {"obs": .., "low": [..], "high": [..], "dt": .., "max_episode_steps": .., "arguments": {name: default, ..}},
     "episodes": [{"first": observation, "steps": [step, ..], "alone": [step, ..]}, ..],
     "resets": [[qpos.., qvel.., observation..], ..],
     "returns": [return, ..] of random actions, uniform within `scale` times the bounds}
with a step {"obs", "reward", "info", "terminated", "truncated", "qpos", "qvel"}. Episodes go on after they have terminated.
"chaos" in a step is how far a twin is away that began at a distance of 1e-10. With "converge", MuJoCo's solver is run to
the end instead of as far as the model's options say. With "alone", every step is also made again from the state before
it, as if an episode began there.
"""

import inspect
import json
import sys
import types

# only rendering needs it
sys.modules.setdefault("imageio", types.ModuleType("imageio"))

import gymnasium as gym
import numpy as np

from converging import solve_to_the_end


def numbers(info):
    return {k: float(v) for k, v in info.items() if np.ndim(v) == 0}


def value(x):
    """A default value as JSON, which has no infinities."""
    if isinstance(x, tuple):
        return [value(y) for y in x]
    return str(x) if isinstance(x, float) and np.isinf(x) else x


def arguments(env):
    """The task's own keyword arguments; those of all MuJoCo tasks are about rendering."""
    parameters = inspect.signature(type(env.unwrapped).__init__).parameters
    skip = {"self", "default_camera_config", "kwargs"}
    return {name: value(p.default) for name, p in parameters.items() if name not in skip}


def converge(model):
    solve_to_the_end(model.opt)


def step(env, action):
    data = env.unwrapped.data
    obs, reward, terminated, truncated, info = env.step(np.array(action, dtype=np.float32))
    return {
        "obs": obs.tolist(),
        "reward": float(reward),
        "info": numbers(info),
        "terminated": bool(terminated),
        "truncated": bool(truncated),
        "qpos": data.qpos.tolist(),
        "qvel": data.qvel.tolist(),
    }


def begin(env, qpos, qvel):
    """Starts an episode in a state; returns the first observation."""
    env.reset(seed=0)
    env.unwrapped.set_state(np.array(qpos), np.array(qvel))
    return env.unwrapped._get_obs().tolist()


def play(env, twin, episode, alone):
    qpos, qvel = episode["qpos"], episode["qvel"]
    out = {"first": begin(env, qpos, qvel), "steps": [], "alone": []}
    away = np.random.default_rng(2).normal(size=len(qvel))
    begin(twin, qpos, np.array(qvel) + 1e-10 * away / np.linalg.norm(away))
    for action in episode["actions"]:
        here, there = step(env, action), step(twin, action)
        here["chaos"] = max(abs(a - b) for k in ["qpos", "qvel"] for a, b in zip(here[k], there[k]))
        out["steps"].append(here)
    if alone:
        befores = [episode, *out["steps"][:-1]]
        for before, action in zip(befores, episode["actions"]):
            begin(env, before["qpos"], before["qvel"])
            out["alone"].append(step(env, action))
    return out


def reset(env, seed):
    obs, _ = env.reset(seed=seed)
    return [*env.unwrapped.data.qpos.tolist(), *env.unwrapped.data.qvel.tolist(), *obs.tolist()]


def random_return(env, rng, scale):
    env.reset(seed=int(rng.integers(2**31)))
    low, high = env.action_space.low, env.action_space.high
    total = 0.0
    while True:
        _, reward, terminated, truncated, _ = env.step((scale * rng.uniform(low, high)).astype(np.float32))
        total += float(reward)
        if terminated or truncated:
            return total


def run(job):
    kwargs = {k: tuple(v) if isinstance(v, list) else v for k, v in job.get("kwargs", {}).items()}
    env, twin = (gym.make(job["id"], disable_env_checker=True, **kwargs) for _ in range(2))
    if job.get("converge"):
        converge(env.unwrapped.model)
        converge(twin.unwrapped.model)
    space = env.action_space
    spec = {
        "obs": env.observation_space.shape[0],
        "low": space.low.tolist(),
        "high": space.high.tolist(),
        "dt": env.unwrapped.dt,
        "max_episode_steps": env.spec.max_episode_steps,
        "arguments": arguments(env),
    }
    rng, returns = np.random.default_rng(1), job.get("returns", {"episodes": 0, "scale": 0})
    return {
        "spec": spec,
        "episodes": [play(env, twin, episode, job.get("alone")) for episode in job.get("episodes", [])],
        "resets": [reset(env, seed) for seed in range(job.get("resets", 0))],
        "returns": [random_return(env, rng, returns["scale"]) for _ in range(returns["episodes"])],
    }


if __name__ == "__main__":
    json.dump([run(job) for job in json.load(sys.stdin)], sys.stdout)
