"""Losses and gradients of PPO's objective in PyTorch.

Reads a JSON list of cases from standard input, one per activation and kind of value loss:
    {"activation": name, "sizes": {"actor": [...], "critic": [...]}, "params": {"actor": [...], "critic": [...]},
     "log_std": [...], "obs": [[...]], "action": [[...]], "log_prob": [[...]], "advantage": [...], "value": [...],
     "target": [...], "clip": x, "value_clip": x or null, "entropy_coef": x, "per_action": bool}
Rows are samples. A log-probability is that of all actions, or with `per_action` one for each; then each has a ratio of its
own, and the objective is the mean over the actions, as in ML-Agents. Parameters are flat, per layer the weights [output, input], then the biases. Log-probabilities leave out
the constant -ln(2 pi) / 2 per action. Advantages are normalized already. Prints a JSON list with, per case, the outputs
of both networks, the mean losses and statistics, and the gradients of the mean losses, computed in double precision.
"""

import json
import math
import sys

import torch
from torch import nn

ACTIVATIONS = {"swish": nn.SiLU, "tanh": nn.Tanh, "elu": nn.ELU, "relu": nn.ReLU}


def network(sizes, activation, params):
    layers = []
    for i, (inputs, outputs) in enumerate(zip(sizes, sizes[1:])):
        layers.append(nn.Linear(inputs, outputs))
        if i + 2 < len(sizes):
            layers.append(ACTIVATIONS[activation]())
    net = nn.Sequential(*layers).double()
    flat = torch.tensor(params, dtype=torch.float64)
    nn.utils.vector_to_parameters(flat, net.parameters())
    return net


def gradient(parameters):
    return torch.cat([p.grad.flatten() for p in parameters]).tolist()


def run(case):
    def tensor(name):
        return torch.tensor(case[name], dtype=torch.float64)

    actor = network(case["sizes"]["actor"], case["activation"], case["params"]["actor"])
    critic = network(case["sizes"]["critic"], case["activation"], case["params"]["critic"])
    log_std = tensor("log_std").requires_grad_()
    obs, action, advantage, old_value, target = map(tensor, ["obs", "action", "advantage", "value", "target"])
    old_log_prob = tensor("log_prob")
    # actions that share a column have the constant as often
    old_log_prob -= 0.5 * math.log(2 * math.pi) * action.shape[1] / old_log_prob.shape[1]

    mean = actor(obs)
    distribution = torch.distributions.Normal(mean, log_std.exp())
    log_prob, entropy = distribution.log_prob(action), distribution.entropy().sum(-1).mean()
    if not case["per_action"]:
        log_prob = log_prob.sum(-1, keepdim=True)
    log_ratio = log_prob - old_log_prob
    ratio, advantage = log_ratio.exp(), advantage.unsqueeze(-1)
    clip = case["clip"]
    surrogate = torch.min(ratio * advantage, ratio.clamp(1 - clip, 1 + clip) * advantage)
    bonus = entropy / log_prob.shape[1]
    (-surrogate.mean() - case["entropy_coef"] * bonus).backward()

    value = critic(obs).squeeze(-1)
    error = (value - target) ** 2
    if case["value_clip"] is not None:
        held = old_value + (value - old_value).clamp(-case["value_clip"], case["value_clip"])
        error = torch.max(error, (held - target) ** 2)
    value_loss = 0.5 * error.mean()
    value_loss.backward()

    return {
        "mean": mean.tolist(),
        "value": value.tolist(),
        "policy_loss": -surrogate.mean().item(),
        "value_loss": value_loss.item(),
        "entropy": entropy.item(),
        "kl": (ratio - 1 - log_ratio).sum(-1).mean().item(),
        "actor_gradient": gradient(actor.parameters()),
        "log_std_gradient": log_std.grad.tolist(),
        "critic_gradient": gradient(critic.parameters()),
    }


if __name__ == "__main__":
    json.dump([run(case) for case in json.load(sys.stdin)], sys.stdout)
