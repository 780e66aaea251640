"""Sections on how far the verdicts hang on the method: declared looks, and the bootstrap."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_logistics_env import spi
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.analysis.bootstrap import bootstrap_check, bootstrap_verdict
from swarm_logistics_env.studies.judgement import LEVEL, Findings, Judgement
from swarm_logistics_env.studies.reporting import wording
from swarm_logistics_env.studies.reporting.sections import Section


def checks(findings: Findings) -> Iterator[Section]:
    """Yield the declared looks and the check by bootstrap, where there are any."""
    if findings.looks:
        yield _looks(findings)
    yield from _bootstrap(findings)


def _looks(findings: Findings) -> Section:
    n_seeds = len(findings.plan.seeds)
    rows = []
    for number, (look, alpha) in enumerate(
        zip(findings.looks, spi.look_levels(findings.looks, 1 - LEVEL)), start=1
    ):
        when = "past" if look < n_seeds else "to come" if look > n_seeds else "this report"
        rows.append(
            (
                f"{number} of {len(findings.looks)}",
                str(look),
                "< 0.0001" if alpha < 0.0001 else f"{alpha:.4f}",
                wording.percent(1 - alpha),
                when,
            )
        )
    lines = [
        (
            "Declared before the first run. O'Brien-Fleming spending (Lan and DeMets) keeps the "
            "error over all looks at 5 %: a verdict at a look needs p below its level, and its "
            "interval has the level beside it."
        )
    ]
    if findings.exploratory:
        lines.append(
            f"No look was declared at {wording.seeds_text(findings)}: every verdict is exploratory."
        )
    return Section(
        "Declared looks",
        ("look", "seeds", "p below", "level of intervals", "when"),
        tuple(rows),
        tuple(lines),
    )


def _bootstrap(findings: Findings) -> Iterator[Section]:
    check = bootstrap_check(findings)
    if not check.checked:
        return
    lines = [
        (
            "The studentised paired bootstrap assumes no distribution; it is run from ten paired "
            f"seeds on. Of {check.checked} verdicts, unadjusted, it leaves "
            f"{check.checked - len(check.differing)} as they are."
        )
    ]
    if check.width is not None:
        least, median, most = check.width
        lines.append(
            f"Its intervals are {median:.2f} times as wide as Fieller's at the median, "
            f"{least:.2f} to {most:.2f} times in all; claims.csv holds every one of them."
        )
    level = wording.percent(findings.level)
    columns = (
        "policy", "verdict that differs", f"Fieller [{level}]", "says", f"bootstrap [{level}]",
        "says",
    )  # fmt: skip
    yield Section(
        "Studentised bootstrap",
        columns if check.differing else (),
        tuple(_row(judgement) for judgement in check.differing),
        tuple(lines),
    )


def _row(judgement: Judgement) -> tuple[str, ...]:
    comparison, estimate = judgement.comparison, judgement.estimate
    assert isinstance(estimate, Estimate)
    checked = Interval(estimate.value, estimate.bootstrap_low, estimate.bootstrap_high)
    return (
        comparison.policy,
        f"{comparison.indicator}, {wording.property_name(judgement)}, {comparison.label}",
        wording.ratio(judgement),
        f"{wording.on_property(judgement, estimate.verdict)}",
        wording.bracketed(checked, 3),
        f"{wording.on_property(judgement, bootstrap_verdict(estimate))}",
    )
