"""The tables of the page that answers questions of the field, from the results of its studies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from tables import table

from swarm_logistics_env import spi
from swarm_logistics_env.report import section
from swarm_logistics_env.spi.estimate import SIGNS, Estimate
from swarm_logistics_env.spi.summaries import Interval, t_interval
from swarm_logistics_env.studies.comparison import Arm
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import Cell, Verdict, grouped

LEGEND = (
    "supported: above the threshold; refuted: below it; equivalent: open there, but P within a "
    "tenth of P_o; under Holm"
)


def over(found: StudyResults) -> str:
    """Return over which seeds a table is."""
    seeds = found.plan.seeds
    return f"{len(seeds)} paired seeds from {seeds[0]:,} on"


def with_verdict(test: Verdict) -> str:
    """Return an indicator with its interval and its verdict."""
    return f"{section.ratio(test)} {SIGNS[test.conclusion or 'blocked'].word}"


def asked(test: Verdict) -> str:
    """Return an indicator and what is changed."""
    return f"{test.compared.indicator}, {test.compared.label}"


Judged = tuple[StudyResults, Verdict]


def difference(one: Judged, other: Judged) -> Interval:
    """Return how much an indicator is above another over the same seeds, with its interval."""
    seeds, others = (judged[0].plan.seeds for judged in (one, other))
    assert list(seeds) == list(others)

    def value(judged: Judged, some: NDArray[np.intp]) -> float:
        results, compared = judged[0], judged[1].compared
        p = {arm: cell.by_seed[some] for arm, cell in results.cells_of(compared).items()}
        return compared.estimate(p).value

    return jackknife_interval(len(seeds), lambda some: value(one, some) - value(other, some))


def jackknife_interval(n_seeds: int, statistic: Callable[[NDArray[np.intp]], float]) -> Interval:
    """Return a statistic of seeds with the 95 % t-interval of its jackknife (Tukey 1958)."""
    seeds = np.arange(n_seeds)
    value = statistic(seeds)
    left_out = np.array([statistic(np.delete(seeds, seed)) for seed in seeds])
    pseudo, low, high = t_interval(n_seeds * value - (n_seeds - 1) * left_out)
    limits = (None if limit is None else limit - pseudo + value for limit in (low, high))
    return Interval(value, *limits)


# -- policies side by side ----------------------------------------------------------------------


def side_by_side(found: StudyResults) -> str:
    """Return P and the indicators of every policy, a column a policy."""
    rows: dict[str, dict[str, str]] = {}
    for label, cell in performances(found):
        rows.setdefault(label, {})[cell.policy] = section.mean_p(cell)
    for own in _of_all_policies(found):
        rows[asked(own[0])] = {test.compared.policy: with_verdict(test) for test in own}
    return f"{_columns(rows, found.policies)}\n\n{over(found)}. [95 %]; {LEGEND}."


def _of_all_policies(found: StudyResults) -> list[list[Verdict]]:
    """Return the verdicts on every question, one a policy, the first policy's first."""
    compared = [one for one in found.verdicts if one.after.kind != "policy"]
    questions = grouped(compared, lambda v: (v.compared.table, v.compared.question))
    return [own for own in questions.values() if len(own) > 1]


def performances(found: StudyResults) -> Iterator[tuple[str, Cell]]:
    """Yield label and cell of each condition without faults."""
    known: set[str] = set()
    cells = [c for c in found.cells if c.arm.setting.kind != "policy" and not c.arm.case.faults]
    by_condition = grouped(cells, lambda cell: (cell.table, cell.arm.setting))
    for (_, setting), own in sorted(by_condition.items(), key=lambda one: one[0][1].kind != "size"):
        for cell in own:
            if cell.arm.case.key not in known:
                known.add(cell.arm.case.key)
                yield f"P, {setting}", cell


def _columns(rows: Mapping[str, Mapping[str, str]], policies: Sequence[str]) -> str:
    body = [(label, *(row.get(policy, "") for policy in policies)) for label, row in rows.items()]
    return table(("", *(f"`{policy}`" for policy in policies)), body)


# -- larger swarms ------------------------------------------------------------------------------


def by_size(found: StudyResults) -> str:
    """Return R of every failure mode against N, and its change from the first N to the last."""
    robustness = [test for test in found.verdicts if test.compared.indicator == "R"]
    tests = grouped(robustness, lambda test: (test.compared.policy, test.after.name))
    sizes = [test.compared.n_robots for test in next(iter(tests.values()))]
    head = ("policy", "mode", *(f"N = {n}" for n in sizes), f"N = {sizes[-1]} less N = {sizes[0]}")
    body = [
        (
            f"`{policy}`",
            mode,
            *map(with_verdict, own),
            section.bracketed(difference((found, own[-1]), (found, own[0])), 3),
        )
        for (policy, mode), own in tests.items()
    ]
    return table(head, body)


def performances_by_size(found: StudyResults) -> str:
    """Return P, P for each robot, and S of every policy against N."""
    cells = [cell for cell in found.cells if cell.arm.setting.kind == "size"]
    sizes = dict.fromkeys(cell.arm.setting.value for cell in cells)
    body = []
    for policy, own in grouped(cells, lambda cell: cell.policy).items():
        body.append((f"P, `{policy}`", *map(section.mean_p, own)))
        each = (f"{c.mean.value / c.arm.setting.value:.2f}" for c in own)
        body.append((f"P / N, `{policy}`", *each))
        steps = [test for test in found.verdicts if test.compared.family == (policy, "S")]
        body.append((f"S up to this N, `{policy}`", "", *map(with_verdict, steps)))
    return table(("", *(f"N = {n:g}" for n in sizes)), body)


# -- wear and repair ----------------------------------------------------------------------------

REPAIRED_AT = 200.0  # [s]: failed at 100 s, for 100 s


def repaired_tests(found: StudyResults) -> Iterator[tuple[str, str, tuple[Verdict, Verdict]]]:
    """Yield policy, mode, and the fault that stays until the end with the one that is repaired."""
    late = [test for test in found.verdicts if test.after.onset]
    pairs = grouped(late, lambda test: (f"`{test.compared.policy}`", test.after.name))
    for (policy, mode), (stays, repaired) in pairs.items():
        yield policy, mode, (stays, repaired)


def repairs(found: StudyResults) -> str:
    """Return what a repair brings."""
    body = []
    for policy, mode, tests in repaired_tests(found):
        gain = spi.relative_change(*(_by_seed(found, one, one.compared.changed) for one in tests))
        body.append((policy, mode, *map(with_verdict, tests), _share(gain)))
    head = ("policy", "mode", "R, not repaired", "R, repaired", "the repair adds to P [%]")
    return table(head, body)


def after_repairs(found: StudyResults) -> str:
    """Return whether anything of a fault is left after its repair."""
    margin, body = found.plan.specification.margin, []
    for policy, mode, tests in repaired_tests(found):
        whole = deliveries_after(found, tests[0].compared.original)
        after = [deliveries_after(found, test.compared.changed) for test in tests]
        left = [spi.relative_change(whole, counts) for counts in after]
        back = section.said(spi.equivalence(whole, after[1], margin=margin).verdict)
        body.append((policy, mode, *map(_share, left), back))
    return table(("policy", "mode", "not repaired [%]", "repaired [%]", "all back"), body)


def _by_seed(found: StudyResults, test: Verdict, arm: Arm) -> NDArray[np.float64]:
    return found.by_place[test.compared.policy, test.compared.table, arm].by_seed


def deliveries_after(found: StudyResults, arm: Arm) -> NDArray[np.float64]:
    """Return the deliveries of every seed after the repair, shape (n_seeds,)."""
    times = found.times_of(arm)
    return np.array([np.count_nonzero(run > REPAIRED_AT) for run in times], dtype=np.float64)


def _share(change: Estimate) -> str:
    """Return a relative change in percent."""
    limits = (None if x is None else 100 * x for x in (change.low, change.high))
    return section.bracketed(Interval(100 * change.value, *limits), 1)


def wear(found: StudyResults) -> str:
    """Return R and the change of P, of wearing motors and of motors slow from the start."""
    body = []
    for test in found.verdicts:
        if test.compared.table == "Wear":
            arms = test.compared.original, test.compared.changed
            change = spi.relative_change(*(_by_seed(found, test, arm) for arm in arms))
            policy, label = test.compared.policy, test.compared.label
            body.append((f"`{policy}`", label, with_verdict(test), _share(change)))
    return table(("policy", "worn robots", "R", "change of P [%]"), body)


# -- two studies of the same questions ----------------------------------------------------------


def beside_another_world(found: StudyResults, ideal: StudyResults) -> str:
    """Return what each policy loses from one study's world to the other's, paired by seed."""
    before = {(cell.policy, cell.arm.setting): cell for cell in ideal.cells}
    body: list[tuple[str, ...]] = []
    for cell in found.cells:
        known = before.get((cell.policy, cell.arm.setting))
        if known is not None and cell.arm.setting.kind == "size":
            change = spi.relative_change(known.by_seed, cell.by_seed)
            means = section.mean_p(known), section.mean_p(cell)
            body.append((f"`{cell.policy}`", f"P, {cell.words}", *means, f"{_share(change)} %"))
    return table(("policy", "", "ideal", "realistic", "change"), body)
