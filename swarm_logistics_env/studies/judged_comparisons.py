"""Judged comparisons: estimate, equivalence and verdicts under Holm of what a study compares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from swarm_logistics_env import spi
from swarm_logistics_env.spi.equivalence import ALPHA, Equivalence
from swarm_logistics_env.spi.estimate import Estimate, Verdict

from .comparisons import Arm, Comparison
from .performance_table import Row
from .plan import Plan

CONFIDENCE = 0.95
CellKey = tuple[str, str, Arm]  # policy, table, arm


class Level(NamedTuple):
    """The level at which a study is judged.

    Attributes:
        confidence: of the indicators' intervals and verdicts, in (0, 1).
        alpha: error of each of the two tests of equivalence, in (0, 0.5).
    """

    confidence: float = CONFIDENCE
    alpha: float = ALPHA


def level_at(look: int, looks: Sequence[int], spending: spi.Spending) -> Level:
    """Return the level of one of the declared looks, counted from 0.

    Each test spends its own error over all of them: 5 % on both sides of a threshold, and as much
    on each side of the margin.
    """
    both = spi.look_alphas(looks, 1 - CONFIDENCE, spending=spending)[look]
    one_sided = spi.look_alphas(looks, 2 * ALPHA, spending=spending)[look] / 2
    return Level(1 - both, one_sided)


@dataclass(frozen=True)
class Judged:
    """One comparison with its verdicts.

    Attributes:
        comparison: what is compared.
        estimate: the indicator; a text: why it is blocked.
        equivalence: whether P is unchanged; None: blocked, or not asked.
        saturated: whether it rests on a P that is capped.
        p_holm, verdict_holm: of the estimate under Holm; None: unaffected, or blocked family.
        equivalence_holm: verdict of the equivalence under Holm; None as `equivalence`.
        stopped_at: number of seeds at which it was clear, in a study that runs until then; None: it
            is not, or the study is another.
    """

    comparison: Comparison
    estimate: Estimate | str
    equivalence: Equivalence | None
    saturated: bool
    p_holm: float | None = None
    verdict_holm: Verdict | None = None
    equivalence_holm: Verdict | None = None
    stopped_at: int | None = None


def judge_all(plan: Plan, cells: Mapping[CellKey, Row]) -> list[Judged]:
    """Return every comparison of a plan, judged; in the order of the plan.

    A comparison that needs a run which failed or is missing is blocked, and with it the adjusted
    verdicts of its family, whose size would else be too small.

    Args:
        plan: of the study.
        cells: rows of the table of performances.
    """
    found = [judge_one(comparison, cells, plan, Level()) for comparison in plan.comparisons]
    families: dict[tuple[str, str], list[int]] = {}
    for index, one in enumerate(found):
        families.setdefault(one.comparison.family, []).append(index)
    for members in families.values():
        here = [found[index] for index in members]
        estimates = [one.estimate for one in here if isinstance(one.estimate, Estimate)]
        if len(estimates) == len(here):
            found_holm = zip(spi.adjusted_p_values(estimates), spi.adjust(estimates))
            for index, (p, verdict) in zip(members, found_holm):
                # One of identical runs is no evidence, and has no verdict.
                if p is not None:
                    found[index] = replace(found[index], p_holm=p, verdict_holm=verdict)
        equivalences = [one.equivalence for one in here if one.equivalence]
        if len(equivalences) == len(here):
            for index, verdict in zip(members, spi.adjust(equivalences)):
                found[index] = replace(found[index], equivalence_holm=verdict)
    return found


def judge_one(
    comparison: Comparison, cells: Mapping[CellKey, Row], plan: Plan, level: Level
) -> Judged:
    """Return a comparison without what Holm makes of it."""
    equivalence = None
    estimate = estimate_of(comparison, cells, paired=plan.paired, confidence=level.confidence)
    used = _used(comparison, cells)
    if isinstance(estimate, Estimate):
        equivalence = comparison.equivalence(
            **_data(comparison, used, paired=plan.paired),
            margin=plan.specification.margin,
            alpha=level.alpha,
        )
    saturated = any(cell.saturated for cell in used.values())
    return Judged(comparison, estimate, equivalence, saturated)


def estimate_of(
    comparison: Comparison,
    cells: Mapping[CellKey, Row],
    *,
    paired: bool,
    confidence: float = CONFIDENCE,
) -> Estimate | str:
    """Return the estimate of a comparison from a study's cells, or why there is none."""
    used = _used(comparison, cells)
    problems = [f"{arm.setting}: {cell.problem}" for arm, cell in used.items() if cell.problem]
    if problems:
        return "; ".join(problems)
    try:
        return comparison.estimate(
            **_data(comparison, used, paired=paired),
            confidence=confidence,
        )
    except spi.IndicatorError as error:
        return str(error)


def _used(comparison: Comparison, cells: Mapping[CellKey, Row]) -> dict[Arm, Row]:
    return {arm: cells[comparison.policy, comparison.table, arm] for arm in comparison.arms}


def _data(comparison: Comparison, used: Mapping[Arm, Row], *, paired: bool) -> dict[str, Any]:
    """Return what an estimate and an equivalence take alike."""
    before, after = used[comparison.original], used[comparison.changed]
    return {
        "performance": lambda arm: used[arm].by_seed,
        "paired": paired,
        "saturated": [arm for arm, cell in used.items() if cell.saturated],
        "identical": comparison.removed is None and same_runs(before.digests, after.digests),
    }


def same_runs(before: Sequence[str | None], after: Sequence[str | None]) -> bool:
    """Return whether two conditions gave the same run at every seed, by the digests of the runs."""
    return list(before) == list(after) and None not in before
