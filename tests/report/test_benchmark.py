"""The benchmark: its file, its table by cell, and how stable the order of entries is."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env.report import benchmark
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.plan import make_plan
from swarm_logistics_env.studies.presets import PRESETS
from swarm_logistics_env.studies.results import StudyResults

SMALL = {"warehouse_width": 3.0, "warehouse_height": 3.0, "delivery_width": 1.0}
SMALL |= {"n_robots": 4, "n_items": 6, "duration": 60.0, "restock": True}


@pytest.fixture(scope="module")
def results() -> StudyResults:
    study = Study(
        policies=["homing"],
        seeds=3,
        scenario=SMALL,
        faults=[
            {"title": "Training: faults", "modes": ["FM1"], "robots": [1]},
            {"title": "Held out: both", "modes": ["FM1+FM4"], "robots": [3]},
        ],
        parameters=[{"title": "Held out: slow", "name": "max_speed", "values": [2.0, 0.1]}],
    )
    study.run()
    return study.findings()


def test_every_cell_has_its_part_and_what_is_held_out_is_no_training_condition() -> None:
    plan = make_plan(PRESETS["benchmark"])
    parts = {one.table.partition(":")[0] for one in plan.comparisons}
    assert parts == {"Training", "Development", benchmark.HELD_OUT}
    practised, held_out = (
        {
            (str(one.changed.case.scenario), one.changed.case.faults)
            for one in plan.comparisons
            if one.table.startswith(benchmark.HELD_OUT) == is_held_out
        }
        for is_held_out in (False, True)
    )
    assert not practised & held_out


def test_the_table_names_the_worst_cell_and_the_score(results: StudyResults) -> None:
    shown = benchmark.table(results)
    cells = {cell.words: cell.by_seed for cell in results.cells}
    names = [row[0].strip() for row in shown.rows]
    # The sound swarm stands once, not under every title.
    assert names.count("no fault") == 1
    assert "Worst cell: Held out: slow, max_speed = 0.1" in shown.lines[0]
    held_out = (cells["FM1+FM4, m = 3"] + cells["max_speed = 0.1"]) / 2
    assert benchmark.score(results) == pytest.approx(held_out)
    assert "2 held-out cells" in shown.lines[1]


def test_both_failures_hold_for_the_same_robots(results: StudyResults) -> None:
    (arm,) = {one.compared.changed for one in results.verdicts if "both" in one.compared.table}
    assert [fault.mode for fault in arm.case.faults] == ["FM1", "FM4"]
    outcome = results.outcome(arm, 0)
    assert outcome is not None
    assert len(outcome.failed_robots) == 3


def test_ranks_are_as_stable_as_the_scores_allow() -> None:
    rng = np.random.default_rng(0)
    clear = {"low": rng.normal(10, 1, 15), "high": rng.normal(50, 1, (5, 15))}
    high, low = benchmark.leaderboard(clear).rows
    assert (high[0], *high[2:]) == ("high", "1 [1, 1]", "100%")
    assert (low[0], *low[2:]) == ("low", "2 [2, 2]", "100%")

    # Seeds agree, trainings do not: one lucky training is no lead.
    spread = np.repeat(rng.normal(50, 20, 5)[:, None], 15, axis=1)
    shaky = {"one": spread, "other": np.full((5, 15), spread.mean() - 1.0)}
    first, _ = benchmark.leaderboard(shaky).rows
    assert first[2] == "1 [1, 2]"
    assert int(first[3].rstrip("%")) < 90
    assert benchmark.leaderboard(shaky) == benchmark.leaderboard(shaky)
