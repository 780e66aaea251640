"""Networks in use: their mode, their precision, what exporters write, and what is refused."""

from __future__ import annotations

import copy
import pickle
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, policies, run_episode
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.evaluation_mode import torch_modules_of
from swarm_logistics_env.world.motion.actions import ACTIONS
from swarm_logistics_env.world.observations import N_COLUMNS

torch = pytest.importorskip("torch")
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of torch.jit

BRIEF = Scenario(n_robots=3, n_items=10, duration=1.0)
ROWS = Warehouse(Scenario(n_robots=6)).reset(seed=1)


def module() -> Any:
    """Return a network in training mode, but for one layer, whose mode shows in its outputs."""
    network = torch.nn.Sequential(
        torch.nn.Linear(N_COLUMNS, 8), torch.nn.BatchNorm1d(8), torch.nn.Dropout(0.5),
        torch.nn.Linear(8, 4), torch.nn.Dropout(0.5), torch.nn.Tanh(),
    )  # fmt: skip
    network(torch.as_tensor(ROWS))
    network[2].eval()
    return network


def modes(network: Any) -> list[bool]:
    return [part.training for part in network.modules()]


def in_use(network: Any) -> Any:
    """Return what a network makes of the rows in evaluation mode."""
    with torch.no_grad():
        return copy.deepcopy(network).eval()(torch.as_tensor(ROWS)).numpy()


class Holder:
    """A policy class of one's own that holds a network somewhere and leaves its mode alone."""

    def __init__(self, network: Any) -> None:
        self.parts = {"networks": [network]}
        self.modes_met: set[bool] = set()

    def reset(self, n_robots: int, seed: int) -> None:
        pass

    def act(self, rows: Any) -> Any:
        (network,) = self.parts["networks"]
        self.modes_met |= set(modes(network))
        with torch.no_grad():
            return network(torch.as_tensor(rows)).numpy()


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "form",
    [
        lambda network: network,
        torch.jit.script,
        lambda network: torch.compile(network, backend="eager"),
        lambda network: lambda rows: network(torch.as_tensor(rows)),
        lambda network: Holder(network).act,
    ],
)
def test_a_network_plays_in_evaluation_mode_and_gets_its_own_mode_back(form: Any) -> None:
    network = module()
    modes_before, numbers = modes(network), copy.deepcopy(network.state_dict())
    expected, random_numbers = in_use(network), torch.get_rng_state()
    policy = policies.of(form(network))
    np.testing.assert_allclose(policy.act(ROWS), expected, atol=1e-6)
    assert modes(network) == modes_before
    assert all((numbers[name] == tensor).all() for name, tensor in network.state_dict().items())
    assert (torch.get_rng_state() == random_numbers).all()


def test_so_it_does_in_a_policy_class_of_ones_own_also_when_the_run_fails() -> None:
    network = module()
    policy, modes_before = Holder(network), modes(network)
    run_episode(BRIEF, policy, seed=0)
    assert policy.modes_met == {False}
    assert modes(network) == modes_before
    policy.parts["networks"].append(None)
    with pytest.raises(ValueError, match="unpack"):
        run_episode(BRIEF, policy, seed=0)
    assert modes(network) == modes_before


def test_of_very_many_parts_those_that_come_first_are_looked_at() -> None:
    network = module()
    for n_others, networks in ((900, [network]), (1100, [])):
        assert torch_modules_of([*(object() for _ in range(n_others)), network]) == networks


def test_a_network_that_a_class_shares_among_its_objects_is_seen_as_well() -> None:
    class Sharing:
        network = module()

    assert torch_modules_of([Sharing()]) == [Sharing.network]


def test_a_method_that_learns_and_is_called_train_is_not_called() -> None:
    class Learner(torch.nn.Module):  # type: ignore[misc, name-defined]  # torch is any module here
        def __init__(self) -> None:
            super().__init__()
            self.network = module()

        def forward(self, rows: Any) -> Any:
            return self.network(rows)

        def train(self, steps: int = 10) -> None:
            raise AssertionError("it learned")

    learner = Learner()
    np.testing.assert_allclose(policies.of(learner).act(ROWS), in_use(learner.network), atol=1e-6)
    assert learner.training


@pytest.mark.parametrize("precision", ["float64", "float16", "bfloat16"])
def test_rows_are_cast_to_what_the_module_holds(precision: str) -> None:
    network = module().to(getattr(torch, precision))
    commands = policies.of(network).act(ROWS)
    assert commands.dtype == np.float32
    np.testing.assert_allclose(commands, in_use(network.float()), atol=0.02)


class Giving(torch.nn.Module):  # type: ignore[misc, name-defined]  # as above
    """Gives the outputs of a network in some form."""

    def __init__(self, form: Callable[[Any], Any]) -> None:
        super().__init__()
        self.network, self.form = module(), form

    def forward(self, rows: Any) -> Any:
        return self.form(self.network(rows))


class Judged(NamedTuple):
    value: Any
    action: Any


class Spread(NamedTuple):
    mean: Any
    deviation: Any


@pytest.mark.parametrize(
    "form",
    [
        lambda actions: (actions, None),
        lambda actions: [actions, actions[:, :1]],
        lambda actions: {"mean": actions},
        lambda actions: {"value": actions[:, :1], "action": actions},
        lambda actions: Judged(value=actions[:, :1], action=actions),
        lambda actions: Spread(mean=actions, deviation=actions[:, :1]),
        lambda actions: actions.tolist(),
    ],
)
def test_the_first_output_or_the_one_called_action_is_played(form: Any) -> None:
    network = Giving(form)
    np.testing.assert_allclose(policies.of(network).act(ROWS), in_use(network.network), atol=1e-6)


class Likely:
    """Predicts as a policy of stable-baselines3: at random, if not asked for the most likely."""

    def predict(self, rows: Any, deterministic: bool = False) -> Any:
        return np.full((len(rows), 4), 1.0 if deterministic else -1.0)


def test_of_what_predicts_the_most_likely_action_is_played() -> None:
    policy = policies.of(Likely())
    policy.reset(2, 0)
    assert (policy.act(np.zeros((2, N_COLUMNS), np.float32)) == 1.0).all()


def test_the_first_output_may_be_numbers_of_actions() -> None:
    network = Giving(lambda actions: (actions.argmax(1), actions))
    numbers = in_use(network.network).argmax(axis=1)
    commands = np.array(list(ACTIONS.values()))[numbers]
    np.testing.assert_array_equal(policies.of(network).act(ROWS), commands)


def exported(network: Any, n_rows: int | None = None, is_use: bool = True) -> Any:
    rows = torch.as_tensor(ROWS[:n_rows])
    shapes = ({0: torch.export.Dim("n")},) if n_rows is None else None
    return torch.export.export(network.train(not is_use), (rows,), dynamic_shapes=shapes)


def batch_norm() -> Any:
    return torch.nn.Sequential(torch.nn.Linear(N_COLUMNS, 4), torch.nn.BatchNorm1d(4))


def test_an_exported_network_plays_row_by_row_if_it_takes_one() -> None:
    network = module()
    for n_rows in (None, 1):
        policy = policies.of(exported(network, n_rows))
        np.testing.assert_allclose(policy.act(ROWS), in_use(network), atol=1e-6)


def traced(network: Any) -> Any:
    with warnings.catch_warnings():  # it warns that the number of rows is checked once
        warnings.simplefilter("ignore")
        return torch.jit.trace(network, torch.as_tensor(ROWS), check_trace=False)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            lambda: exported(module(), is_use=False),
            "other outputs for the same rows: should be exp",
        ),
        (
            lambda: exported(batch_norm(), is_use=False).module(),
            "other outputs beside other rows, as one that was exported in training mode",
        ),
        (
            lambda: traced(module()),
            "gave other outputs for the same rows: should be exported after network.eval()",
        ),
        (lambda: exported(module(), 3), r"input of shape \(3, 141\): should take rows, of any num"),
        (lambda: torch.nn.Linear(12, 4), r"shape \(5, 141\) .*5x141 and 12x4"),
        (lambda: torch.nn.Linear(N_COLUMNS, 13), r"should be .*, as argmax makes of 13 values"),
        (lambda: torch.nn.LSTM(N_COLUMNS, 4), "has a memory, LSTM: should have none"),
        (lambda: torch.nn.LazyLinear(4), "has lazy layers: should have been called once"),
        (
            lambda: Giving(lambda actions: {"value": actions, "logits": actions}),
            "the outputs value, logits: should give one, or call one of them action",
        ),
        (lambda: Giving(lambda actions: None), "gave no array of numbers"),
        (lambda: Giving(lambda actions: ()), r"shape \(0,\)"),
        (lambda: Giving(torch.rand_like), "draw no random numbers"),
    ],
)
def test_what_cannot_be_played_is_refused_before_any_run(make: Any, sentence: str) -> None:
    with pytest.raises(PolicyError, match=sentence):
        policies.of(make())


def session(
    shape: list[Any], kind: str = "FLOAT", outputs: tuple[str, ...] = ("action",),
    width: int = N_COLUMNS, inputs: tuple[str, ...] = ("rows",), node: str = "Identity",
) -> Any:  # fmt: skip
    """Return a session whose "action" is the rows times a matrix, and whose "other" is zeros."""
    onnx = pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    helper = onnx.helper
    real = getattr(onnx.TensorProto, kind)
    matrix = matrix_of(width).astype(helper.tensor_dtype_to_np_dtype(real))
    constants = {"matrix": matrix, "half": np.float32(0.5), "yes": np.bool_(True)}
    nodes = [helper.make_node("MatMul", [inputs[0], "matrix"], ["product"])]
    extra = {"Dropout": ["half", "yes"], "Identity": []}[node]
    nodes.append(helper.make_node(node, ["product", *extra], ["action"]))
    nodes.append(helper.make_node("Sub", ["action", "action"], ["other"]))
    graph = helper.make_graph(
        nodes, "network",
        [helper.make_tensor_value_info(name, real, shape) for name in inputs],
        [helper.make_tensor_value_info(name, real, [shape[0], 4]) for name in outputs],
        [onnx.numpy_helper.from_array(np.asarray(v), name) for name, v in constants.items()],
    )  # fmt: skip
    version = helper.make_opsetid("", 17)
    model = helper.make_model(graph, opset_imports=[version], ir_version=8)
    return runtime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])


def matrix_of(width: int) -> Any:
    return np.random.default_rng(0).normal(0.0, 0.1, (width, 4))


@pytest.mark.parametrize("kind", ["FLOAT", "DOUBLE", "FLOAT16"])
def test_a_session_plays_whatever_its_precision_and_its_batch(kind: str) -> None:
    for shape in (["n", N_COLUMNS], [1, N_COLUMNS]):
        policy: Any = policies.of(session(shape, kind, ("other", "action")))
        for player in (policy, pickle.loads(pickle.dumps(policy)), copy.deepcopy(policy)):
            commands = player.act(ROWS)
            assert commands.dtype == np.float32
            np.testing.assert_allclose(commands, ROWS @ matrix_of(N_COLUMNS), atol=0.01)


@pytest.mark.parametrize(
    ("arguments", "frame", "sentence"),
    [
        ({"shape": [4, N_COLUMNS]}, False, r"takes an input of shape \(4, 141\): should take rows"),
        ({"shape": ["n", N_COLUMNS], "inputs": ("rows", "state")}, False, "inputs rows, state: sh"),
        ({"shape": ["n", 50], "width": 50}, False, r"rows of shape \(50,\): should be \(141,\)"),
        ({"shape": ["n", 95], "width": 95}, False, r"\(95,\) and not \(141,\), so it learned thro"),
        ({"shape": ["n", N_COLUMNS]}, True, r"rows of shape \(141,\): .* should be 95 inputs"),
        ({"shape": ["n", N_COLUMNS], "node": "Dropout"}, False, "other outputs for the same rows"),
        ({"shape": ["n", N_COLUMNS], "kind": "INT64"}, False, r"as tensor\(int64\): should be one"),
    ],
)
def test_a_session_that_takes_something_else_is_refused(
    arguments: Any, frame: bool, sentence: str
) -> None:
    with pytest.raises(PolicyError, match=sentence):
        policies.of(session(**arguments), frame=frame)


def test_a_session_refuses_rows_of_another_length_than_its_file_says() -> None:
    policy = policies.of(session(["n", N_COLUMNS]))
    with pytest.raises(PolicyError, match="reads rows of 141 numbers, and these have 143"):
        policy.act(np.pad(ROWS, ((0, 0), (0, 2))))


def test_within_wrappers_a_network_is_tried_with_the_first_rows() -> None:
    policy = policies.within(exported(batch_norm(), is_use=False).module(), lambda env: env)
    with pytest.raises(PolicyError, match="beside other rows, as one that was exported in train"):
        policy.act(ROWS)
    one_row = policies.within(exported(module(), 1), lambda env: env)
    assert one_row.act(ROWS).shape == (6, 4)
