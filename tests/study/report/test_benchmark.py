"""The benchmark: shares and their floor, the score's interval, its tables, and entries by rank."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study.questions.benchmark_cells import DEVELOPMENT, HELD_OUT, REFERENCE
from swarm_logistics_env.study.report import benchmark
from swarm_logistics_env.study.report.benchmark import Entry
from swarm_logistics_env.study.report.section import mean_p
from swarm_logistics_env.study.report.set_up import setup_sheet
from swarm_logistics_env.study.studies import Study

SMALL = {"warehouse_width": 3.0, "warehouse_height": 3.0, "delivery_width": 1.0}
SMALL |= {"n_robots": 4, "n_items": 6, "duration": 100.0, "restock": True}


def entry_of(shares: Numbers) -> Entry:
    """An entry with these held-out shares, of trainings (rows) in cells (columns)."""
    return Entry(digest="0" * 64, held_out=shares.tolist(), development=shares.tolist())


def study_of(policy: object) -> Study:
    """A study of two cells, a small benchmark."""
    cells: list[dict[str, Any]] = [
        {"title": f"{DEVELOPMENT} 1"},
        {"title": f"{HELD_OUT} 1", "mode": "FM1+FM4", "robots": 3},
        {"title": f"{HELD_OUT} 2", "scenario": {"max_speed": 0.2}},
    ]
    ablations = [{"policy": REFERENCE, **cell} for cell in cells]
    return Study(policies=[policy], seeds=3, scenario=SMALL, ablations=ablations)


class Failing:
    """A policy whose runs fail."""

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode."""

    def act(self, observations: Any) -> Any:
        """Fail."""
        raise RuntimeError("no more")


def test_a_share_has_a_floor_and_is_the_reciprocal_of_the_other_way() -> None:
    p = np.array([0.0, 0.4, 3.0, 60.0, 900.0])
    for reference in p:
        shares = benchmark.share(p, reference)
        assert shares == pytest.approx(1.0 / benchmark.share(reference, p))
        assert shares.min() >= benchmark.FLOOR
    # Nothing beside nothing tells nothing; a few items beside many count as the floor.
    assert benchmark.share(p, np.array(0.0)).tolist() == [1.0, 1.0, 3.0, 20.0, 20.0]
    assert benchmark.share(p, np.array(120.0)).tolist() == [0.05, 0.05, 0.05, 0.5, 7.5]


def test_the_reference_has_score_1_and_so_has_whoever_delivers_as_much() -> None:
    assert Entry.of_reference().score == (1.0, 1.0, 1.0)
    rng = np.random.default_rng(1)
    p, reference = rng.poisson(20.0, size=(2, 24, 4)).mean(axis=2)
    _, low, high = entry_of(benchmark.share(p, reference)[None]).score
    assert low is not None
    assert high is not None
    assert low < 1.0 < high


@pytest.mark.parametrize("n_trainings", [1, 7])
def test_the_interval_of_a_score_has_the_error_of_cells_seeds_and_the_reference(
    n_trainings: int,
) -> None:
    """Of 300 benchmarks, in which both sides have seeds' noise, about 95 % hold the true score."""
    rng = np.random.default_rng(2)
    spread = 0.15 if n_trainings > 1 else 0.0
    n_held = 0
    for _ in range(300):
        cell = rng.normal(0.0, 0.6, 24)
        training = rng.normal(0.0, spread, (n_trainings, 1))
        noise = rng.gamma(4.0, 0.25, (n_trainings + 1, 24, 4)).mean(axis=2)  # of both sides
        p = 40.0 * np.exp(np.log(0.8) + cell + training) * noise[1:]
        score = entry_of(benchmark.share(p, 40.0 * noise[0])).score
        assert score.low is not None
        assert score.high is not None
        n_held += score.low <= 0.8 <= score.high
    assert 0.91 <= n_held / 300 <= 0.99


def test_the_table_sets_every_cell_beside_the_reference() -> None:
    study = study_of("homing")
    study.run()
    results = study.findings()
    entry = Entry.of(results, "ab" * 32)
    p = {(cell.arm.setting.name, cell.table): cell for cell in results.cells}
    titles = [part.title for part in study.specification.ablations]
    by_hand = [
        benchmark.share(
            p["homing", title].by_seed.mean(), p[REFERENCE, title].by_seed.mean()
        ).item()
        for title in titles
    ]
    assert entry.development == ((by_hand[0],),)
    assert entry.held_out == (tuple(by_hand[1:]),)
    assert entry.score.value == pytest.approx(np.sqrt(by_hand[1] * by_hand[2]))
    table = benchmark.table(results, entry)
    assert table.title == "homing: benchmark of robustness, edition 3"
    assert table.columns == (
        "cell", "P [95 %]", "P of homing-stock [95 %]", "share",
        "contacts a robot-minute [95 %]", "runs that stand still",
    )  # fmt: skip
    pairs = [(p["homing", title], p[REFERENCE, title]) for title in titles]
    assert [row[1:3] for row in table.rows] == [
        (mean_p(homing), mean_p(reference)) for homing, reference in pairs
    ]
    assert [row[0] for row in table.rows] == [
        "Development 1: ", "Held out 1: ; FM1+FM4, m = 3", "Held out 2: max_speed = 0.2",
    ]  # fmt: skip
    assert [row[3] for row in table.rows] == [f"{value:.2f}" for value in by_hand]
    worst = titles[1 + int(np.argmin(by_hand[1:]))]
    assert f"share {min(by_hand[1:]):.2f}: {worst}: " in table.lines[1]
    assert "digest abababab." in table.lines[0]
    # Both failures hold for the same robots, under either policy.
    for policy in ("homing", REFERENCE):
        assert {len(run.failed_robots) for run in p[policy, titles[1]].outcomes} == {3}
    lines = [line for section in setup_sheet(study.plan()) for line in section.lines]
    assert "Held out 1: FM1+FM4, m = 3, under both policies." in lines


def test_runs_that_failed_leave_no_score() -> None:
    study = study_of(Failing())
    study.run()
    with pytest.raises(StudyError, match="Failing, Held out 1: 3 of 3 runs failed, so"):
        Entry.of(study.findings(), "")


def test_entries_are_written_and_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped_entries = benchmark.read_entries()
    for entry in shipped_entries.values():
        assert 0.0 < entry.score.value < 20.0
    text = benchmark.ENTRIES.read_text()
    monkeypatch.setattr(benchmark, "ENTRIES", tmp_path / "entries.json")
    benchmark.write_entries(shipped_entries)
    assert benchmark.ENTRIES.read_text() == text
    entries = {"homing": entry_of(np.array([[0.5, 2.0], [0.05, 1.0]]))}
    benchmark.write_entries(entries)
    assert benchmark.read_entries() == entries


@pytest.mark.parametrize("shape", [(1, 24), (8, 1)])  # cells differ, or trainings
def test_a_score_by_its_error_above_that_of_the_reference_leads_in_84_percent_of_resamples(
    shape: tuple[int, int],
) -> None:
    logarithms = np.random.default_rng(3).normal(0.0, 0.3, shape)
    error = logarithms.std() / np.sqrt(logarithms.size)
    shares = np.exp(logarithms - logarithms.mean() + error)
    entries = {"mine": entry_of(np.broadcast_to(shares, (shape[0], 24)))}
    leader, _ = benchmark.leaderboard(entries).rows
    assert (leader[0], leader[2]) == ("mine", "1 [1, 2]")
    assert int(leader[3].rstrip("%")) == pytest.approx(84, abs=3)


def test_the_leaderboard_says_what_is_known_of_each_entry() -> None:
    entries = {
        "few": Entry(
            digest="0123456789", held_out=((0.5, 2.0), (0.5, 1.0)), development=((0.9,), (1.6,)),
            contacts=12.345, standing_still=0.256,
        ),
        "one": Entry(digest="", held_out=((0.2, 0.3),), development=((0.25, 0.25),)),
    }  # fmt: skip
    board = benchmark.leaderboard(entries)
    assert board.title == "Benchmark of robustness, edition 3: entries by score"
    assert board.columns == (
        "policy", "score [95 %]", "rank [95 %]", "same rank", "development",
        "contacts a robot-minute", "runs that stand still", "least share", "digest",
    )  # fmt: skip
    of_reference, of_few, of_single = [" | ".join(row) for row in board.rows]
    score = "1.00 [1.00, 1.00]"
    assert of_reference == f"{REFERENCE} | {score} | 1 [1, 1] | 100% | {score} | – | – | 1.00 | –"
    assert of_few == (
        "few | 0.84 [0.00, 621.52] | open | – | 1.20 [0.03, 46.42] | 12.3 | 26% | 0.50 | 01234567"
    )
    assert of_single == (
        "one | 0.24 [0.02, 3.22] | 2 [2, 2] | 100% | 0.25 [0.25, 0.25] | – | – | 0.20 | –"
    )
    assert board.lines[0] == (
        "Score: P as a share of that of homing-stock in the same cell, the geometric mean of the "
        "held-out cells, which differ from entry to entry; development: of the cells that all "
        "share."
    )
    assert board.lines[1:] == (
        "Limits of a rank, and how often it is the same: of 2000 resamples.",
        "Open: of fewer than 5 trainings, too few for a rank.",
    )


@pytest.mark.parametrize("kind", [int, float])  # of ranks, before SciPy 1.18 and since
def test_ranks_are_as_stable_as_the_scores_allow(
    kind: type, monkeypatch: pytest.MonkeyPatch
) -> None:
    rank = stats.rankdata
    monkeypatch.setattr(stats, "rankdata", lambda *data, **how: rank(*data, **how).astype(kind))
    rng = np.random.default_rng(0)

    def entry(score: float, spread: float, n_trainings: int = 1) -> Entry:
        return entry_of(score * np.exp(rng.normal(0.0, spread, (n_trainings, 24))))

    clear = {"low": entry(0.2, 0.1), "high": entry(2.0, 0.1, 5)}
    high, reference, low = benchmark.leaderboard(clear).rows
    assert (high[0], *high[2:4]) == ("high", "1 [1, 1]", "100%")
    assert (reference[0], *reference[1:4]) == (REFERENCE, "1.00 [1.00, 1.00]", "2 [2, 2]", "100%")
    assert (low[0], *low[2:4]) == ("low", "3 [3, 3]", "100%")
    # Of three trainings no rank is told, and those of all others are among themselves.
    few = benchmark.leaderboard({**clear, "three": entry(9.0, 0.1, 3)}).rows
    assert [(row[0], row[2]) for row in few[:2]] == [("three", "open"), ("high", "1 [1, 1]")]
    # Cells agree, trainings do not: one lucky training is no lead.
    spread = np.exp(np.repeat(rng.normal(0.0, 0.5, (5, 1)), 24, axis=1))
    mean = float(np.exp(np.log(spread).mean()))
    shaky = {"one": entry_of(spread), "other": entry_of(np.full((5, 24), 0.99 * mean))}
    rows = {row[0]: row for row in benchmark.leaderboard(shaky).rows}
    assert int(rows["one"][3].rstrip("%")) < 90
