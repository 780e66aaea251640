"""Numbers and verdicts in words: every surface names the level of what it prints, and its side."""

from __future__ import annotations

import csv
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from swarm_logistics_env import spi
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.for_a_paper import in_a_sentence
from swarm_logistics_env.study.report.latex import latex_tables
from swarm_logistics_env.study.report.section import (
    bracketed,
    conclusion_text,
    fixed,
    join_names,
    levels,
    percent,
)
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.report.write import markdown, write_report
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.task import Outcome
from swarm_logistics_env.study.verdicts.results import StudyResults
from tests.made_up import delivered, judged, paper

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


MEANS = {"FM2": 38.5, "FM3": 32.5, "FM4": 15.0}  # of 40 items


def looked_at(modes: list[str]) -> StudyResults:
    """A study whose comparisons stop at looks of other levels than 95 %."""
    faults = [{"modes": modes, "robots": [1]}]
    study = Study(seeds=60, until_clear=True, faults=faults, indicators=["R"])

    def play(_: str, setting: Setting, seed: int) -> Outcome:
        draw = np.random.default_rng([seed, *map(ord, setting.name)])
        return delivered(draw.poisson(MEANS.get(setting.name, 40.0)), digest=f"{setting} {seed}")

    return judged(study, play)


@pytest.fixture(scope="module")
def stopped() -> StudyResults:
    return looked_at([*MEANS])


# Of P, and of the methods: a level of all looks together.
ALWAYS_95 = (
    r"(P|one run|P ours) \[95 %\]|the true value with 95 %|one of our|\(95 %\)"
    "|bar: 95 % interval</span><span>dot: one seed"
)


def test_every_surface_names_the_level_that_it_prints(
    stopped: StudyResults, tmp_path: Path
) -> None:
    level_by_question = {
        f"R {test.after.name}": percent(test.estimate.confidence)
        for test in stopped.verdicts
        if test.estimate
    }
    assert len({*level_by_question.values()}) == 3
    assert "95 %" not in level_by_question.values()
    write_report(stopped, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    full_document = document(stopped)
    surfaces = {
        "terminal": terminal_answer(answer(stopped), 80),
        "report": markdown(full_document),
        "page": page.split("<script", maxsplit=1)[0],
        "tables": latex_tables(full_document.paper).replace("\\,\\%", " %"),
        "sentence": in_a_sentence(stopped, answer(stopped)),
        "captions": " ".join(figure.caption for figure in full_document.figures),
    }
    for name, text in surfaces.items():
        assert "95 %" not in re.sub(ALWAYS_95, "", text), name
    # What the heading does not name stands behind the interval.
    common = percent(answer(stopped).level)
    for question, level in level_by_question.items():
        (row,) = re.findall(rf"^{question}, .*$", surfaces["terminal"], re.MULTILINE)
        assert (f"] {level}" in row) == (level != common)
        assert f", {level} interval [" in surfaces["report"]
    unfolded = re.sub(r"\s+", " ", surfaces["terminal"])
    assert f"{common} intervals, or as said behind them" in unfolded
    assert f"| question | value | {common} interval |" in surfaces["report"]
    assert f"R [{common}]" in surfaces["report"]
    assert f">value [{common}]</th>" in page
    assert f"{levels(stopped.verdicts)} intervals" in surfaces["captions"]
    assert f" = -0.55, {level_by_question['R FM4']} interval [-0." in surfaces["sentence"]
    view = r'role="img" aria-label="(.).*?<p class="legend"><span>bar: (.*?) interval'
    assert dict(re.findall(view, page, re.DOTALL)) == {"P": "95 %", "R": levels(stopped.verdicts)}
    for file, column in (("claims", "confidence"), ("figures/answer", "confidence")):
        with (tmp_path / f"{file}.csv").open(newline="") as lines:
            assert len({row[column] for row in csv.DictReader(lines)}) == 3
    with (tmp_path / "cells.csv").open(newline="") as lines:
        assert {row["confidence"] for row in csv.DictReader(lines)} == {"0.95"}


@pytest.mark.daily
def test_what_is_asked_is_answered_before_what_else_is_known() -> None:
    results = paper(seeds=100)
    equivalent = [test for test in results.verdicts if test.conclusion == "equivalent"]
    texts = {
        "FT": "open; P_F and P_S differ by less than 10 % of P_o",
        "R": "open; P changes by less than 10 %",
    }
    assert {test.compared.indicator for test in equivalent} == {*texts}
    assert [conclusion_text(test) for test in equivalent] == [
        texts[test.compared.indicator] for test in equivalent
    ]
    verdict_texts = [line.verdict_text for line in answer(results, most=None).lines]
    assert Counter(word for word in verdict_texts if word in texts.values()) == Counter(
        conclusion_text(test) for test in equivalent
    )
    text = markdown(document(results))
    assert not re.search(r"\| equivalent|\d equivalent", text)
    counts = Counter(test.compared.indicator for test in equivalent)
    sentence = in_a_sentence(results, answer(results))
    for symbol, words in texts.items():
        assert f"{words.removeprefix('open')} in {counts[symbol]}" in sentence


def test_one_question_is_answered_in_a_sentence() -> None:
    results = looked_at(["FM2"])
    sentence = in_a_sentence(results, answer(results))
    question = r"; R FM2, 1 of 25 = 0\.01, 97\.84 % interval \[-0\.06, 0\.08\]; R > 0: "
    verdict = r"open; P changes by less than 10 % \(Holm's method, 5 % error\)\.$"
    assert re.search(question + verdict, sentence)
    assert "lowest" not in sentence
    assert "question" not in sentence


def test_a_paper_is_told_the_world_and_what_is_not_decided() -> None:
    results = looked_at(["FM2", "FM4"])
    sentence = in_a_sentence(results, answer(results))
    world = "a warehouse of 10 m x 10 m with 60 items, robots of 2 m/s"
    assert sentence.startswith(f"swarm-dt in {world}: P [95 %]")
    n_open = sum(verdict.conclusion == "open" for verdict in results.verdicts)
    assert ("not decided: R of " in sentence) == (n_open > 0)


def test_names_are_joined_as_a_sentence_has_them() -> None:
    assert [join_names(names) for names in (["a"], ["a", "b"], ["a", "b", "c"])] == [
        "a",
        "a and b",
        "a, b and c",
    ]
