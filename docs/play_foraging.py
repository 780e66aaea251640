"""Plays foraging and the warehouse and sets them side by side: `python docs/play_foraging.py`.

It rewrites the table of docs/foraging.md. What is played is kept, as by `play_tables.py`.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from front_page import rewritten
from play_tables import OUT, ROOT, play
from record_tables import table

from swarm_logistics_env.report import wording
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.studies.policy_comparison import judged_policies
from swarm_logistics_env.studies.results import StudyResults

PAGE = ROOT / "docs" / "foraging.md"
STUDIES = ("foraging", "foraging_beside_warehouse")
_EXACT = " ="


def studies(out: Path) -> tuple[Study, ...]:
    """Return the two studies, which ask the same questions."""
    return tuple(
        Study.from_file(ROOT / "examples" / f"{name}.toml", out=out / name) for name in STUDIES
    )


def side_by_side(results: Iterable[StudyResults]) -> str:
    """Return P and the indicators, a row a question and a column a policy in its world."""
    rows: dict[str, dict[str, str]] = {}
    columns: list[str] = []
    for found in results:
        world = found.plan.specification.played.name
        columns += [f"{world}: `{policy}`" for policy in judged_policies(found)]
        for cell in rows_of(found.performance):
            if cell.arm.setting.kind in ("size", "parameter"):
                row = rows.setdefault(f"P, {cell.arm.setting}", {})
                row[f"{world}: `{cell.policy}`"] = wording.mean_p(cell)
        for test in rows_of(found.indicators):
            row = rows.setdefault(f"{test.indicator}, {test.comparison}", {})
            mark = _EXACT if test.verdict == "unaffected" else ""
            row[f"{world}: `{test.policy}`"] = wording.ratio(test) + mark
    body = [(label, *(row.get(column, "") for column in columns)) for label, row in rows.items()]
    return table(("", *columns), body)


def main() -> None:
    """Play, and rewrite the page."""
    blocks = {"foraging": side_by_side(play(studies(OUT)))}
    PAGE.write_text(rewritten(PAGE.read_text(encoding="utf-8"), blocks), encoding="utf-8")


if __name__ == "__main__":
    main()
