"""`judge`: trials from a file, as a command."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env.cli import app

LAB = """robots;fault;faulty;boxes
8;;;12.5
8;;;11.25
8;;;13.1
8;wheel;1;10.5
8;wheel;1;9.75
8;wheel;1;11.5
"""


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("lab.csv").write_text(LAB)
    return tmp_path


def test_judge_prints_the_tables_and_leaves_nothing(
    lab: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert app.run(["judge", "lab.csv", "--column", "performance=boxes", "--full"]) == 0
    printed = capsys.readouterr().out
    assert "| wheel, m = 1 | 10.6 [8.4, 12.8] | [6.2, 14.9] | -0.013 [" in printed
    assert [path.name for path in lab.iterdir()] == ["lab.csv"]


def test_a_small_performance_is_not_rounded_away(
    lab: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("rates.csv").write_text("N;P\n4;0.0123\n4;0.0131\n4;0.011\n8;0.02\n8;0.021\n8;0.019\n")
    assert app.run(["judge", "rates.csv", "--full"]) == 0
    assert "| N = 4 | 0.0121 [0.0095, 0.0148] | [" in capsys.readouterr().out


def test_judge_keeps_study_report_and_latex(lab: Path) -> None:
    Path("setup.toml").write_text('arena = "4 m x 4 m"\nrobots = 8\n')
    given = ["--column", "performance=boxes", "--setup", "setup.toml", "--setup", "floor=tiles"]
    assert app.run(["judge", "lab.csv", *given, "--out", "out"]) == 0
    report = Path("out/report.md").read_text()
    assert "| arena | 4 m x 4 m |\n| robots | 8 |\n| floor | tiles |" in report
    tables = Path("out/tables.tex").read_text()
    assert r"{wheel, m = 1} & {10.6 [8.4, 12.8]} & {[6.2, 14.9]} & {-0.013 [" in tables
    assert tables.count(r"\begin{table}") == tables.count(r"\end{table}") > 1
    assert "95 \\%" in tables
    assert "_" not in tables.replace("\\_", "")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["lab.csv", "--colum", "a=b"], "No such option: --colum"),
        (["lab.csv", "--column", "performance"], "--column performance: should be NAME=VALUE"),
        (["lab.csv", "--column", "performance=boxe"], "'boxe': did you mean 'boxes'?"),
        (["lab.csv"], "has no column 'performance'"),
        (["lab.cvs"], "cannot read lab.cvs"),
        (["lab.csv", "--setup", "nowhere.toml"], "--setup nowhere.toml: should be NAME=VALUE, or"),
        (["lab.csv", "--setup", "lab.csv"], "--setup lab.csv is not TOML"),
    ],
)
def test_what_cannot_be_judged_ends_in_one_sentence(
    lab: Path, arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert app.run(["judge", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert len(said.splitlines()) == 1
