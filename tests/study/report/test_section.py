"""Numbers and verdicts in words: every surface names the level of what it prints, and its side."""

from __future__ import annotations

import csv
import html
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from swarm_logistics_env import spi
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.for_a_paper import in_a_sentence
from swarm_logistics_env.study.report.latex import latex_tables
from swarm_logistics_env.study.report.section import (
    bracketed,
    count_words,
    digits_of,
    fixed,
    interval_to_clear,
    join_names,
    levels,
    number,
    percent,
    plural,
    share_in_words,
    slug,
    time_to_clear,
    width_of,
)
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.report.write import markdown, write_report
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from tests.made_up import delivered, looked_at

NUMBERS = st.floats(-3.0, 3.0) | st.floats(-0.02, 0.02) | st.floats(0.98, 1.02)


@given(value=NUMBERS, threshold=st.sampled_from([0.0, 1.0, -1 / 3, 0.1]), digits=st.integers(0, 3))
def test_no_number_is_rounded_onto_a_threshold_or_beyond_it(
    value: float, threshold: float, digits: int
) -> None:
    assume(abs(value - threshold) > 1e-8)
    shown = fixed(value, digits, [threshold])
    assert (float(shown) > threshold, float(shown) < threshold) == (
        value > threshold,
        value < threshold,
    )
    assert abs(float(shown) - value) <= 0.5000001 * 10.0**-digits
    near = abs(round(value, digits) - threshold) <= 10.0**-digits
    assert near or len(shown.rpartition(".")[2]) == digits or not digits


def test_an_interval_is_shown_beside_its_threshold() -> None:
    assert bracketed(spi.Interval(0.0521, -0.0049, 0.0986), 2) == "0.05 [-0.00, 0.10]".replace(
        "-0", "0"
    )
    assert bracketed(spi.Interval(0.0521, -0.0049, 0.0986), 2, [0.0]) == "0.05 [-0.005, 0.10]"
    rng = np.random.default_rng(0)
    p = rng.poisson(40, 20)
    estimate = spi.scalability(p, p + 1 + rng.integers(0, 2, 20), n=40, m=1, threshold=1.0)
    assert estimate.low is not None
    rounded = round(estimate.low, 2)
    assert fixed(estimate.low, 2) in bracketed(estimate, 2)
    # A threshold that would be shown as the limit is, gets it more digits.
    assert fixed(estimate.low, 2, [rounded]) != fixed(rounded, 2)
    assert fixed(np.inf, 2, [0.0]) == "∞"


# Of P, and of the methods: a level of all looks together.
ALWAYS_95 = r"(P|one run|P ours) \[95 %\]|the true value with 95 %|one of our|\(95 %\)"


def test_every_surface_names_the_level_that_it_prints(
    stopped: StudyResults, tmp_path: Path
) -> None:
    level_by_question = {
        test.question.removesuffix(", 1 of 25"): percent(test.estimate.confidence)
        for test in stopped.verdicts
        if test.estimate
    }
    assert len({*level_by_question.values()}) == 3
    assert "95 %" not in level_by_question.values()
    assert percent(stopped.level) == answer(stopped).level
    write_report(stopped, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    full_document = document(stopped)
    surfaces = {
        "terminal": terminal_answer(answer(stopped), 80),
        "report": markdown(full_document),
        "page": page.split("<script", maxsplit=1)[0],
        "tables": latex_tables(full_document.paper).replace("\\,\\%", " %"),
        "sentence": in_a_sentence(stopped, answer(stopped)),
        "figures": " ".join(figure.note for figure in full_document.figures),
    }
    tex = surfaces["tables"].replace("$", "")
    for name, text in surfaces.items():
        assert "95 %" not in re.sub(ALWAYS_95, "", text), name
    # Where levels differ, that of most stands in the heading, the others in their rows.
    most = answer(stopped).level
    assert most in level_by_question.values()
    heading = f"| question | value | {most} interval | verdict |"
    assert heading in surfaces["report"]
    assert f">value [{most}]<" in page
    assert re.search(rf"{most} interval +verdict", surfaces["terminal"])
    letters = dict(re.findall(r"^([a-z]): interval of (.+)\.$", surfaces["terminal"], re.MULTILINE))
    for question, level in level_by_question.items():
        (row,) = re.findall(rf"^{question}, .*$", surfaces["terminal"], re.MULTILINE)
        own = ""
        if level != most:
            (letter,) = [letter for letter, other in letters.items() if other == level]
            own = f" {letter}"
            assert f"{letter}: interval of {level}" in tex
        assert re.search(rf"\]{own}  +\w", row)
        assert f", {level} interval [" in surfaces["report"]
        assert re.search(
            rf"^\| {question}, 1 of 25 \| .*\]{own} \|", surfaces["report"], re.MULTILINE
        )
        indicator, _, fault = question.partition(" ")
        mode = fault.split()[0]
        assert re.search(rf"\| {mode}, m = 1 \|.*\| {level} \|", surfaces["report"])
        part = page.split(f">Robustness {indicator}</th>")[1]
        assert re.search(rf'{fault}, 1 of 25</th><td class="number">.*\]{own}</td>', part)
        assert re.search(rf"^{question}, 1 of 25 & .*\]{own}.? & ", tex, re.MULTILINE)
    assert f"{levels(stopped.verdicts)} intervals" in surfaces["figures"]
    worst = f", R -0.55 [-0.67, -0.37] at {level_by_question['R FM4 no delivery']}, refuted"
    assert worst in surfaces["sentence"]
    assert "bars: 95 % intervals" in full_document.runs.note
    for file, column in (("claims", "confidence"), ("figures/answer", "confidence")):
        with (tmp_path / f"{file}.csv").open(newline="") as lines:
            assert len({row[column] for row in csv.DictReader(lines)}) == 3
    with (tmp_path / "cells.csv").open(newline="") as lines:
        assert {row["confidence"] for row in csv.DictReader(lines)} == {"0.95"}


def test_the_words_of_a_verdict_are_the_same_in_terminal_page_latex_and_csv(
    stopped: StudyResults, tmp_path: Path
) -> None:
    write_report(stopped, tmp_path)
    with (tmp_path / "claims.csv").open(newline="") as lines:
        words = [row["in_words"] for row in csv.DictReader(lines)]
    assert words == [verdict.in_words for verdict in stopped.verdicts]
    assert {*words} > {"open"}
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    in_page = [html.unescape(word) for word in re.findall(r'<td class="word \w+">(.*?)</td>', page)]
    assert in_page == words
    report = (tmp_path / "report.md").read_text(encoding="utf-8")
    latex = (tmp_path / "tables.tex").read_text(encoding="utf-8")
    tex = re.sub(r"\$|\\phantom{.*?}", "", latex).replace("\\,\\%", " %")
    for verdict in stopped.verdicts:
        condition = f"{verdict.after.name}, m = 1"
        question = verdict.question
        assert re.search(rf"^\| {question} \|.*\| {verdict.in_words} \|$", report, re.MULTILINE)
        assert re.search(rf"^\| {condition} \|.*\| {verdict.in_words} \|$", report, re.MULTILINE)
        assert re.search(rf"^{question} &.*& {verdict.in_words} \\\\", tex, re.MULTILINE)
        row = rf"^{verdict.after.name}, {{m = 1}} &.*& {verdict.in_words} \\\\"
        assert re.search(row, tex, re.MULTILINE)


def test_a_paper_is_told_conditions_seeds_and_why_each_question_was_played_no_further() -> None:
    results = looked_at(["FM2", "FM4"])
    sentence = in_a_sentence(results, answer(results))
    world = "a warehouse of 10 m x 10 m with 60 items, robots of 2 m/s"
    how = "(preset paper, engine chipmunk), 60 paired seeds (0 to 59)"
    assert sentence.startswith(f"swarm-dt in {world} {how}. swarm-dt: P [95 %] = ")
    worst = "FM4 no delivery, 1 of 25"
    counts = f"1 refuted ({worst}), 1 with P within 10 %"
    assert f"; robustness R: {counts}; lowest at {worst}: P 3" in sentence
    assert sentence.endswith(
        "looked at after 10, 20, 30, 40, 50, 60 seeds: of 2 questions 1 stopped where clear, "
        "1 after all 60 seeds."
    )


def test_the_time_to_clear_of_several_trainings_is_that_of_their_means() -> None:
    plan = Study(policies=["ppo-robust@all"], seeds=3, sizes=[{"values": [2, 4]}]).plan()
    outcomes = {
        (run.case.key, run.seed): delivered(5, ended_at=100.0 + number**2 % 17, all_delivered=True)
        for number, run in enumerate(plan.runs)
    }
    cell = judge(plan, outcomes).cells[0]
    times = np.array([outcome.ended_at for outcome in cell.outcomes]).reshape(7, 3)
    expected = spi.mean_interval(times)
    assert interval_to_clear(cell) == expected != spi.median_interval(times.ravel())
    assert time_to_clear(cell) == bracketed(expected, 0)


def test_names_are_joined_as_a_sentence_has_them() -> None:
    assert [join_names(names) for names in (["a"], ["a", "b"], ["a", "b", "c"])] == [
        "a",
        "a and b",
        "a, b and c",
    ]


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        ([digits_of(p) for p in (-1.0, 0.0, 0.0123, 0.1, 0.999, 1.0)], [1, 1, 4, 3, 3, 1]),
        ([digits_of(0.5, width) for width in (0.0, 0.2, 0.00031, np.inf)], [3, 3, 4, 3]),
        ([digits_of(40.0, width) for width in (0.0, 5.0, 0.5, 0.012)], [1, 1, 1, 2]),
        ([width_of(spi.Interval(2.0, *ends)) for ends in ((1.0, 4.0), (None, 4.0))], [3.0, 0.0]),
        ([fixed(value, 2) for value in (-0.001, 1.005, -np.inf)], ["0.00", "1.00", "-∞"]),
        ([bracketed(spi.Interval(2.0, 1.0, None), 1), bracketed(None, 1)], ["2.0", "–"]),
        ([bracketed(spi.Interval(2.0, 1.0, np.inf), 0)], ["2 [1, ∞]"]),
        ([number(None), number(1.23456), number(1.25, 1)], ["–", "1.235", "1.2"]),
        ([percent(level) for level in (0.95, 0.98765, 0.9999)], ["95 %", "98.77 %", "99.99 %"]),
        ([percent(0.99991)], ["> 99.99 %"]),
        ([share_in_words(spi.Interval(0.158, 0.096, 0.234))], ["16 % [10, 23]"]),
        ([share_in_words(spi.Interval(0.158, None, 1.0))], ["16 % [0, 100]"]),
        ([plural(n, "claim") for n in (0, 1, 2)], ["0 claims", "1 claim", "2 claims"]),
        ([slug("R, S", "a/b_c", 1.5, "ü"), len(slug("a" * 99))], ["R-S-a-b-c-1-5", 80]),
        (
            [count_words(["open", "refuted", "supported (n < 10)", "undefined", "open"])],
            ["1 supported (n < 10), 1 refuted, 2 open, 1 undefined"],
        ),
    ],
)
def test_numbers_and_words_are_shown_alike_everywhere(
    shown: list[str | float], expected: list[str | float]
) -> None:
    assert shown == expected
