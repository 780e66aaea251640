"""The value of a parameter that A is relative to."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.study.trials import Trials, read_trials

LAB = [
    "8,none,0,2,12",
    "8,none,0,2,11",
    "8,none,0,2,13",
    "8,none,0,1.5,9",
    "8,none,0,1.5,10",
    "8,jam,1,1.5,5",
    "8,jam,1,1.5,4",
]


def read(tmp_path: Path, rows: list[str], **reference: float) -> Trials:
    (tmp_path / "t.csv").write_text("\n".join(["robots,fault,m,width,P", *rows]))
    return read_trials(tmp_path / "t.csv", reference=reference)


def test_most_trials_without_a_fault_or_a_person_settle_the_reference(tmp_path: Path) -> None:
    for rows in (LAB, LAB[::-1]):
        trials = read(tmp_path, rows)
        assert trials.references == (("", "width", 2.0),)
        assert "A is relative to width = 2, as most trials" in trials.notes[-1]
        assert read(tmp_path, rows, width=1.5).references == (("", "width", 1.5),)
        # Two of each: a person has to say.
        assert read(tmp_path, rows[:2] + rows[2:][::-1], width=2.0).references[0][2] == 2.0
    assert read(tmp_path, LAB[1:]).references == ()
    four = [f"4,none,0,2,{p}" for p in (5, 6, 7)]  # as many of 4 robots, of the same width
    both = [*four, *LAB]
    assert read(tmp_path, both).references == (("", "width", 2.0),)


def test_a_reference_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(spi.IndicatorError, match="has no parameter 'widht' that varies, but"):
        read(tmp_path, LAB, widht=2.0)
    with pytest.raises(spi.IndicatorError, match=r"no trial without a fault has it: .* 1\.5, 2"):
        read(tmp_path, LAB, width=3.0)
