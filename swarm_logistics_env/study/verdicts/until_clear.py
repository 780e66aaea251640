"""A study that runs until it is clear: each comparison stops at the first look that decides it.

The looks are declared before the first run and alpha is spent over them, linearly, so that clear
cases stop early. At each look Holm's procedure steps down through what its family has not decided
yet, each step at the level that the spending gives for its share of alpha (Ye et al. 2013,
Statistics in Medicine 32). The interval is the repeated one of Jennison and Turnbull (1989): over
all looks together it holds the true value with 95 %, whatever made the comparison stop.

A comparison is also played no further once its verdict can hardly change any more: the predictive
power, the chance that the last look decides it given the runs so far, is below 10 % (Spiegelhalter,
Freedman and Blackburn 1986, Controlled Clinical Trials 7). Nor is one played further whose change
is shown to be within the margin: which sign so small a change has is not worth the runs. Both stay
open, and in their family, so this costs no error.

Everything follows from the outcomes, so a study that was killed goes on as if it had not been.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

from more_itertools import map_reduce

from swarm_logistics_env import spi
from swarm_logistics_env.spi.equivalence import ALPHA
from swarm_logistics_env.study.questions.comparison import CONFIDENCE, Arm, Comparison, Family
from swarm_logistics_env.study.questions.plan import Plan
from swarm_logistics_env.study.tasks.task import Case, Outcomes, Run

from .cell import Cell
from .verdict import UNTESTABLE, Decision, Verdict, judge_comparison

MOST_SEEDS_UNTIL_CLEAR = 200
HARDLY = 0.1  # chance of a verdict below which no further seed is played


class LatestLook(NamedTuple):
    """The state of the comparisons of a study at its latest look.

    Attributes:
        verdicts: on every comparison, as it was when it stopped or at the last complete look.
        next_runs: the runs that the next look needs; empty: everything is clear, or the most seeds
            are played.
        n_most: how many runs are left at most: if nothing that is open becomes clear before all
            seeds are played.
        shared_runs: those of them that the first look needs of the condition that most comparisons
            of a policy share.
        seeds_of: number of seeds that a condition has, counted at the looks, by its key.
    """

    verdicts: tuple[Verdict, ...]
    next_runs: tuple[Run, ...]
    n_most: int
    shared_runs: tuple[Run, ...]
    seeds_of: Mapping[str, int]

    @property
    def shared_seeds(self) -> int:
        """Number of seeds that every condition has."""
        return min(self.seeds_of.values())


Judged: TypeAlias = dict[tuple[Comparison, int], Verdict]  # by the comparison and its seeds


def latest_look(plan: Plan, outcomes: Outcomes, judged: Judged | None = None) -> LatestLook:
    """Return the state of a plan's comparisons after these outcomes.

    Args:
        judged: verdicts of looks whose runs are all there, of this plan: they are not computed
            again, and new ones are added.
    """
    looks = _Looks(plan, outcomes, {} if judged is None else judged)
    next_runs = looks.missing(plan.cases, looks.seeds[0])
    shared_runs = looks.missing(_shared_cases(plan), looks.seeds[0])
    last_runs = dict(next_runs)
    verdicts = dict[Comparison, Verdict]()
    families: dict[Family, list[Comparison]] = map_reduce(
        plan.comparisons, lambda comparison: comparison.family
    )
    for comparisons in families.values():
        family = _Family(comparisons, looks)
        next_runs |= family.next_runs
        last_runs |= family.last_runs
        verdicts |= family.verdicts()
    return LatestLook(
        tuple(verdicts[comparison] for comparison in plan.comparisons),
        # Seed by seed, so that a study that is stopped early has something of every question.
        tuple(sorted(next_runs.values(), key=lambda run: run.seed)),
        len(last_runs),
        tuple(shared_runs.values()),
        {case.key: looks.seeds_of(case) for case in plan.cases},
    )


def _shared_cases(plan: Plan) -> list[Case]:
    """Return, of each policy, the condition that most of its comparisons share."""
    uses = Counter(arm.case.key for comparison in plan.comparisons for arm in comparison.arms)
    cases = {case.key: case for case in plan.cases}
    most_used: dict[str, Case] = {}
    for key, _ in uses.most_common():
        most_used.setdefault(cases[key].policy.title, cases[key])
    return list(most_used.values())


class _Looks:
    """The outcomes of a plan, as far as each look sees them.

    Attributes:
        seeds: the numbers of seeds at which comparisons may stop.
    """

    def __init__(self, plan: Plan, outcomes: Outcomes, judged: Judged) -> None:
        self.seeds = plan.specification.looks
        self._plan = plan
        self._outcomes = outcomes
        self._judged = judged

    def missing(self, cases: Iterable[Case], n_seeds: int) -> dict[str, Run]:
        """Return the runs of cases that are not played yet, by their keys."""
        seeds = self._plan.seeds[:n_seeds]
        runs = (Run(case, self._plan.code, seed) for case in cases for seed in seeds)
        return {run.key: run for run in runs if (run.case.key, run.seed) not in self._outcomes}

    def seeds_of(self, case: Case) -> int:
        """Return the number of seeds of the latest look that a condition is complete for."""
        complete = [n_seeds for n_seeds in self.seeds if not self.missing([case], n_seeds)]
        return max(complete, default=self.seeds[0])

    def judge(self, comparisons: Iterable[Comparison], n_seeds: int) -> dict[Comparison, Verdict]:
        """Judge comparisons at a look, as far as it is played."""
        return {comparison: self._verdict(comparison, n_seeds) for comparison in comparisons}

    def _verdict(self, comparison: Comparison, n_seeds: int) -> Verdict:
        if (comparison, n_seeds) in self._judged:
            return self._judged[comparison, n_seeds]
        cells = self._cells(comparison, n_seeds)
        # Each test spends its own error: 5 % on both sides of a threshold, and as much on each
        # side of the margin.
        verdict = judge_comparison(
            comparison,
            cells,
            paired=True,
            margin=self._plan.specification.margin,
            confidence=1 - self.alpha(n_seeds, 1 - CONFIDENCE),
            alpha=self.alpha(n_seeds, 2 * ALPHA) / 2,
        )
        if all(cell.n_seeds == n_seeds for cell in cells.values()):  # without one that failed
            self._judged[comparison, n_seeds] = verdict
        return verdict

    def _cells(self, comparison: Comparison, n_seeds: int) -> dict[Arm, Cell]:
        seeds = self._plan.seeds[:n_seeds]
        keys = [arm.case.key for arm in comparison.arms]
        complete = [seed for seed in seeds if all((key, seed) in self._outcomes for key in keys)]
        # Before the first look is complete, the seeds of all arms tell a value and no verdict.
        seeds = complete or seeds
        return {
            arm: Cell.of("", "", arm, [self._outcomes.get((arm.case.key, seed)) for seed in seeds])
            for arm in comparison.arms
        }

    def alpha(self, n_seeds: int, alpha: float) -> float:
        """Return what is spent of an error up to the look at `n_seeds`, or the next one."""
        spent = spi.look_alphas(self.seeds, alpha)
        return spent[bisect_left(self.seeds, n_seeds)]


class _Family:
    """The comparisons of one indicator for one policy, judged look after look.

    Attributes:
        next_runs: the runs that its next look needs and that are not played yet, by their keys.
        last_runs: those that its last look needs, if nothing is clear before.
    """

    def __init__(self, comparisons: Sequence[Comparison], looks: _Looks) -> None:
        self.next_runs: dict[str, Run] = {}
        self.last_runs: dict[str, Run] = {}
        self._looks = looks
        self._open = list(comparisons)
        self._playing = list(comparisons)  # those of them whose verdict may still change
        self._verdicts: dict[Comparison, Verdict] = {}
        for n_seeds in looks.seeds:
            playing = [
                comparison for comparison in self._playing if not self._is_undefined(comparison)
            ]
            cases = [arm.case for comparison in playing for arm in comparison.arms]
            self.next_runs = looks.missing(cases, n_seeds)
            is_first = not self._verdicts
            if is_first or not self.next_runs:
                self._verdicts |= looks.judge(playing, n_seeds)
            if self.next_runs:
                self.last_runs = looks.missing(cases, looks.seeds[-1])
                break
            self._stop_clear_ones(n_seeds)
            self._playing = [comparison for comparison in self._playing if comparison in self._open]
            if n_seeds < looks.seeds[-1]:
                self._give_up_hopeless_ones(n_seeds)

    def _is_undefined(self, comparison: Comparison) -> bool:
        # A failed run ends a comparison in this call: it stays in the family, without seeds.
        return comparison in self._verdicts and self._verdicts[comparison].estimate is None

    def _stop_clear_ones(self, n_seeds: int) -> None:
        """Note p on the scale on which 0.05 decides, and stop by Holm's steps, smallest p first."""
        p_values = dict[Comparison, float]()
        for comparison in list(self._playing):
            estimate = self._verdicts[comparison].estimate
            if estimate is None:
                continue
            if estimate.identical or "cannot_fail" in estimate.flags:
                self._stop(comparison, n_seeds)  # nothing to test, at any number of seeds
            elif estimate.p_value is not None:
                p_values[comparison] = estimate.p_value
        for comparison, p in sorted(p_values.items(), key=lambda item: item[1]):
            # Once one stays open the level stays as it is, and every larger p is above it.
            level = self._looks.alpha(n_seeds, (1 - CONFIDENCE) / len(self._open))
            is_clear = p < level
            verdict = self._verdicts[comparison]
            plain = verdict.on_threshold.plain
            self._verdicts[comparison] = replace(
                verdict,
                p_adjusted=min(1.0, p * (1 - CONFIDENCE) / level),
                on_threshold=Decision(plain, plain if is_clear else "open"),
            )
            if is_clear:
                self._stop(comparison, n_seeds)

    def _give_up_hopeless_ones(self, n_seeds: int) -> None:
        """Play no further, and note why, what the last look can hardly decide."""
        for comparison in list(self._playing):
            if reason := self._why_given_up(comparison, n_seeds):
                self._playing.remove(comparison)
                self._verdicts[comparison] = replace(self._verdicts[comparison], given_up=reason)

    def _why_given_up(self, comparison: Comparison, n_seeds: int) -> str:
        """Return why a comparison that is open at a look stays so; empty: the last may decide."""
        verdict = self._verdicts[comparison]
        if verdict.estimate is None:
            return ""
        if verdict.estimate.untestable:
            return UNTESTABLE
        if self._is_equivalent(verdict, n_seeds):
            return "margin"
        most = self._looks.seeds[-1]
        p = verdict.estimate.p_value
        # Of both sides, that on which the value lies.
        tests = [(p and p / 2, self._looks.alpha(most, 1 - CONFIDENCE) / 2)]
        if verdict.equivalence and not verdict.equivalence.identical:
            tests.append((verdict.equivalence.p_value, self._looks.alpha(most, 2 * ALPHA) / 2))
        may_be_clear = any(
            p is None or predictive_power(p, n_seeds, most, error / len(self._open)) >= HARDLY
            for p, error in tests  # None: one seed tells nothing yet
        )
        return "" if may_be_clear else "hardly"

    def _is_equivalent(self, verdict: Verdict, n_seeds: int) -> bool:
        """Return whether a look shows equivalence at the level that holds for a whole family."""
        test = verdict.equivalence
        if test is None or test.identical or test.p_value is None:
            return False
        level = self._looks.alpha(n_seeds, 2 * ALPHA / len(self._verdicts)) / 2
        return test.verdict == "equivalent" and test.p_value < level

    def _stop(self, comparison: Comparison, n_seeds: int) -> None:
        self._open.remove(comparison)
        self._verdicts[comparison] = replace(self._verdicts[comparison], stopped_at=n_seeds)

    def verdicts(self) -> dict[Comparison, Verdict]:
        """Return every verdict, with the equivalences under Holm, each at its own look."""
        tests = {
            comparison: verdict.equivalence
            for comparison, verdict in self._verdicts.items()
            if verdict.equivalence
        }
        if len(tests) < len(self._verdicts):  # S has none, or one is undefined
            return self._verdicts
        untold = {comparison: test for comparison, test in tests.items() if not test.identical}

        def multiple_of_level(comparison: Comparison) -> float:
            """Return p as a multiple of the level that it needs."""
            test = untold[comparison]
            if test.p_value is None:
                return 1.0
            # Both sides share the error that is spent, and Holm's step divides it.
            level = self._looks.alpha(test.change.n_seeds, 2 * ALPHA / len(untold)) / 2
            return test.p_value / level

        while untold:
            comparison = min(untold, key=multiple_of_level)
            if multiple_of_level(comparison) >= 1.0:
                break
            del untold[comparison]
        for comparison, test in tests.items():
            adjusted = "open" if comparison in untold else test.verdict
            self._verdicts[comparison] = replace(
                self._verdicts[comparison], on_equivalence=Decision(test.verdict, adjusted)
            )
        return self._verdicts


def predictive_power(p: float, n_seeds: int, most: int, alpha: float) -> float:
    """Return the chance that a test decides at the last look, given its p at this one.

    Any effect was as likely as any other before the first run.

    Args:
        p: of a one-sided test after `n_seeds`, in (0, 1].
        n_seeds, most: seeds now and at the last look.
        alpha: level of the test at the last look, one-sided.
    """
    from scipy.special import ndtr, ndtri

    if n_seeds >= most:
        return 0.0
    growth = most / n_seeds
    expected = -math.sqrt(growth) * ndtri(p)
    deviation = math.sqrt(growth - 1.0)
    return float(ndtr((expected + ndtri(alpha)) / deviation))
