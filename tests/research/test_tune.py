"""The declared search: its ranges, its worth, and that a second call goes on."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from research import tune
from research.tables import write_rows


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


def test_the_page_has_the_values_of_both_sets_and_the_gain_in_each_world(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "tuning.md"
    blocks = (
        f"<!-- tables: tuned {name} -->\n<!-- end of tables -->" for name in ("gains", "values")
    )
    page.write_text("\n".join(blocks))
    monkeypatch.setattr(tune, "PAGE", page)
    monkeypatch.setattr(tune, "RESULTS", tmp_path / "results" / "tune")
    for script, names in tune.SCRIPTS.items():
        p = dict.fromkeys(tune.WORLDS, 7)
        tune.append(tune.Tried(0, 5, tune.shipped(script), p), tmp_path / f"{script}.csv")
        rows = [("shipped", *[1.5] * len(names)), ("searched", *[2.5] * len(names))]
        write_rows(tmp_path / f"{script}-values.csv", ("set", *names), rows)
        gains = [("aisles", math.log(1.5), math.log(0.9), math.log(2.0))]
        write_rows(tmp_path / f"{script}-confirmed.csv", ("world", *tune.ENDS), gains)
    tune.publish(tmp_path)
    text = page.read_text()
    assert "| aisles | 50 [-10, 100] | 50 [-10, 100] | 50 [-10, 100] |" in text
    assert "| `homing-stock` | density | 1.5 | 2.5 |" in text
    assert "`homing`, 1 sets" in text
    assert tune.read_tried(tune.RESULTS / "homing.csv", "homing")
