"""Trained policies as ONNX files, for robots and programs without Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.motion.frame import LEAD, OUTPUTS
from swarm_logistics_env.policies.files import CARD
from swarm_logistics_env.policies.learned import LearnedPolicy
from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.writing import becoming

# Both are old enough for the runtimes of 2022.
OPERATORS, FORMAT = 17, 8
DEVIATIONS = "deviations"  # in the metadata


def write_onnx(policy: Policy, path: Path | str) -> None:
    """Write the network of a trained policy as an ONNX file.

    Its input "inputs" is float32 (robots, inputs), in the order of its card; its output "outputs"
    is float32 (robots, 3), `motion.OUTPUTS`. What makes inputs of observations and a memory, and
    commands of outputs, is `motion.MotionFrame`; docs/onnx.md has it in words. The metadata hold
    the card, and as "deviations" three numbers: the standard deviations of the noise that is added
    to the outputs at each step, zeros for a policy that does not explore.

    Args:
        policy: a trained one, as `policies.load("ppo-delivery")`.
        path: of the file, which is replaced.

    Raises:
        PolicyError: the policy is no trained one, the package onnx is missing, or the file cannot
            be written.
    """
    if not isinstance(policy, LearnedPolicy):
        raise PolicyError(
            f"policy = {type(policy).__name__}: should be a trained one, as "
            'policies.load("ppo-delivery") returns, since scripts have no network'
        )
    try:
        from onnx import TensorProto, checker, helper, numpy_helper
    except ModuleNotFoundError as error:
        raise PolicyError(
            f"to write ONNX needs the package onnx ({error}): pip install "
            "'swarm-logistics-env[onnx]'"
        ) from error
    network, tensors = policy.card.network, dict(policy.tensors)
    if not network.listens:
        # Such a policy reads zeros there. Without their weights it may be given anything.
        tensors["layers.0.weight"] = tensors["layers.0.weight"].copy()
        tensors["layers.0.weight"][:, LEAD] = 0.0
    nodes, last, real = [], len(network.hidden), TensorProto.FLOAT
    kind = {"tanh": "Tanh", "relu": "Relu"}[network.activation]
    at = "inputs"
    for layer in range(last + 1):
        weight, bias = f"layers.{layer}.weight", f"layers.{layer}.bias"
        to = "outputs" if layer == last else f"layers.{layer}.sum"
        nodes.append(helper.make_node("Gemm", [at, weight, bias], [to], transB=1))
        at = to
        if layer < last:
            at = f"layers.{layer}.out"
            nodes.append(helper.make_node(kind, [to], [at]))
    kept = {name: np.ascontiguousarray(t) for name, t in tensors.items() if "layers" in name}
    model = helper.make_model(
        helper.make_graph(
            nodes,
            policy.card.name,
            [helper.make_tensor_value_info("inputs", real, ["robots", len(network.inputs)])],
            [helper.make_tensor_value_info("outputs", real, ["robots", len(OUTPUTS)])],
            [numpy_helper.from_array(tensor, name) for name, tensor in kept.items()],
        ),
        opset_imports=[helper.make_opsetid("", OPERATORS)],
        ir_version=FORMAT,
        producer_name="swarm-logistics-env",
    )
    noise = tensors["deviations"] * np.float32(network.exploration)
    props = {CARD: policy.card.to_json(), DEVIATIONS: " ".join(map(str, noise.tolist()))}
    helper.set_model_props(model, props)
    checker.check_model(model)
    with becoming(Path(path), PolicyError) as part:
        part.write_bytes(model.SerializeToString())
