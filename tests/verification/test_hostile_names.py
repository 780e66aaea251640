"""Names from files of others: no path of theirs is written, no sign of theirs steers a screen."""

from __future__ import annotations

import csv
import io
import itertools
import json
import re
from contextlib import nullcontext
from pathlib import Path

import pytest

from swarm_logistics_env.core.errors import StudyError, SwarmLogisticsError
from swarm_logistics_env.core.records import file_name, has_control_signs
from swarm_logistics_env.study.questions.specification import Specification
from swarm_logistics_env.study.runs.recorded import RecordedStudy
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.trials import read_trials
from swarm_logistics_env.views.cli import app
from tests.conftest import figures_drawn

# A label of 300 signs leaves a drawing no room for its axes.
pytestmark = pytest.mark.filterwarnings("ignore:constrained_layout:UserWarning")

SIGNS = ["", "\x1b]0;owned\x07", "\x1b[2J", "\x9b31m", "\x00", "\n# A heading\n", "\r", "\x7f",
         "\u202e", "\u2028", "\ufeff", "\t"]  # fmt: skip
WORDS = ["../../victim", "/tmp/victim", "..\\victim", "..", ".hidden", "con", "a/b", "~/victim",
         "<script>alert(1)</script>", "<img src=x onerror=alert(1)>", "</script><script>alert(1)",
         "![x](http://x.test/y.png)", "[x](javascript:alert(1))", "{{ 7 * 7 }}", "$\\frac$",
         "[bold red]x[/]"]  # fmt: skip
ALONE = ["é" * 40, "x" * 300, "x" * 80, "`" * 5, "|", "\\", "a|b", "-rf", "%s%n", "0", "\ud800",
         "]"]  # fmt: skip
# Each word as it is, and after one sign, in turn.
NAMES = sorted({*WORDS, *map("".join, zip(itertools.cycle(SIGNS), WORDS)), *ALONE})
WRITTEN = [name for name in NAMES if name != "\ud800"]  # which no file of UTF-8 can hold

# The page's own pictures are drawings that stand in it; what stands in quotation marks is a text.
ACTIVE = (
    r'<img\b(?! src="data:image/svg)|<(?:iframe|object)\b'
    r'|<\w(?:[^<>"]|"[^"]*")*\son\w+=|<script>alert'
)


def check_report(out: Path) -> None:
    page = (out / "report.html").read_text(encoding="utf-8")
    assert re.findall(ACTIVE, page) == []
    report = (out / "report.md").read_text(encoding="utf-8")
    for active in ("<script", "<img", "](javascript", "](http", "\n# A heading"):
        assert active not in report
    assert not has_control_signs(report.replace("\n", ""))


@pytest.mark.parametrize("field", ["name", "task"])
def test_a_study_file_is_refused_before_anything_is_played(
    field: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "a" / "b"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    good = ("x" * 80, "con", "-rf", "0") if field == "name" else ()
    for name in (name for name in WRITTEN if name not in good):
        text = f"{field} = {json.dumps(name)}\n[[sizes]]\nvalues = [2, 3]\n"
        Path("evil.toml").write_text(text)
        assert app.run(["study", "run", "evil.toml", "--processes", "1"]) == 2, name
        printed = capsys.readouterr()
        assert field in printed.err
        assert not has_control_signs((printed.out + printed.err).replace("\n", "")), name
        assert [path for path in tmp_path.rglob("*") if path.is_file()] == [folder / "evil.toml"]


def test_labels_are_refused_or_reported() -> None:
    accepted = []
    for name in NAMES:
        made = file_name(name)
        assert Specification(name=made).name == made == Path(made).name
        try:
            Study(policies=[{"name": "swarm-dt", "label": name}])
        except StudyError:
            continue
        accepted.append(name)
    # How a report shows them is tested with the policies of trials.
    assert accepted == [name for name in NAMES if not has_control_signs(name)]


def table(column: str, names: list[str]) -> str:
    """Return trials in which `column` has these names; "header": which have such columns."""
    rows: list[list[object]] = []
    if column == "header":
        # The first condition has most trials, so that A is relative to it.
        rows = [["robots", "delivered", *names], [8, 4, *(1 for _ in names)]]
        for trial, index in itertools.product(range(3), range(-1, len(names))):
            rows.append([8, trial + 5, *(1 + (n == index) for n in range(len(names)))])
    elif column == "fault":
        rows = [["robots", "delivered", "faulty", "fault"]]
        for trial, name in itertools.product(range(3), ["none", *names]):
            rows.append([8, trial + 5, int(name != "none"), name])
    else:
        rows = [["robots", "delivered", "faulty", "fault", column]]
        for trial, name, fault in itertools.product(range(3), names, ["none", "jam"]):
            rows.append([8, trial + 5, int(fault != "none"), fault, name])
    text = io.StringIO()
    csv.writer(text).writerows(rows)
    return text.getvalue()


COLUMNS = ["policy", "table", "fault", "header"]


@pytest.mark.daily
@pytest.mark.parametrize("column", COLUMNS)
def test_cells_of_trials_are_refused_or_reported(
    column: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "one.csv", tmp_path / "out"
    accepted: list[str] = []
    # Each name in one of the columns.
    for number, name in enumerate(WRITTEN[COLUMNS.index(column) :: len(COLUMNS)]):
        file.write_text(table(column, [name]), encoding="utf-8", newline="")
        try:
            RecordedStudy.of(read_trials(file)).keep(tmp_path / "tried" / str(number))
        except SwarmLogisticsError:
            continue
        accepted.append(name.strip())
    assert len(accepted) >= 4
    file.write_text(table(column, list(dict.fromkeys(accepted))), encoding="utf-8", newline="")
    capsys.readouterr()
    # Names stand in all drawings alike: as a series or on an axis.
    with figures_drawn("svg") if column in ("policy", "fault") else nullcontext():
        assert app.run(["judge", str(file), "--out", str(out), "--full"]) == 0
    assert not has_control_signs(capsys.readouterr().out.replace("\n", ""))
    check_report(out)
    assert {path.name for path in tmp_path.iterdir()} == {"one.csv", "tried", "out"}
