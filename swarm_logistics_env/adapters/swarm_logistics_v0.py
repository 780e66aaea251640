"""The environment in PettingZoo's house style: `parallel_env`, `env` (AEC), `raw_env`."""

from __future__ import annotations

from typing import Any, Literal, overload

from pettingzoo import AECEnv
from pettingzoo.utils import wrappers
from pettingzoo.utils.conversions import parallel_to_aec

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.wrappers import MotionFrame

__all__ = ["env", "parallel_env", "raw_env"]

View = Literal["body", "motion"]


@overload
def parallel_env(
    scenario: Scenario | None = None, *, view: Literal["body"] = "body", **arguments: Any
) -> SwarmLogisticsEnv: ...
@overload
def parallel_env(
    scenario: Scenario | None = None, *, view: Literal["motion"], **arguments: Any
) -> MotionFrame: ...
def parallel_env(
    scenario: Scenario | None = None, *, view: View = "body", **arguments: Any
) -> SwarmLogisticsEnv | MotionFrame:
    """Return the parallel environment.

    Args:
        scenario: the conditions; the paper's by default.
        view: "body": rows as sensors tell them, which turn with the robot's body, and its commands;
            "motion": inputs and outputs in the frame of its motion, with a memory, as `MotionFrame`
            has them. A network learns from those in minutes, and hardly ever from the others.
        **arguments: of `SwarmLogisticsEnv`: rewards, faults, fields of the scenario.

    Raises:
        SetupError: there is no such view; and what `SwarmLogisticsEnv` raises.

    Example:
        >>> env = parallel_env(n_robots=3, view="motion")
        >>> env.observation_space("robot_0").shape, env.action_space("robot_0").shape
        ((95,), (3,))
    """
    if view not in ("body", "motion"):
        raise SetupError(f'view = {view!r}: should be "body" or "motion"')
    environment = SwarmLogisticsEnv(scenario, **arguments)
    return environment if view == "body" else MotionFrame(environment)


def raw_env(**arguments: Any) -> AECEnv[str, Any, Any]:
    """Return the AEC form, robot by robot, of `parallel_env` with these arguments."""
    return parallel_to_aec(parallel_env(**arguments))


def env(**arguments: Any) -> AECEnv[str, Any, Any]:
    """Return `raw_env` with the order of calls enforced."""
    return wrappers.OrderEnforcingWrapper(raw_env(**arguments))
