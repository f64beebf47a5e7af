"""The checks of Unity's importer for a policy file, from the list in its package's model loader. (Not Unity itself.)"""

import numpy as np
import onnx
from onnx.reference import ReferenceEvaluator


def shape(value):
    return [d.dim_value or d.dim_param for d in value.type.tensor_type.shape.dim]


def check(path, obs, act):
    """Raises an AssertionError that says what an importer would object to in a policy of one vector observation."""
    model = onnx.load(path)
    onnx.checker.check_model(model)
    # what Unity's inference engine reads
    assert [entry.version for entry in model.opset_import if not entry.domain] == [9], model.opset_import
    inputs = {value.name: shape(value) for value in model.graph.input}
    weights = {tensor.name for tensor in model.graph.initializer}
    assert set(inputs) - weights == {"obs_0"}, inputs
    assert inputs["obs_0"][-1] == obs, inputs
    outputs = {value.name for value in model.graph.output}
    needed = {"version_number", "memory_size", "continuous_actions", "continuous_action_output_shape"}
    assert needed <= outputs, outputs
    # as Unity does: run once with zeros; numbers are floats
    runner = ReferenceEvaluator(model)
    got = dict(zip(runner.output_names, runner.run(None, {"obs_0": np.zeros((1, obs), np.float32)}), strict=True))
    assert all(value.dtype == np.float32 for value in got.values()), got
    assert got["version_number"].item() in (2, 3) and got["memory_size"].item() == 0
    assert got["continuous_action_output_shape"].item() == act
    for name in ("continuous_actions", "deterministic_continuous_actions"):
        assert got[name].shape == (1, act) and np.isfinite(got[name]).all(), name
    return runner


def best_actions(runner, obs):
    return runner.run(["deterministic_continuous_actions"], {"obs_0": obs.astype(np.float32)})[0]
