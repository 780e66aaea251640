"""`attack`: what it searches, and what it leaves when it is stopped."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.study import attack
from swarm_logistics_env.study.attack import Attack
from swarm_logistics_env.views.cli import app

OPTIONS = "--robots 3 --mode FM1 --mode FM4 --budget 90 --fresh 8 --seed 5 --set n_robots=9"


@pytest.mark.parametrize(
    ("options", "search"),
    [
        ("", Attack(policy="homing", scenario=Scenario())),
        (
            f"{OPTIONS} --out mine",
            Attack(
                policy="homing", scenario=Scenario(n_robots=9), robots=3, modes=("FM1", "FM4"),
                budget=90, fresh=8, seed=5,
            ),
        ),
    ],
)  # fmt: skip
def test_a_search_that_is_stopped_says_where_it_is_kept(
    options: str,
    search: Attack,
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def stop(search_of_command: Attack, engine: object, out: Path) -> None:
        assert (search_of_command, str(out)) == (search, directory)
        raise KeyboardInterrupt

    directory = "mine" if options else str(Path("results", "attack-homing"))
    monkeypatch.setattr(attack, "attack", stop)
    assert app.run(["attack", "homing", *options.split()]) == 130
    assert capsys.readouterr().err == (
        f"\nStopped. What is finished is kept in {directory}; the same command goes on.\n"
    )
