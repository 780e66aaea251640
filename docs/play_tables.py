"""Plays the studies behind docs/results.md and writes its tables: `python docs/play_tables.py`.

From these tables follow the README's numbers and picture, and `judge` gets its score cards.

What is played is kept, so that a second call plays nothing, and one after an interruption the rest.
Costs are not measured here: their table is written from what `make benchmark` left, if it did.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path

import front_page
import score_cards
from table_blocks import costs_block, paper_block, policies_block
from tables import rewritten

from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.results import StudyResults

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results.md"
OUT = ROOT / "results" / "tables"
BENCHMARK = ROOT / "results" / "benchmark" / "benchmark.json"
# No seed from here on was used to fit, train, tune or choose anything: defaults were fitted on the
# seeds from 0 on, trainings evaluate on those from 1,000,000 on.
FIRST_SEED = 20_000
SEEDS, SEEDS_WHERE_SKEWED = 20, 100
PROCESSES = os.cpu_count() or 1


def paper_studies(out: Path) -> tuple[Study, ...]:
    """Return the study of the paper in two parts: the faults, where P is skewed, with more seeds.

    No family of claims is divided: FT and R are asked of faults only, S, A and change of the rest.
    """
    return (
        Study.preset("paper", out=out / "paper", seeds=SEEDS, first_seed=FIRST_SEED, faults=()),
        Study.preset(
            "paper",
            out=out / "paper-faults",
            seeds=SEEDS_WHERE_SKEWED,
            first_seed=FIRST_SEED,
            sizes=(),
            parameters=(),
            ablations=(),
        ),
    )


def policy_studies(out: Path) -> tuple[Study, ...]:
    """Return the studies of the shipped policies, those with more seeds last."""
    return tuple(
        Study.from_file(ROOT / "examples" / f"{name}.toml", out=out / name)
        for name in ("shipped_policies", "shipped_policies_fm4")
    )


def play(studies: Iterable[Study]) -> list[StudyResults]:
    """Play what is missing of each study; return what the runs say.

    Raises:
        SystemExit: a run failed.
    """
    found = []
    for study in studies:
        tally = study.run(processes=PROCESSES)
        if tally.failed:
            raise SystemExit(f"{tally.failed} runs failed: {tally.error}")
        found.append(study.findings())
    return found


def main() -> None:
    """Play, rewrite the page of results, then the README, and record the score cards."""
    blocks = {
        "paper": paper_block(play(paper_studies(OUT))),
        "policies": policies_block(*play(policy_studies(OUT))),
    }
    if BENCHMARK.exists():
        blocks["costs"] = costs_block(json.loads(BENCHMARK.read_text(encoding="utf-8")))
    PAGE.write_text(rewritten(PAGE.read_text(encoding="utf-8"), blocks), encoding="utf-8")
    front_page.main()
    score_cards.main()


if __name__ == "__main__":
    main()
