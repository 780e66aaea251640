"""What a report says of few real trials beside many simulated ones."""

from __future__ import annotations

from dataclasses import replace

from swarm_logistics_env.report import wording
from swarm_logistics_env.report.document import Chapter, Document
from swarm_logistics_env.report.result_tables import Section
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.few_real_runs import narrowed, replays
from swarm_logistics_env.studies.results import StudyResults


def with_simulation(whole: Document, real: StudyResults, simulated: StudyResults) -> Document:
    """Return a report on real trials with a chapter on what simulation adds to them.

    Raises:
        StudyError: the simulated trials are not of the same set-ups and comparisons.
    """
    seeds, further = replays(real, simulated)
    rows, problems = [], []
    for one in narrowed(real, simulated):
        comparison = one.comparison
        name = f"{comparison.indicator} > {comparison.threshold:.3g}, {comparison.label}"
        if one.combined is None:
            problems.append(f"{comparison.policy}, {name}: {one.problem}.")
            continue
        width = wording.NOTHING if one.width is None else f"{one.width:.2f}"
        rows.append(
            (
                comparison.policy,
                name,
                *(_interval(estimate) for estimate in (one.alone, one.combined)),
                width,
                one.combined.verdict,
            )
        )
    explained = (
        f"{len(seeds)} real trials of each condition, their set-ups simulated, and {len(further)} "
        "further simulated ones. The real trials are corrected for how lucky their set-ups were in "
        "simulation (control variate, Student's t at two degrees of freedom fewer). Nothing is "
        "taken from simulation itself. Decide for one of the two intervals before you look; "
        "verdicts unadjusted."
    )
    section = Section(
        "Real trials with simulation",
        (
            "policy", "question", "real alone [95 %]", "with simulation [95 %]",
            "width, with over alone", "with simulation",
        ),
        tuple(rows),
        (explained, *problems),
    )  # fmt: skip
    *chapters, setup = whole.chapters
    return replace(
        whole,
        chapters=(*chapters, Chapter("With simulation", "", (section,)), setup),
        summary=(*whole.summary, section),
    )


def _interval(estimate: Estimate) -> str:
    return wording.bracketed(Interval(estimate.value, estimate.low, estimate.high), 3)
