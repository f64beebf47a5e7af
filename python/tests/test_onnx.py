"""Policies as ONNX files act as they do here, in ONNX Runtime and back again; networks of other trainers play here.

All comparisons are with ONNX Runtime, to 1e-5.
"""

import itertools
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from onnx import TensorProto, helper, numpy_helper

import marathon_rl
from marathon_rl import load_policy

ROOT = Path(__file__).parents[2]
POLICIES = sorted((ROOT / "assets/policies").glob("*.safetensors"))


def observations(n: int, size: int) -> np.ndarray:
    return np.random.default_rng(7).normal(0, 1.5, (n, size)).astype(np.float32)


def run(file: Path, obs: np.ndarray, output: str | None = None) -> np.ndarray:
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 4
    session = onnxruntime.InferenceSession(str(file), options, providers=["CPUExecutionProvider"])
    name = session.get_inputs()[0].name
    return session.run([output or session.get_outputs()[0].name], {name: obs})[0]


@pytest.mark.parametrize("path", POLICIES, ids=lambda path: path.stem)
def test_an_exported_policy_acts_the_same(path: Path, tmp_path: Path) -> None:
    policy, file = load_policy(path), tmp_path / "policy.onnx"
    policy.save(file)
    onnx.checker.check_model(onnx.load(file), full_check=True)
    obs = observations(200, policy.obs_size)
    expected = policy(obs)
    np.testing.assert_allclose(run(file, obs, "deterministic_continuous_actions"), expected, atol=1e-5)
    # on states that matter, too
    env = marathon_rl.VecEnv(policy.task, 64, dtype="float32", **policy.meta.get("options", {}))
    obs = env.reset(seed=1)
    for _ in range(100):
        obs, *_ = env.step(policy(obs))
    np.testing.assert_allclose(run(file, obs, "deterministic_continuous_actions"), policy(obs), atol=1e-5)
    # drawn actions scatter about the best ones as here
    still = np.tile(obs[:1], (4000, 1))
    drawn = run(file, still, "continuous_actions")
    ours = policy(still, rng=0)
    np.testing.assert_allclose(drawn.std(0), ours.std(0), rtol=0.15, atol=0.01)
    np.testing.assert_allclose(drawn.mean(0), ours.mean(0), atol=0.03)
    again = load_policy(file)
    assert again.task == policy.task and again.meta["training"] == policy.meta["training"]
    np.testing.assert_allclose(again(obs), policy(obs), atol=1e-5)


def test_the_file_keeps_the_contract_of_ml_agents(tmp_path: Path) -> None:
    file = tmp_path / "hopper.onnx"
    load_policy(ROOT / "assets/policies/hopper.safetensors").save(file)
    model = onnx.load(file)
    assert [(opset.domain, opset.version) for opset in model.opset_import] == [("", 9)]

    def shape(value: onnx.ValueInfoProto) -> tuple[str, list[str | int]]:
        tensor = value.type.tensor_type
        assert tensor.elem_type == TensorProto.FLOAT
        return value.name, [dim.dim_param or dim.dim_value for dim in tensor.shape.dim]

    assert [shape(value) for value in model.graph.input] == [("obs_0", ["batch", 31])]
    assert dict(shape(value) for value in model.graph.output) == {
        "version_number": [1],
        "memory_size": [1],
        "continuous_actions": ["batch", 4],
        "continuous_action_output_shape": [1],
        "deterministic_continuous_actions": ["batch", 4],
    }
    zeros = np.zeros((1, 31), np.float32)
    for name, value in (("version_number", 3), ("memory_size", 0), ("continuous_action_output_shape", 4)):
        assert run(file, zeros, name).tolist() == [value]
    # what ML-Agents' own exporter uses, and no more
    allowed = {"Sub", "Mul", "Clip", "Gemm", "Tanh", "Sigmoid", "Exp", "RandomNormalLike", "Add", "Identity"}
    assert {node.op_type for node in model.graph.node} <= allowed


def mlagents(file: Path, obs_size: int, act_size: int, seed: int) -> None:
    """A PPO policy as ML-Agents 1.1 writes it: swish, normalization, sampled and best actions."""
    rng, nodes, constants = np.random.default_rng(seed), [], []

    def constant(name: str, data: np.ndarray | list[float]) -> str:
        constants.append(numpy_helper.from_array(np.asarray(data, np.float32), name))
        return name

    def node(op: str, inputs: list[str], output: str, **attributes: float) -> str:
        nodes.append(helper.make_node(op, inputs, [output], **attributes))
        return output

    x = node("Sub", ["obs_0", constant("running_mean", rng.normal(size=obs_size))], "centered")
    x = node("Div", [x, constant("std", rng.uniform(0.5, 2, obs_size))], "scaled")
    x = node("Concat", [node("Clip", [x], "clipped", min=-5.0, max=5.0)], "all", axis=1)
    sizes = [obs_size, 24, 16, act_size]
    for i, (n, m) in enumerate(itertools.pairwise(sizes)):
        weights = constant(f"w{i}", rng.normal(size=(m, n)) / np.sqrt(n))
        inputs = [x, weights, constant(f"b{i}", rng.normal(size=m) / 5)]
        x = node("Gemm", inputs, f"gemm{i}", alpha=1.0, beta=1.0, transB=1)
        if i < 2:
            x = node("Mul", [x, node("Sigmoid", [x], f"sigmoid{i}")], f"hidden{i}")
    noise = node("RandomNormalLike", [x], "noise", dtype=TensorProto.FLOAT)
    sigma = node("Exp", [constant("action_model.log_sigma", np.full((1, act_size), -0.5))], "sigma")
    drawn = node("Add", [x, node("Mul", [noise, sigma], "spread")], "drawn")
    for value, name in ((drawn, "continuous_actions"), (x, "deterministic_continuous_actions")):
        clipped = node("Clip", [value], f"{name}_clipped", min=-3.0, max=3.0)
        node("Div", [clipped, node("Identity", [constant(f"{name}_three", [3.0])], f"{name}_by")], name)
    for name, value in (("version_number", 3.0), ("memory_size", 0.0), ("continuous_action_output_shape", act_size)):
        node("Identity", [constant(f"{name}_value", [value])], name)
    lists = [("version_number", [1]), ("memory_size", [1]), ("continuous_actions", ["batch", act_size])]
    lists += [("continuous_action_output_shape", [1]), ("deterministic_continuous_actions", ["batch", act_size])]
    outputs = [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in lists]
    observation = helper.make_tensor_value_info("obs_0", TensorProto.FLOAT, ["batch", obs_size])
    graph = helper.make_graph(nodes, "policy", [observation], outputs, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 9)])
    model.ir_version = 4
    onnx.checker.check_model(model)
    onnx.save(model, file)


def test_a_policy_of_ml_agents_plays_here(tmp_path: Path) -> None:
    file = tmp_path / "Hopper.onnx"
    mlagents(file, 31, 4, seed=3)
    with pytest.raises(ValueError, match="another program than Marathon has written the file"):
        load_policy(file)
    policy, obs = load_policy(file, "hopper"), observations(300, 31)
    np.testing.assert_allclose(policy(obs), run(file, obs, "deterministic_continuous_actions"), atol=1e-5)
    assert policy.meta["activation"] == "swish" and policy.meta["hidden"] == [24, 16]
    still = np.tile(obs[:1], (4000, 1))
    drawn = run(file, still, "continuous_actions")
    # the clip to [-3, 3] works on what is drawn there, and here: the spread is that of the file
    np.testing.assert_allclose(policy(still, rng=1).std(0), drawn.std(0), rtol=0.2, atol=0.02)
    assert marathon_rl.evaluate(policy, 2)["episodes"] == 2


class Scaled(torch.nn.Module):
    """Normalization, layers, and actions of a range."""

    def __init__(self, activation: type[torch.nn.Module], squash: bool) -> None:
        super().__init__()
        self.mean, self.std = torch.nn.Buffer(torch.randn(31)), torch.nn.Buffer(torch.rand(31) + 0.5)
        self.width, self.middle = torch.nn.Buffer(torch.tensor([0.4, 1, 2, 0.5])), torch.nn.Buffer(torch.randn(4))
        layers = [torch.nn.Flatten(), torch.nn.Linear(31, 12), activation(), torch.nn.Linear(12, 9), activation()]
        self.layers, self.squash = torch.nn.Sequential(*layers, torch.nn.Linear(9, 4)), squash

    def forward(self, obs: torch.Tensor) -> torch.Tensor:
        x = self.layers(((obs - self.mean) / self.std).clamp(-5, 5))
        x = torch.tanh(x) if self.squash else x.clamp(-1, 1)
        return x * self.width + self.middle


def export(module: torch.nn.Module, file: Path, new: bool) -> None:
    example = (torch.randn(3, 31),)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if new:
            batch = {"obs": {0: torch.export.Dim("batch")}}
            names = {"input_names": ["obs"], "output_names": ["actions"]}
            torch.onnx.export(module, example, file, dynamo=True, dynamic_shapes=batch, verbose=False, **names)
        else:
            axes = {"obs": {0: "batch"}}
            torch.onnx.export(module, example, file, dynamo=False, input_names=["obs"], dynamic_axes=axes)


@pytest.mark.parametrize("new", [False, True], ids=["torchscript", "dynamo"])
@pytest.mark.parametrize("squash", [False, True], ids=["clipped", "squashed"])
@pytest.mark.parametrize("activation", [torch.nn.Tanh, torch.nn.ReLU, torch.nn.ELU, torch.nn.SiLU])
def test_networks_of_pytorch_play_here(
    activation: type[torch.nn.Module], squash: bool, new: bool, tmp_path: Path
) -> None:
    torch.manual_seed(2)
    module, file, obs = Scaled(activation, squash).eval(), tmp_path / "net.onnx", observations(100, 31)
    export(module, file, new)
    policy = load_policy(file, "Hopper-v0")
    np.testing.assert_allclose(policy(obs), run(file, obs), atol=1e-5)
    # and travel on, back to ONNX
    policy.save(tmp_path / "again.onnx")
    np.testing.assert_allclose(
        run(tmp_path / "again.onnx", obs, "deterministic_continuous_actions"), policy(obs), atol=1e-5
    )


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("name", ["PPO", "SAC", "TD3"])
def test_policies_of_stable_baselines3_play_here(name: str, tmp_path: Path) -> None:
    import stable_baselines3  # noqa: PLC0415

    env, file = marathon_rl.MarathonEnv("hopper"), tmp_path / "sb3.onnx"
    model = getattr(stable_baselines3, name)("MlpPolicy", env, seed=1, device="cpu")

    class Actor(torch.nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.policy = model.policy if name == "PPO" else model.policy.actor

        def forward(self, obs: torch.Tensor) -> torch.Tensor:
            acted = self.policy(obs, deterministic=True) if name != "TD3" else self.policy(obs)
            return acted[0] if name == "PPO" else acted

    obs = observations(100, 31)
    export(Actor().eval(), file, new=False)
    policy = load_policy(file, "hopper")
    np.testing.assert_allclose(policy(obs), run(file, obs), atol=1e-5)
    np.testing.assert_allclose(policy(obs).clip(-1, 1), model.predict(obs, deterministic=True)[0], atol=1e-4)


def refused(change: Callable[[list[onnx.NodeProto]], None], tmp_path: Path) -> str:
    file = tmp_path / "net.onnx"
    mlagents(file, 31, 4, seed=1)
    model = onnx.load(file)
    change(model.graph.node)
    onnx.save(model, file)
    with pytest.raises(ValueError) as error:
        load_policy(file, "hopper")
    return str(error.value)


def test_what_no_policy_can_be_is_refused_by_name(tmp_path: Path) -> None:
    def rename(output: str, op: str) -> Callable[[list[onnx.NodeProto]], None]:
        def change(nodes: list[onnx.NodeProto]) -> None:
            for node in nodes:
                if node.output[0] == output:
                    node.op_type = op
                    del node.attribute[:], node.input[1:]

        return change

    assert "operation LSTM on the network" in refused(rename("scaled", "LSTM"), tmp_path)
    assert "activation sigmoid, expected one of swish, tanh, elu, relu" in refused(
        rename("hidden1", "Sigmoid"), tmp_path
    )
    mlagents(tmp_path / "ant.onnx", 53, 8, seed=1)
    with pytest.raises(ValueError, match="'obs_0' of 53 numbers, expected one observation of 31 numbers, as Hopper-v0"):
        load_policy(tmp_path / "ant.onnx", "hopper")
    (tmp_path / "empty.onnx").write_bytes(b"")
    with pytest.raises(ValueError, match="expected an ONNX model"):
        load_policy(tmp_path / "empty.onnx", "hopper")
    with pytest.raises(ValueError, match=r"expected \.safetensors or \.onnx"):
        load_policy(POLICIES[0]).save(tmp_path / "policy.pkl")


def test_weights_in_files_elsewhere_are_not_read(tmp_path: Path) -> None:
    torch.manual_seed(1)
    folder = tmp_path / "folder"
    folder.mkdir()
    export(Scaled(torch.nn.Tanh, False).eval(), folder / "net.onnx", new=True)
    model = onnx.load(folder / "net.onnx", load_external_data=False)
    moved = [tensor for tensor in model.graph.initializer if tensor.external_data]
    assert moved, "this exporter keeps the weights in the file"
    (tmp_path / "elsewhere").write_bytes((folder / "net.onnx.data").read_bytes())
    for tensor in moved:
        tensor.external_data[0].value = "../elsewhere"
    (folder / "net.onnx").write_bytes(model.SerializeToString())
    with pytest.raises(ValueError, match=r"in file '\.\./elsewhere', expected one in the model's folder"):
        load_policy(folder / "net.onnx", "hopper")
