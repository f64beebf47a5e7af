"""Trainers of other projects, for `marathon-studies`: one JSON request on stdin, one JSON answer as the last line of stdout.

A request names a trainer. `sb3` trains with Stable-Baselines3 on Marathon's environments in this process; `mlagents` runs
`mlagents-learn` with `marathon-player` and writes the policy to a file. An answer has the wall time and the processor time of
all processes in seconds, and the mean returns of episodes during training as `[steps, return]`. If a package is not
installed, the answer names it as `missing`.
"""

import importlib.metadata
import json
import os
import re
import resource
import socket
import subprocess
import sys
import time
from pathlib import Path


def versions(*packages):
    return ", ".join(f"{name} {importlib.metadata.version(name)}" for name in packages)


def cpu(who):
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def sb3(job):
    import marathon_rl
    import numpy as np
    import stable_baselines3
    import torch
    from marathon_rl.adapters.sb3 import Sb3VecEnv
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

    device = job.get("device", "cpu")
    if device != "cpu" and not torch.cuda.is_available():
        return {"missing": "GPU that PyTorch can use"}
    torch.set_num_threads(job["threads"])
    curve = []

    class Watch(BaseCallback):
        def _on_step(self):
            # the returns of the task, not those scaled for learning
            ended = [info["episode"]["r"] for info in self.locals["infos"] if "episode" in info]
            if ended:
                curve.append([self.num_timesteps, float(np.mean(ended))])
            return True

    settings = dict(job["settings"])
    rate = settings.pop("learning_rate")
    bare = Sb3VecEnv(job["agent"], job["agents"], threads=1)
    bare.seed(1000 * job["seed"])
    envs = VecNormalize(VecMonitor(bare), gamma=0.99)
    model = getattr(stable_baselines3, job["algorithm"])(
        "MlpPolicy",
        envs,
        seed=job["seed"],
        device=device,
        learning_rate=lambda left: rate * left,
        policy_kwargs={"net_arch": [64, 64], "activation_fn": torch.nn.Tanh, "log_std_init": job["log_std"]},
        **settings,
    )
    start, used = time.perf_counter(), time.process_time()
    model.learn(job["steps"], callback=Watch())
    wall, used = time.perf_counter() - start, time.process_time() - used

    # each agent plays one whole episode with the best actions
    env = marathon_rl.VecEnv(job["agent"], job["episodes"], seed=1_000_003, threads=1, autoreset="disabled")
    spec, obs = env.spec, env.reset()
    alive = np.ones(job["episodes"], bool)
    returns, lengths, distance = (np.zeros(job["episodes"]) for _ in range(3))
    while alive.any():
        action = model.predict(envs.normalize_obs(np.array(obs, np.float64)), deterministic=True)[0]
        obs, reward, terminated, truncated = env.step(np.asarray(action, np.float32))
        returns[alive] += reward[alive]
        distance[alive] += env.forward[alive]
        lengths[alive] += 1
        alive &= ~(terminated | truncated)
    return {
        "steps": model.num_timesteps,
        "wall": wall,
        "cpu": used,
        "curve": curve,
        "return": float(returns.mean()),
        "length": float(lengths.mean()),
        "speed": float((distance / (lengths * spec.dt)).mean()),
        "versions": versions("stable-baselines3", "torch"),
    }


def free_port():
    with socket.socket() as one:
        one.bind(("localhost", 0))
        return one.getsockname()[1]


def mlagents(job):
    import mlagents.trainers  # noqa: F401

    folder = Path(job["folder"])
    config = folder / "config.yaml"
    config.write_text(json.dumps(job["config"]))
    words = [sys.executable, "-m", "mlagents.trainers.learn", config, f"--env={job['player']}", "--run-id=run", "--force"]
    words += [f"--seed={job['seed']}", "--no-graphics", f"--base-port={free_port()}", f"--results-dir={folder}"]
    words += ["--torch-device=cpu", "--env-args", f"--spawn-env={job['agent']}", f"--num-spawn-envs={job['agents']}"]
    start = time.perf_counter()
    environment = {**os.environ, "OMP_NUM_THREADS": str(job["threads"])}
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False, env=environment)
    wall = time.perf_counter() - start
    text = done.stdout + done.stderr
    policy = folder / "run" / f"{job['agent']}.onnx"
    if done.returncode != 0 or not policy.exists():
        return {"error": text[-2000:]}
    # "Step: 1000. Time Elapsed: 2.5 s. Mean Reward: 1.25."; the reward is missing if no episode has ended
    times = [(int(n), float(t)) for n, t in re.findall(r"Step: (\d+)\. Time Elapsed: ([\d.]+) s", text)]
    (first, began), (last, ended) = times[0], times[-1]
    found = re.findall(r"Step: (\d+)\. Time Elapsed: [\d.]+ s\. Mean Reward: (-?\d+\.\d+)", text)
    return {
        "steps": job["config"]["behaviors"][job["agent"]]["max_steps"],
        "wall": wall,
        "cpu": cpu(resource.RUSAGE_CHILDREN),
        "curve": [[int(steps), float(reward)] for steps, reward in found],
        "rate": (last - first) / (ended - began) if last > first else None,
        "policy": str(policy),
        "versions": versions("mlagents", "torch"),
    }


def gpu(_job):
    import torch

    return {"gpu": torch.cuda.get_device_name() if torch.cuda.is_available() else None}


def main():
    job = json.loads(sys.stdin.readline())
    try:
        answer = {"sb3": sb3, "mlagents": mlagents, "gpu": gpu}[job["trainer"]](job)
    except ImportError as error:
        answer = {"missing": f"package {error.name}" if error.name else str(error)}
    print("\n" + json.dumps(answer), flush=True)


main()
