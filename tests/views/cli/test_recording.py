"""`record`: what it writes and says."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env import Fault, Scenario, policies
from swarm_logistics_env.policies.demonstrations import Demonstrations, record
from swarm_logistics_env.views.cli import recording
from tests.views.cli.conftest import Command

SMALL = "--episodes 1 --set n_robots=2 --set n_items=2 --set duration=1"


def test_minaris_data_sets_are_made_only_where_they_are_asked_for(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    names: list[str] = []
    monkeypatch.setattr(Demonstrations, "to_minari", lambda _, name: names.append(name))
    plain = command(f"record --policy homing {SMALL}")
    path = Path("results/demonstrations/homing.parquet")
    scenario = Scenario(n_robots=2, n_items=2, duration=1.0)
    recorded = record(policies.load("homing"), 1, scenario=scenario)
    assert plain == f"{path}: {recorded!r}\n"
    assert names == []
    assert command(f"record --policy homing {SMALL} --minari") == (
        f"{plain}Minari data set swarm-logistics/homing-v0\n"
    )
    assert names == ["swarm-logistics/homing-v0"]
    assert Path("results/demonstrations/homing.parquet").is_file()


@pytest.mark.parametrize(
    ("options", "names", "n_episodes", "keywords"),
    [
        ("", ["homing", "ppo-robust", "swarm-dt"], 10, {"seed": 0, "faults": [], "frame": False}),
        (
            "--policy homing-stock --policy homing --episodes 3 --seed 4 --fault FM1:1@0.5 --frame",
            ["homing-stock", "homing"],
            3,
            {"seed": 4, "faults": [Fault("FM1", 1, onset=0.5)], "frame": True},
        ),
    ],
)
def test_each_policy_is_recorded_as_the_options_say(
    options: str,
    names: list[str],
    n_episodes: int,
    keywords: dict[str, object],
    command: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario = Scenario(n_robots=2, n_items=2, duration=1.0)
    players: list[str] = []

    def noted(player: object, episodes: int, **fields: object) -> Demonstrations:
        assert episodes == n_episodes
        assert fields == {"scenario": scenario, **keywords}
        players.append(type(player).__name__)
        return record(policies.load("homing"), 1, scenario=scenario)

    monkeypatch.setattr(recording, "record", noted)

    world = SMALL.removeprefix("--episodes 1 ")
    printed = command(f"record {world} {options} --out own/folder").splitlines()
    files = [str(Path("own/folder", f"{name}.parquet")) for name in names]
    assert [line.partition(": ")[0] for line in printed] == files
    assert players == [type(policies.load(name)).__name__ for name in names]
