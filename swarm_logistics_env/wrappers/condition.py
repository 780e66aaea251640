"""The condition of an episode: what indicators tell episodes apart by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import Warehouse
from swarm_logistics_env.warehouse.faults import failed_robots


@dataclass(frozen=True)
class Condition:
    """The difference of an episode from its reference: size, faults, a changed parameter.

    The onset of a fault is no part of it: if onsets are drawn, P_F is the mean over them.

    Args:
        n_robots: the swarm size N.
        modes: failure modes of its faults, sorted; "removed" is none of them.
        n_failed: how many robots these affect (m of R and FT).
        n_removed: how many robots are removed.
        changes: (field, value) of the scenario where it is not the environment's own, sorted.

    Raises:
        SetupError: more robots fail or are removed than there are, or faults without a mode.

    Example:
        >>> Condition(25, ("FM1",), n_failed=2)
        Condition(n_robots=25, modes=('FM1',), n_failed=2, n_removed=0, changes=())
    """

    n_robots: int
    modes: tuple[str, ...] = ()
    n_failed: int = 0
    n_removed: int = 0
    changes: tuple[tuple[str, Any], ...] = ()

    def __post_init__(self) -> None:
        for name in ("n_failed", "n_removed"):
            if not 0 <= getattr(self, name) <= self.n_robots:
                raise SetupError(
                    f"Condition.{name} = {getattr(self, name)}: should be at least 0 and at most "
                    f"n_robots = {self.n_robots}"
                )
        if bool(self.modes) != bool(self.n_failed):
            raise SetupError(
                f"Condition.modes = {self.modes}, n_failed = {self.n_failed}: should both be given "
                "or neither"
            )


def condition_of(world: Warehouse, seed: int, own: Scenario) -> Condition:
    """Return the condition of the episode of `seed` in `world`, relative to the scenario `own`."""
    n_robots = world.scenario.n_robots
    modes, failed, removed = set[str](), set[int](), set[int]()
    for fault in world.faults:
        robots = failed_robots(fault, seed, n_robots).tolist()
        if fault.mode == "removed":
            removed.update(robots)
        else:
            modes.add(fault.mode)
            failed.update(robots)
    changes = changes_of(world.scenario, own)
    return Condition(n_robots, tuple(sorted(modes)), len(failed), len(removed), changes)


def changes_of(scenario: Scenario, own: Scenario) -> tuple[tuple[str, Any], ...]:
    """Return the fields of `scenario`, but for the size, that differ from `own`, with values."""
    return tuple(
        (name, getattr(scenario, name))
        for name in sorted(type(own).model_fields)
        if name != "n_robots" and getattr(scenario, name) != getattr(own, name)
    )
