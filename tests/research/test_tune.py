"""The declared search: its ranges, its worth, and that a second call goes on."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from research import tune


def test_a_search_begins_with_the_shipped_values_and_goes_to_four_times_and_a_quarter() -> None:
    for script, names in tune.SCRIPTS.items():
        shipped = tune.shipped(script)
        assert list(shipped) == list(names)
        middle = tune.values_at(script, [0.5] * len(names))
        assert middle == pytest.approx(shipped, rel=1e-3)
        assert tune.values_at(script, [1.0] * len(names)) == pytest.approx(
            {name: 4.0 * value for name, value in shipped.items()}, rel=1e-3
        )
        assert tune.values_at(script, [-3.0] * len(names)) == pytest.approx(
            {name: value / 4.0 for name, value in shipped.items()}, rel=1e-3
        )


def test_worth_is_the_mean_logarithm_and_a_run_without_a_delivery_counts_as_one() -> None:
    assert tune.worth({"a": 10, "b": 1000}) == pytest.approx(math.log(100))
    assert tune.worth({"a": 0, "b": 1}) == 0.0


def test_what_was_tried_is_read_back_and_a_line_that_was_cut_short_is_not(tmp_path: Path) -> None:
    path = tmp_path / "new" / "homing.csv"
    assert tune.read_tried(path, "homing") == []
    p = {world: number for number, world in enumerate(tune.WORLDS)}
    tried = [tune.Tried(g, g + 5, tune.shipped("homing"), p) for g in (0, 1)]
    for tried_set in tried:
        tune.append(tried_set, path)
    assert tune.read_tried(path, "homing") == tried
    path.write_text(path.read_text().rstrip()[:-4])
    assert tune.read_tried(path, "homing") == tried[:1]
