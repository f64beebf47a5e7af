"""PPO in one file of PyTorch, in the manner of CleanRL: to be read from top to bottom and changed.

Everything that the algorithm is stands in `learn`; nothing is hidden in a library. The environment is Gymnasium's
vector interface, so any task of `marathon list` can be named, and with `copy=False` its arrays are used up before the
next step overwrites them. `SAME_STEP` is the autoreset mode for code that does not want to know about resets: an
episode that ends is followed by the next in the same step, and what it ended with is in `infos["final_obs"]`, from
which an episode that was merely cut off is continued by the critic.

    python cleanrl_ppo.py                                    Hopper-v0: stands within half a minute, runs within some
    python cleanrl_ppo.py --task Walker2d-v5 --steps 3000000
"""

import argparse

import gymnasium
import numpy as np
import torch
from torch import nn

import marathon_rl  # noqa: F401 (registers the tasks with Gymnasium)

HORIZON, EPOCHS, MINIBATCHES = 64, 5, 8
GAMMA, LAMBDA, CLIP, ENTROPY = 0.99, 0.95, 0.2, 0.001


class Normalizer:
    """Mean and variance of all observations so far (Chan, Golub, LeVeque, 1979)."""

    def __init__(self, size: int) -> None:
        self.mean, self.var, self.count = torch.zeros(size), torch.ones(size), 1e-4

    def update(self, x: torch.Tensor) -> None:
        total = self.count + len(x)
        shift = x.mean(0) - self.mean
        spread = self.var * self.count + x.var(0, correction=0) * len(x) + shift**2 * self.count * len(x) / total
        self.mean, self.var, self.count = self.mean + shift * len(x) / total, spread / total, total

    def __call__(self, x: torch.Tensor) -> torch.Tensor:
        return ((x - self.mean) / (self.var + 1e-8).sqrt()).clamp(-10, 10)


def mlp(inputs: int, outputs: int, scale: float) -> nn.Sequential:
    """Two hidden layers; the last one starts small."""
    net = nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs))
    nn.init.orthogonal_(net[-1].weight, scale)
    nn.init.zeros_(net[-1].bias)
    return net


def learn(task: str, steps: int, num_envs: int, seed: int) -> list[float]:  # noqa: PLR0915 (to be read in one go)
    """Learn a task; returns the mean returns of the episodes that ended, rollout by rollout."""
    torch.manual_seed(seed)
    # networks this small are slower on several threads
    torch.set_num_threads(1)
    mode = gymnasium.vector.AutoresetMode.SAME_STEP
    envs = gymnasium.make_vec(f"marathon_rl/{task}", num_envs=num_envs, autoreset_mode=mode, copy=False)
    space = envs.single_action_space
    middle, half = torch.tensor((space.high + space.low) / 2), torch.tensor((space.high - space.low) / 2)
    obs_size, act_size = envs.single_observation_space.shape[0], space.shape[0]

    normalize, reward_scale = Normalizer(obs_size), Normalizer(1)
    actor, critic = mlp(obs_size, act_size, 0.01), mlp(obs_size, 1, 1.0)
    log_std = nn.Parameter(torch.full((act_size,), -0.5))
    parameters = [*actor.parameters(), *critic.parameters(), log_std]
    optimizer = torch.optim.Adam(parameters, lr=1e-3, eps=1e-5)

    def tensor(x: np.ndarray) -> torch.Tensor:
        return torch.tensor(x, dtype=torch.float32)

    def log_prob(obs: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
        return torch.distributions.Normal(actor(obs), log_std.exp()).log_prob(action).sum(-1)

    raw = tensor(envs.reset(seed=seed)[0])
    total, discounted, history = torch.zeros(num_envs), torch.zeros(num_envs), []
    iterations = max(1, steps // (HORIZON * num_envs))
    for iteration in range(iterations):
        optimizer.param_groups[0]["lr"] = 1e-3 * (1 - iteration / iterations)
        # act
        rollout = {name: [] for name in ("raw", "obs", "action", "log_prob", "reward", "ended", "last_value")}
        returns = []
        for _ in range(HORIZON):
            with torch.no_grad():
                obs = normalize(raw)
                action = actor(obs) + log_std.exp() * torch.randn(num_envs, act_size)
                chances = log_prob(obs, action)
            next_obs, reward, terminated, truncated, infos = envs.step((middle + half * action.clamp(-1, 1)).numpy())
            ended = torch.tensor(terminated | truncated)
            # the value of what would have followed an episode that was cut off
            last_value = torch.zeros(num_envs)
            for i in np.flatnonzero(truncated):
                with torch.no_grad():
                    last_value[i] = critic(normalize(tensor(infos["final_obs"][i])[None]))[0, 0]
            row = raw, obs, action, chances, tensor(reward), ended, last_value
            for values, value in zip(rollout.values(), row, strict=True):
                values.append(value)
            total, discounted = total + row[4], GAMMA * discounted + row[4]
            reward_scale.update(discounted[:, None])
            returns += total[ended].tolist()
            total[ended], discounted[ended] = 0.0, 0.0
            raw = tensor(next_obs)
        batch = {name: torch.stack(values) for name, values in rollout.items()}

        # generalized advantage estimation, backwards
        rewards = batch["reward"] / (reward_scale.var + 1e-8).sqrt()
        with torch.no_grad():
            values = critic(batch["obs"])[..., 0]
            following, advantage = critic(normalize(raw))[:, 0], torch.zeros(num_envs)
        advantages = torch.zeros(HORIZON, num_envs)
        for t in reversed(range(HORIZON)):
            goes_on = (~batch["ended"][t]).float()
            target = rewards[t] + GAMMA * (goes_on * following + batch["last_value"][t])
            advantage = target - values[t] + GAMMA * LAMBDA * goes_on * advantage
            advantages[t], following = advantage, values[t]
        flat = {name: values.flatten(0, 1) for name, values in batch.items()}
        flat["advantage"], flat["target"] = advantages.flatten(), (advantages + values).flatten()

        # improve
        for _ in range(EPOCHS):
            for rows in torch.randperm(HORIZON * num_envs).chunk(MINIBATCHES):
                x = {name: values[rows] for name, values in flat.items()}
                ratio = (log_prob(x["obs"], x["action"]) - x["log_prob"]).exp()
                gain = (x["advantage"] - x["advantage"].mean()) / (x["advantage"].std() + 1e-8)
                policy_loss = -torch.min(gain * ratio, gain * ratio.clamp(1 - CLIP, 1 + CLIP)).mean()
                value_loss = (critic(x["obs"])[:, 0] - x["target"]).square().mean()
                loss = policy_loss + 0.5 * value_loss - ENTROPY * log_std.sum()
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(parameters, 0.5)
                optimizer.step()
        normalize.update(flat["raw"])

        if returns:
            history.append(float(np.mean(returns)))
            done = (iteration + 1) * HORIZON * num_envs
            print(f"{done:9,} steps, {len(returns):4} episodes, return {history[-1]:8.1f}", flush=True)
    return history


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--task", default="Hopper-v0")
    parser.add_argument("--steps", type=int, default=1_000_000, help="steps of all agents together")
    parser.add_argument("--agents", dest="num_envs", type=int, default=64)
    parser.add_argument("--seed", type=int, default=1)
    learn(**vars(parser.parse_args()))
