"""The report as files: what it holds, from outcomes that are made up."""

from __future__ import annotations

import base64
import csv
import re
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.study.report import write
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.drawing import PAGE_STYLE, SERIF, FigureStyle, Images
from swarm_logistics_env.study.report.section import Section, limits, word_to_count
from swarm_logistics_env.study.report.sentences import sentence
from swarm_logistics_env.study.report.write import (
    markdown,
    section_markdown,
    write_document,
    write_report,
)
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.verdicts.results import StudyResults
from tests.conftest import figures_drawn
from tests.made_up import delivered, judged, paper

FROZEN = Path(__file__).parents[2] / "frozen"


def test_no_headline_counts_a_verdict_that_assumes_normal_differences(few: StudyResults) -> None:
    assumed = [test for test in few.verdicts if "assumes_normal" in test.flags]
    decided = {word_to_count(test, "supported") for test in assumed}
    assert decided == {"supported (n < 10)"}
    assert {word_to_count(test, "open") for test in assumed} == {"open"}


def test_no_name_breaks_a_table() -> None:
    hostile = ("a|b", r"50 % of \a_{b}", "[x]", "~^&#$")
    table = Section("t_1", hostile, (hostile,))
    head, _, row = section_markdown(table).splitlines()[2:]
    assert head == row == r"| a\|b | 50 % of \a_{b} | [x] | ~^&#$ |"


@pytest.mark.parametrize("text", ["<img src=x>", "[a](b)", "![a](b)", "a < b", "x\x1b[31m"])
def test_no_name_is_markup_in_markdown(text: str) -> None:
    shown = text.replace("<i", "&lt;i").replace("](", r"]\(").replace("\x1b", r"\x1b")
    lines = section_markdown(Section(text, ("c",), ((text,),), (text,))).splitlines()
    assert [line for line in lines if shown in line] == [f"## {shown}", f"| {shown} |", shown]


@pytest.fixture(scope="module")
def directory(few: StudyResults, tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("report")
    with figures_drawn("svg"):
        write_report(few, directory)
    return directory


@pytest.mark.daily
def test_equal_rows_give_equal_bytes(tmp_path: Path) -> None:
    study = Study(seeds=3, sizes=[{"values": [5, 10]}])
    results = judged(study, lambda _, setting, seed: delivered(5 * (setting.value or 10) + seed))
    outcomes_reversed = dict(reversed(list(results.outcomes.items())))
    contents = []
    for name, outcomes in (("first", results.outcomes), ("second", outcomes_reversed)):
        folder = tmp_path / name
        with figures_drawn():
            write_report(replace(results, outcomes=outcomes), folder)
        files = [path for path in folder.rglob("*") if path.is_file()]
        contents.append({path.relative_to(folder): path.read_bytes() for path in files})
    assert contents[0] == contents[1]
    assert contents[0][Path("figures", "answer.png")].startswith(b"\x89PNG")
    assert contents[0][Path("figures", "answer.pdf")].startswith(b"%PDF")


def test_page_needs_nothing_but_itself(directory: Path) -> None:
    page = (directory / "report.html").read_text()
    assert not re.search(
        r"https?:|\bsrc=(?!\"data:)|<(link|iframe|object)\b|@import|url\((?!#)", page
    )
    # The browser itself refuses what would be loaded all the same.
    assert "default-src 'none'" in page
    linked = set(re.findall(r'href="([^#"][^"]*)"', page))
    assert linked
    assert all((directory / name).is_file() for name in linked)
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'href="#([^"]+)', page)) <= set(ids)


def test_every_figure_comes_as_drawing_and_data(few: StudyResults, directory: Path) -> None:
    names = [figure.name for figure in document(few).figures]
    assert len(names) == len(set(names)) >= 5
    page, text = (directory / "report.html").read_text(), (directory / "report.md").read_text()
    for name in names:
        file = directory / "figures" / name
        assert file.with_suffix(".png").is_file()
        assert file.with_suffix(".pdf").is_file()
        drawing = file.with_suffix(".svg").read_text()
        assert ElementTree.fromstring(drawing).tag.endswith("svg")
        assert len(file.with_suffix(".csv").read_text().splitlines()) > 1
        assert f'alt="{name}"' in page
        assert f"](figures/{name}.png)" in text
    # At the narrow warehouse every item was delivered.
    assert "† marks a P that is capped" in page
    for name in few.plan.specification.scenario.model_dump():
        assert f'<th scope="row">{name}</th>' in page


def test_every_verdict_quotes_seeds_interval_and_what_it_rests_on(few: StudyResults) -> None:
    for test in few.verdicts:
        assert test.estimate is not None
        words = sentence(few, test).text
        assert f"95 % interval {limits(test.estimate, 3)} over 4 paired seeds (0 to 3)" in words
        assert ("Alone: " in words) != test.estimate.untestable
        assert ("by Holm's method: " in words) != test.estimate.untestable
        assert ("†" in words) == test.saturated
    text = markdown(document(paper(unaffected=frozenset({"FM2"}))))
    assert re.search(
        r"P_F within 10 % of P_o\? Change -0\.[67]\d\d \[.*\] \(90 %\): refuted\.", text
    )
    assert "R = 0.080 exactly, over 10 paired seeds (0 to 9): unaffected." in text
    assert re.search(
        r"too few to exclude stalled ones .* p is \S+: it needs at least \d+ seeds\.", text
    )


def test_figures_for_a_journal_leave_the_page_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def drawn(_draw: object, height: float, note: str, style: FigureStyle = PAGE_STYLE) -> str:
        words = f"{style.width} {height:.1f} {len(note)}"
        return f'<svg xmlns="http://www.w3.org/2000/svg" id="{words}"/>'

    monkeypatch.setattr(write, "svg_image", drawn)
    monkeypatch.setattr(write, "images", lambda *parts: Images(drawn(*parts), b"%PDF", b"PNG"))
    study = Study(seeds=3, sizes=[{"values": [5, 10]}])
    report = document(judged(study, lambda _, at, seed: delivered(5.0 * at.value + seed)))
    (figure, *_) = report.figures
    shape = f"{figure.height:.1f} {len(figure.note)}"
    for style in (PAGE_STYLE, FigureStyle(3.4, SERIF)):
        paths = write_document(report, tmp_path, style)
        names = ["report.html", "report.md", "cells.csv", "claims.csv", "tables.tex"]
        assert [path.name for path in paths] == names
        file = tmp_path / "figures" / figure.name
        assert f'id="{style.width} {shape}"' in file.with_suffix(".svg").read_text()
        assert file.with_suffix(".pdf").read_bytes() == b"%PDF"
        assert file.with_suffix(".png").read_bytes() == b"PNG"
        of_page = drawn(None, figure.height, figure.note).encode()
        assert base64.b64encode(of_page).decode() in paths[0].read_text()


def test_a_folder_that_cannot_be_made_is_named(few: StudyResults, tmp_path: Path) -> None:
    (tmp_path / "figures").write_text("")
    with pytest.raises(StudyError) as refusal:
        write_report(few, tmp_path)
    assert str(refusal.value) == f"cannot write {tmp_path / 'figures'}: File exists"


@pytest.mark.parametrize("package", ["matplotlib", "jinja2"])
def test_without_the_extra_the_markdown_still_comes_and_one_seed_gives_values_alone(
    package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    names = {path.name for path in write_report(paper(seeds=1), tmp_path)}
    assert names == {"report.md", "cells.csv", "claims.csv", "tables.tex"}
    text = (tmp_path / "report.md").read_text()
    assert f"need {package}: pip install -c constraints.txt -e" in text
    assert "![" not in text
    assert "S = 0.611 (no interval) over one seed (0). Alone: open; by Holm" in text
    with (tmp_path / "claims.csv").open(newline="") as file:
        assert {row["verdict"] for row in csv.DictReader(file)} == {"open", "untestable"}
