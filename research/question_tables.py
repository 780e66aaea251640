"""The tables of the page that answers questions of the field, from the results of its studies."""

from collections.abc import Callable, Iterator

import numpy as np
from more_itertools import map_reduce
from numpy.typing import NDArray

from research.tables import by_policy, percent_change, seeds_from, table
from swarm_logistics_env import spi
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.spi.summaries import Interval, t_interval
from swarm_logistics_env.study.questions.comparison import Arm, Question
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict


def with_verdict(test: Verdict) -> str:
    """Return an indicator with its interval and its verdict."""
    return f"{section.ratio(test)} {test.in_words}"


def _seeds(results: StudyResults) -> str:
    return f"{seeds_from(results, 'paired seeds')}. [95 %]."


def _change(before: Numbers, after: Numbers) -> str:
    """Return the relative change of P in percent."""
    return section.bracketed(percent_change(before, after), 1)


def difference(results: StudyResults, upper: Verdict, lower: Verdict) -> Interval:
    """Return how much an indicator is above another over the same seeds, with its interval."""

    def value(test: Verdict, seeds: NDArray[np.intp]) -> float:
        samples = {arm: cell.by_seed[seeds] for arm, cell in test.cells.items()}
        return test.compared.estimate(samples).value

    n_seeds = len(results.plan.seeds)
    return jackknife_interval(n_seeds, lambda seeds: value(upper, seeds) - value(lower, seeds))


def jackknife_interval(n_seeds: int, statistic: Callable[[NDArray[np.intp]], float]) -> Interval:
    """Return a statistic of seeds with the 95 % t-interval of its jackknife (Tukey 1958)."""
    seeds = np.arange(n_seeds)
    value = statistic(seeds)
    without_each = np.array([statistic(np.delete(seeds, seed)) for seed in seeds])
    pseudo, low, high = t_interval(n_seeds * value - (n_seeds - 1) * without_each)
    limits = (None if limit is None else limit - pseudo + value for limit in (low, high))
    return Interval(value, *limits)


def side_by_side(results: StudyResults) -> str:
    """Return P and the indicators of every policy, a column a policy."""
    cells = [
        cell
        for cell in results.cells
        if cell.arm.setting.kind != "policy" and not cell.arm.case.faults
    ]
    # A case may stand in several tables; that of sizes names it.
    cells.sort(key=lambda cell: cell.arm.setting.kind != "size")
    by_case: dict[str, list[Cell]] = map_reduce(cells, lambda cell: cell.arm.case.key)
    distinct = [equal[0] for equal in by_case.values()]
    tests = [test for test in results.verdicts if test.after.kind != "policy"]
    questions: dict[tuple[str, Question], list[Verdict]] = map_reduce(
        tests, lambda test: (test.compared.table, test.compared.question)
    )
    asked_of_several = [test for alike in questions.values() if len(alike) > 1 for test in alike]
    return by_policy(results.policies, distinct, asked_of_several, with_verdict, _seeds(results))


def by_size(results: StudyResults) -> str:
    """Return R of every failure mode against N, and its change from the first N to the last."""
    robustness = [test for test in results.verdicts if test.compared.indicator == "R"]
    by_mode = map_reduce(robustness, lambda test: (test.compared.policy, test.after.name))
    sizes = [test.compared.n_robots for test in next(iter(by_mode.values()))]
    head = ("policy", "mode", *(f"N = {n}" for n in sizes), f"N = {sizes[-1]} less N = {sizes[0]}")
    body = []
    for (policy, mode), tests in by_mode.items():
        change = section.bracketed(difference(results, tests[-1], tests[0]), 3)
        body.append((f"`{policy}`", mode, *map(with_verdict, tests), change))
    note = "The last column is paired by seed and unadjusted."
    return table(head, body, f"{_seeds(results)} {note}")


def performances_by_size(results: StudyResults) -> str:
    """Return P, P for each robot, and S of every policy against N."""
    sized = [cell for cell in results.cells if cell.arm.setting.kind == "size"]
    sizes = dict.fromkeys(cell.arm.setting.value for cell in sized)
    body = []
    for policy, cells in map_reduce(sized, lambda cell: cell.policy).items():
        by_robot = (f"{cell.mean.value / cell.arm.setting.value:.2f}" for cell in cells)
        steps = [test for test in results.verdicts if test.compared.family == (policy, "S")]
        body += [
            (f"P, `{policy}`", *map(section.mean_p, cells)),
            (f"P / N, `{policy}`", *by_robot),
            (f"S up to this N, `{policy}`", "", *map(with_verdict, steps)),
        ]
    return table(("", *(f"N = {n:g}" for n in sizes)), body)


REPAIRED_AT = 200.0  # [s]: failed at 100 s, for 100 s


def repaired_tests(results: StudyResults) -> Iterator[tuple[str, str, tuple[Verdict, Verdict]]]:
    """Yield policy, mode, and the fault that stays until the end with the one that is repaired."""
    late = [test for test in results.verdicts if test.after.onset]
    pairs = map_reduce(late, lambda test: (f"`{test.compared.policy}`", test.after.name))
    for (policy, mode), (permanent, repaired) in pairs.items():
        yield policy, mode, (permanent, repaired)


def repairs(results: StudyResults) -> str:
    """Return what a repair brings."""
    body = []
    for policy, mode, tests in repaired_tests(results):
        samples = (test.cells[test.compared.changed].by_seed for test in tests)
        body.append((policy, mode, *map(with_verdict, tests), _change(*samples)))
    head = ("policy", "mode", "R, not repaired", "R, repaired", "the repair adds to P [%]")
    return table(head, body)


def after_repairs(results: StudyResults) -> str:
    """Return whether any effect of a fault remains after its repair."""
    margin = results.plan.specification.margin
    body = []
    for policy, mode, tests in repaired_tests(results):
        arms = tests[0].compared.original, *(test.compared.changed for test in tests)
        sound, broken, repaired = (_delivered_after_repair(results, arm) for arm in arms)
        equivalent = spi.equivalence(sound, repaired, margin=margin).verdict
        body.append((policy, mode, _change(sound, broken), _change(sound, repaired), equivalent))
    head = ("policy", "mode", "not repaired [%]", "repaired [%]", "all back")
    return table(head, body, _seeds(results))


def _delivered_after_repair(results: StudyResults, arm: Arm) -> Numbers:
    """Return how many items each run delivers after the repair."""
    times = (outcome.delivery_times for outcome in results.timed_outcomes[arm])
    return np.array([np.count_nonzero(of_run > REPAIRED_AT) for of_run in times], np.float64)


def wear(results: StudyResults) -> str:
    """Return R and the change of P, of wearing motors and of motors slow from the start."""
    body = []
    for test in results.verdicts:
        comparison = test.compared
        if comparison.table == "Wear":
            arms = comparison.original, comparison.changed
            change = _change(*(test.cells[arm].by_seed for arm in arms))
            policy = f"`{comparison.policy}`"
            body.append((policy, comparison.label, with_verdict(test), change))
    return table(("policy", "worn robots", "R", "change of P [%]"), body)


def losses_between_worlds(results: StudyResults, ideal: StudyResults) -> str:
    """Return what each policy loses from one study's world to the other's, paired by seed."""
    ideal_cells = {(cell.policy, cell.arm.setting): cell for cell in ideal.cells}
    body = []
    for cell in results.cells:
        before = ideal_cells.get((cell.policy, cell.arm.setting))
        if before is not None and cell.arm.setting.kind == "size":
            change = f"{_change(before.by_seed, cell.by_seed)} %"
            means = section.mean_p(before), section.mean_p(cell)
            body.append((f"`{cell.policy}`", f"P, {cell.words}", *means, change))
    return table(("policy", "", "ideal", "realistic", "change"), body)
