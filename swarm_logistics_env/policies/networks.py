"""Networks of other libraries as functions of rows, and the first try of one.

A network of a library that is not installed is never met, so nothing is imported here.
"""

from __future__ import annotations

import contextlib
import copyreg
import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import RAISED_BY_OTHERS, PolicyError
from swarm_logistics_env.policies.evaluation_mode import in_evaluation
from swarm_logistics_env.world.motion.network_inputs import INPUTS

Rows = NDArray[np.float32]
Decide = Callable[[Rows], Any]
_ACTION_NAMES = ("action", "actions")


class TorchNetwork:
    """A torch module, of any precision: rows in, tensors out, no gradients.

    Attributes:
        is_fixed: whether its mode is the one in which it was exported.
        width: D, if it was exported for that.

    Raises:
        PolicyError: it has a memory, or was not called yet.
    """

    def __init__(self, module: Any) -> None:
        import torch

        self._module = module
        for part in module.modules():
            if isinstance(part, torch.nn.RNNBase | torch.nn.RNNCellBase):
                raise PolicyError(
                    f"{type(module).__name__} has a memory, {type(part).__name__}: should have "
                    "none, as each row is a robot; a class of your own with reset and act keeps it"
                )
        if any(map(torch.nn.parameter.is_lazy, module.parameters())):
            raise PolicyError(
                f"{type(module).__name__} has lazy layers: should have been called once, so that "
                "they have their numbers"
            )
        self.is_fixed = isinstance(module, torch.jit.ScriptModule | torch.fx.GraphModule)
        self.width: int | None = None
        if isinstance(module, torch.fx.GraphModule):
            inputs = [
                node.meta.get("val") for node in module.graph.nodes if node.op == "placeholder"
            ]
            if len(inputs) == 1 and inputs[0] is not None:
                _, self.width = _rows_of_shape(type(module).__name__, inputs[0].shape)

    def __call__(self, rows: Rows) -> Any:
        """Return what the module makes of rows (N, D), which it gets as it holds its numbers."""
        import torch

        tensors = chain(self._module.parameters(), self._module.buffers())
        weight = next((tensor for tensor in tensors if tensor.is_floating_point()), torch.empty(0))
        inputs = torch.as_tensor(rows).to(weight.device, weight.dtype, copy=True)
        with torch.no_grad():
            return self._module(inputs)


class PredictingPolicy:
    """A policy with the method `predict` of stable-baselines3: rows in, most likely actions out.

    Attributes:
        policy: as given.
        width: of a row, if the policy says so.

    Raises:
        PolicyError: it does not hold its numbers as stable-baselines3 does.
    """

    def __init__(self, policy: Any) -> None:
        self.policy = policy
        shape = getattr(getattr(policy, "observation_space", None), "shape", None)
        self.width = shape[0] if shape and len(shape) == 1 else None
        parameters = policy.parameters() if hasattr(policy, "state_dict") else ()
        types = {str(p.dtype) for p in parameters if p.is_floating_point()} - {"torch.float32"}
        if types:
            raise PolicyError(
                f"{type(policy).__name__} has numbers of type {', '.join(sorted(types))}: should "
                "have torch.float32, as stable-baselines3 makes of rows; policy.float() does so"
            )

    def __call__(self, rows: Rows) -> Any:
        """Return actions for rows (N, D)."""
        return self.policy.predict(rows, deterministic=True)


_ONNX_TYPES = {
    "tensor(float)": np.float32,
    "tensor(double)": np.float64,
    "tensor(float16)": np.float16,
}


class OnnxNetwork:
    """An InferenceSession of onnxruntime: rows in, its output "action" or the first one out.

    A network that was exported for one row plays row by row.

    Attributes:
        width: D, if the file says so.

    Raises:
        PolicyError: it takes something else than rows of numbers.
    """

    is_fixed = True

    def __init__(self, session: Any) -> None:
        self._session = session
        inputs = session.get_inputs()
        names = ", ".join(argument.name for argument in inputs)
        if len(inputs) != 1:
            raise PolicyError(
                f"the ONNX network takes the inputs {names}: should take one, rows of "
                "observations; a class of your own with reset and act hands over the others"
            )
        self._name = inputs[0].name
        kind = getattr(inputs[0], "type", "tensor(float)")
        if kind not in _ONNX_TYPES:
            raise PolicyError(
                f"the ONNX network takes {names} as {kind}: should be one of "
                f"{', '.join(_ONNX_TYPES)}"
            )
        self._type = _ONNX_TYPES[kind]
        shape = getattr(inputs[0], "shape", [None, None])
        self._takes_one_row, self.width = _rows_of_shape("the ONNX network", shape)
        if type(session).__module__.startswith("onnxruntime."):
            # Neither of which it offers itself. A copy is the same one: it has no memory, and its
            # file may be another one by now.
            copyreg.pickle(type(session), _taken_apart)
            type(session).__deepcopy__ = lambda session, _: session

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self  # it has no memory

    def __call__(self, rows: Rows) -> NDArray[Any]:
        """Return the outputs for rows (N, D)."""
        rows = np.asarray(rows)
        if self.width not in (None, rows.shape[1]):
            raise PolicyError(
                f"the ONNX network reads rows of {self.width} numbers, and these have "
                f"{rows.shape[1]}"
            )
        if not self._takes_one_row:
            return self._outputs_of(rows)
        return np.concatenate([self._outputs_of(rows[i : i + 1]) for i in range(len(rows))])

    def _outputs_of(self, rows: Rows) -> NDArray[Any]:
        outputs = self._session.run(None, {self._name: rows.astype(self._type, copy=False)})
        number = 0
        if len(outputs) > 1:
            names = [argument.name for argument in self._session.get_outputs()]
            number = next((names.index(name) for name in _ACTION_NAMES if name in names), 0)
        output = np.asarray(outputs[number])
        return output.astype(np.float32) if output.dtype.kind == "f" else output


def _taken_apart(session: Any) -> tuple[Any, ...]:
    """Return what makes the same session in another process: class, model and providers."""
    model = session._model_path or session._model_bytes
    return type(session), (model, None, session.get_providers())


def _rows_of_shape(about: str, shape: Sequence[Any]) -> tuple[bool, int | None]:
    """Return whether an exported network takes one row at a time, and how long a row is.

    Raises:
        PolicyError: it takes another number of rows, or no rows.
    """
    is_any = not isinstance(shape[0], int) if shape else False
    if len(shape) != 2 or not (is_any or shape[0] == 1):
        raise PolicyError(
            f"{about} takes an input of shape {tuple(shape)}: should take rows, of any number or "
            "one at a time; what leaves the number open is called a dynamic axis or shape"
        )
    return not is_any, shape[1] if isinstance(shape[1], int) else None


class _RowByRow:
    """A network that takes one row at a time."""

    def __init__(self, decide: Decide) -> None:
        self._decide = decide

    def __call__(self, rows: Rows) -> NDArray[Any]:
        actions = [_array_of(self._decide(rows[i : i + 1]), 1) for i in range(len(rows))]
        return np.concatenate(actions)


def outputs_of(decide: Decide, prepare: Decide, rows: Rows, about: str) -> NDArray[Any]:
    """Return what a network in use makes of rows (N, D), as an array of numbers.

    Raises:
        PolicyError: it fails, or returns something else.
    """
    try:
        with in_evaluation(decide, prepare):
            outputs = _array_of(decide(prepare(rows)), len(rows))
    except PolicyError:
        raise
    except RAISED_BY_OTHERS as error:
        kind = type(error).__name__
        hint = "; if it learned through MotionFrame: frame=True, in other wrappers: policies.within"
        if rows.shape[1] == len(INPUTS):
            hint = ""
        raise PolicyError(
            f"{about} failed with rows of shape {rows.shape} ({kind}: {error})" + hint
        ) from error
    if outputs.dtype.kind not in "fiub":
        raise PolicyError(
            f"{about} gave no array of numbers: should give one, with a row of outputs for each row"
        )
    return outputs


def _array_of(outputs: Any, n_rows: int) -> NDArray[Any]:
    """Return the actions among a network's outputs: the one of that name, or the first."""
    if hasattr(outputs, "_asdict"):  # a named tuple
        names = outputs._asdict()
        outputs = names if set(_ACTION_NAMES) & names.keys() else tuple(outputs)
    if isinstance(outputs, Mapping):
        names = [name for name in _ACTION_NAMES if name in outputs] or list(outputs)
        if len(names) != 1:
            raise PolicyError(
                f"the network gives the outputs {', '.join(map(str, names))}: should give one, or "
                "call one of them action"
            )
        outputs = outputs[names[0]]
    elif isinstance(outputs, tuple | list) and _are_several(outputs, n_rows):
        outputs = outputs[0]
    if hasattr(outputs, "detach"):  # a tensor, which may have a gradient or be on a GPU
        outputs = outputs.detach().cpu()
        outputs = outputs.float() if outputs.is_floating_point() else outputs
    return np.asarray(outputs)


def _are_several(outputs: tuple[Any, ...] | list[Any], n_rows: int) -> bool:
    """Return whether a sequence is of outputs, of which each has all rows, and not of rows."""
    shapes = [getattr(output, "shape", None) for output in outputs]
    if not shapes or shapes[0] is None or len(shapes[0]) == 0:
        return False
    are_rows = len(shapes) == n_rows and len(shapes[0]) == 1 and len(set(shapes)) == 1
    return shapes[0][0] == n_rows and not are_rows


def tried(decide: Decide, prepare: Decide, rows: Rows, about: str) -> Decide:
    """Return a network as it can be played, after a first try with rows (N, D).

    One that takes a single row at a time is played row by row.

    Raises:
        PolicyError: it fails, or its outputs show that it plays as in training: they are others
            for the same rows, or, of one that was exported, depend on the rows beside.
    """
    with _same_torch_numbers():
        try:
            outputs = outputs_of(decide, prepare, rows, about)
        except PolicyError as error:
            decide = _RowByRow(decide)
            try:
                outputs = outputs_of(decide, prepare, rows, about)
            except PolicyError:
                raise error from None
        again = outputs_of(decide, prepare, rows, about)
        if not np.array_equal(outputs, again, equal_nan=True):
            raise PolicyError(
                f"{about} gave other outputs for the same rows: should be exported after "
                "network.eval(), and draw no random numbers, which a class of your own with reset "
                "and act draws by its seed"
            )
        if getattr(decide, "is_fixed", False):
            single_rows = [rows[i : i + 1] for i in range(len(rows))]
            alone = [outputs_of(decide, prepare, row, about) for row in single_rows]
            scale = np.abs(np.nan_to_num(outputs)).max()
            tolerance = 0.01 * scale  # half precision, and sums in another order
            if not np.allclose(outputs, np.concatenate(alone), 0.0, tolerance, equal_nan=True):
                raise PolicyError(
                    f"{about} gave a row other outputs beside other rows, as one that was exported "
                    "in training mode: should be exported after network.eval()"
                )
    return decide


@contextlib.contextmanager
def _same_torch_numbers() -> Any:
    """Let torch's random numbers go on afterwards as if none had been drawn."""
    torch: Any = sys.modules.get("torch")
    if torch is None or not hasattr(torch, "random"):
        yield
    else:
        with torch.random.fork_rng(devices=[]):
            yield


def predictor_in(network: Any) -> Any | None:
    """Return what predicts as policies of stable-baselines3 do, in a model or a bound method."""
    if inspect.ismethod(network) and network.__name__ == "predict":
        network = network.__self__
    candidates: list[Any] = [getattr(network, "policy", None), network]
    for policy in candidates:
        try:
            parameters = inspect.signature(policy.predict).parameters
        except (AttributeError, TypeError, ValueError):
            continue
        if "deterministic" in parameters:
            return policy
    return None
