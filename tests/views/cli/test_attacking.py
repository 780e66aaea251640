"""`attack`: what it leaves when it is stopped."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env.study import attack
from swarm_logistics_env.views.cli import app


@pytest.mark.parametrize("option", ["", "--out mine"])
def test_a_search_that_is_stopped_says_where_it_is_kept(
    option: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(attack, "attack", stop)
    assert app.run(["attack", "homing", *option.split()]) == 130
    directory = "mine" if option else Path("results", "attack-homing")
    assert capsys.readouterr().err == (
        f"\nStopped. What is finished is kept in {directory}; the same command goes on.\n"
    )
