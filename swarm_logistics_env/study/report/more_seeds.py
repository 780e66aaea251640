"""How many more seeds what is open needs, or that no number in reach will do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from swarm_logistics_env import spi
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.until_clear import MOST_SEEDS_UNTIL_CLEAR
from swarm_logistics_env.study.verdicts.verdict import POWER, Verdict

EFFECT = 0.1  # the smallest for which more seeds are worth while
_MOST_NAMED = 3  # questions
# What questions need, by the case that applies to them.
_NEEDS = {
    "within_reach": "{n_seeds} new {runs} might decide {them}",
    "beyond": "{reach} {runs} are too few for {them} ({named})",
    "none": "no number in reach will do for {them} ({named})",
    "small": f"the effect of {{count}} is likely below {EFFECT:g}, too small for more {{runs}}",
}


class MoreSeeds(NamedTuple):
    """What open questions need.

    Attributes:
        n_seeds: seeds, all of them new, with which those within reach may be decided; None: none
            is within reach.
        words: the same of all open questions; empty: none is open.
    """

    n_seeds: int | None
    words: str


def more_seeds(results: StudyResults) -> MoreSeeds:
    """Return how many seeds the open questions of a study need.

    At the value found where stalls may be hidden (`spi.seeds_against_stalls`), else to tell an
    effect of `EFFECT` on the side of the value with 80 % power.
    """
    n_played = max((v.estimate.n_seeds for v in results.verdicts if v.estimate), default=0)
    reach = max(MOST_SEEDS_UNTIL_CLEAR, 2 * n_played)
    needs: dict[str, list[tuple[Verdict, int | None]]] = {}
    for verdict in results.verdicts:
        if verdict.conclusion == "open" and verdict.estimate is not None:
            case, n_seeds = _need(verdict, reach)
            needs.setdefault(case, []).append((verdict, n_seeds))
    runs = "trials a condition" if results.plan.origin else "seeds"
    within_reach = [n_seeds or 0 for _, n_seeds in needs.get("within_reach", ())]
    most = max(within_reach, default=None)
    words = [
        template.format(
            count=len(needs[case]),
            them=_pronoun(needs[case]) if len(needs) == 1 else len(needs[case]),
            n_seeds=most,
            runs=runs,
            reach=reach,
            named=_named(needs[case]),
        )
        for case, template in _NEEDS.items()
        if case in needs
    ]
    n_open = sum(map(len, needs.values()))
    return MoreSeeds(most, f"{n_open} open: {'; '.join(words)}" if words else "")


def _need(verdict: Verdict, reach: int) -> tuple[str, int | None]:
    """Return which case of `_NEEDS` applies to an open verdict, and the seeds it needs."""
    estimate = verdict.estimate
    assert estimate is not None
    n_seeds = spi.seeds_against_stalls(estimate)
    if n_seeds is None and "hidden_stalls" not in estimate.flags:
        side = math.copysign(EFFECT, estimate.value - estimate.threshold)
        n_seeds = spi.seeds_for_power(estimate, estimate.threshold + side, POWER)
        if n_seeds is not None and n_seeds <= estimate.n_seeds:
            return "small", None
    if n_seeds is None:
        return "none", None
    # Rounded up, as looks are at whole tens.
    n_seeds = 10 * math.ceil(n_seeds / 10)
    return ("within_reach" if n_seeds <= reach else "beyond"), n_seeds


def _pronoun(questions: Sequence[object]) -> str:
    return "it" if len(questions) == 1 else "them"


def _named(questions: Sequence[tuple[Verdict, int | None]]) -> str:
    """Return the first of some questions with the seeds that each needs."""
    names = [
        verdict.question if n_seeds is None else f"{verdict.question}: {n_seeds}"
        for verdict, n_seeds in questions[:_MOST_NAMED]
    ]
    left = len(questions) - len(names)
    return ", ".join([*names, f"and {left} more"] if left else names)
