"""Commands from elsewhere: tensors that NumPy cannot read, and names that are not there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.environment.dict_view import agent_names
from swarm_logistics_env.environment.requests import gathered
from swarm_logistics_env.errors import CommandError
from swarm_logistics_env.swarm_logistics_v0 import parallel_env


class OnGPU:
    """What a tensor on another device does when NumPy asks for it."""

    dtype, device, requires_grad, shape = "torch.float32", "cuda:0", False, (4,)

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise TypeError("can't convert cuda:0 device type tensor to numpy.")


def tensor(**arguments: Any) -> Any:
    torch = pytest.importorskip("torch")
    kind = {"dtype": torch.bfloat16} if arguments.pop("half", False) else {}
    return torch.zeros(4, **kind, **arguments)


UNREADABLE: list[tuple[Callable[[], Any], str]] = [
    (lambda: tensor(half=True), "type Tensor, dtype torch.bfloat16, device cpu"),
    (lambda: tensor(device="meta"), "type Tensor, dtype torch.float32, device meta"),
    (lambda: tensor(requires_grad=True), "type Tensor, .*, device cpu, requires_grad True"),
    (OnGPU, "type OnGPU, dtype torch.float32, device cuda:0"),
]
LOOPS: dict[str, Callable[[Callable[[], Any]], Any]] = {
    "map": lambda step: list(map(lambda _: step(), range(3))),  # noqa: C417  # the case in point
    "generator": lambda step: list(step() for _ in range(3)),  # noqa: C400
    "loop": lambda step: [step() for _ in range(3)],
}


@pytest.mark.parametrize("loop", LOOPS.values(), ids=LOOPS)
@pytest.mark.parametrize(("make", "kind"), UNREADABLE)
def test_actions_that_cannot_be_read_are_refused_in_any_loop(
    make: Callable[[], Any], kind: str, loop: Callable[[Callable[[], Any]], Any]
) -> None:
    env = parallel_env(n_robots=2)
    env.reset(seed=0)
    actions: dict[str, Any] = {"robot_0": np.zeros(4), "robot_1": make()}
    with pytest.raises(CommandError, match=rf"command of 'robot_1' \({kind}.*\) cannot be read"):
        loop(lambda: env.step(actions))
    assert env.warehouse.state.step == 0


@pytest.mark.parametrize(("make", "kind"), UNREADABLE)
def test_arrays_that_cannot_be_read_are_refused(make: Callable[[], Any], kind: str) -> None:
    env, central = parallel_env(n_robots=1), CentralEnv(n_robots=1)
    env.reset(seed=0)
    central.reset(seed=0)
    with pytest.raises(CommandError, match=rf"commands \({kind}.*\) cannot be read"):
        env.step_arrays(make())
    with pytest.raises(CommandError, match=rf"action \({kind}.*\) cannot be read"):
        central.step(make())


def test_tensors_that_can_be_read_are_commands() -> None:
    torch = pytest.importorskip("torch")
    tensors, arrays = parallel_env(n_robots=2), parallel_env(n_robots=2)
    for env in (tensors, arrays):
        env.reset(seed=0)
    drive = np.array([0.5, 0.0, 0.2, 1.0])
    told = tensors.step({agent: torch.as_tensor(drive) for agent in tensors.agents})
    wanted = arrays.step(dict.fromkeys(arrays.agents, drive))
    for agent in arrays.agents:
        np.testing.assert_array_equal(told[0][agent], wanted[0][agent])


def test_dtypes_that_have_nothing_in_common_are_refused() -> None:
    env = parallel_env(n_robots=2)
    env.reset(seed=0)
    times = np.zeros(4, "datetime64[s]")
    with pytest.raises(CommandError, match="commands should be numbers"):
        env.step({"robot_0": np.zeros(4), "robot_1": times})


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"robot_99999": None}, "no command for 'robot_99999'"),
        ({"robot_x": np.zeros(4)}, "a command for 'robot_x', .* 100000 possible agents"),
    ],
)
def test_a_name_among_many_is_told(change: dict[str, Any], complaint: str) -> None:
    names = agent_names(range(100_000))
    command = np.zeros(4)
    actions = {**dict.fromkeys(names, command), **change}
    given = {agent: wish for agent, wish in actions.items() if wish is not None}
    with pytest.raises(CommandError, match=complaint):
        gathered(given, names, list(names), (4,))
