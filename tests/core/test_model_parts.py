"""Networks of other libraries are told apart by all that they compute with, and by nothing else."""

from __future__ import annotations

import copy
import functools
import io
import os
import subprocess
import sys
import textwrap
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import policies
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.fingerprint import UNSTABLE, deep_copy, fingerprint
from swarm_logistics_env.core.model_parts import model_parts
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.study.runs.notes import merge
from swarm_logistics_env.study.studies import Study

torch = pytest.importorskip("torch")
nn = torch.nn
ROWS = torch.ones(2, 141)


def value_of(value: object) -> str:
    return str(fingerprint(value)["value"])


def linear(seed: int = 0) -> Any:
    torch.manual_seed(seed)
    return nn.Linear(141, 4)


class Holding(nn.Module):  # type: ignore[misc, name-defined]
    def __init__(self, part: Any) -> None:
        super().__init__()
        self.part = part

    def forward(self, rows: Any) -> Any:
        return self.part(rows) if callable(self.part) else rows


class Shifted(nn.Module):  # type: ignore[misc, name-defined]
    def __init__(self, mean: float) -> None:
        super().__init__()
        self.register_buffer("mean", torch.full((141,), mean), persistent=False)

    def forward(self, rows: Any) -> Any:
        return rows - self.mean


class Scaling(nn.Module):  # type: ignore[misc, name-defined]
    def __init__(self, gain: float) -> None:
        super().__init__()
        self.gain = gain

    def forward(self, weight: Any) -> Any:
        return self.gain * weight


class Tagged(torch.Tensor):  # type: ignore[misc, name-defined]
    """A tensor of a kind of its own."""


@dataclass
class Data:
    network: Any

    def __call__(self, rows: Any) -> Any:
        return self.network(torch.as_tensor(rows))


def pruned(share: float) -> Any:
    from torch.nn.utils import prune

    layer = linear()
    prune_weights: Any = prune.l1_unstructured
    prune_weights(layer, "weight", share)
    return layer


def parametrized(gain: float) -> Any:
    from torch.nn.utils import parametrize

    layer = linear()
    parametrize.register_parametrization(layer, "weight", Scaling(gain))
    return layer


def hooked(gain: float) -> Any:
    layer = linear()
    layer.register_forward_hook(lambda module, inputs, output: gain * output)
    return layer


def normalized(mean: float) -> Any:
    layer = nn.BatchNorm1d(141)
    layer.running_mean += mean
    return layer


def calling(network: Any) -> Any:
    return lambda rows: network(torch.as_tensor(rows))


def apply(rows: Any, network: Any) -> Any:
    return network(torch.as_tensor(rows))


def traced(seed: int, *functions: Any) -> Any:
    network = nn.Sequential(linear(seed), *map(Holding, functions))
    torch.jit.trace(network, ROWS)  # later ones call the type by a name with another number
    return torch.jit.trace(network, ROWS)


def generator(draws: int) -> Any:
    rng = np.random.default_rng(0)
    rng.normal(size=draws)
    return rng


def double(seed: int) -> Any:
    return linear().double() if seed else linear()


CASES: dict[str, tuple[Callable[[Any], Any], Any, Any]] = {
    "attribute": (Holding, 0.5, 1.0),
    "function": (Holding, torch.tanh, torch.relu),
    "lambda": (Holding, lambda x: x, lambda x: -x),
    "ufunc": (Holding, np.tanh, np.sin),
    "nested modules": (lambda seed: Holding([[linear(1)], [linear(seed)]]), 2, 3),
    "tensors by name": (lambda x: Holding({"a": torch.full((3,), x)}), 0.0, 1.0),
    "sparse": (lambda x: Holding(torch.full((3,), x).to_sparse()), 1.0, 2.0),
    "generator": (lambda draws: Holding(generator(draws)), 0, 1),
    "dataclass": (lambda seed: Data(linear(seed)), 0, 1),
    "dropout": (nn.Dropout, 0.1, 0.2),
    "unsaved buffer": (Shifted, 0.0, 1.0),
    "statistics": (normalized, 0.0, 1.0),
    "pruned": (pruned, 0.1, 0.2),
    "parametrized": (parametrized, 1.0, 2.0),
    "hook": (hooked, 1.0, 2.0),
    "type": (double, 0, 1),
    "closure": (lambda seed: calling(linear(seed)), 0, 1),
    "decorated": (lambda seed: torch.no_grad()(calling(linear(seed))), 0, 1),
    "partial": (lambda seed: functools.partial(apply, network=linear(seed)), 0, 1),
    "bound": (lambda seed: linear(seed).forward, 0, 1),
    "traced weights": (traced, 0, 1),
    "traced": (lambda functions: traced(0, *functions), [torch.tanh, torch.relu],
               [torch.relu, torch.tanh]),
    "compiled": (lambda part: torch.compile(Holding(part), backend="eager"), 0.5, 1.0),
    "compiled function": (lambda f: torch.compile(f, backend="eager"), lambda x: x, lambda x: -x),
    "compiler": (lambda backend: torch.compile(apply, backend=backend), "eager", "aot_eager"),
    "subclass of tensors": (lambda x: Holding(torch.full((3,), x).as_subclass(Tagged)), 0.0, 1.0),
    "graph": (lambda kind: torch.fx.symbolic_trace(nn.Sequential(linear(), kind())), nn.Tanh,
              nn.ReLU),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore:`torch.jit.*` is deprecated")
@pytest.mark.parametrize("name", CASES)
def test_what_computes_otherwise_is_another_network(name: str) -> None:
    make, first, second = CASES[name]
    values = [value_of(make(part)) for part in (first, second)]
    assert values[0] != values[1]
    assert values == [value_of(make(part)) for part in (first, second)]


def test_how_a_network_is_kept_and_learned_is_no_part_of_it() -> None:
    network = nn.Sequential(linear(), nn.Dropout(), Holding(torch.tanh))
    file = io.BytesIO()
    torch.save(network, file)
    file.seek(0)
    copies = [
        copy.deepcopy(network),
        torch.load(file, weights_only=False),
        copy.deepcopy(network).eval(),
        copy.deepcopy(network).requires_grad_(False),
    ]
    network(ROWS).sum().backward()
    assert {value_of(part) for part in (*copies, network)} == {value_of(network)}


@pytest.mark.parametrize(
    "part", [threading.Lock(), np.frompyfunc(abs, 1, 1)], ids=["a lock", "an unnamed function"]
)
def test_what_cannot_be_compared_is_another_one_each_time(part: Any) -> None:
    network = linear()
    network.part = part
    policy = policies.of(network)
    spec = PolicySpec.of(policy)
    planned = spec.identity()
    assert UNSTABLE in planned
    assert policy.identity != policy.identity
    spec.refuse_other(planned)  # it is played all the same


@pytest.mark.filterwarnings("ignore:You are using the legacy TorchScript-based ONNX export")
@pytest.mark.filterwarnings("ignore:The feature will be removed")
def test_a_session_is_its_model_and_not_what_its_file_has_become(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    path = tmp_path / "network.onnx"

    def session(seed: int) -> Any:
        torch.onnx.export(linear(seed), (ROWS[:1],), path, dynamo=False)
        return runtime.InferenceSession(path)

    weights = path.with_name("network.onnx.data")  # as larger networks keep them
    weights.write_bytes(b"weights")
    first = session(0)
    before = value_of(first)
    glob = Path.glob
    with monkeypatch.context() as patched:  # a folder has no order
        patched.setattr(Path, "glob", lambda *where: sorted(glob(*where), reverse=True))
        assert value_of(session(0)) == before
    weights.write_bytes(b"others")
    assert value_of(session(0)) != before
    weights.write_bytes(b"weights")
    other = value_of(session(1))
    assert len({before, other, value_of(first)}) == 3
    policies.of(first)  # from here on sessions can be pickled, by their files
    assert deep_copy([first]) == [first]


def test_a_session_that_draws_numbers_has_no_stable_value(tmp_path: Path) -> None:
    onnx = pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    make_node = onnx.helper.make_node
    nodes = [make_node("RandomUniformLike", ["x"], ["n"]), make_node("Add", ["x", "n"], ["y"])]
    x, y = (onnx.helper.make_tensor_value_info(n, onnx.TensorProto.FLOAT, [8, 3]) for n in "xy")
    graph = onnx.helper.make_graph(nodes, "drawing", [x], [y])
    operators = [onnx.helper.make_opsetid("", 17)]
    model = onnx.helper.make_model(graph, opset_imports=operators, ir_version=8)
    onnx.save(model, tmp_path / "drawing.onnx")
    session = runtime.InferenceSession(tmp_path / "drawing.onnx")
    assert value_of(session).startswith(UNSTABLE)
    for argument in (x, y):
        argument.type.tensor_type.elem_type = onnx.TensorProto.DOUBLE
    model = onnx.helper.make_model(
        onnx.helper.make_graph([make_node("Neg", ["x"], ["y"])], "doubles", [x], [y]),
        opset_imports=operators, ir_version=8,
    )  # fmt: skip
    doubles = runtime.InferenceSession(model.SerializeToString())
    with pytest.raises(TypeError, match=r"input x of tensor\(double\): cannot be drawn"):
        model_parts(doubles)


def test_a_model_of_stable_baselines3_is_what_it_predicts_with(tmp_path: Path) -> None:
    sb3 = pytest.importorskip("stable_baselines3")
    model = sb3.PPO("MlpPolicy", "Pendulum-v1", n_steps=8, batch_size=8, device="cpu", seed=0)
    model.save(tmp_path / "model.zip")
    again = sb3.PPO.load(tmp_path / "model.zip", device="cpu")
    before = value_of(Data(model))
    assert value_of(Data(again)) == before
    again.predict(np.zeros((2, 3), np.float32))
    assert value_of(Data(again)) == before
    again.policy.action_space.high[:] = 0.5
    assert value_of(Data(again)) != before
    again.lock = threading.Lock()  # so that it cannot be copied
    assert deep_copy([again]) == [again]


def test_what_was_computed_with_a_gradient_is_copied_without() -> None:
    network = linear()
    network.computed = 2.0 * network.weight
    copied = deep_copy(network)
    assert (copied.computed == network.computed).all()
    assert not copied.computed.requires_grad
    assert copied.weight.requires_grad
    copied.computed += 1.0
    copied.weight.data += 1.0
    assert (network.computed == 2.0 * network.weight).all()
    with pytest.raises(TypeError, match="lock"):
        deep_copy([network, threading.Lock()])


def test_a_policy_that_learned_after_its_plan_is_refused_and_then_played_anew(
    tmp_path: Path,
) -> None:
    network = nn.Sequential(linear(), Holding(torch.tanh))
    policy = policies.of(network)
    world = {
        "scenario": {"n_robots": 2, "n_items": 4, "duration": 1.0},
        "sizes": [{"values": [2, 3]}],
        "seeds": 1,
        "policies": [policy],
    }
    study = Study(out=tmp_path, **world)
    assert study.run().played == 2
    assert study.run().kept == 2
    with torch.no_grad():
        network[0].weight.zero_()
    with pytest.raises(PolicyError, match="is not what was planned"):
        study.run()
    tally = Study(out=tmp_path, **world).run()
    assert (tally.played, tally.kept) == (2, 0)


SCRIPT = """
import sys
import numpy as np
import torch
from torch import nn
from layers import Last
from swarm_logistics_env import policies
from swarm_logistics_env.study.runs.engines import Shard
from swarm_logistics_env.study.studies import Study

class Mine:
    def __init__(self, network): self.network, self.tensors = network, {"a": torch.ones(3)}
    def reset(self, n, seed): pass
    def act(self, rows):
        with torch.no_grad():
            return self.network(torch.as_tensor(rows)).numpy()

torch.manual_seed(0)
network = nn.Sequential(nn.Linear(141, 4), Last(torch.tanh))
scenario = dict(n_robots=2, n_items=4, duration=1.0)
world = dict(seeds=2, scenario=scenario, sizes=[dict(values=[2, 3])])
played = [policies.of(network), Mine(network)]
tally = Study(out=sys.argv[1], policies=played, **world).run(shard=Shard.parse(sys.argv[2]))
print(tally.played, tally.kept)
"""
LAST = """
from torch import nn
class Last(nn.Module):
    def __init__(self, function):
        super().__init__()
        self.function = function
    def forward(self, rows): return 1.0 * self.function(rows)
"""


@pytest.mark.daily
def test_shards_of_several_starts_merge_and_an_edited_layer_is_played_anew(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(textwrap.dedent(SCRIPT))
    (tmp_path / "layers.py").write_text(LAST)

    def start(out: str, shard: str) -> str:
        done = subprocess.run(
            [sys.executable, "script.py", out, shard],
            cwd=tmp_path,
            env={**os.environ, "PYTHONHASHSEED": "random"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    assert [start("one", "1/2"), start("two", "2/2")] == ["4 0", "4 0"]
    assert merge([tmp_path / "one", tmp_path / "two"], tmp_path / "both") == 8
    (tmp_path / "layers.py").write_text(LAST.replace("1.0 *", "0.0 *"))
    assert start("both", "1/2") == "4 0"
