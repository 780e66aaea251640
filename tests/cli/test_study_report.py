"""`swarm-logistics study report` computes each measure once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.cli import app
from swarm_logistics_env.studies import Study


def test_self_repair_is_resampled_once_for_terminal_and_files(
    small: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = {**small["scenario"], "restock": True}
    faults = [{"modes": ["FM1"], "robots": [1], "onsets": [5.0]}]
    Study(out=tmp_path, seeds=2, scenario=scenario, faults=faults).run()
    resampled = spi.self_repair
    onsets = []

    def counted(*runs: Any, **asked: Any) -> spi.SelfRepair:
        onsets.append(asked["onset"])
        return resampled(*runs, **asked)

    monkeypatch.setattr(spi, "self_repair", counted)
    assert app.run(["study", "report", str(tmp_path)]) == 0
    assert onsets == [5.0]
    assert "Self-repair time" in (tmp_path / "report.md").read_text()
