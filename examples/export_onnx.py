"""Write the network of a trained policy as an ONNX file, for robots and programs without Python.

The file maps "inputs", float32 (robots, inputs) in the order of `motion.INPUTS`, to "outputs",
float32 (robots, 3), `motion.OUTPUTS`. Its metadata hold the policy's card, and as "deviations"
the standard deviations of the noise that is added to the outputs at each step. What makes inputs
of observation rows and a memory, and commands of outputs, is `motion.MotionView`; a policy whose
card says `listens = false` needs it with `listens=False`.
"""

import sys
from pathlib import Path
from typing import Any

from onnx import TensorProto, checker, helper, numpy_helper

from swarm_logistics_env import policies
from swarm_logistics_env.motion import INPUTS, OUTPUTS

OPERATORS, FORMAT = 17, 8  # old enough for the runtimes of 2022


def main(trained="ppo-delivery", path="ppo-delivery.onnx"):
    policy: Any = policies.load(trained)
    network, tensors = policy.card.network, policy.tensors
    nodes, at = [], "inputs"
    for layer in range(len(network.hidden) + 1):
        is_last = layer == len(network.hidden)
        weight, bias = f"layers.{layer}.weight", f"layers.{layer}.bias"
        total = "outputs" if is_last else f"layers.{layer}.sum"
        nodes.append(helper.make_node("Gemm", [at, weight, bias], [total], transB=1))
        if not is_last:
            at = f"layers.{layer}.out"
            nodes.append(helper.make_node("Tanh", [total], [at]))
    real = TensorProto.FLOAT
    model = helper.make_model(
        helper.make_graph(
            nodes,
            policy.card.name,
            [helper.make_tensor_value_info("inputs", real, ["robots", len(INPUTS)])],
            [helper.make_tensor_value_info("outputs", real, ["robots", len(OUTPUTS)])],
            [numpy_helper.from_array(t, n) for n, t in tensors.items() if n != "deviations"],
        ),
        opset_imports=[helper.make_opsetid("", OPERATORS)],
        ir_version=FORMAT,
    )
    noise = tensors["deviations"] * network.exploration
    about = {"card": policy.card.to_json(), "deviations": " ".join(map(str, noise.tolist()))}
    helper.set_model_props(model, about)
    checker.check_model(model)
    Path(path).write_bytes(model.SerializeToString())


if __name__ == "__main__":
    main(*sys.argv[1:])
