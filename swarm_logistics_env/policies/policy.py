"""The interface between a policy and the warehouse."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import WarehouseState


@runtime_checkable
class Policy(Protocol):
    """Decides for all robots at once, one row a robot; a class with these two methods is one.

    A policy may also have

    * `needs_state = True`: `act` gets the WarehouseState as a second argument (a central
      controller that sees everything); robots that do not hear get no commands then, see
      `mask_unreachable_commands`;
    * `configure(scenario)`: called before `reset`, for what a robot's maker writes into it, such
      as its control period;
    * `identity`: text that names everything its behaviour depends on (see `identity`).
    """

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode of `n_robots` rows; what is random follows from `seed` and the row."""

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) in [-1, 1] for observation rows (N, D)."""


def start(policy: Policy, scenario: Scenario, seed: int) -> None:
    """Let `policy` begin an episode.

    Raises:
        PolicyError: it is none.
    """
    if not isinstance(policy, Policy):
        raise PolicyError(
            f"policy = {policy!r}: should have the methods reset and act, as what "
            "policies.load(name) returns has"
        )
    configure = getattr(policy, "configure", None)
    if configure is not None:
        configure(scenario)
    policy.reset(scenario.n_robots, seed)


def decide(
    policy: Policy, observations: NDArray[np.float32], state: WarehouseState
) -> NDArray[np.float64]:
    """Return the commands of `policy`, with the state for those that need it.

    A policy that needs the state is a central controller: its commands reach robots that hear.
    They are checked where they are used, by `Warehouse.step`.
    """
    if getattr(policy, "needs_state", False):
        # The protocol knows the one argument that all policies take.
        return mask_unreachable_commands(policy.act(observations, state), state)  # type: ignore[call-arg]
    return policy.act(observations)


def mask_unreachable_commands(commands: NDArray[Any], state: WarehouseState) -> NDArray[Any]:
    """Return a central controller's commands (N, 4) with zeros for the robots that do not hear.

    A command of zeros lets a robot stand still, leaves its gripper as it is and broadcasts
    nothing new. So the failure modes FM3 and FM3_hear act on central control as they would in
    reality. The controller sees from above and reaches every robot that hears, wherever it is:
    it makes no difference whether a robot sends, nor do radio range, loss and sensor noise.
    """
    deaf = state.robot_present & ~state.hears
    if not deaf.any():
        return commands
    try:
        masked = np.array(commands, dtype=np.float64)
    except (TypeError, ValueError):
        return commands  # the warehouse says what is wrong with them
    if masked.shape[:1] == deaf.shape:
        masked[deaf] = 0.0
    return masked
