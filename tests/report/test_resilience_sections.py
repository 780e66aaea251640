"""The chapter of a study's report on who is to blame."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from swarm_logistics_env.cli.app import app
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.report.resilience_sections import attribution_section
from swarm_logistics_env.studies import Study

FIELDS = {
    "seeds": 2,
    "scenario": {"n_robots": 6, "n_items": 10, "warehouse_width": 5.0, "duration": 30.0},
    "faults": [{"modes": ["FM4"], "robots": [1]}],
}


def test_what_blame_finds_for_a_study_stands_in_its_report(tmp_path: Path) -> None:
    study = Study(out=tmp_path, **FIELDS)
    study.run()
    study.report()
    page, text = tmp_path / "report.html", tmp_path / "report.md"
    assert "Who is to blame" not in text.read_text(encoding="utf-8")
    blamed = ["blame", "swarm-dt", "--fault", "FM4:1@10", "--seeds", "2", "--processes", "1"]
    result = CliRunner().invoke(app, [*blamed, "--study", str(tmp_path)])
    assert result.exit_code == 0, result.output
    folder = tmp_path / "blame-swarm-dt-FM4-1@10"
    assert {path.name for path in folder.iterdir()} >= {"attribution.csv", "attribution.png"}
    for path in (page, text):
        report = path.read_text(encoding="utf-8")
        assert "Who is to blame" in report
        assert "deliveries that FM4 of 1 (by the seed) from 10 s costs" in report
        assert "it holds what is asked for" in report
    assert (tmp_path / "figures" / "blame-swarm-dt-FM4-1-10.svg").exists()
    changed = CliRunner().invoke(app, [*blamed, "--study", str(tmp_path), "--set", "n_items=9"])
    assert changed.exit_code != 0
    assert "--study has a scenario" in f"{changed.output}{changed.exception}"


def test_a_table_of_another_version_is_named(tmp_path: Path) -> None:
    path = tmp_path / "attribution.csv"
    for text in ("", "policy,fault\nswarm-dt,FM4\n", "\x00"):
        path.write_text(text)
        with pytest.raises(StudyError, match=r"attribution\.csv is no table of this version"):
            attribution_section(path)
