"""The report as files: what it holds, from outcomes that are made up."""

from __future__ import annotations

import csv
import re
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from swarm_logistics_env.report.document import document
from swarm_logistics_env.report.section import Section, counted_as, sentence
from swarm_logistics_env.report.tables import sentences, tables
from swarm_logistics_env.report.write import (
    latex_tables,
    markdown,
    section_markdown,
    write_report,
)
from swarm_logistics_env.studies.presets import PAPER
from swarm_logistics_env.studies.results import StudyResults, judge
from tests.studies.made_up import paper


def test_no_headline_counts_a_verdict_that_assumes_normal_differences(few: StudyResults) -> None:
    assumed = [test for test in few.verdicts if "assumes_normal" in test.flags]
    decided = {counted_as(test, "supported") for test in assumed}
    assert len(decided) == 1
    assert decided.isdisjoint({"supported", "refuted", "equivalent"})
    assert {counted_as(test, "inconclusive") for test in assumed} == {"open"}


def test_no_name_breaks_a_table() -> None:
    hostile = ("a|b", r"50 % of \a_{b}", "[x]", "~^&#$")
    table = Section("t_1", hostile, (hostile,))
    head, _, row = section_markdown(table).splitlines()[2:]
    assert head == row == r"| a\|b | 50 % of \a_{b} | [x] | ~^&#$ |"
    latex = latex_tables([table])
    cells = (r"a|b", r"50 \% of \textbackslash{}a\_\{b\}", "[x]",
             r"\textasciitilde{}\textasciicircum{}\&\#\$")  # fmt: skip
    assert latex.count(" & ".join(f"{{{cell}}}" for cell in cells)) == 2
    assert r"\caption{t\_1}" in latex


@pytest.mark.parametrize("text", ["<img src=x>", "[a](b)", "![a](b)", "a < b", "x\x1b[31m"])
def test_no_name_is_markup_in_markdown(text: str) -> None:
    shown = text.replace("<i", "&lt;i").replace("](", r"]\(").replace("\x1b", r"\x1b")
    section = Section(text, ("c",), ((text,),), (text,))
    assert [line for line in section_markdown(section).splitlines() if shown in line] == [
        f"## {shown}", f"| {shown} |", shown
    ]  # fmt: skip


@pytest.fixture(scope="module")
def directory(few: StudyResults, tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("report")
    write_report(few, directory)
    return directory


def test_equal_rows_give_equal_bytes(few: StudyResults, directory: Path, tmp_path: Path) -> None:
    shuffled = replace(few, outcomes=dict(reversed(list(few.outcomes.items()))))
    write_report(shuffled, tmp_path)
    files, others = (
        {path.relative_to(here): path.read_bytes() for path in here.rglob("*.*")}
        for here in (directory, tmp_path)
    )
    assert files == others


def test_page_needs_nothing_but_itself(directory: Path) -> None:
    page = (directory / "report.html").read_text()
    assert not re.search(r"https?:|\bsrc=|<(link|img|iframe|object)\b|@import|url\((?!#)", page)
    # The browser itself refuses what would be loaded all the same.
    assert "default-src 'none'" in page
    beside = set(re.findall(r'href="([^#"][^"]*)"', page))
    assert beside
    assert all((directory / name).is_file() for name in beside)
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    referred = set(re.findall(r'(?:href="|url\()#([^")]+)', page))
    assert referred
    assert referred <= set(ids)


def test_every_figure_comes_as_drawing_and_data(few: StudyResults, directory: Path) -> None:
    names = [figure.name for figure in document(few).figures()]
    assert names[0] == "answer"
    assert len(names) == len(set(names)) >= 5
    page, text = (directory / "report.html").read_text(), (directory / "report.md").read_text()
    for name in names:
        assert (directory / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        drawing = (directory / "figures" / f"{name}.svg").read_text()
        assert ElementTree.fromstring(drawing).tag.endswith("svg")
        assert len((directory / "figures" / f"{name}.csv").read_text().splitlines()) > 1
        assert f'aria-label="{name}"' in page
        assert f"](figures/{name}.png)" in text


def test_every_verdict_quotes_seeds_interval_and_what_it_rests_on(few: StudyResults) -> None:
    for test in few.verdicts:
        assert test.estimate is not None
        low, high = test.estimate.low, test.estimate.high
        told = sentence(few, test)
        assert f"95 % interval [{low:.3f}, {high:.3f}] over 4 paired seeds (0 to 3)" in told.text
        assert "Unadjusted: " in told.text
        assert "Holm-adjusted: " in told.text
        assert ("†" in told.text) == test.saturated
        if test.after.kind == "fault":
            assert f"? {test.after.name}, m = {test.after.value:g}, N = 25." in told.head
    text = markdown(document(paper(same=frozenset({"FM2"}))))
    assert re.search(r"P_F within 10 % of P_o\? Change -0\.[67]\d\d \[.*\]: refuted\.", text)
    assert "R = 0.080 exactly, over 10 paired seeds (0 to 9): same runs." in text
    assert re.search(r"too few to exclude stalled runs .* It needs at least \d+ seeds\.", text)
    place = few.plan.comparisons[0].changed.case.key, 2
    blocked = judge(few.plan, {name: o for name, o in few.outcomes.items() if name != place})
    assert sentence(blocked, blocked.verdicts[0]).verdict == "blocked"
    assert "N = 10: 1 of 4 runs missing" in markdown(document(blocked))


def test_capped_cells_and_the_set_up_are_on_the_page(few: StudyResults, directory: Path) -> None:
    page = (directory / "report.html").read_text().replace("\N{NO-BREAK SPACE}", " ")
    assert "† marks a P that is capped" in page
    name = "A-Table-III-adaptability-to-warehouse-width"
    drawing = ElementTree.parse(directory / "figures" / f"{name}.svg")
    assert sum(element.text == "†" for element in drawing.iter()) == 3
    for name in few.plan.specification.scenario.model_dump():
        assert f'<th scope="row">{name}</th>' in page
    assert "Table I: scalability differs: n_items = 100." in page


@pytest.mark.parametrize("package", ["matplotlib", "jinja2"])
def test_without_the_extra_the_markdown_still_comes_and_one_seed_gives_values_alone(
    package: str, single: StudyResults, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    names = {path.name for path in write_report(single, tmp_path)}
    assert names == {"report.md", "cells.csv", "claims.csv", "tables.tex"}
    text = (tmp_path / "report.md").read_text()
    assert f"need {package}: in a clone, pip install -c constraints.txt '.[study]'" in text
    assert "![" not in text
    assert {path.suffix for path in (tmp_path / "figures").iterdir()} == {".csv"}
    assert "S = 0.611 (no interval) over one seed (0). Unadjusted: open; Holm-adj" in text
    with (tmp_path / "claims.csv").open(newline="") as file:
        assert {row["verdict"] for row in csv.DictReader(file)} == {"inconclusive"}


def test_every_sentence_of_the_paper_stands_beside_its_claims(few: StudyResults) -> None:
    tests = few.verdicts
    rows = sentences(PAPER, tests)
    assert len([row for row in rows if row[0]]) == len(PAPER.sentences) == 9
    assert len(rows) == sum(1 for test in tests if test.compared.question in PAPER.claims) == 41
    (text,) = [section for section in tables(few) if section.title.endswith("what the text says")]
    assert text.rows == tuple(rows)
    assert "re-implementation" in text.lines[0]
    tough = paper(lambda _, at: 39.0 if at.name == "FM4" else 20.0)
    verdicts = {claim: verdict for _, claim, _, verdict in sentences(PAPER, tough.verdicts)}
    assert verdicts["FM4, m = 3: R ≤ 0"] == "contradicted"
