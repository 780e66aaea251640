"""A study that runs until it is clear: each comparison stops at the first look that decides it.

The looks are declared before the first run and alpha is spent over them, linearly, so that clear
cases stop early. At each look Holm's procedure steps down through what its family has not decided
yet, each step at the level that the spending gives for its share of alpha (Ye et al. 2013,
Statistics in Medicine 32). The interval is the repeated one of Jennison and Turnbull (1989): over
all looks together it holds the true value with 95 %, whatever made the comparison stop.

Everything follows from the outcomes, so a study that was killed goes on as if it had not been.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from swarm_logistics_env import spi
from swarm_logistics_env.grouping import grouped
from swarm_logistics_env.questions.comparison import CONFIDENCE, Arm, Comparison
from swarm_logistics_env.questions.plan import Plan
from swarm_logistics_env.spi.equivalence import ALPHA
from swarm_logistics_env.tasks.task import Case, Outcomes, Run

from .cell import Cell
from .verdict import Verdict, judge_one

MOST_SEEDS = 200
SPENDING: spi.Spending = "linear"


class Standing(NamedTuple):
    """The state of the comparisons of a study at its latest look.

    Attributes:
        verdicts: on every comparison, as it was when it stopped or at the last complete look.
        wanted: the runs that the next look needs; empty: everything is clear, or the most seeds
            are played.
        shared_seeds: number of seeds that every condition has, counted at the looks.
    """

    verdicts: tuple[Verdict, ...]
    wanted: tuple[Run, ...]
    shared_seeds: int


def standing(plan: Plan, outcomes: Outcomes) -> Standing:
    """Return the state of a plan's comparisons after these outcomes."""
    runs = _Looks(plan, outcomes)
    wanted, verdicts = runs.missing(plan.cases, runs.looks[0]), dict[Comparison, Verdict]()
    for members in grouped(plan.comparisons, lambda comparison: comparison.family).values():
        family = _Family(members, runs)
        wanted |= family.wanted
        verdicts |= family.judged()
    shared = [n_seeds for n_seeds in runs.looks if not runs.missing(plan.cases, n_seeds)]
    in_order = tuple(verdicts[comparison] for comparison in plan.comparisons)
    # Seed by seed, so that a study that is stopped early has something of every question.
    evenly = tuple(sorted(wanted.values(), key=lambda run: run.seed))
    return Standing(in_order, evenly, max(shared, default=runs.looks[0]))


class _Looks:
    """The outcomes of a plan, as far as each look sees them."""

    def __init__(self, plan: Plan, outcomes: Outcomes) -> None:
        self.plan, self.looks = plan, plan.specification.looks
        self._outcomes = outcomes

    def missing(self, cases: Iterable[Case], n_seeds: int) -> dict[str, Run]:
        """Return the runs of cases that are not played yet, by their keys."""
        runs = (Run(case, self.plan.code, s) for case in cases for s in self.plan.seeds[:n_seeds])
        return {run.key: run for run in runs if (run.case.key, run.seed) not in self._outcomes}

    def judged(self, comparisons: Iterable[Comparison], n_seeds: int) -> dict[Comparison, Verdict]:
        """Judge comparisons at a look, as far as it is played."""
        # Each test spends its own error: 5 % on both sides of a threshold, and as much on each
        # side of the margin.
        confidence = 1 - self.alpha(n_seeds, 1 - CONFIDENCE)
        alpha = self.alpha(n_seeds, 2 * ALPHA) / 2
        margin, found = self.plan.specification.margin, dict[Comparison, Verdict]()
        for comparison in comparisons:
            cells = self._cells(comparison, n_seeds)
            found[comparison] = judge_one(
                comparison, cells, paired=True, margin=margin, confidence=confidence, alpha=alpha
            )
        return found

    def _cells(self, comparison: Comparison, n_seeds: int) -> dict[Arm, Cell]:
        seeds, arms, known = self.plan.seeds[:n_seeds], comparison.arms, self._outcomes
        # Before the first look is complete, the seeds of all arms tell a value and no verdict.
        there = [seed for seed in seeds if all((arm.case.key, seed) in known for arm in arms)]
        return {
            arm: Cell.of("", "", arm, [known.get((arm.case.key, s)) for s in there or seeds])
            for arm in arms
        }

    def alpha(self, n_seeds: int, alpha: float) -> float:
        """Return what is spent of an error up to the look at `n_seeds`, or the next one."""
        spent = spi.look_alphas(self.looks, alpha, spending=SPENDING)
        return spent[bisect_left(self.looks, n_seeds)]


class _Family:
    """The comparisons of one indicator for one policy, judged look after look.

    Attributes:
        wanted: the runs that its next look needs and that are not played yet, by their keys.
    """

    def __init__(self, members: Sequence[Comparison], runs: _Looks) -> None:
        self.wanted: dict[str, Run] = {}
        self._runs, self._open = runs, list(members)
        self._found: dict[Comparison, Verdict] = {}
        for n_seeds in runs.looks:
            # A failed run blocks a comparison in this call: it stays in the family, without seeds.
            playing = [c for c in self._open if c not in self._found or self._found[c].estimate]
            self.wanted = runs.missing([arm.case for c in playing for arm in c.arms], n_seeds)
            if not (self.wanted and self._found):
                self._found |= runs.judged(playing, n_seeds)
            if self.wanted:
                break
            self._stop_clear_ones(n_seeds)

    def _stop_clear_ones(self, n_seeds: int) -> None:
        """Note p on the scale on which 0.05 decides, and stop by Holm's steps, smallest p first."""
        tested = list[tuple[float, Comparison, spi.Estimate]]()
        for comparison in list(self._open):
            estimate = self._found[comparison].estimate
            if estimate and (
                estimate.identical or estimate.untestable
            ):  # nothing to test, at any number of seeds
                self._stop(comparison, n_seeds)
            elif estimate and estimate.p_value is not None:
                tested.append((estimate.p_value, comparison, estimate))
        for p, comparison, estimate in sorted(tested, key=lambda one: one[0]):
            # Once one stays open the level stays as it is, and every larger p is above it.
            level = self._runs.alpha(n_seeds, (1 - CONFIDENCE) / len(self._open))
            is_clear = p < level
            self._found[comparison] = replace(
                self._found[comparison],
                p_holm=min(1.0, p * (1 - CONFIDENCE) / level),
                verdict_holm=estimate.verdict_for(p) if is_clear else "inconclusive",
            )
            if is_clear:
                self._stop(comparison, n_seeds)

    def _stop(self, comparison: Comparison, n_seeds: int) -> None:
        self._open.remove(comparison)
        self._found[comparison] = replace(self._found[comparison], stopped_at=n_seeds)

    def judged(self) -> dict[Comparison, Verdict]:
        """Return every comparison, with the equivalences under Holm, each at its own look."""
        tests = {c: one.equivalence for c, one in self._found.items() if one.equivalence}
        if len(tests) < len(self._found):  # not asked, or one is blocked
            return self._found
        left = {c: test for c, test in tests.items() if not test.identical}

        def ratio(comparison: Comparison) -> float:
            """Return p as a multiple of the level that it needs."""
            p, n_seeds = left[comparison].p_value, left[comparison].change.n_seeds
            return 1.0 if p is None else p / self._runs.alpha(n_seeds, 2 * ALPHA / len(left)) * 2

        while left and ratio(first := min(left, key=ratio)) < 1.0:
            del left[first]
        for comparison, test in tests.items():
            verdict = "inconclusive" if comparison in left else test.verdict
            self._found[comparison] = replace(self._found[comparison], equivalence_holm=verdict)
        return self._found
