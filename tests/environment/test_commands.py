"""Commands from elsewhere: tensors that NumPy cannot read, and names that are not there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.environment.requests import gathered
from swarm_logistics_env.environment.spaces import agent_names
from swarm_logistics_env.errors import CommandError
from swarm_logistics_env.swarm_logistics_v0 import parallel_env


class OnGPU:
    """What a tensor on another device does when NumPy asks for it."""

    dtype, device, requires_grad, shape = "torch.float32", "cuda:0", False, (4,)

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise TypeError("can't convert cuda:0 device type tensor to numpy.")


def tensor(dtype: str = "float32", **arguments: Any) -> Any:
    torch = pytest.importorskip("torch")
    return torch.zeros(4, dtype=getattr(torch, dtype), **arguments)


@pytest.mark.parametrize(
    ("make", "kind"),
    [
        (lambda: tensor("bfloat16"), "type Tensor, dtype torch.bfloat16, device cpu"),
        (lambda: tensor(device="meta"), "type Tensor, dtype torch.float32, device meta"),
        (lambda: tensor(requires_grad=True), "type Tensor, .*, device cpu, requires_grad True"),
        (OnGPU, "type OnGPU, dtype torch.float32, device cuda:0"),
    ],
)
def test_what_cannot_be_read_is_refused(make: Callable[[], Any], kind: str) -> None:
    env, central = parallel_env(n_robots=2), CentralEnv(n_robots=1)
    env.reset(seed=0)
    central.reset(seed=0)
    actions: dict[str, Any] = {"robot_0": np.zeros(4), "robot_1": make()}
    with pytest.raises(CommandError, match=rf"command of 'robot_1' \({kind}.*\) cannot be read"):
        list(map(env.step, [actions] * 3))
    with pytest.raises(CommandError, match="cannot be read"):
        list(env.step(actions) for _ in range(3))  # noqa: C400  # no loop swallows it
    with pytest.raises(CommandError, match=rf"commands \({kind}.*\) cannot be read"):
        env.step_arrays(make())
    with pytest.raises(CommandError, match=rf"action \({kind}.*\) cannot be read"):
        central.step(make())
    assert env.warehouse.state.step == 0


def test_tensors_that_can_be_read_are_commands() -> None:
    torch = pytest.importorskip("torch")
    drive = np.array([0.5, 0.0, 0.2, 1.0])
    seen = []
    for command in (torch.as_tensor(drive), drive, drive.tolist()):
        env = parallel_env(n_robots=2)
        env.reset(seed=0)
        seen.append(env.step(dict.fromkeys(env.agents, command))[0])
    np.testing.assert_equal(seen[0], seen[1])
    np.testing.assert_equal(seen[0], seen[2])


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"robot_99999": None}, "no command for 'robot_99999'"),
        ({"robot_x": np.zeros(4)}, "a command for 'robot_x', .* 100000 possible agents"),
    ],
)
def test_a_name_among_many_is_told(change: dict[str, Any], complaint: str) -> None:
    names = agent_names(range(100_000))
    actions = {**dict.fromkeys(names, np.zeros(4)), **change}
    given = {agent: wish for agent, wish in actions.items() if wish is not None}
    with pytest.raises(CommandError, match=complaint):
        gathered(given, names, list(names), (4,))
