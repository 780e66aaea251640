"""Files of trained policies.

Safetensors with the card as JSON in the header execute nothing. ONNX is for robots and programs
without Python. Models that stable-baselines3 saved are read by `models`.
"""

from __future__ import annotations

import functools
import hashlib
import json
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import PolicyError, how_to_install
from swarm_logistics_env.core.records import atomic_write, canonical_json
from swarm_logistics_env.policies.c_files import CFile, is_c_name
from swarm_logistics_env.policies.learned import LearnedPolicy, PolicyCard, check_tensors
from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.policies.sb3_files import SB3_SUFFIX, from_sb3
from swarm_logistics_env.world.motion.network_inputs import LEAD

SUFFIX = ".safetensors"
CARD = "swarm_logistics_policy"  # the header's entry that holds the card
DIGEST = "swarm_logistics_digest"  # and that of card and tensors, see `content_digest`
LARGEST_FILE = 64 * 2**20  # bytes; a policy of ours has less than 1 MB


def read_policy(path: Path) -> LearnedPolicy:
    """Return the trained policy in a file; reading one executes nothing that is in it.

    Warns:
        UserWarning: the file has no digest, as those of version 0.3.0, so that
            damage to it would not be seen.

    Raises:
        PolicyError: the file cannot be read, is cut short or damaged, carries something else, or
            its numbers are not those of the network on its card.
    """
    from safetensors import SafetensorError, safe_open

    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise PolicyError(
                f"{path} has {size} bytes: a policy file should have at most {LARGEST_FILE}"
            )
        with safe_open(path, framework="numpy") as file:
            header = file.metadata() or {}
            if CARD not in header:
                raise PolicyError(
                    f"{path} is safetensors without a card: a policy file should be one that "
                    "`swarm-logistics train` wrote"
                )
            if unknown := sorted(header.keys() - {CARD, DIGEST}):
                raise PolicyError(
                    f"{path} is damaged or of a later version: its header has {unknown[0]!r}, and "
                    f"should have {CARD!r} and {DIGEST!r} alone"
                )
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - no dict
    except OSError as error:
        reason = error.strerror or error
        raise PolicyError(f"cannot read the policy file {path}: {reason}") from error
    except (SafetensorError, TypeError) as error:
        raise PolicyError(f"{path} is cut short or no safetensors file: {error}") from None
    if DIGEST in header and header[DIGEST] != content_digest(header[CARD], tensors):
        raise PolicyError(
            f"{path} is damaged: its card and numbers are not those that were written, by their "
            "digest; copy it again from where it came"
        )
    try:
        policy = LearnedPolicy(PolicyCard.from_json(header[CARD]), tensors)
    except PolicyError as error:
        raise PolicyError(f"the policy file {path} cannot be used: {error}") from None
    if DIGEST not in header:
        warnings.warn(
            f"{path} has no digest, as files of version 0.3.0: damage to it would not be seen. To "
            "write it with one: policies.files.write_policy(path, policy.card, policy.tensors) of "
            "policy = policies.load(str(path)), where path is a pathlib.Path",
            stacklevel=2,
        )
    return policy


def content_digest(card: str, tensors: Mapping[str, NDArray[Any]]) -> str:
    """Return the digest of a card's text and all tensors: 64 hexadecimal digits.

    It covers the names, types and shapes of the tensors as well, and no other part of a file.
    """
    total = hashlib.sha256()
    for name in sorted(tensors):
        tensor = tensors[name]
        about = canonical_json([name, str(tensor.dtype), tensor.shape])
        total.update(about.encode() + b"\0" + np.ascontiguousarray(tensor).tobytes())
    total.update(card.encode())
    return total.hexdigest()


def read_card(path: Path) -> PolicyCard:
    """Return the card of a policy file.

    Raises:
        PolicyError: as `read_policy`.
    """
    return read_policy(path).card


def write_policy(path: Path, card: PolicyCard, tensors: Mapping[str, NDArray[np.float32]]) -> None:
    """Write a policy file, whole or not at all.

    Raises:
        PolicyError: the tensors are not those of the network on the card, or it cannot be written.
    """
    check_tensors(card.network, tensors)
    content = file_content(card.to_json(), tensors)
    with atomic_write(path, PolicyError) as part:
        part.write_bytes(content)


def file_content(card: str, tensors: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the bytes of a policy file with this text as its card; equal content, equal bytes."""
    from safetensors.numpy import save

    about = {CARD: card, DIGEST: content_digest(card, tensors)}
    content = save({name: np.ascontiguousarray(t) for name, t in tensors.items()}, about)
    # Safetensors writes the header's entries in any order.
    end = 8 + int.from_bytes(content[:8], "little")
    header = json.dumps({**json.loads(content[8:end]), "__metadata__": about}).encode()
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + content[end:]


# Both are old enough for the runtimes of 2022.
OPERATORS = 17
FORMAT = 8
DEVIATIONS = "deviations"  # in the metadata
TEMPERATURE = "temperature"


def write_onnx(policy: Policy, path: Path | str, robots: int | None = None) -> None:
    """Write the network of a trained policy as an ONNX file.

    Its input "inputs" is float32 (robots, inputs), in the order of its card; its output "outputs"
    is float32 (robots, 3), `motion.OUTPUTS`. What makes inputs of observations and a memory, and
    commands of outputs, is `motion.MotionView`; docs/training.md has an example. The metadata hold
    the card, and as "deviations" three numbers: the standard deviations of the noise that is added
    to the outputs at each step, zeros for a policy that does not explore.

    Of a network that says classes the output is "logits" (robots, 40), see `motion.classes`, and
    the metadata have "temperature" instead, with which classes are drawn; 0 means the likeliest.

    Of a network that talks two columns more come last: its messages, which are to be cut to
    [0, 1], and to which no noise is added.

    Args:
        policy: a trained one, as `policies.load("ppo-delivery")`.
        path: of the file, which is replaced.
        robots: how many rows it takes at a time, for runtimes that have to know; None: any number.

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
            f"to write ONNX needs the package onnx ({error}): {how_to_install('onnx')}"
        ) from error
    network = policy.card.network
    tensors = dict(policy.tensors)
    noise = {TEMPERATURE: str(network.exploration)}
    output_name = "logits"
    if not network.says_classes:
        deviations = tensors.pop(DEVIATIONS) * np.float32(network.exploration)
        noise = {DEVIATIONS: " ".join(map(str, deviations.tolist()))}
        output_name = "outputs"
    if not network.listens:
        # Such a policy reads zeros there. Without their weights it may be given anything.
        tensors["layers.0.weight"] = tensors["layers.0.weight"].copy()
        tensors["layers.0.weight"][:, LEAD] = 0.0
    nodes = []
    layer_input = "inputs"
    for layer in range(len(network.hidden) + 1):
        is_last = layer == len(network.hidden)
        weight = f"layers.{layer}.weight"
        bias = f"layers.{layer}.bias"
        total = output_name if is_last else f"layers.{layer}.sum"
        nodes.append(helper.make_node("Gemm", [layer_input, weight, bias], [total], transB=1))
        if not is_last:
            layer_input = f"layers.{layer}.out"
            nodes.append(helper.make_node("Tanh", [total], [layer_input]))
    real = TensorProto.FLOAT
    n_rows = robots or "robots"
    graph = helper.make_graph(
        nodes,
        policy.card.name,
        [helper.make_tensor_value_info("inputs", real, [n_rows, network.widths[0]])],
        [helper.make_tensor_value_info(output_name, real, [n_rows, network.widths[-1]])],
        [numpy_helper.from_array(np.ascontiguousarray(t), n) for n, t in tensors.items()],
    )
    version = helper.make_opsetid("", OPERATORS)
    model = helper.make_model(graph, opset_imports=[version], ir_version=FORMAT)
    helper.set_model_props(model, {CARD: policy.card.to_json(), **noise})
    checker.check_model(model)
    with atomic_write(Path(path), PolicyError) as part:
        part.write_bytes(model.SerializeToString())


def maker_of_file(name: str, trust_code: bool) -> Callable[..., Policy] | None:
    """Return what reads the policy file of that path; None: it is not called as one."""
    if is_c_name(name):
        return functools.partial(CFile, name)
    path = Path(name)
    if path.suffix == SUFFIX:
        return functools.partial(read_policy, path)
    if path.suffix == SB3_SUFFIX:
        return functools.partial(from_sb3, path, trust_code=trust_code)
    return None
