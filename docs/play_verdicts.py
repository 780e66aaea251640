"""Plays the paper's faults and asks which do no harm: `python docs/play_verdicts.py`.

It rewrites the table of docs/equivalence.md. What is played is kept, as by `play_tables.py`, which
plays the same runs.
"""

from __future__ import annotations

from pathlib import Path

from play_tables import OUT, ROOT, paper_studies, play, rewritten
from record_tables import table

from swarm_logistics_env import spi
from swarm_logistics_env.report import wording
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.indicator_table import Finding
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.studies.results import StudyResults

EQUIVALENCE = ROOT / "docs" / "equivalence.md"


def faults_study(out: Path) -> Study:
    """Return the study of the paper's faults."""
    return paper_studies(out)[1]


def harm(found: StudyResults) -> str:
    """Return what each fault does to P, a row a fault."""
    rows: dict[str, dict[str, Finding]] = {}
    for test in rows_of(found.indicators):
        rows.setdefault(test.comparison, {})[test.indicator] = test
    margin = found.plan.specification.margin
    headings = (
        "",
        "P_F / P_o - 1 [90 %]",
        f"within {margin:.0%} of P_o",
        "robust",
        "(P_F - P_S) / P_o [90 %]",
        f"within {margin:.0%} from P_S",
        "tolerant",
        "seeds planned",
    )
    body = [
        (
            label,
            _change(tests["R"]),
            _verdict(tests["R"]),
            wording.verdict(tests["R"]),
            _change(tests["FT"]),
            _verdict(tests["FT"]),
            wording.verdict(tests["FT"]),
            ", ".join(str(_planned(tests[symbol])) for symbol in ("R", "FT")),
        )
        for label, tests in rows.items()
    ]
    seeds = found.plan.seeds
    return f"{table(headings, body)}\n\nOver {len(seeds)} seeds from {seeds[0]:,} on."


def _change(test: Finding) -> str:
    return wording.bracketed(Interval(test.change, test.change_low, test.change_high), 3)


def _verdict(test: Finding) -> str:
    plain, adjusted = test.equivalence, test.equivalence_holm
    return plain if plain == adjusted else f"{plain} ({adjusted})"


def _planned(test: Finding) -> int | None:
    return spi.seeds_for_equivalence(test.equivalence_test)


def main() -> None:
    """Play, and rewrite the page."""
    (faults,) = play([faults_study(OUT)])
    text = rewritten(EQUIVALENCE.read_text(encoding="utf-8"), {"harm": harm(faults)})
    EQUIVALENCE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
