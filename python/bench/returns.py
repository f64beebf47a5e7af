"""Trains Gymnasium's tasks natively and with Stable-Baselines3, and compares every policy in the installed Gymnasium.

    $ python python/bench/returns.py docs/studies/gymnasium-returns.csv

Every task is trained with five seeds by `marathon_rl.train` and its fast settings, on one thread. Beside them,
Stable-Baselines3's PPO learns in Gymnasium, on one thread and for the processor time that the native run of the same
seed took: with its own defaults and with the settings of RL Baselines3 Zoo. Each policy is played here (100 episodes)
and in Gymnasium (20 episodes) with its best actions, and is a line of the CSV file. Lines that are there already are
kept, so an interrupted table goes on. Processor seconds are those of training and, for the native runs, of its final
evaluation.

Needs `gymnasium[mujoco]`, and for its part `stable_baselines3`.
"""

import argparse
import csv
import statistics
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import marathon_rl
from marathon_rl.compare_gymnasium import Act, compare

TASKS = ["Hopper-v5", "Walker2d-v5", "HalfCheetah-v5", "Ant-v5", "Humanoid-v5"]
# the return that a task is to reach, and the processor seconds it may take
BARS = {
    "Hopper-v5": (3000, 40),
    "Walker2d-v5": (4000, 40),
    "HalfCheetah-v5": (5000, 60),
    "Ant-v5": (4000, 200),
    "Humanoid-v5": (5000, 600),
}
COLUMNS = [
    *("task", "trainer", "seed", "steps", "cpu_seconds"),
    *("here", "here_half_width", "here_falls"),
    *("gymnasium", "gymnasium_half_width", "gymnasium_falls"),
]

# settings of RL Baselines3 Zoo, hyperparams/ppo.yml, for the tasks' versions v3 (v4 and v5 have none of their own)
ZOO_NET = {"log_std_init": -2, "ortho_init": False, "net_arch": {"pi": [256, 256], "vf": [256, 256]}}
ZOO: dict[str, dict[str, Any]] = {
    "Hopper-v5": {
        **{"batch_size": 32, "n_steps": 512, "gamma": 0.999, "learning_rate": 9.80828e-05, "ent_coef": 0.00229519},
        **{"clip_range": 0.2, "n_epochs": 5, "gae_lambda": 0.99, "max_grad_norm": 0.7, "vf_coef": 0.835671},
        "policy_kwargs": ZOO_NET,
    },
    "Walker2d-v5": {
        **{"batch_size": 32, "n_steps": 512, "gamma": 0.99, "learning_rate": 5.05041e-05, "ent_coef": 0.000585045},
        **{"clip_range": 0.1, "n_epochs": 20, "gae_lambda": 0.95, "max_grad_norm": 1, "vf_coef": 0.871923},
    },
    "HalfCheetah-v5": {
        **{"batch_size": 64, "n_steps": 512, "gamma": 0.98, "learning_rate": 2.0633e-05, "ent_coef": 0.000401762},
        **{"clip_range": 0.1, "n_epochs": 20, "gae_lambda": 0.92, "max_grad_norm": 0.8, "vf_coef": 0.58096},
        "policy_kwargs": ZOO_NET,
    },
    # the zoo leaves the ant with the defaults
    "Ant-v5": {},
    "Humanoid-v5": {
        **{"batch_size": 256, "n_steps": 512, "gamma": 0.95, "learning_rate": 3.56987e-05, "ent_coef": 0.00238306},
        **{"clip_range": 0.3, "n_epochs": 5, "gae_lambda": 0.9, "max_grad_norm": 2, "vf_coef": 0.431892},
        "policy_kwargs": ZOO_NET,
    },
}


def main() -> None:
    """Make the table."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("csv", type=Path, help="the table; lines that it has are not made again")
    parser.add_argument("--task", action="append", choices=TASKS, help="only this one; may be repeated")
    parser.add_argument("--seeds", type=int, default=5, help="native runs of each task (default: 5)")
    parser.add_argument("--sb3-seeds", type=int, default=1, help="runs of Stable-Baselines3 (default: 1; 0: none)")
    parser.add_argument("--steps", action="append", default=[], metavar="TASK=N", help="decisions of a task's runs")
    args = parser.parse_args()
    tasks = args.task or TASKS
    steps = {task: int(float(n)) for task, n in (word.split("=") for word in args.steps)}
    rows = read(args.csv)
    for task in tasks:
        for seed in range(1, args.seeds + 1):
            if (task, "marathon", str(seed)) not in rows:
                put(args.csv, rows, native(task, seed, steps.get(task)))
    for task in tasks:
        for seed in range(1, args.sb3_seeds + 1):
            budget = float(rows[task, "marathon", str(seed)]["cpu_seconds"])
            for trainer, settings in {"sb3": {}, "sb3-zoo": ZOO[task]}.items():
                if (task, trainer, str(seed)) not in rows and (settings or trainer == "sb3"):
                    put(args.csv, rows, stable_baselines3(task, trainer, settings, seed, budget))
    print("\n".join(summary(rows)))


def native(task: str, seed: int, steps: int | None) -> dict[str, str]:
    """A native run."""
    start = time.process_time()
    result = marathon_rl.train(task, seed=seed, threads=1, steps=steps)
    return row((task, "marathon", seed), result.steps, time.process_time() - start, result.policy)


def stable_baselines3(task: str, trainer: str, settings: dict[str, Any], seed: int, budget: float) -> dict[str, str]:
    """A run of Stable-Baselines3's PPO that ends after `budget` processor seconds."""
    import torch  # noqa: PLC0415
    from stable_baselines3 import PPO  # noqa: PLC0415
    from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize  # noqa: PLC0415

    torch.set_num_threads(1)
    settings = dict(settings)
    if "policy_kwargs" in settings:
        settings["policy_kwargs"] = {**settings["policy_kwargs"], "activation_fn": torch.nn.ReLU}
    envs = VecNormalize(DummyVecEnv([lambda: gymnasium.make(task)]), gamma=settings.get("gamma", 0.99))
    model = PPO("MlpPolicy", envs, seed=seed, device="cpu", **settings)
    start = time.process_time()
    model.learn(10**9, callback=lambda *_: time.process_time() - start < budget)
    seconds = time.process_time() - start

    def act(obs: np.ndarray) -> np.ndarray:
        return np.asarray(model.predict(envs.normalize_obs(obs), deterministic=True)[0])

    return row((task, trainer, seed), model.num_timesteps, seconds, act)


def row(run: tuple[str, str, int], steps: int, seconds: float, act: Act) -> dict[str, str]:
    """A line about the policy of a run: a task, a trainer and a seed."""
    comparison = compare(run[0], act)
    here, there = comparison.marathon, comparison.gymnasium
    of = [
        *(*run, steps, f"{seconds:.1f}"),
        *(f"{here.mean:.1f}", f"{here.half_width:.1f}", here.falls),
        *(f"{there.mean:.1f}", f"{there.half_width:.1f}", there.falls),
    ]
    return dict(zip(COLUMNS, map(str, of), strict=True))


Rows = dict[tuple[str, str, str], dict[str, str]]


def read(path: Path) -> Rows:
    """The lines of a table, by task, trainer and seed."""
    if not path.exists():
        return {}
    with path.open(newline="") as file:
        return {(r["task"], r["trainer"], r["seed"]): r for r in csv.DictReader(file)}


def put(path: Path, rows: Rows, line: dict[str, str]) -> None:
    """Add a line and write the table."""
    rows[line["task"], line["trainer"], line["seed"]] = line
    print(", ".join(f"{k} {v}" for k, v in line.items()), flush=True)
    temporary = path.with_name(f".{path.name}.tmp")
    with temporary.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows.values())
    temporary.replace(path)


def summary(rows: Rows) -> Iterator[str]:
    """Medians of the native runs against their bars, as lines."""
    for task, (bar, seconds) in BARS.items():
        of = [r for (name, trainer, _), r in rows.items() if (name, trainer) == (task, "marathon")]
        if of:
            score = statistics.median(float(r["gymnasium"]) for r in of)
            cpu = statistics.median(float(r["cpu_seconds"]) for r in of)
            met = "reached" if score >= bar and cpu <= seconds else "missed"
            yield f"{task}: median {score:.0f} in {cpu:.0f} processor seconds; {bar} in {seconds}: {met}"


if __name__ == "__main__":
    main()
