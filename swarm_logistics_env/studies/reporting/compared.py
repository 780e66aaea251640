"""Sections that set policies side by side; only for studies of several."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from swarm_logistics_env.studies.analysis.policies import (
    CellContest,
    IndicatorContest,
    cell_contests,
    indicator_contests,
    judged_policies,
)
from swarm_logistics_env.studies.judgement import Findings
from swarm_logistics_env.studies.reporting import wording
from swarm_logistics_env.studies.reporting.differences import difference_figures
from swarm_logistics_env.studies.reporting.sections import Section

_HOW_TO_READ = (
    "How many questions got which Holm-adjusted verdict; the questions themselves follow.",
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


def compared(findings: Findings) -> Iterator[Section]:
    """Yield policy x indicator: verdicts counted, values with differences, P cell by cell."""
    policies = judged_policies(findings)
    if len(policies) < 2:
        return
    yield _matrix(findings, policies)
    contests = tuple(indicator_contests(findings))
    cells_by_table = cell_contests(findings)
    for figure in difference_figures(findings, cells_by_table, contests):
        yield Section("", figures=(figure,))
    level = wording.percent(findings.level)
    for table in dict.fromkeys(contest.table for contest in contests):
        here = [contest for contest in contests if contest.table == table]
        yield _indicators(table, here, policies, level)
    for table, cells in cells_by_table.items():
        yield _cells(table, cells, policies[0])


def _matrix(findings: Findings, policies: tuple[str, ...]) -> Section:
    properties = dict.fromkeys(
        wording.property_name(j) for j in findings.judgements if j.comparison.indicator != "change"
    )
    rows = []
    for policy in policies:
        row = [policy]
        for name in properties:
            verdicts = Counter[str](
                wording.counted_as(j, j.adjusted_verdict)
                for j in findings.judgements
                if j.comparison.policy == policy and wording.property_name(j) == name
            )
            row.append(wording.counted(verdicts) or wording.NOTHING)
        rows.append(tuple(row))
    return Section(
        "Policy x indicator",
        ("policy", *properties),
        tuple(rows),
        (
            *_HOW_TO_READ,
            f"All over {wording.seeds_text(findings)}.",
        ),
    )


def _indicators(
    table: str, contests: list[IndicatorContest], policies: tuple[str, ...], level: str
) -> Section:
    columns = ["question", *(f"{policy} [{level}]" for policy in policies)]
    columns += [f"{policy} - {policies[0]} [95 %]" for policy in policies[1:]]
    rows = []
    for contest in contests:
        judgement = next(j for j in contest.judgements if j is not None)
        label = f"{wording.property_name(judgement)}, {judgement.comparison.label}"
        values = [
            wording.NOTHING if j is None else f"{wording.ratio(j)} {wording.verdict(j)}"
            for j in contest.judgements
        ]
        differences = [wording.bracketed(d, 3) for d in contest.differences[1:]]
        rows.append((label, *values, *differences))
    return Section(
        f"Indicators side by side: {table}",
        tuple(columns),
        tuple(rows),
    )


def _cells(table: str, contests: list[CellContest], baseline: str) -> Section:
    rows = tuple(
        (
            str(contest.cell.arm.level),
            contest.cell.policy,
            wording.items(contest.cell.mean)
            + (wording.SATURATED if contest.cell.saturated else ""),
            f"{contest.interquartile_mean:.1f}",
            f"{contest.worst_decile:.1f}",
            wording.bracketed(contest.difference, 1),
            wording.bracketed(contest.ratio, 2),
            wording.bracketed(contest.improvement, 2),
        )
        for contest in contests
    )
    return Section(
        f"P side by side: {table}",
        (
            "condition", "policy", "mean P [95 %]", "IQM of P", "worst tenth",
            f"P - {baseline}'s [95 %]", f"P / {baseline}'s [95 %]",
            f"delivers more than {baseline} [95 %]",
        ),
        rows,
    )  # fmt: skip
