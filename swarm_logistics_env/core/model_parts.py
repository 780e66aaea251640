"""What objects of learners' libraries consist of: tensors, torch modules, models, sessions.

Pickle takes some of them apart into what changes from process to process, and others not at all.
"""

from __future__ import annotations

import glob
import hashlib
import io
import pickletools
import re
import zipfile
from collections.abc import Callable, Set
from functools import partial
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

Parts = tuple[Any, ...]
_INSTALLED_TOPS = ("onnxruntime", "sb3_contrib", "stable_baselines3")
# Of a torch module's attributes, what its forward pass does not read; `_hooks_of` reads the others.
_NOT_READ = {
    "_backward_hooks", "_backward_pre_hooks", "_compiled_call_impl", "_forward_hooks",
    "_forward_hooks_always_called", "_forward_hooks_with_kwargs", "_forward_pre_hooks",
    "_forward_pre_hooks_with_kwargs", "_is_full_backward_hook", "_load_state_dict_post_hooks",
    "_load_state_dict_pre_hooks", "_non_persistent_buffers_set", "_state_dict_hooks",
    "_state_dict_pre_hooks", "training",
}  # fmt: skip
# Of a network of stable-baselines3: what learns it, and what it computed last.
_NOT_PREDICTED_WITH = {"optimizer", "action_dist"}
# Of a module of torch.fx: what its code was made from.
_NOT_OF_GRAPH = {
    "_create_node_hooks", "_deepcopy_hooks", "_erase_node_hooks", "_graph", "_replace_hooks",
    "_tracer_cls", "_tracer_extras", "eval", "meta", "train",
}  # fmt: skip


def model_parts(value: Any) -> Parts | None:
    """Return what decides how an object of a learner's library computes; None: it is none.

    The mode of a torch module, training or evaluation, is no part, as all play in evaluation mode.

    Raises:
        Exception: it cannot be taken apart.
    """
    kind = type(value)
    for base in kind.__mro__:
        take_apart = _KINDS.get(f"{base.__module__}.{base.__qualname__}")
        if take_apart is not None:
            parts = take_apart(value)
            return None if parts is None else (kind, *parts)
    return None


def copy_of_part(value: Any) -> Any:
    """Return what takes the place of an object of a library that cannot be copied; None: it can.

    Models and sessions are shared: they predict without a memory. A tensor that was computed with
    a gradient is copied without.
    """
    names = {f"{base.__module__}.{base.__qualname__}" for base in type(value).__mro__}
    if names & {_MODEL, _SESSION}:
        return value
    is_computed = _TENSOR in names and value.grad_fn is not None
    return value.detach().clone() if is_computed else None


def _module_parts(module: Any, left_out: Set[str] = frozenset()) -> Parts:
    """Return a torch module's attributes by name, layers, buffers and weights among them."""
    unread = _NOT_READ | left_out
    attributes = {name: part for name, part in vars(module).items() if name not in unread}
    return (*sorted(attributes.items()), _hooks_of(module))


def _hooks_of(module: Any) -> list[Parts]:
    """Return what a torch module calls around its forward pass, in order."""
    return [
        (when, hook, number in vars(module).get(f"{when}_with_kwargs", ()))
        for when in ("_forward_pre_hooks", "_forward_hooks")
        for number, hook in vars(module).get(when, {}).items()
    ]


def _model_parts(model: Any) -> Parts | None:
    """Return the network that a model of stable-baselines3 predicts with."""
    return (model.policy,) if _is_installed(model) else None


def _tensor_parts(tensor: Any) -> Parts | None:
    """Return type, shape, digest and attributes of a tensor; None: of another kind than usual."""
    import torch

    is_usual = type(tensor) in (torch.Tensor, torch.nn.Parameter) and not tensor.is_quantized
    if not is_usual or tensor.layout is not torch.strided:
        return None
    numbers = tensor.detach().cpu().resolve_conj().resolve_neg().contiguous()
    content = numbers.reshape(-1).view(torch.uint8).numpy()
    return (str(tensor.dtype), tuple(tensor.shape), _digest(content), vars(tensor))


def _compiled_module_parts(module: Any) -> Parts:
    """Return what torch.compile made a module of, and what compiles it."""
    return (module._orig_mod, _backend_of(module.dynamo_ctx.callback))


def _function_parts(function: Any) -> Parts | None:
    """Return what torch.compile made a function of, and what compiles it; None: another one."""
    original = vars(function).get("_torchdynamo_orig_callable")
    if original is None:
        return None
    closure = dict(zip(function.__code__.co_freevars, function.__closure__ or ()))
    callback = closure.get("callback")
    return (original, None if callback is None else _backend_of(callback.cell_contents))


def _backend_of(callback: Any) -> Any:
    """Return the function that compiles, or the class of one of torch's own."""
    inner = callback
    while inner is not None:
        backend = inner
        inner = getattr(backend, "_torchdynamo_orig_backend", getattr(backend, "compiler_fn", None))
    return backend if isinstance(backend, FunctionType) else type(backend)


def _storage_parts(storage: Any) -> Parts:
    """Return the digest of the numbers that tensors of unusual kinds share."""
    import torch

    untyped = getattr(storage, "_untyped_storage", storage)  # its `untyped()` warns
    content = torch.empty(0, dtype=torch.uint8).set_(untyped.cpu()).numpy()
    return (_digest(content),)


def _script_parts(script: Any) -> Parts:
    """Return the code, constants and values of a module or function of torch.jit.

    Its file tells all of them. Numbers that torch gives to types of one name count by their order,
    as they go on from one script to the next in a process.
    """
    with zipfile.ZipFile(io.BytesIO(script.save_to_buffer())) as archive:
        content = {name.partition("/")[2]: archive.read(name) for name in archive.namelist()}
    texts = [("data.pkl", _pickle_text(content.pop("data.pkl")))]
    for name, data in sorted(content.items()):
        if name.endswith(".py"):
            texts.append((name, data.decode()))
        elif name.startswith(("constants/", "data/")):
            texts.append((name, _digest(data)))
        elif name == "constants.pkl":
            texts.append((name, _pickle_text(data)))
    numbers: dict[str, str] = {}

    def renumber(match: re.Match[str]) -> str:
        return numbers.setdefault(match[0], f"mangle {len(numbers)}")

    return tuple(re.sub(r"___torch_mangle_\d+", renumber, f"{n}: {text}") for n, text in texts)


def _pickle_text(pickled: bytes) -> str:
    return " ".join(f"{code.name} {value!r}" for code, value, _ in pickletools.genops(pickled))


def _session_parts(session: Any) -> Parts | None:
    """Return the digests of an ONNX model, and of what its session gives for rows drawn once.

    The file may be another one by now than the session read, or keep its weights in a second file.
    """
    if not _is_installed(session):
        return None
    if session._model_bytes is not None:
        digests = [_digest(session._model_bytes)]
    else:
        path = Path(session._model_path)
        files = sorted(path.parent.glob(f"{glob.escape(path.name)}*"))
        digests = [_digest(file.read_bytes()) for file in files]
    rng = np.random.default_rng(0)
    rows = {}
    for argument in session.get_inputs():
        if argument.type != "tensor(float)":
            raise TypeError(f"input {argument.name} of {argument.type}: cannot be drawn")
        shape = [size if isinstance(size, int) else 8 for size in argument.shape]
        rows[argument.name] = rng.normal(size=shape).astype(np.float32)
    outputs = [
        [np.asarray(output).tobytes() for output in session.run(None, rows)] for _ in range(2)
    ]
    if outputs[0] != outputs[1]:
        raise ValueError("its outputs are others each time")
    return (digests, outputs[0])


def _is_installed(value: object) -> bool:
    """Return whether a class is a library's own: one that a user derives may do anything."""
    return type(value).__module__.partition(".")[0] in _INSTALLED_TOPS


def _digest(content: Any) -> str:
    return hashlib.sha256(content).hexdigest()


_MODEL = "stable_baselines3.common.base_class.BaseAlgorithm"
_SESSION = "onnxruntime.capi.onnxruntime_inference_collection.InferenceSession"
_TENSOR = "torch.Tensor"
# By name, as none of these libraries need be installed. The first base of a class counts.
_KINDS: dict[str, Callable[[Any], Parts | None]] = {
    "stable_baselines3.common.policies.BaseModel": partial(
        _module_parts, left_out=_NOT_PREDICTED_WITH
    ),
    "builtins.function": _function_parts,
    "torch._dynamo.eval_frame.OptimizedModule": _compiled_module_parts,
    "torch.export._unlift.GuardsFn": lambda _: (),  # checks the shapes of what is given
    # Its class has the code of its graph.
    "torch.fx.graph_module.GraphModule": partial(_module_parts, left_out=_NOT_OF_GRAPH),
    "torch.jit.torch.jit.ScriptFunction": _script_parts,
    "torch.jit._script.ScriptModule": _script_parts,
    "torch.nn.modules.module.Module": _module_parts,
    "torch.storage.TypedStorage": _storage_parts,
    "torch.storage.UntypedStorage": _storage_parts,
    _MODEL: _model_parts,
    _SESSION: _session_parts,
    _TENSOR: _tensor_parts,
}
