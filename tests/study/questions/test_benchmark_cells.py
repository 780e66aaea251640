"""The cells of the benchmark: what they follow from, and that they can be played."""

from __future__ import annotations

import shutil
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.policies.catalogue import TRAINED
from swarm_logistics_env.study.questions import benchmark_cells
from swarm_logistics_env.study.questions.benchmark_cells import (
    BASE,
    DEVELOPMENT,
    FIRST_SEED,
    HELD_OUT,
    N_CELLS,
    REFERENCE,
    benchmark_study,
    development_cells,
    drawn_cells,
    entry_digest,
    words_of,
)
from swarm_logistics_env.study.questions.plan import make_plan
from swarm_logistics_env.study.tasks.task import digest_of
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Warehouse


class Standing:
    """A policy of a user's own."""

    def __init__(self, value: object = 0) -> None:
        self.value = value

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode."""

    def act(self, observations: Any) -> Any:
        """Return no motion."""
        return np.zeros((len(observations), 4))


def test_cells_follow_from_their_source_alone() -> None:
    cells = drawn_cells("Any", "a", 6)
    assert cells == drawn_cells("Any", "a", 6)
    assert cells[:3] == drawn_cells("Any", "a", 3)
    assert len({*map(words_of, cells), *map(words_of, drawn_cells("Any", "b", 6))}) == 12


def test_the_development_half_is_the_declared_one() -> None:
    """Whoever changes the space or the drawing makes another edition."""
    cells = development_cells()
    assert cells[2].title == "Development 3"
    words = list(map(words_of, cells))
    assert words[2] == "n_robots = 25, n_items = 50, drive = holonomic, heading_drift = 0.02"
    assert words[1].endswith("max_acceleration = 4.0; FM1+FM4_jam, m = 1 from 250 s")
    assert digest_of(*words)[:16] == "1e086b027688bd07"
    assert (N_CELLS, REFERENCE) == ({DEVELOPMENT: 12, HELD_OUT: 24}, "homing-stock")


@pytest.mark.unmeasured
def test_worlds_are_as_declared_and_their_runs_begin() -> None:
    worlds = [BASE.replace(**cell.scenario) for cell in drawn_cells("Any", "any", 150)]
    for world in worlds:
        floor = world.warehouse_width * world.warehouse_height
        assert 1.0 <= floor / world.n_robots <= 10.0
        assert world.n_items * np.pi * world.item_radius**2 <= 0.05 * floor * (1.0 + 1e-6)
        assert (world.restock, world.orders) == (True, "next")  # nothing caps P
    floors = {world.floor for world in worlds}
    assert floors == {None, "aisles", "bottleneck", "large", "two_docks"}
    plan = make_plan(benchmark_study(PolicySpec.of("swarm-dt")))
    assert len(plan.cases) == 2 * sum(N_CELLS.values())
    for case in plan.cases[::6]:
        assert isinstance(case.scenario, Scenario)
        warehouse = Warehouse(case.scenario)
        warehouse.reset(FIRST_SEED)
        assert all(fault.onset < case.scenario.duration for fault in case.faults)


def test_each_entry_has_held_out_cells_of_its_own_and_the_same_development_half() -> None:
    n_development = N_CELLS[DEVELOPMENT]
    held_out: list[str] = []
    for name in ("swarm-dt", "homing"):
        study = benchmark_study(PolicySpec.of(name))
        assert (study.seed_numbers, study.scenario) == (range(530_000, 530_004), BASE)
        assert study.ablations[:n_development] == development_cells()
        drawn = study.ablations[n_development:]
        assert all(cell.title.startswith(HELD_OUT) for cell in drawn)
        held_out += map(words_of, drawn)
    assert len(set(held_out)) == 2 * N_CELLS[HELD_OUT]


def test_the_digest_is_of_the_content_of_an_entry(tmp_path: Path) -> None:
    copied = shutil.copy(TRAINED["ppo-robust"], tmp_path / "copied.safetensors")
    digests_of_copies = {
        entry_digest(PolicySpec.of(policy)) for policy in ("ppo-robust", str(copied))
    }
    assert len(digests_of_copies) == 1
    other_entries = (
        "ppo-robust@1",
        "ppo-robust@all",
        "homing",
        {"name": "homing", "parameters": {"wall_gain": 1.6}},
        Standing(1),
        Standing(2),
    )
    digests = {entry_digest(PolicySpec.of(policy)) for policy in other_entries}
    assert len(digests | digests_of_copies) == 7
    assert entry_digest(PolicySpec.of(Standing(1))) in digests


def test_what_has_no_cells_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(StudyError, match="homing-stock' is the benchmark's reference"):
        benchmark_study(PolicySpec.of(REFERENCE))
    monkeypatch.setattr(benchmark_cells, "REFERENCE", "homing")
    with pytest.raises(StudyError, match="'homing' is the benchmark's reference"):
        benchmark_study(PolicySpec.of("homing"))
    changing = PolicySpec.of(Standing(threading.Lock()))
    with pytest.raises(StudyError, match="cannot be compared with itself"):
        benchmark_study(changing)
