"""The tables of the pages that answer a question of the field, from the results of its study."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from tables import table

from swarm_logistics_env import spi
from swarm_logistics_env.report import wording
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.spi.summaries import Interval, t_interval
from swarm_logistics_env.spi.verdict_signs import SIGNS
from swarm_logistics_env.studies.comparisons import Arm
from swarm_logistics_env.studies.indicator_table import Finding
from swarm_logistics_env.studies.performance_table import Cell, rows_of
from swarm_logistics_env.studies.policy_comparison import (
    cells_against_baseline,
    indicators_against_baseline,
    jackknife_interval,
    judged_policies,
)
from swarm_logistics_env.studies.results import StudyResults

LEGEND = (
    f"{SIGNS['supported'].mark} above the threshold, {SIGNS['refuted'].mark} below it, "
    f"{SIGNS['equivalent'].mark} open there but P within a tenth of P_o, "
    f"{SIGNS['inconclusive'].mark} open, {SIGNS['unaffected'].mark} the same runs; under Holm"
)


def over(found: StudyResults) -> str:
    """Return over which seeds a table is."""
    seeds = found.plan.seeds
    return f"{len(seeds)} paired seeds from {seeds[0]:,} on"


def with_sign(test: Finding) -> str:
    """Return an indicator with its interval and the sign of its verdict."""
    known = "unaffected" if test.verdict == "unaffected" else test.conclusion or "blocked"
    return f"{wording.ratio(test)} {SIGNS[known].mark}"


Judged = tuple[StudyResults, Finding]


def difference(one: Judged, other: Judged) -> Interval:
    """Return how much an indicator is above another over the same seeds, with its interval."""
    seeds, others = (judged[0].plan.seeds for judged in (one, other))
    assert list(seeds) == list(others)

    def value(judged: Judged, some: NDArray[np.intp]) -> float:
        results, test = judged
        key = test.policy, test.table
        estimate = test.compared.estimate(lambda arm: results.by_arm[*key, arm].by_seed[some])
        return float(estimate.value)

    return jackknife_interval(len(seeds), lambda some: value(one, some) - value(other, some))


# -- policies side by side ----------------------------------------------------------------------


def side_by_side(found: StudyResults) -> str:
    """Return P and the indicators of every policy, a column a policy."""
    rows: dict[str, dict[str, str]] = {}
    for label, cell, _ in performances(found):
        rows.setdefault(label, {})[cell.policy] = wording.mean_p(cell)
    for asked in indicators_against_baseline(found):
        label = f"{asked.test.indicator}, {asked.test.comparison}"
        rows[label] = {policy: with_sign(own) for policy, own in asked.tests.items()}
    return f"{_columns(rows, judged_policies(found))}\n\n{over(found)}. [95 %]; {LEGEND}."


def differences(found: StudyResults) -> str:
    """Return how P and the indicators of every other policy differ from the first one's."""
    baseline, *others = judged_policies(found)
    rows: dict[str, dict[str, str]] = {}
    for label, cell, less in performances(found):
        rows.setdefault(label, {})[cell.policy] = wording.bracketed(less, 1)
    for asked in indicators_against_baseline(found):
        label = f"{asked.test.indicator}, {asked.test.comparison}"
        rows[label] = {
            policy: f"{wording.bracketed(less, 3)} {_side(less)}"
            for policy, less in asked.differences.items()
        }
    heads = [f"`{policy}` less `{baseline}`" for policy in others]
    return (
        f"{_columns(rows, others, heads)}\n\n[95 %], paired by seed, unadjusted. An indicator is "
        "higher or lower if its interval is clear of 0."
    )


def performances(found: StudyResults) -> Iterator[tuple[str, Cell, Interval | None]]:
    """Yield label, row and difference of P, each condition once and those with faults not."""
    labels: dict[str, str] = {}
    cells = [one for own in cells_against_baseline(found).values() for one in own]
    for one in sorted(cells, key=lambda one: one.cell.kind != "size"):
        setting, key = one.cell.arm.setting, one.cell.arm.condition.key
        if (setting.kind == "fault" and setting.value) or key in labels:
            continue
        labels[key] = f"P, {setting}"
        yield labels[key], one.cell, one.difference


def _columns(
    rows: Mapping[str, Mapping[str, str]], policies: Sequence[str], heads: Sequence[str] = ()
) -> str:
    body = [(label, *(row.get(policy, "") for policy in policies)) for label, row in rows.items()]
    return table(("", *(heads or [f"`{policy}`" for policy in policies])), body)


def _side(difference: Interval | None) -> str:
    if difference is None or difference.low is None or difference.high is None:
        return "open"
    return "higher" if difference.low > 0 else "lower" if difference.high < 0 else "open"


# -- larger swarms ------------------------------------------------------------------------------


def by_size(found: StudyResults) -> str:
    """Return R of every failure mode against N, and its change from the first N to the last."""
    tests: dict[tuple[str, str], list[Finding]] = {}
    for test in rows_of(found.indicators):
        if test.indicator == "R":
            tests.setdefault((test.policy, test.factor), []).append(test)
    sizes = [test.n_robots for test in next(iter(tests.values()))]
    head = ("policy", "mode", *(f"N = {n}" for n in sizes), f"N = {sizes[-1]} less N = {sizes[0]}")
    body = [
        (
            f"`{policy}`",
            mode,
            *map(with_sign, own),
            wording.bracketed(difference((found, own[-1]), (found, own[0])), 3),
        )
        for (policy, mode), own in tests.items()
    ]
    return table(head, body)


def performances_by_size(found: StudyResults) -> str:
    """Return P, P for each robot, and S of every policy against N."""
    cells: dict[str, list[Cell]] = {}
    for cell in rows_of(found.performance):
        if cell.kind == "size":
            cells.setdefault(cell.policy, []).append(cell)
    sizes = [cell.n_robots for cell in next(iter(cells.values()))]
    body = []
    for policy, own in cells.items():
        body.append((f"P, `{policy}`", *map(wording.mean_p, own)))
        body.append((f"P / N, `{policy}`", *(f"{c.mean / c.n_robots:.2f}" for c in own)))
        steps = [
            with_sign(test)
            for test in rows_of(found.indicators)
            if (test.policy, test.indicator) == (policy, "S")
        ]
        body.append((f"S up to this N, `{policy}`", "", *steps))
    return table(("", *(f"N = {n}" for n in sizes)), body)


# -- wear and repair ----------------------------------------------------------------------------

REPAIRED_AT = 200.0  # [s]: failed at 100 s, for 100 s


def repaired_tests(found: StudyResults) -> Iterator[tuple[Finding, Finding]]:
    """Yield each fault that stays until the end with the same one that is repaired."""
    tests = {
        (test.policy, test.factor, test.table): test
        for test in rows_of(found.indicators)
        if test.onset
    }
    for (policy, mode, where), repaired in tests.items():
        if where.startswith("Repaired"):
            yield tests[policy, mode, "Not repaired"], repaired


def repairs(found: StudyResults) -> str:
    """Return what a repair brings."""
    body = []
    for tests in repaired_tests(found):
        gain = spi.relative_change(*(_by_seed(found, one, one.compared.changed) for one in tests))
        named = f"`{tests[0].policy}`", tests[0].factor
        body.append((*named, *map(with_sign, tests), _share(gain)))
    head = ("policy", "mode", "R, not repaired", "R, repaired", "the repair adds to P [%]")
    return table(head, body)


def after_repairs(found: StudyResults) -> str:
    """Return whether anything of a fault is left after its repair."""
    body = []
    for tests in repaired_tests(found):
        whole = deliveries_after(found, tests[0].compared.original)
        after = [deliveries_after(found, test.compared.changed) for test in tests]
        left = [spi.relative_change(whole, counts) for counts in after]
        back = spi.equivalence(whole, after[1], margin=found.plan.specification.margin)
        named = f"`{tests[0].policy}`", tests[0].factor
        body.append((*named, *map(_share, left), back.verdict))
    return table(("policy", "mode", "not repaired [%]", "repaired [%]", "all back"), body)


def _by_seed(found: StudyResults, test: Finding, arm: Arm) -> NDArray[np.float64]:
    counts: NDArray[np.float64] = found.by_arm[test.policy, test.table, arm].by_seed
    return counts


def deliveries_after(found: StudyResults, arm: Arm) -> NDArray[np.float64]:
    """Return the deliveries of every seed after the repair, shape (n_seeds,)."""
    times = found.times_of(arm)
    assert times is not None  # the study has been played
    return np.array([np.count_nonzero(run > REPAIRED_AT) for run in times], dtype=np.float64)


def _share(change: Estimate) -> str:
    """Return a relative change in percent."""
    return wording.bracketed(
        Interval(*(100 * (x or 0.0) for x in (change.value, change.low, change.high))), 1
    )


def wear(found: StudyResults) -> str:
    """Return R and the change of P, of wearing motors and of motors slow from the start."""
    body = []
    for test in rows_of(found.indicators):
        if test.table == "Wear":
            whole, worn = (
                _by_seed(found, test, arm)
                for arm in (test.compared.original, test.compared.changed)
            )
            change = _share(spi.relative_change(whole, worn))
            body.append((f"`{test.policy}`", test.comparison, with_sign(test), change))
    return table(("policy", "worn robots", "R", "change of P [%]"), body)


# -- mixed swarms -------------------------------------------------------------------------------


def replacements(found: StudyResults) -> list[tuple[str, ...]]:
    """Return the policies from each pure swarm to the next one, the mixes between them."""
    policies = judged_policies(found)
    names = [str(getattr(one, "name", one)) for one in found.plan.specification.policies]
    pure = [place for place, name in enumerate(names) if "=" not in name]
    ends = sorted({0, *pure, len(policies) - 1})
    return [policies[first : last + 1] for first, last in itertools.pairwise(ends)]


def shares(found: StudyResults) -> str:
    """Return P and R by share, the step from share to share, and what the mix adds to its parts."""
    p = {
        cell.policy: cell for cell in rows_of(found.performance) if cell.arm.setting.name == "none"
    }
    tests = {(test.policy, test.comparison): test for test in rows_of(found.indicators)}
    asked = list(dict.fromkeys(comparison for _, comparison in tests))
    policies = judged_policies(found)
    steps = [
        spi.relative_change(p[before].by_seed, p[after].by_seed)
        for before, after in itertools.pairwise(policies)
    ]
    told = {
        policy: f"{_share(step)} {SIGNS[verdict].mark}"
        for policy, step, verdict in zip(policies[1:], steps, spi.adjust(steps))
    }
    more = {}
    for own in replacements(found):
        first, last = (p[own[place]].by_seed for place in (0, -1))
        for place, policy in enumerate(own[1:-1], 1):
            part = place / (len(own) - 1)
            beyond = p[policy].by_seed - (1 - part) * first - part * last
            more[policy] = wording.bracketed(t_interval(beyond), 1)
    body = [
        (
            f"`{policy}`",
            wording.mean_p(p[policy]),
            told.get(policy, ""),
            more.get(policy, ""),
            *(with_sign(tests[policy, comparison]) for comparison in asked),
        )
        for policy in policies
    ]
    head = ("", "P", "step [%]", "P less the straight line", *(f"R, {one}" for one in asked))
    return table(head, body)


# -- two studies of the same questions ----------------------------------------------------------


def beside_another_world(found: StudyResults, ideal: StudyResults) -> str:
    """Return what each policy loses from one study's world to the other's, paired by seed."""
    body = list(_lost(found, ideal))
    return table(("policy", "", "ideal", "realistic", "realistic less ideal"), body)


def _lost(found: StudyResults, ideal: StudyResults) -> Iterator[tuple[str, ...]]:
    before = {
        (cell.policy, cell.arm.setting): cell
        for cell in rows_of(ideal.performance)
        if cell.kind == "size"
    }
    for cell in rows_of(found.performance):
        known = before.get((cell.policy, cell.arm.setting))
        if known is not None:
            change = spi.relative_change(known.by_seed, cell.by_seed)
            means = wording.mean_p(known), wording.mean_p(cell)
            yield f"`{cell.policy}`", f"P, {cell.cell}", *means, f"{_share(change)} %"
    asked = {(test.policy, test.compared.question): test for test in rows_of(ideal.indicators)}
    for test in rows_of(found.indicators):
        same = asked.get((test.policy, test.compared.question))
        if same is not None and test.indicator == "R":
            less = difference((found, test), (ideal, same))
            label = f"{test.indicator}, {test.comparison}"
            values = with_sign(same), with_sign(test)
            yield f"`{test.policy}`", label, *values, wording.bracketed(less, 3)
