"""`judge`: trials from a file, as a command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swarm_logistics_env.cli import app

LAB = """Roboter;Fehler;Defekt;Kisten
8;;;12,5
8;;;11,25
8;;;13,1
8;Radbruch;1;10,5
8;Radbruch;1;9,75
8;Radbruch;1;11,5
"""


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("lab.csv").write_text(LAB)
    return tmp_path


def test_judge_prints_the_tables_and_leaves_nothing(
    lab: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert app.run(["judge", "lab.csv", "--column", "performance=Kisten", "--full"]) == 0
    printed = capsys.readouterr().out
    assert "| Radbruch, m = 1 | 10.6 [8.4, 12.8] | [6.2, 14.9] | -0.013 [" in printed
    assert [path.name for path in lab.iterdir()] == ["lab.csv"]


def test_a_small_performance_is_not_rounded_away(
    lab: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("rates.csv").write_text("N;P\n4;0,0123\n4;0,0131\n4;0,011\n8;0,02\n8;0,021\n8;0,019\n")
    assert app.run(["judge", "rates.csv", "--full"]) == 0
    assert "| N = 4 | 0.0121 [0.0095, 0.0148] | [" in capsys.readouterr().out


def test_judge_keeps_study_report_and_latex(lab: Path) -> None:
    Path("setup.toml").write_text('arena = "4 m x 4 m"\nrobots = 8\n')
    given = ["--column", "performance=Kisten", "--setup", "setup.toml", "--setup", "floor=tiles"]
    assert app.run(["judge", "lab.csv", *given, "--out", "out"]) == 0
    report = Path("out/report.md").read_text()
    assert "| arena | 4 m x 4 m |\n| robots | 8 |\n| floor | tiles |" in report
    tables = Path("out/tables.tex").read_text()
    assert r"{Radbruch, m = 1} & {10.6 [8.4, 12.8]} & {[6.2, 14.9]} & {-0.013 [" in tables
    assert tables.count(r"\begin{table}") == tables.count(r"\end{table}") > 1
    assert "95 \\%" in tables
    assert "_" not in tables.replace("\\_", "")


def trials(path: Path, seeds: range, scale: float) -> None:
    """Trials of set-ups that differ in how much a fault does: the same ones at the same seeds."""
    harm = np.random.default_rng(0).uniform(0.2, 1.0, 100)
    noise = np.random.default_rng(round(10 * scale))
    rows = ["robots,fault,faulty,seed,delivered"]
    for seed in seeds:
        whole = scale * (40 + noise.normal(0, 1))
        rows.append(f"8,none,0,{seed},{whole:.3f}")
        rows.append(f"8,wheel,2,{seed},{whole * harm[seed] + noise.normal(0, 1):.3f}")
    path.write_text("\n".join(rows))


def test_simulation_narrows_the_intervals_of_few_real_trials(
    lab: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trials(lab / "real.csv", range(12), 0.8)
    trials(lab / "model.csv", range(100), 1.0)
    assert app.run(["judge", "real.csv", "--simulated", "model.csv", "--out", "out"]) == 0
    printed = capsys.readouterr().out
    (row,) = (line for line in printed.splitlines() if line.startswith("| recorded | R > 0, wheel"))
    assert float(row.split("|")[5]) < 0.5
    assert "12 real trials of each condition, their set-ups simulated, and 88 further" in printed
    assert row in Path("out/report.md").read_text()
    # A study of them, kept before, does as well as the file.
    assert app.run(["study", "import", "model.csv", "--out", "model"]) == 0
    assert app.run(["judge", "real.csv", "--simulated", "model"]) == 0
    assert row in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["lab.csv", "--colum", "a=b"], "No such option: --colum"),
        (["lab.csv", "--column", "performance"], "--column performance: should be NAME=VALUE"),
        (["lab.csv", "--column", "performance=Kiste"], "'Kiste': did you mean 'Kisten'?"),
        (["lab.csv"], "has no column 'performance'"),
        (["lab.cvs"], "cannot read lab.cvs"),
        (["real.csv", "--setup", "nowhere.toml"], "--setup nowhere.toml: should be NAME=VALUE, or"),
        (["real.csv", "--setup", "lab.csv"], "--setup lab.csv is not TOML"),
        (["real.csv", "--simulated", "bare.csv"], "the simulated trials have no seeds"),
        (["real.csv", "--simulated", "few.csv"], "seed 5 of the real trials was not simulated"),
        (["real.csv", "--simulated", "other.csv"], "the simulated trials compare N 4 -> 8"),
    ],
)
def test_what_cannot_be_judged_ends_in_one_sentence(
    lab: Path, arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    trials(lab / "real.csv", range(12), 0.8)
    trials(lab / "few.csv", range(5), 1.0)
    (lab / "bare.csv").write_text("robots,p\n4,1\n8,2\n")
    sizes = [f"{n},{seed},{n}" for n in (4, 8) for seed in range(20)]
    (lab / "other.csv").write_text("\n".join(["robots,seed,p", *sizes]))
    assert app.run(["judge", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert len(said.splitlines()) == 1


def test_too_few_real_trials_keep_their_own_interval_and_say_so(
    lab: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trials(lab / "real.csv", range(9), 0.8)
    trials(lab / "model.csv", range(40), 1.0)
    assert app.run(["judge", "real.csv", "--simulated", "model.csv"]) == 0
    assert "R > 0, wheel, m = 2: 9 real runs: should be at least 10." in capsys.readouterr().out
