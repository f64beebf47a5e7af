"""dm_control's tasks, played from given states with given actions.

Reads a JSON object {"jobs": [job, ..], "tolerances": [tolerance, ..]} from standard input, a job being
    {"domain": "walker", "task": "walk", "kwargs": {...}, "converge": bool, "alone": bool,
     "episodes": [{"qpos": [...], "qvel": [...], "actions": [[...], ...]}, ...],
     "resets": n, "settled": n, "returns": n}
and a tolerance {"x": [..], "bounds": [a, b], "margin": m, "sigmoid": name, "value_at_margin": v}; prints
    {"jobs": [answer, ..], "tolerances": [[..], ..]}
with answers
    {"spec": {"obs": .., "low": [..], "high": [..], "dt": .., "max_episode_steps": ..},
     "episodes": [{"first": observation, "contacts": n, "steps": [step, ..], "alone": [step, ..]}, ..],
     "resets": [[qpos.., qvel.., observation..], ..],
     "settled": [{"drawn": [...], "qpos": [...], "qvel": [...]}, ..],
     "returns": [{"return": x, "length": n, "discount": d}, ..] of random actions}
and steps {"obs", "reward", "last", "qpos", "qvel"}. `kwargs` are those of the task's class. "settled" are starts of the
cheetah with the configuration that was drawn. "chaos" in a step is how far a twin is away that began at a distance of 1e-10.
With "converge", MuJoCo's solver is run to the end instead of as far as the model's options say. With "alone", every step is
also made again from the state before it, as if an episode began there.
"""

import json
import os
import sys
import types

# nothing is drawn
os.environ["MUJOCO_GL"] = "disable"

import mujoco
import numpy as np
from dm_control.mujoco.wrapper.mjbindings import sizes

# arrays that dm_control has a name for and the installed MuJoCo no longer has
for struct, of in [("mjmodel", mujoco.MjModel), ("mjdata", mujoco.MjData)]:
    sizes.array_sizes[struct] = {k: v for k, v in sizes.array_sizes[struct].items() if hasattr(of, k)}

from dm_control import suite
from dm_control.suite import cheetah, hopper, humanoid, walker
from dm_control.utils import rewards

from converging import solve_to_the_end

TASKS = {
    "cheetah": cheetah.Cheetah,
    "hopper": hopper.Hopper,
    "humanoid": humanoid.Humanoid,
    "walker": walker.PlanarWalker,
}


def make(job):
    env = suite.load(job["domain"], job["task"], task_kwargs={"random": 1})
    if job.get("kwargs"):
        own = {k.lstrip("_"): v for k, v in vars(env.task).items() if k in ("_move_speed", "_pure_state", "_hopping")}
        env._task = TASKS[job["domain"]](random=1, **{**own, **job["kwargs"]})
    if job.get("converge"):
        solve_to_the_end(env.physics.model.ptr.opt)
    return env


def flat(observation):
    return np.concatenate([np.ravel(x) for x in observation.values()]).tolist()


def begin(env, qpos, qvel):
    """Starts an episode in a state; returns the first observation."""
    with env.physics.reset_context():
        env.physics.data.qpos[:], env.physics.data.qvel[:] = qpos, qvel
    env._reset_next_step, env._step_count = False, 0
    return flat(env.task.get_observation(env.physics))


def step(env, action):
    now = env.step(np.array(action))
    data = env.physics.data
    return {
        "obs": flat(now.observation),
        "reward": float(now.reward),
        "last": bool(now.last()),
        "qpos": data.qpos.tolist(),
        "qvel": data.qvel.tolist(),
    }


def play(env, twin, episode, alone):
    qpos, qvel = episode["qpos"], episode["qvel"]
    out = {"first": begin(env, qpos, qvel), "contacts": int(env.physics.data.ncon), "steps": [], "alone": []}
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


def reset(env):
    observation = flat(env.reset().observation)
    return [*env.physics.data.qpos.tolist(), *env.physics.data.qvel.tolist(), *observation]


def settled(env, rng):
    drawn = []

    def uniform(low, high):
        drawn[:] = rng.uniform(low, high)
        return np.array(drawn)

    env.task._random = types.SimpleNamespace(uniform=uniform)
    env.reset()
    return {"drawn": drawn, "qpos": env.physics.data.qpos.tolist(), "qvel": env.physics.data.qvel.tolist()}


def random_return(env, rng):
    env.reset()
    total, length, spec = 0.0, 0, env.action_spec()
    while True:
        now = env.step(rng.uniform(spec.minimum, spec.maximum))
        total, length = total + float(now.reward), length + 1
        if now.last():
            return {"return": total, "length": length, "discount": float(now.discount)}


def run(job):
    env, twin = make(job), make(job)
    action = env.action_spec()
    observation = env.reset().observation
    spec = {
        "obs": len(flat(observation)),
        "observations": [[name, int(np.size(x))] for name, x in observation.items()],
        "low": action.minimum.tolist(),
        "high": action.maximum.tolist(),
        "dt": env.control_timestep(),
        "max_episode_steps": int(np.ceil(env._step_limit)),
    }
    rng = np.random.default_rng(1)
    return {
        "spec": spec,
        "episodes": [play(env, twin, episode, job.get("alone")) for episode in job.get("episodes", [])],
        "resets": [reset(env) for _ in range(job.get("resets", 0))],
        "returns": [random_return(env, rng) for _ in range(job.get("returns", 0))],
        "settled": [settled(env, rng) for _ in range(job.get("settled", 0))],
    }


def tolerance(t):
    bounds = [float(b) for b in t["bounds"]]
    worth = rewards.tolerance(np.array(t["x"]), bounds, t["margin"], t["sigmoid"], t["value_at_margin"])
    return worth.tolist()


def main():
    request = json.load(sys.stdin)
    answer = {
        "jobs": [run(job) for job in request.get("jobs", [])],
        "tolerances": [tolerance(t) for t in request.get("tolerances", [])],
    }
    json.dump(answer, sys.stdout)


if __name__ == "__main__":
    main()
