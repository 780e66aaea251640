"""The second search: it finds what is better, and leaves alone what is best."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from research import search_again, tune


@pytest.mark.parametrize("best", [1.0, 2.0])
def test_a_search_finds_what_delivers_more(best: float, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped = tune.shipped("homing")

    def deliver(script: str, values: tune.Values, scenario: object, seed: int) -> int:
        return round(1000.0 / (1.0 + abs(values["sure"] / shipped["sure"] - best)))

    monkeypatch.setattr(search_again, "delivered", deliver)
    monkeypatch.setattr(search_again, "CONFIRMED", 4)
    scenario = search_again.PRESETS["paper"]
    with ThreadPoolExecutor(1) as threads:
        values, n_sets = search_again.search("homing", scenario, 0.2, threads)
        before, after, change = search_again.compare("homing", values, scenario, threads)
    assert n_sets >= search_again.SETS
    assert values["sure"] == pytest.approx(best * shipped["sure"], rel=0.2)
    assert after >= before
    assert change.value == pytest.approx(100.0 * (after - before) / before)
