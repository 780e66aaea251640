"""Blocks: what trials share, and what counts as one of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi.hidden import stalls
from swarm_logistics_env.spi.ratio import Design, Term, ratio_test
from swarm_logistics_env.study.trials import read_trials


def test_trials_of_a_block_count_as_one_and_blocks_alike(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    rows = ["4,Tuesday,1,1", "4,Monday,3,2", "4,Monday,5,4", "8,Monday,9,1", "8,Tuesday,7,1"]
    path.write_text("\n".join(["robots,day,P,contacts", *rows]))
    trials = read_trials(path)
    assert trials.performance(n_robots=4).tolist() == [4.0, 1.0]  # Monday, Tuesday
    assert trials.performance(n_robots=8).tolist() == [9.0, 7.0]
    monday = trials.select(n_robots=4)[0]
    assert (monday.n_trials, monday.contacts, monday.line, trials.n_trials) == (2, 3.0, 3, 5)
    (note,) = trials.notes
    assert note == (
        "1 to 2 trials of one day and condition count as one trial, their mean, as they share "
        "what differs between blocks; every day counts alike."
    )
    # Numbers may name blocks, too; a seed names one run.
    numbered = path.read_text().replace("Monday", "1").replace("Tuesday", "2")
    path.write_text(numbered)
    assert read_trials(path).performance(n_robots=4).tolist() == [4.0, 1.0]
    path.write_text(numbered.replace("day", "seed"))
    with pytest.raises(spi.IndicatorError, match=r"has seed 1 like line 3.*--column block=NAME"):
        read_trials(path)
    assert read_trials(path, columns={"block": "seed"}).performance(n_robots=4)[0] == 4.0


MAPS = """policy,robots,seed,map,performance
A,4,,hall,1
A,4,,yard,2
A,8,,yard,4
A,8,,hall,3
B,4,,hall,5
B,8,,hall,6
B,8,,roof,7
"""


def test_any_text_is_a_block_and_an_empty_column_is_none(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(MAPS)
    trials = read_trials(path)
    assert [row.seed for row in trials.rows] == [0, 2, 2, 0, 0, 0, 1]
    assert trials.performance(policy="A", n_robots=8).tolist() == [3.0, 4.0]
    assert trials.notes == (
        "A has runs of 2 of the file's 3 blocks (map).",
        "B has runs of 2 of the file's 3 blocks (map).",
        (
            "B: no partner of the same map in some condition for 1 of its runs: they count for P, "
            "and are left out where such a condition is compared."
        ),
    )


def test_a_seed_and_a_map_make_a_block_together(tmp_path: Path) -> None:
    text = "robots,seed,map,p\n4,0,hall,1\n4,1,hall,2\n4,0,yard,3\n8,0,yard,4\n"
    path = tmp_path / "t.csv"
    path.write_text(text)
    trials = read_trials(path)
    assert [row.seed for row in trials.rows] == [0, 2, 1, 1]
    shared, partners = trials.notes
    assert shared == (
        "Pairs are of one seed and map, so verdicts are of the 2 values of 'map' alone; --ignore "
        "seed compares their means, for all such values."
    )
    assert "of the same seed and map in some condition" in partners


@pytest.mark.parametrize("names", [["seed", "crate"], ["crate", "seed"]])
def test_a_column_that_is_called_the_seed_makes_a_block_with_a_seed_on_either_side(
    names: list[str],
) -> None:
    values = {"robots": [4, 4, 8, 8], "seed": [0, 1, 0, 1], "crate": ["a", "b", "a", "b"], "P": 1}
    trials = read_trials(pd.DataFrame(values)[["robots", *names, "P"]], columns={"seed": "crate"})
    assert [(row.seed, row.parameters) for row in trials.rows] == [(0, ()), (1, ())] * 2
    assert [column.use for column in trials.columns] == ["robots", "seed", "seed", "performance"]


def test_a_single_block_pairs_nothing(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("robots,map,P\n4,hall,1\n4,hall,2\n8,hall,5\n")
    trials = read_trials(path)
    assert not trials.paired
    assert trials.performance(n_robots=4).tolist() == [1.0, 2.0]
    (note,) = trials.notes
    assert note == "All trials are of one map: they are not paired, and tell of no other map."


def test_deliveries_of_a_block_have_no_times_of_one_run(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("robots,map,trial,time\n4,a,1,5\n4,a,2,6\n4,a,2,7\n4,b,3,8\n")
    hall, yard = read_trials(path).rows
    assert (hall.performance, hall.times, yard.times) == (1.5, None, (8.0,))


STUDIES, P = 400, 40.0


@pytest.mark.daily
@pytest.mark.parametrize(("n_maps", "n_trials", "deviation"), [(4, 5, 0.15), (10, 3, 0.3)])
def test_verdicts_hold_where_a_fault_costs_more_in_some_maps(
    n_maps: int, n_trials: int, deviation: float
) -> None:
    """Trials paired in the file's order err in 6 and in 8 % of studies on each side."""
    draw = np.random.default_rng(0)
    shape = STUDIES, n_maps, n_trials
    left = np.clip(draw.normal(0.9, deviation, (STUDIES, n_maps, 1)), 0.0, None)
    sound, faulty = draw.poisson(P, shape), draw.poisson(P * left, shape)
    study, number_of_map, _ = (axis.ravel() for axis in np.indices(shape))
    of_study = {"policy": study, "map": [f"map {k}" for k in number_of_map], "robots": 10}
    frame = pd.concat(
        [
            pd.DataFrame({**of_study, "fault": "none", "m": 0, "P": sound.ravel()}),
            pd.DataFrame({**of_study, "fault": "jam", "m": 1, "P": faulty.ravel()}),
        ]
    )
    rows = sorted(read_trials(frame).rows, key=lambda row: (int(row.policy), row.seed))
    p_o, p_f = (
        np.array([row.performance for row in rows if row.fault == fault]).reshape(STUDIES, n_maps)
        for fault in ("none", "jam")
    )
    terms = [Term(p_f, 1.0, 0.0), Term(p_o, 0.0, 1.0)]
    hidden = [stalls(term.sample) for term in terms]
    # R, which is 0
    test = ratio_test(terms, Design(), hidden, offset=-0.9, threshold=0.0, confidence=0.95)
    is_wrong = test.p_value < 0.05
    for side in (1, -1):
        assert np.mean(is_wrong & (side * test.mean_difference > 0.0)) <= 0.025
