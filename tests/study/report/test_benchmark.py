"""The benchmark: its file, its table by cell, and how stable the order of entries is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from swarm_logistics_env.study.questions.plan import make_plan
from swarm_logistics_env.study.questions.presets import PRESETS
from swarm_logistics_env.study.report import benchmark
from swarm_logistics_env.study.report.section import bracketed
from swarm_logistics_env.study.studies import Study

SMALL = {"warehouse_width": 3.0, "warehouse_height": 3.0, "delivery_width": 1.0}
SMALL |= {"n_robots": 4, "n_items": 6, "duration": 150.0, "restock": True}


def test_what_is_held_out_is_no_condition_of_training_or_development() -> None:
    plan = make_plan(PRESETS["benchmark"])
    conditions: dict[str, set[object]] = {}
    for comparison in plan.comparisons:
        case = comparison.changed.case
        part = conditions.setdefault(comparison.table.partition(":")[0], set())
        part.add((str(case.scenario), case.faults))
    held_out = conditions.pop(benchmark.HELD_OUT)
    assert conditions.keys() == {"Development"}
    assert held_out.isdisjoint(set.union(*conditions.values()))


def test_the_table_names_the_worst_cell_and_the_score() -> None:
    study = Study(
        policies=["homing"],
        seeds=3,
        scenario=SMALL,
        faults=[
            {"title": "Training: faults", "modes": ["FM1"], "robots": [1]},
            {"title": "Held out: both", "modes": ["FM1+FM4"], "robots": [3]},
        ],
        parameters=[{"title": "Held out: slow", "name": "max_speed", "values": [2.0, 0.2]}],
    )
    study.run()
    results = study.findings()
    references = {
        world: cell.mean.value for world, (_, cell) in benchmark.best_scripts([results]).items()
    }
    shown = benchmark.table(results, references)
    cells = {cell.words: cell.by_seed for cell in results.cells}
    (sound,) = (row for row in shown.rows if row[0].strip() == "no fault")
    cell = next(cell for cell in results.cells if cell.words == "no fault")
    assert sound[2] == bracketed(cell.contacts, 1)
    assert float(benchmark.contacts(results)) > 0.0
    # The sound swarm stands once, not under every title.
    assert [row[0].strip() for row in shown.rows].count("no fault") == 1
    assert "Worst cell: Held out: slow, max_speed = 0.2" in shown.lines[0]
    # A fault is set beside the sound swarm; another world beside the script in that world.
    shares = [
        cells["FM1+FM4, m = 3"] / cells["no fault"].mean(),
        cells["max_speed = 0.2"] / cells["max_speed = 0.2"].mean(),
    ]
    assert benchmark.score(results, references) == pytest.approx(np.mean(shares, axis=0))
    # Both failures hold for the same robots.
    (arm,) = {
        verdict.compared.changed for verdict in results.verdicts if "both" in verdict.compared.table
    }
    outcome = results.succeeded.get((arm.case.key, 0))
    assert outcome is not None
    assert len(outcome.failed_robots) == 3


def test_the_entries_of_the_package_are_of_its_benchmark() -> None:
    entries = benchmark.Entries.read()
    plan = make_plan(PRESETS["benchmark"])
    assert min(entries.references.values()) > 0.0
    assert {"swarm-dt", "homing", "central-stock"} <= entries.scores.keys()
    for scores in entries.scores.values():
        assert scores.shape[-1] == len(plan.seeds)
        assert 0.0 < scores.mean() < 10.0  # a share, no number of items


@pytest.mark.parametrize("kind", [int, float])  # of ranks, before SciPy 1.18 and since
def test_ranks_are_as_stable_as_the_scores_allow(
    kind: type, monkeypatch: pytest.MonkeyPatch
) -> None:
    ranked = stats.rankdata
    monkeypatch.setattr(stats, "rankdata", lambda *data, **how: ranked(*data, **how).astype(kind))
    rng = np.random.default_rng(0)
    clear = {"low": rng.normal(10, 1, 15), "high": rng.normal(50, 1, (5, 15))}
    high, low = benchmark.leaderboard(clear).rows
    assert (high[0], *high[2:]) == ("high", "1 [1, 1]", "100%")
    assert (low[0], *low[2:]) == ("low", "2 [2, 2]", "100%")
    # Of three trainings no rank is told, and those of all others are among themselves.
    few = benchmark.leaderboard({**clear, "three": rng.normal(70, 1, (3, 15))}).rows
    assert [(row[0], row[2]) for row in few] == [
        ("three", "open"), ("high", "1 [1, 1]"), ("low", "2 [2, 2]"),
    ]  # fmt: skip
    # Seeds agree, trainings do not: one lucky training is no lead.
    spread = np.repeat(rng.normal(50, 20, 5)[:, None], 15, axis=1)
    shaky = {"one": spread, "other": np.full((5, 15), spread.mean() - 1.0)}
    first, _ = benchmark.leaderboard(shaky).rows
    assert first[2] == "1 [1, 2]"
    assert int(first[3].rstrip("%")) < 90
