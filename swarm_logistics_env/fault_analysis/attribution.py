"""Who is to blame: the deliveries that a fault costs, by robot, role and lost capability."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from swarm_logistics_env.errors import FaultError
from swarm_logistics_env.fault_analysis.fork import AfterOnset, Fork
from swarm_logistics_env.policies import Policy
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.spi.shapley import coalitions, shapley_values
from swarm_logistics_env.spi.summaries import t_interval
from swarm_logistics_env.warehouse import Fault
from swarm_logistics_env.warehouse.failure_modes import failure_mode, lost_capabilities
from swarm_logistics_env.warehouse.roles import ROLES

if TYPE_CHECKING:
    import pandas as pd

MOST_CAUSES = 6  # 2^6 copies of a world

# How the loss of a capability costs deliveries.
MECHANISMS = {
    "move": "anchoring: it stands in the others' way and fetches nothing",
    "sense": "it does not find items, and runs into others",
    "pick_up": "it fetches nothing",
    "deliver": "blocked requests: it holds what is asked for",
    "send": "lost timers: others do not hear from it where the delivery area is",
    "hear": "it does not hear where the delivery area is",
    "tell_the_truth": "false timers: it leads others astray",
    "be_there": "its work is missing",
}


class Losses(NamedTuple):
    """What one seed's fault cost, in deliveries after the onset.

    Attributes:
        seed: of the episode.
        total: deliveries without the fault, less those with it.
        robots: failed robots with role and contribution; the contributions sum to `total`.
        capabilities: lost capabilities with their contributions, which sum to `total`.
        missing_work: what it costs to take the same robots out of the arena instead.
        blocked_seconds, anchoring_seconds: as in `AfterOnset`, with the whole fault.
        is_capped: whether every item was delivered without the fault: it costs more than `total`.
    """

    seed: int
    total: float
    robots: dict[int, tuple[str, float]]
    capabilities: dict[str, float]
    missing_work: float
    blocked_seconds: float
    anchoring_seconds: float
    is_capped: bool


@dataclass(frozen=True)
class Attribution:
    """The losses of several seeds; see `attribute`."""

    fault: Fault
    seeds: tuple[Losses, ...]

    def table(self) -> pd.DataFrame:
        """Return the deliveries lost per episode: in all, by role and by lost capability.

        Returns:
            A table with the columns `group`, `part`, `meaning`, `robots` (how many failed in that
            role, over all seeds; missing where no role is asked), `lost` (mean over seeds), and
            the limits `low` and `high` of its 95 % t-interval; these are missing at one seed. The
            rows of each group but the first sum to the first row.
        """
        import pandas as pd

        total = np.array([each.total for each in self.seeds])
        missing_work = np.array([each.missing_work for each in self.seeds])
        rows: list[tuple[str, str, str, int | None, ArrayLike]] = [
            ("in all", "all", "deliveries lost after the onset", None, total),
            ("in all", "missing work", "as if they had left", None, missing_work),
            ("in all", "staying", "beyond that, as they stay", None, total - missing_work),
        ]
        for role, meaning in ROLES.items():
            in_role = [
                [lost for its, lost in each.robots.values() if its == role] for each in self.seeds
            ]
            if failed := sum(map(len, in_role)):
                lost = [sum(robots) for robots in in_role]
                rows.append(("by role at the onset", role, meaning, failed, lost))
        for name in self.seeds[0].capabilities:
            lost = [each.capabilities[name] for each in self.seeds]
            rows.append(("by lost capability", name, MECHANISMS[name], None, lost))
        means = [t_interval(np.asarray(lost, dtype=np.float64)) for *_, lost in rows]
        return pd.DataFrame(
            [
                (group, part.replace("_", " "), meaning, robots, *mean)
                for (group, part, meaning, robots, _), mean in zip(rows, means)
            ],
            columns=["group", "part", "meaning", "robots", "lost", "low", "high"],
        ).astype({"robots": "Int64"})


def attribute(
    scenario: Scenario, policy: Policy, fault: Fault, seeds: Iterable[int]
) -> Attribution:
    """Tell which robots and which lost capabilities cost the deliveries that a fault costs.

    At the onset the world is copied, once for each set of the robots that fail and once for each
    set of the capabilities that they lose; what a robot or a capability contributes is its Shapley
    value over these copies (`shapley_values`).

    Args:
        fault: m robots from an onset on; m and the number of capabilities at most `MOST_CAUSES`.
        seeds: of the episodes; each costs at most 2^m + 2^capabilities copies.

    Raises:
        FaultError: too many robots or capabilities, a fault that lasts from the start, or an
            episode that ends before the onset.
    """
    return Attribution(fault, tuple(losses(scenario, policy, fault, seed) for seed in seeds))


def check_fault(fault: Fault) -> None:
    """Check that `attribute` can tell who is to blame for a fault.

    Raises:
        FaultError: as `attribute`.
    """
    count = fault.robots if isinstance(fault.robots, int) else len(fault.robots)
    capabilities = lost_capabilities(fault.mode)
    for what, number in (("robots", count), (f"capabilities of {fault.mode}", len(capabilities))):
        if number > MOST_CAUSES:
            raise FaultError(
                f"{number} {what}: should be at most {MOST_CAUSES}, for each set of them is a copy"
            )
    if fault.onset <= 0.0:
        raise FaultError(
            f"Fault.onset = {fault.onset:g} s: should be later than 0, when robots have roles"
        )


def losses(scenario: Scenario, policy: Policy, fault: Fault, seed: int) -> Losses:
    """Return what one seed's fault costs, by robot and by capability; see `attribute`."""
    check_fault(fault)
    fork = Fork(scenario, policy, seed, fault.onset)
    robots = fork.robots_of(fault)
    capabilities = lost_capabilities(fault.mode)
    sound, whole = fork.go_on(), fork.go_on([_part(fault, robots)])

    def lost(outcome: AfterOnset) -> float:
        return float(sound.delivered - outcome.delivered)

    def lost_with(robots: Iterable[int], taken: Iterable[str] = capabilities) -> float:
        return lost(fork.go_on([_part(fault, robots, taken)]))

    by_robots: dict[frozenset[int], float] = {frozenset(): 0.0, frozenset(robots): lost(whole)}
    for some in coalitions(robots):
        if some not in by_robots:
            by_robots[some] = lost_with(some)
    by_capabilities: dict[frozenset[str], float] = {
        frozenset(): 0.0,
        frozenset(capabilities): lost(whole),
    }
    for taken in coalitions(capabilities):
        if taken not in by_capabilities:
            by_capabilities[taken] = lost_with(robots, taken)
    removed = Fault("removed", robots, onset=fault.onset)
    return Losses(
        seed=seed,
        total=lost(whole),
        robots={
            robot: (str(fork.roles[robot]), value)
            for robot, value in shapley_values(robots, by_robots).items()
        },
        capabilities=shapley_values(capabilities, by_capabilities),
        missing_work=lost(whole if fault.mode == "removed" else fork.go_on([removed])),
        blocked_seconds=whole.blocked_seconds,
        anchoring_seconds=whole.anchoring_seconds,
        is_capped=sound.is_capped,
    )


def _part(fault: Fault, robots: Iterable[int], taken: Iterable[str] = ()) -> Fault:
    """Return the fault of these robots, which lose these capabilities alone; none given: all."""
    mode = fault.mode
    if (lost := sorted(taken)) and len(lost) < len(lost_capabilities(mode)):
        mode = f"{mode.partition('[')[0]}[{','.join(lost)}]"
    factor = fault.factor if failure_mode(mode).factor else None
    return fault.replace(mode=mode, robots=tuple(sorted(robots)), factor=factor, role=None)
