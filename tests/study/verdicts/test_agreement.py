"""Agreement with published values: which lie inside our intervals, and how far the means differ."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from swarm_logistics_env.study import Study
from swarm_logistics_env.study.verdicts.agreement import agreement, agreements
from swarm_logistics_env.study.verdicts.cell import Cell
from tests.made_up import delivered

ARM = Study(seeds=3, sizes=[{"values": [5, 10]}]).plan().cells[0][2]
P = [18, 20, 22]  # mean 20 [15.0, 25.0]; one run [10.1, 29.9]


def cell(published: float | None, policy: str = "homing", p: list[int] = P) -> Cell:
    runs = [delivered(n) for n in p]
    return replace(Cell.of(policy, "", ARM, runs), published=published, counted=True)


def test_published_values_are_met_or_missed_by_our_intervals() -> None:
    cells = [cell(p) for p in (20.0, 15.1, 24.9, 14.9, 25.1, 10.2, 29.8, 10.0, 30.0)]
    homing = agreement("homing", cells)
    assert (homing.policy, homing.cells) == ("homing", tuple(cells))
    assert homing.met == tuple(cells[:3])
    assert homing.misses == tuple(cells[-2:])
    logs = [abs(math.log(20.0 / (c.published or 0.0))) for c in cells]
    assert homing.mean_log_error == pytest.approx(sum(logs) / len(logs))


def test_nothing_is_inside_an_interval_that_is_not_there() -> None:
    one_seed = agreement("homing", [cell(20.0, p=[20])])
    assert (one_seed.met, one_seed.misses, one_seed.mean_log_error) == ((), (), 0.0)
    nothing = agreement("homing", [cell(20.0, p=[0, 0, 0]), cell(20.0)])
    assert nothing.mean_log_error is None


def test_policies_whose_cells_are_all_played_agree_or_not() -> None:
    broken = replace(cell(20.0, "swarm-dt"), problem="1 of 3 runs failed")
    uncounted = replace(cell(9.0, "central"), counted=False)
    cells = [cell(20.0), cell(20.0, "swarm-dt"), cell(25.0), broken, uncounted]
    (only,) = agreements(cells)
    assert (only.policy, only.cells) == ("homing", (cells[0], cells[2]))
