"""Plays the paper's study until it is clear, and all of it: `python docs/play_until_clear.py`.

It rewrites the table of docs/studies.md: the seeds that each claim took. What is played is kept, as
by `play_tables.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from play_tables import FIRST_SEED, OUT, ROOT, play, rewritten
from record_tables import table

from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.indicator_table import Finding
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.store import FILE_NAME, Store

STUDIES = ROOT / "docs" / "studies.md"
MOST = 50


def studies(out: Path) -> Iterator[Study]:
    """Yield the study that runs until it is clear, then the fixed plan, which has its runs too."""
    clear, fixed = out / "until-clear", out / "paper-fixed"
    seeds = {"seeds": MOST, "first_seed": FIRST_SEED}
    yield Study.preset("paper", out=clear, until_clear=True, **seeds)
    fixed.mkdir(parents=True, exist_ok=True)
    with Store(fixed / FILE_NAME) as store:
        store.absorb(clear / FILE_NAME)
    yield Study.preset("paper", out=fixed, **seeds)


def spent(clear: StudyResults, fixed: StudyResults) -> str:
    """Return the seeds that each claim took until it was clear, and both verdicts on it."""
    claims: dict[tuple[str, str], list[tuple[Finding, Finding]]] = {}
    for one, other in zip(rows_of(clear.indicators), rows_of(fixed.indicators), strict=True):
        claims.setdefault((one.claim, one.factor), []).append((one, other))
    head = (
        "claim",
        "asked of",
        "seeds",
        "verdict on the claim",
        f"with {len(fixed.plan.seeds)} seeds",
    )
    rows = []
    for (claim, factor), both in claims.items():
        verdicts, later = ([test.claim_verdict_holm for test in tests] for tests in zip(*both))
        asked = ", ".join(_asked(one) for one, _ in both)
        seeds = ", ".join(f"{one.stopped_at or f'{one.n_seeds} (open)'}" for one, _ in both)
        rows.append(
            (
                f"{claim}, {factor}",
                asked,
                seeds,
                ", ".join(verdicts),
                "the same" if verdicts == later else ", ".join(later),
            )
        )
    stops = [one.stopped_at for one in rows_of(clear.indicators)]
    at = [
        f"{stops.count(look)} at {look} seeds"
        for look in clear.plan.specification.looks
        if look in stops
    ]
    text = (
        f"{len(clear.outcomes):,} runs instead of the fixed plan's {len(fixed.outcomes):,}. "
        f"{sum(stop is not None for stop in stops)} of {len(stops)} comparisons stop: "
        f"{', '.join(at)}."
    )
    return f"{table(head, rows)}\n\n{text}"


def _asked(test: Finding) -> str:
    if test.kind == "fault":
        return f"m = {test.after:g}"
    return f"N = {test.n_robots}" if test.kind == "policy" else f"{test.before:g} -> {test.after:g}"


def main() -> None:
    """Play, and rewrite the page."""
    block = spent(*play(studies(OUT)))
    text = rewritten(STUDIES.read_text(encoding="utf-8"), {"spent": block})
    STUDIES.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
