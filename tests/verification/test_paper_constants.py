"""The search of the paper's constants: what is planted is found, and nothing is played twice."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, policies, run_episode
from swarm_logistics_env.studies.presets import fault, size
from swarm_logistics_env.studies.runs import Run
from swarm_logistics_env.studies.store import Store
from verification import paper_constants
from verification.paper_constants import (
    CELLS,
    ITEMS,
    PUBLISHED,
    RANGES,
    TABLE_I,
    Budget,
    Found,
    Players,
    candidates_at,
    defaults,
    errors,
    halves,
    places_of,
    play,
    spread,
)
from verification.paper_model import Model, fitted
from verification.paper_profile import identify

NAMES = list(RANGES)
TINY = Budget(first=8, rounds=((2, 1), (1, 2)), fresh=2, reference=3, duration=2.0)


def test_each_half_has_its_share_of_every_table_and_mode() -> None:
    one, other = halves()
    assert sorted(one + other) == list(range(len(CELLS)))
    for _, group in groupby(range(len(CELLS)), lambda k: (CELLS[k].kind, CELLS[k].name)):
        assert abs(sum(1 if k in one else -1 for k in group)) <= 1


def test_candidates_keep_their_places() -> None:
    places = spread(16, "test")
    assert np.allclose(places_of(candidates_at(places)), places, atol=0.01)
    (same,) = candidates_at(places_of([defaults()]))
    assert same == defaults()


def test_the_defaults_play_what_the_paper_describes() -> None:
    scenarios = (Scenario(n_items=100, n_robots=5, duration=60.0), Scenario(duration=60.0))
    expected = [
        run_episode(scenario, policies.load("swarm-dt"), seed=7, faults=faults).delivered
        for scenario, faults in zip(scenarios, ([], [Fault("FM4", 3)]))
    ]
    cells = [CELLS.index(cell) for cell in (size(5), fault("FM4", 3))]
    played = Players(Store(None), duration=60.0).played(defaults(), cells, [7])
    assert played[:, 0].tolist() == expected
    assert sum(expected) > 0


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Found]:
    """A folder with the runs of a small search, and what it found."""
    folder = tmp_path_factory.mktemp("search")
    with Store(folder / "runs.sqlite") as store:
        return folder, play(Players(store, TINY.duration), TINY)


def test_a_search_goes_on_where_it_was(
    searched: tuple[Path, Found], monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing_is_left(runs: Iterable[Run]) -> Iterator[object]:
        assert not list(runs)
        return iter(())

    folder, found = searched
    monkeypatch.setattr(paper_constants, "serial", nothing_is_left)
    with Store(folder / "runs.sqlite") as store:
        again = play(Players(store, TINY.duration), TINY)
    assert [one.searched for one in again.judged] == [one.searched for one in found.judged]
    assert np.array_equal(again.p_first, found.p_first)
    for one in found.judged:
        assert not set(one.cells) & set(one.searched.cells)
        assert one.difference.value == pytest.approx(one.losses[0] - one.losses[1])


def test_the_page_quotes_what_was_played(
    searched: tuple[Path, Found], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "docs")
    script = importlib.import_module("play_constants")
    page, figure = tmp_path / "page.md", tmp_path / "figure.svg"
    page.write_text(script.PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.setattr(script, "PAGE", page)
    monkeypatch.setattr(script, "FIGURE", figure)
    folder, found = searched
    script.main(folder, TINY)
    text = page.read_text(encoding="utf-8")
    for one in found.judged:
        assert all(f"| {loss:.3f} |" in text for loss in one.losses)
    assert f"{found.p_trade[-1].mean():.1f}" in text
    assert all(f"{name} [" in figure.read_text(encoding="utf-8") for name in script.UNITS)


@pytest.fixture(scope="module")
def planted() -> Model:
    """A model of cells of which only diffusion and, in Table I, the items decide."""
    rng = np.random.default_rng(0)
    places = spread(64, "planted")
    change = 2.0 * (places[:, [NAMES.index("diffusion")]] - 0.5)
    means = PUBLISHED * np.exp(change * np.ones(len(CELLS)))
    means[:, list(TABLE_I)] *= np.exp(places[:, [NAMES.index(ITEMS)]] - 0.5)
    uses = [[name != ITEMS or k in TABLE_I for name in NAMES] for k in range(len(CELLS))]
    return fitted(places, rng.poisson(means).astype(np.float64), np.array(uses))


def test_the_model_finds_the_mean_behind_single_runs(planted: Model) -> None:
    middle = np.full((1, len(NAMES)), 0.5)
    assert float(errors(planted.means(middle), range(len(CELLS))).mean()) < 0.1
    assert planted.explained[list(TABLE_I)[3:]].min() > 0.8
    other = middle.copy()
    other[:, NAMES.index(ITEMS)] = 1.0
    same = np.setdiff1d(range(len(CELLS)), TABLE_I)
    assert np.array_equal(planted.means(other)[:, same], planted.means(middle)[:, same])


def test_tables_identify_the_constant_that_decides_and_no_other(planted: Model) -> None:
    runs = np.random.default_rng(1).poisson(PUBLISHED[:, None], (len(CELLS), 30))
    told = identify(planted, runs.astype(np.float64))
    low, high = told.profiles["diffusion"].kept
    assert low < np.sqrt(0.1 * 4.0) < high
    assert told.profiles["diffusion"].share < 0.4
    assert told.profiles["taxis_gain"].share > 0.7
    assert told.profiles["wall_distance"].share > 0.7
    assert told.right.low is not None
    assert told.right.low < told.right.value < 0.3
