"""A discriminator's loss and its gradient in PyTorch; the penalty takes second derivatives.

Reads a JSON list of cases from standard input:
    {"form": "amp" or "gail", "activation": name, "sizes": [...], "params": [...], "own": [[...]], "expert": [[...]],
     "gradient_penalty": x, "logit_decay": x}
Rows are samples. Parameters are flat, per layer the weights [output, input], then the biases. Prints a JSON list with, per
case, the loss summed over the samples and its gradient, computed in double precision.
"""

import json
import sys

import torch
from torch.nn.functional import softplus
from torch_ppo import gradient, network


def run(case):
    net = network(case["sizes"], case["activation"], case["params"])
    own = torch.tensor(case["own"], dtype=torch.float64)
    expert = torch.tensor(case["expert"], dtype=torch.float64).requires_grad_()
    of_own, of_expert = net(own), net(expert)
    if case["form"] == "amp":
        loss = ((of_own + 1) ** 2).sum() + ((of_expert - 1) ** 2).sum()
    else:
        loss = softplus(of_own).sum() + softplus(-of_expert).sum()
    (slope,) = torch.autograd.grad(of_expert.sum(), expert, create_graph=True)
    loss = loss + 0.5 * case["gradient_penalty"] * (slope**2).sum()
    loss = loss + case["logit_decay"] * len(own) * (net[-1].weight ** 2).sum()
    loss.backward()
    # the last bias has no part in the slope
    return {"loss": loss.item(), "gradient": gradient(net.parameters())}


if __name__ == "__main__":
    json.dump([run(case) for case in json.load(sys.stdin)], sys.stdout)
