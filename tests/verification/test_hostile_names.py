"""Names from files of others: no path of theirs is written, no sign of theirs steers a screen."""

from __future__ import annotations

import contextlib
import csv
import io
import itertools
import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.cli import app
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.records import file_name, steers
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.importing import import_results
from swarm_logistics_env.studies.specification import Specification

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
# Each word as it is, and after one sign, in turn; each sign before one word.
PAIRS = zip(itertools.cycle(SIGNS), WORDS, strict=False)
NAMES = sorted({*WORDS, *(sign + word for sign, word in PAIRS), *ALONE})
# No lone surrogate can stand in a file of UTF-8.
WRITTEN = [
    name for name in NAMES if name.isascii() or name.encode(errors="ignore").decode() == name
]


class Tags(HTMLParser):
    """Collects what a page executes or loads."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note tags that load, and attributes that execute."""
        self.found += [tag] if tag in ("img", "iframe", "object") else []
        self.found += [name for name, _ in attrs if name.startswith("on")]


def check_report(out: Path) -> None:
    page = (out / "report.html").read_text(encoding="utf-8")
    tags = Tags()
    tags.feed(page)
    assert tags.found == []
    assert "<script>alert" not in page
    report = (out / "report.md").read_text(encoding="utf-8")
    for active in ("<script", "<img", "](javascript", "](http", "\n# A heading"):
        assert active not in report
    assert not steers(report.replace("\n", ""))


def paths_under(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


@pytest.mark.parametrize("field", ["name", "task"])
def test_a_study_file_is_refused_before_anything_is_played(
    field: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    here = tmp_path / "a" / "b"
    here.mkdir(parents=True)
    monkeypatch.chdir(here)
    file = Path("evil.toml")
    for name in WRITTEN:
        if field == "name" and name in ("x" * 80, "con", "-rf", "0"):
            continue  # these are good names
        file.write_text(f"{field} = {json.dumps(name)}\n[[sizes]]\nvalues = [2, 3]\n")
        assert app.run(["study", "run", "evil.toml", "--processes", "1"]) == 2, name
        said = capsys.readouterr()
        assert field in said.err
        assert not steers((said.out + said.err).replace("\n", "")), name
        assert paths_under(tmp_path) == {"a", "a/b", "a/b/evil.toml"}, name


def test_names_of_files_stay_one_part_of_a_path() -> None:
    for name in NAMES:
        made = file_name(name)
        assert Specification(name=made).name == made
        assert Path(made).name == made
        try:
            kept = Specification(name=name).name
        except StudyError:
            continue
        assert Path(kept).name == kept


def test_labels_are_refused_or_reported() -> None:
    def is_accepted(label: str) -> bool:
        try:
            Study(policies=[{"name": "swarm-dt", "label": label}])
        except StudyError:
            return False
        return True

    # How a report shows those that are is tested with the policies of trials.
    assert [name for name in NAMES if is_accepted(name)] == [n for n in NAMES if not steers(n)]


def table(column: str, names: list[str]) -> str:
    """Return trials in which `column` has these names."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(["delivered", "robots", "faulty", "fault", *([column] * (column != "fault"))])
    faults = ["none", *names] if column == "fault" else ["none", "jam"]
    for name in [""] if column == "fault" else names:
        for fault in faults:
            for trial in range(3):
                extra = [name] if column != "fault" else []
                writer.writerow([trial + 5, 8, int(fault != "none"), fault, *extra])
    return text.getvalue()


@pytest.mark.parametrize("column", ["policy", "table", "fault"])
def test_cells_of_trials_are_refused_or_reported(
    column: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = []
    for number, name in enumerate(WRITTEN):
        file = tmp_path / "one.csv"
        file.write_text(table(column, [name]), encoding="utf-8", newline="")
        try:
            import_results(file, tmp_path / "tried" / str(number))
        except StudyError:
            continue
        kept.append(name.strip())
    kept = list(dict.fromkeys(kept))
    assert len(kept) >= 10
    file, out = tmp_path / "all.csv", tmp_path / "out"
    file.write_text(table(column, kept), encoding="utf-8", newline="")
    capsys.readouterr()
    assert app.run(["judge", str(file), "--out", str(out), "--full"]) == 0
    assert not steers(capsys.readouterr().out.replace("\n", ""))
    check_report(out)
    assert {path.name for path in tmp_path.iterdir()} == {"one.csv", "all.csv", "tried", "out"}


def test_headers_of_trials_are_refused_or_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.csv"
    for number, name in enumerate(WRITTEN):
        text = io.StringIO()
        rows: list[list[Any]] = [
            ["delivered", name],
            *([value, 1 + value % 2] for value in range(5, 13)),
        ]
        csv.writer(text).writerows(rows)
        file.write_text(text.getvalue(), encoding="utf-8", newline="")
        out = tmp_path / "tried" / str(number)
        if number % 10 == 0:
            done = app.run(["judge", str(file), "--out", str(out)])
            assert done == (0 if out.exists() else 2)
            if done == 0:
                check_report(out)
        with contextlib.suppress(StudyError):
            import_results(file, tmp_path / "again" / str(number))
        said = capsys.readouterr()
        assert not steers((said.out + said.err).replace("\n", ""))
