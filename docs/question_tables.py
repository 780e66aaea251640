"""The tables of the page that answers questions of the field, from the results of its studies."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from tables import by_policy, seeds_from, table

from swarm_logistics_env import spi
from swarm_logistics_env.grouping import grouped
from swarm_logistics_env.report import section
from swarm_logistics_env.spi.summaries import Interval, t_interval
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.verdicts.verdict import Verdict

Counts = NDArray[np.float64]  # of every seed, or of every training and seed


def with_verdict(test: Verdict) -> str:
    """Return an indicator with its interval and its verdict."""
    return f"{section.ratio(test)} {section.concluded(test)}"


def _over(found: StudyResults) -> str:
    return f"{seeds_from(found, 'paired seeds')}. [95 %]."


def _change(before: Counts, after: Counts) -> str:
    """Return the relative change of P in percent."""
    change = spi.relative_change(before, after)
    limits = (None if x is None else 100 * x for x in (change.low, change.high))
    return section.bracketed(Interval(100 * change.value, *limits), 1)


def difference(found: StudyResults, one: Verdict, other: Verdict) -> Interval:
    """Return how much an indicator is above another over the same seeds, with its interval."""

    def value(test: Verdict, some: NDArray[np.intp]) -> float:
        cells = found.cells_of(test.compared)
        return test.compared.estimate({arm: c.by_seed[some] for arm, c in cells.items()}).value

    n_seeds = len(found.plan.seeds)
    return jackknife_interval(n_seeds, lambda some: value(one, some) - value(other, some))


def jackknife_interval(n_seeds: int, statistic: Callable[[NDArray[np.intp]], float]) -> Interval:
    """Return a statistic of seeds with the 95 % t-interval of its jackknife (Tukey 1958)."""
    seeds = np.arange(n_seeds)
    value = statistic(seeds)
    left_out = np.array([statistic(np.delete(seeds, seed)) for seed in seeds])
    pseudo, low, high = t_interval(n_seeds * value - (n_seeds - 1) * left_out)
    limits = (None if limit is None else limit - pseudo + value for limit in (low, high))
    return Interval(value, *limits)


def side_by_side(found: StudyResults) -> str:
    """Return P and the indicators of every policy, a column a policy."""
    cells = [c for c in found.cells if c.arm.setting.kind != "policy" and not c.arm.case.faults]
    # A case may stand in several tables; that of sizes names it.
    cells.sort(key=lambda one: one.arm.setting.kind != "size")
    once = [alike[0] for alike in grouped(cells, lambda cell: cell.arm.case.key).values()]
    compared = [one for one in found.verdicts if one.after.kind != "policy"]
    questions = grouped(compared, lambda v: (v.compared.table, v.compared.question)).values()
    of_all = [test for own in questions if len(own) > 1 for test in own]
    return f"{by_policy(found.policies, once, of_all, with_verdict)}\n\n{_over(found)}"


def by_size(found: StudyResults) -> str:
    """Return R of every failure mode against N, and its change from the first N to the last."""
    robustness = [test for test in found.verdicts if test.compared.indicator == "R"]
    tests = grouped(robustness, lambda test: (test.compared.policy, test.after.name))
    sizes = [test.compared.n_robots for test in next(iter(tests.values()))]
    head = ("policy", "mode", *(f"N = {n}" for n in sizes), f"N = {sizes[-1]} less N = {sizes[0]}")
    body = []
    for (policy, mode), own in tests.items():
        more = section.bracketed(difference(found, own[-1], own[0]), 3)
        body.append((f"`{policy}`", mode, *map(with_verdict, own), more))
    note = "The last column is paired by seed and unadjusted."
    return f"{table(head, body)}\n\n{_over(found)} {note}"


def performances_by_size(found: StudyResults) -> str:
    """Return P, P for each robot, and S of every policy against N."""
    cells = [cell for cell in found.cells if cell.arm.setting.kind == "size"]
    sizes = dict.fromkeys(cell.arm.setting.value for cell in cells)
    body = []
    for policy, own in grouped(cells, lambda cell: cell.policy).items():
        each = (f"{c.mean.value / c.arm.setting.value:.2f}" for c in own)
        steps = [test for test in found.verdicts if test.compared.family == (policy, "S")]
        body += [
            (f"P, `{policy}`", *map(section.mean_p, own)),
            (f"P / N, `{policy}`", *each),
            (f"S up to this N, `{policy}`", "", *map(with_verdict, steps)),
        ]
    return table(("", *(f"N = {n:g}" for n in sizes)), body)


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
        gain = _change(*(found.cells_of(t.compared)[t.compared.changed].by_seed for t in tests))
        body.append((policy, mode, *map(with_verdict, tests), gain))
    head = ("policy", "mode", "R, not repaired", "R, repaired", "the repair adds to P [%]")
    return table(head, body)


def after_repairs(found: StudyResults) -> str:
    """Return whether anything of a fault is left after its repair."""
    margin, body = found.plan.specification.margin, []
    for policy, mode, tests in repaired_tests(found):
        arms = tests[0].compared.original, *(test.compared.changed for test in tests)
        whole, *after = (
            np.array([np.count_nonzero(run > REPAIRED_AT) for run in found.times_of(arm)]) * 1.0
            for arm in arms
        )
        back = spi.equivalence(whole, after[1], margin=margin).verdict
        body.append((policy, mode, *(_change(whole, counts) for counts in after), back))
    head = ("policy", "mode", "not repaired [%]", "repaired [%]", "all back")
    return f"{table(head, body)}\n\n{_over(found)}"


def wear(found: StudyResults) -> str:
    """Return R and the change of P, of wearing motors and of motors slow from the start."""
    body = []
    for test in found.verdicts:
        if test.compared.table == "Wear":
            cells, asked_of = found.cells_of(test.compared), test.compared
            change = _change(*(cells[a].by_seed for a in (asked_of.original, asked_of.changed)))
            body.append((f"`{asked_of.policy}`", asked_of.label, with_verdict(test), change))
    return table(("policy", "worn robots", "R", "change of P [%]"), body)


def beside_another_world(found: StudyResults, ideal: StudyResults) -> str:
    """Return what each policy loses from one study's world to the other's, paired by seed."""
    before = {(cell.policy, cell.arm.setting): cell for cell in ideal.cells}
    body = []
    for cell in found.cells:
        known = before.get((cell.policy, cell.arm.setting))
        if known is not None and cell.arm.setting.kind == "size":
            change = f"{_change(known.by_seed, cell.by_seed)} %"
            means = section.mean_p(known), section.mean_p(cell)
            body.append((f"`{cell.policy}`", f"P, {cell.words}", *means, change))
    return table(("policy", "", "ideal", "realistic", "change"), body)
