"""`record`: what it writes and says."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env.policies.demonstrations import Demonstrations
from tests.views.cli.conftest import Command

SMALL = "--episodes 1 --set n_robots=2 --set n_items=2 --set duration=1"


def test_minaris_data_sets_are_made_only_where_they_are_asked_for(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    names: list[str] = []
    monkeypatch.setattr(Demonstrations, "to_minari", lambda _, name: names.append(name))
    plain = command(f"record --policy homing {SMALL}")
    assert names == []
    assert command(f"record --policy homing {SMALL} --minari") == (
        f"{plain}Minari data set swarm-logistics/homing-v0\n"
    )
    assert names == ["swarm-logistics/homing-v0"]
    assert Path("results/demonstrations/homing.parquet").is_file()
