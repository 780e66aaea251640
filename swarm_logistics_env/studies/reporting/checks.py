"""The section on declared looks."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_logistics_env import spi
from swarm_logistics_env.studies.judgement import LEVEL, Findings
from swarm_logistics_env.studies.reporting import wording
from swarm_logistics_env.studies.reporting.sections import Section


def checks(findings: Findings) -> Iterator[Section]:
    """Yield the declared looks, where there are any."""
    if findings.looks:
        yield _looks(findings)


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
