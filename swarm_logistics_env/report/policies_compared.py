"""Sections that set policies side by side; only for studies of several."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from swarm_logistics_env.studies.policy_comparison import (
    CellAgainstBaseline,
    IndicatorAgainstBaseline,
    cells_against_baseline,
    indicators_against_baseline,
)
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import grouped

from . import section
from .section import Section

_HOW_TO_READ = (
    (
        "Indicators: the verdict is the unadjusted one, Holm's in brackets where it differs; "
        "differences are paired by seed, their intervals jackknifed."
    ),
    (
        "P: IQM is the mean without the lowest and the highest quarter of the seeds, worst tenth "
        "the mean of the lowest tenth, rounded up to whole seeds. Differences are paired by seed "
        "(t-interval), and so are ratios of mean P (Fieller); the last column is the share of "
        "seeds with more deliveries, ties counting half (Wilson)."
    ),
)


def policy_sections(results: StudyResults) -> Iterator[Section]:
    """Yield policy x indicator: values with differences, then P cell by cell."""
    if len(results.policies) < 2:
        return
    yield Section("", lines=(*_HOW_TO_READ, f"All over {section.seeds_text(results)}."))
    questions = list(indicators_against_baseline(results))
    by_table = grouped(questions, lambda one: one.test.compared.table)
    for table, here in by_table.items():
        yield _indicators(table, here, results.policies)
    for table, cells in cells_against_baseline(results).items():
        yield _cells(table, cells, results.policies[0])


def _indicators(
    table: str, questions: Sequence[IndicatorAgainstBaseline], policies: Sequence[str]
) -> Section:
    def answer(one: IndicatorAgainstBaseline, policy: str) -> str:
        test = one.tests.get(policy)
        return f"{section.ratio(test)} {section.answered(test)}" if test else section.NOTHING

    def difference(one: IndicatorAgainstBaseline, policy: str) -> str:
        return section.bracketed(one.differences.get(policy), 3)

    baseline, *others = policies
    columns: list[tuple[str, Callable[[IndicatorAgainstBaseline], str]]] = [
        ("question", lambda one: f"{one.test.asked}, {one.test.compared.label}"),
        *((f"{policy} [95 %]", partial(answer, policy=policy)) for policy in policies),
        *((f"{one} - {baseline} [95 %]", partial(difference, policy=one)) for one in others),
    ]
    return Section.table(f"Indicators side by side: {table}", questions, columns)


def _cells(table: str, cells: Sequence[CellAgainstBaseline], baseline: str) -> Section:
    return Section.table(
        f"P side by side: {table}",
        cells,
        [
            ("condition", lambda one: str(one.cell.arm.setting)),
            ("policy", lambda one: one.cell.policy),
            ("mean P [95 %]", lambda one: section.mean_p(one.cell)),
            ("IQM of P", lambda one: f"{one.interquartile_mean:.1f}"),
            ("worst tenth", lambda one: f"{one.worst_decile:.1f}"),
            (f"P - {baseline}'s [95 %]", lambda one: section.bracketed(one.difference, 1)),
            (f"P / {baseline}'s [95 %]", lambda one: section.bracketed(one.ratio, 2)),
            (
                f"delivers more than {baseline} [95 %]",
                lambda one: section.bracketed(one.improvement, 2),
            ),
        ],
    )
