"""The report: what it holds, from outcomes that are made up, so that the answer is known."""

from __future__ import annotations

import csv
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from swarm_logistics_env.report.document import document
from swarm_logistics_env.report.report_files import latex_tables, section_markdown, write_report
from swarm_logistics_env.report.result_tables import Section
from swarm_logistics_env.report.wording import counted_as, sentence
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparisons import Setting
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.studies.presets import PAPER
from swarm_logistics_env.studies.results import StudyResults, judge
from swarm_logistics_env.tasks.task import Outcome

NARROW = Setting("parameter", "warehouse_width", 5.0)


def results(
    seeds: int, p: Callable[[str, Setting], float] | None = None, **fields: Any
) -> StudyResults:
    """The paper's study if every cell gave the published P, and noise at several seeds."""
    plan = Study.preset("paper", seeds=seeds, **fields).plan()
    levels = {arm.condition.key: (policy, arm.setting) for policy, _, arm in reversed(plan.cells)}
    noise = np.random.default_rng(0)
    outcomes = {}
    for run in plan.runs():
        policy, level = levels[run.condition.key]
        delivered = p(policy, level) if p else PAPER.performance.get(level, 10.0)
        delivered += float(noise.normal(0, 2)) if seeds > 1 else 0.0
        times = np.sort(noise.uniform(0.0, 500.0, max(0, round(delivered))))
        capped = level == NARROW and run.seed == 0
        outcomes[run.key] = Outcome(run.key, times, all_delivered=capped)
    return judge(plan, outcomes)


def test_no_headline_counts_a_verdict_that_assumes_normal_differences(
    found: StudyResults,
) -> None:
    assumed = [row for row in rows_of(found.indicators) if "assumes_normal" in row.flags]
    decided = {counted_as(row, "supported") for row in assumed}
    assert len(decided) == 1
    assert decided.isdisjoint({"supported", "refuted", "equivalent"})
    assert {counted_as(row, "inconclusive") for row in assumed} == {"inconclusive"}


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


@pytest.fixture(scope="module")
def found() -> StudyResults:
    return results(4)


@pytest.fixture(scope="module")
def directory(found: StudyResults, tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("report")
    write_report(found, directory)
    return directory


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on one seed that gave exactly the paper's tables."""
    directory = tmp_path_factory.mktemp("single")
    write_report(results(1), directory)
    return directory


def files(directory: Path) -> dict[str, bytes]:
    return {
        path.relative_to(directory).as_posix(): path.read_bytes()
        for path in sorted(directory.rglob("*"))
        if path.is_file()
    }


def test_equal_rows_give_equal_bytes(found: StudyResults, directory: Path, tmp_path: Path) -> None:
    shuffled = replace(found, outcomes=dict(reversed(list(found.outcomes.items()))))
    write_report(shuffled, tmp_path)
    assert files(tmp_path) == files(directory)


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


def test_every_figure_comes_as_drawing_and_data(found: StudyResults, directory: Path) -> None:
    names = [figure.name for figure in document(found).figures()]
    assert len(names) == len(set(names)) >= 5
    page, text = (directory / "report.html").read_text(), (directory / "report.md").read_text()
    for name in names:
        assert (directory / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        drawing = (directory / "figures" / f"{name}.svg").read_text()
        assert ElementTree.fromstring(drawing).tag.endswith("svg")
        assert len((directory / "figures" / f"{name}.csv").read_text().splitlines()) > 1
        assert f'aria-label="{name}"' in page
        assert f"](figures/{name}.png)" in text


def test_every_verdict_quotes_seeds_interval_and_both_verdicts(found: StudyResults) -> None:
    for test in rows_of(found.indicators):
        estimate = test.estimate
        assert estimate is not None
        told = sentence(found, test)
        assert "4 paired seeds (0 to 3)" in told.text
        assert f"95 % interval [{estimate.low:.3f}, {estimate.high:.3f}]" in told.text
        assert "Unadjusted: " in told.text
        assert "Holm-adjusted: " in told.text
        assert re.search(r"N = \d+", told.head)
        if test.kind == "fault":
            assert f"Failure mode {test.factor}, m = {test.after:g}" in told.head


def test_blocked_verdict_says_why(found: StudyResults) -> None:
    key = found.plan.comparisons[0].changed.condition.run(found.plan.code, 2).key
    outcomes = {name: o for name, o in found.outcomes.items() if name != key}
    blocked = judge(found.plan, outcomes)
    told = sentence(blocked, next(rows_of(blocked.indicators)))
    assert told.verdict == "blocked"
    assert "N = 10: 1 of 4 runs missing" in told.text


def test_saturated_cells_and_all_that_rests_on_them_are_marked(
    found: StudyResults, directory: Path
) -> None:
    marked = {
        test.comparison for test in rows_of(found.indicators) if "†" in sentence(found, test).text
    }
    assert marked == {f"warehouse_width 5 -> {x}" for x in (10, 15, 20)}
    page = (directory / "report.html").read_text()
    assert "† marks a P that is capped" in page
    drawing = ElementTree.parse(directory / "figures" / "A.svg")
    assert sum(element.text == "†" for element in drawing.iter()) == 3
    drawing = ElementTree.parse(directory / "figures" / "S-Table-I-scalability.svg")
    assert not any(element.text == "†" for element in drawing.iter())


def test_set_up_sheet_is_whole(found: StudyResults, directory: Path) -> None:
    page = (directory / "report.html").read_text()
    for name in type(found.plan.specification.scenario).model_fields:
        assert f'<th scope="row">{name}</th>' in page
    assert "Table I: scalability differs: n_items = 100." in page.replace("\N{NO-BREAK SPACE}", " ")


def test_one_seed_gives_values_and_no_verdict(single: Path) -> None:
    text = (single / "report.md").read_text()
    assert "S = 0.611 (no interval) over one seed (0)." in text
    assert "FT = -0.615 (no interval)" in text
    assert "Unadjusted: inconclusive; Holm-adjusted: inconclusive." in text
    with (single / "claims.csv").open(newline="") as file:
        assert {row["verdict"] for row in csv.DictReader(file)} == {"inconclusive"}


@pytest.mark.parametrize("package", ["matplotlib", "jinja2"])
def test_without_the_extra_the_markdown_still_comes(
    package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    paths = write_report(results(1), tmp_path)
    assert {path.name for path in paths} == {"report.md", "cells.csv", "claims.csv"}
    text = (tmp_path / "report.md").read_text()
    assert f"need {package}: pip install 'swarm-logistics-env[study]'" in text
    assert "![" not in text
    assert {path.suffix for path in (tmp_path / "figures").iterdir()} == {".csv"}
