"""What is printed of a study: the same at every width, in a pipe and in a file."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from swarm_logistics_env.study.report.document import Document, document
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.runs.engines import Tally
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from swarm_logistics_env.views.cli import terminal
from swarm_logistics_env.views.cli.terminal import what_the_rest_takes
from tests.made_up import delivered, looked_at, paper


def console_of(width: int | None) -> Callable[..., Console]:
    """Return what stands for the console: a terminal of a width; None: a pipe or a file."""
    return partial(Console, width=width, force_terminal=width is not None)


@pytest.fixture(autouse=True)
def _no_wishes_about_terminals(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("COLUMNS", "FORCE_COLOR", "NO_COLOR", "TERM"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture(scope="module")
def documents() -> list[tuple[StudyResults, Document]]:
    """Return a study of two policies and one that plays until its verdicts are clear."""
    studies = [paper(seeds=4, policies=["swarm-dt", "swarm-dt-follow"]), looked_at()]
    return [(results, document(results)) for results in studies]


@pytest.mark.parametrize("width", [60, 80, 120, None])
def test_terminal_pipe_and_file_have_the_same_content_and_no_row_is_folded(
    width: int | None,
    documents: list[tuple[StudyResults, Document]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(terminal, "Console", console_of(width))
    monkeypatch.setattr(terminal, "write_document", lambda *_: [tmp_path])
    for results, report in documents:
        monkeypatch.setattr(terminal, "document", lambda _, report=report: report)
        terminal.show_report(results, tmp_path, full=False)
        output = capsys.readouterr().out
        text, _, _ = output.partition("\nReport: ")
        assert "\x1b" not in output
        assert width is None or max(map(len, text.splitlines())) <= width
        unfolded = " ".join(text.split())
        study_answer = report.answer
        for sentence in (*study_answer.head, *study_answer.notes):
            assert sentence in unfolded
        rows = text.splitlines()
        for line in study_answer.lines:
            numbers = "  ".join(filter(None, [line.value, study_answer.interval(line)]))
            ends = rf"^.*{re.escape(numbers)} .*{re.escape(line.verdict.in_words)}$"
            rows_of_line = [row for row in rows if re.fullmatch(ends, row)]
            # A narrow terminal has room for the ends of a question alone.
            question = line.question if width in (120, None) else line.question.partition(" ")[0]
            assert any(row.startswith(question) for row in rows_of_line), line


def test_at_a_terminal_text_is_folded_and_a_command_stands_whole_on_its_own_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text, command = "More seeds, which nobody has seen:", "judge homing --out mine-40"
    output = {
        None: f"{text} {command}\nAn end.\n",
        20: f"More seeds, which\nnobody has seen:\n{command}\nAn end.\n",
    }
    for width, expected in output.items():
        monkeypatch.setattr(terminal, "Console", console_of(width))
        terminal.say(text, command)
        terminal.say("An end.")
        assert capsys.readouterr().out == expected


def test_where_figures_cannot_be_drawn_it_says_what_to_install_instead_of_where_they_are(
    documents: list[tuple[StudyResults, Document]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(terminal, "document", lambda _: documents[0][1])
    monkeypatch.setattr(terminal, "write_document", lambda *_: [tmp_path])
    monkeypatch.setattr(terminal, "how_to_get_figures", lambda: "Install pens.")
    terminal.show_report(documents[0][0], tmp_path, full=False)
    assert capsys.readouterr().out.endswith(f"\nReport: {tmp_path}\nInstall pens.\n")


def test_why_stored_runs_do_not_count_is_told_before_what_was_played(
    capsys: pytest.CaptureFixture[str],
) -> None:
    terminal.say_what_was_played(Tally(4, 0, 1, 2.0, changes=("the code is new", "so is numpy")))
    assert capsys.readouterr().out.splitlines() == [
        "Runs that were stored before do not count: the code is new.",
        "Runs that were stored before do not count: so is numpy.",
        "4 runs played in 2.0 s, 2.00 episodes/s; 1 were kept from before; 0 failed",
    ]
    trace = 'Traceback:\n  File "/home/me/mine.py", line 7, in act\nError: \x07\n'
    terminal.say_what_was_played(Tally(0, 2, 3, 0.5, trace, left=7, gave_up=True))
    assert capsys.readouterr().out.splitlines() == [
        r"0 runs played in 0.5 s; 3 were kept from before; 2 failed, the first with Error: \x07",
        (
            "Stopped, as nothing works: runs of every condition have failed and none succeeded, so "
            "the other 7 were not played. The first failed at /home/me/mine.py:7. "
            "The same command plays all of them again."
        ),
    ]


def first_runs(n_seeds: int) -> StudyResults:
    """Return a study until it is clear in which seeds without a fault are played."""
    study = Study(seeds=60, until_clear=True, faults=[{"modes": ["FM1"], "robots": [1, 2]}])
    plan = study.plan()
    runs = [run for run in plan.runs if not run.case.faults and run.seed < n_seeds]
    return judge(
        plan, {(run.case.key, run.seed): delivered(40 + 4 * (run.seed % 3)) for run in runs}
    )


@pytest.mark.parametrize(
    ("n_seeds", "seconds_a_run", "first_look", "whole", "more"),
    [
        (10, 0.1, "0:04", "0:29", ""),
        (10, 1.0, "0:40", "4:50", " A run takes 1.0 s: {}"),
        (10, 4.0, "2:40", "19:20", " A run takes 4.0 s: {}"),
        (9, 4.0, "2:44", "19:24", ""),
        (60, 0.5, "0:00", "2:00", ""),
    ],
)
def test_how_long_the_rest_takes_is_told_and_of_a_slow_policy_what_fewer_seeds_would_tell(
    n_seeds: int, seconds_a_run: float, first_look: str, whole: str, more: str
) -> None:
    effects = (
        "--seeds 10 ends after the first look and tells effects of about 0.10, "
        "60 seeds those of about 0.04."
    )
    assert what_the_rest_takes(first_runs(n_seeds), seconds_a_run) == (
        f"The first look comes in {first_look}, the whole takes at most {whole} "
        f"(h:mm:ss or m:ss).{more.format(effects)}"
    )


def test_effects_that_fewer_seeds_would_tell_are_those_of_the_first_condition(
    documents: list[tuple[StudyResults, Document]],
) -> None:
    results = documents[1][0]
    p = results.cells[0].by_seed
    share = 2.8 * np.std(p, ddof=1) / np.mean(p)
    effects = [f"{share * math.sqrt(2 / n_seeds):.2f}" for n_seeds in (10, 60)]
    assert what_the_rest_takes(results, 2.0).endswith(
        f"tells effects of about {effects[0]}, 60 seeds those of about {effects[1]}."
    )


def test_of_a_study_that_goes_on_p_then_the_whole_answer_then_a_line_are_shown(
    documents: list[tuple[StudyResults, Document]],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(terminal, "time", SimpleNamespace(monotonic=lambda: clock.now))
    first_answer, later_answer = terminal.AnswerSoFar(8), terminal.AnswerSoFar(10)
    clock.now = 105.0
    first_answer.show(first_runs(10))
    p = "swarm-dt: P [95 %] = 43.6 [41.1, 46.1] items in 500 s, N = 25, no fault; 10 paired seeds"
    assert capsys.readouterr().err == (
        f"After 5 s: {p} (0 to 9).\n{what_the_rest_takes(first_runs(10), 2.5)}\n"
    )
    later_answer.show(first_runs(10))  # nothing is played of which to tell the time
    assert capsys.readouterr().err == f"After 5 s: {p} (0 to 9).\n"
    results, report = documents[1]
    clock.now = 106.6
    later_answer.show(results)
    assert capsys.readouterr().err == (
        f"After 7 s, a first look:\n{terminal_answer(report.answer)}\n\n"
    )
    later_answer.show(results)
    assert capsys.readouterr().err == (
        "After 7 s, 60 seeds: 2 of 3 questions are clear, 0 are played no further.\n"
    )


@pytest.mark.parametrize(
    ("study", "numbers", "effect", "head", "rows"),
    [
        (
            0,
            (7, 28, 34, 41),
            None,
            "4 seeds, of verdicts at 95 %",
            [
                "swarm-dt | S > 0, N 100 -> 150 | -0.135 | 29 | 0.308 | –",
                (
                    "swarm-dt | FT > 0, FM4, m = 1 | 0.000 | these runs deliver too little, or all "
                    "the same, to plan others by | – | –"
                ),
                (
                    "swarm-dt | A > 0, warehouse_width 5 -> 10 | 0.872 | it cannot lie below 0: "
                    "there is nothing to find | – | 10"
                ),
                "swarm-dt | change > 0, random-walk, N = 25 | – | no effect is named | 0.469 | 37",
            ],
        ),
        (
            1,
            (0, 1, 2),
            0.1,
            "60 seeds, of verdicts at 97.84 % to 99.17 %",
            [
                "swarm-dt | R > 0, FM2, m = 1 | 0.100 | 75 | 0.115 | 77",
                "swarm-dt | R > 0, FM3, m = 1 | 0.100 | 67 | 0.145 | 67",
                "swarm-dt | R > 0, FM4, m = 1 | 0.100 | 148 | 0.664 | 162",
            ],
        ),
    ],
)
def test_the_seeds_that_an_effect_needs_are_shown_of_each_comparison(
    study: int,
    numbers: tuple[int, ...],
    effect: float | None,
    head: str,
    rows: list[str],
    documents: list[tuple[StudyResults, Document]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    results = documents[study][0]
    verdicts = tuple(results.verdicts[number] for number in numbers)
    terminal.show_power("a study", replace(results, verdicts=verdicts), effect)
    title, _, columns, _, *table_rows, _, hint, _ = capsys.readouterr().out.splitlines()
    assert title == f"## Power, from {head}"
    n_seeds = head.partition(",")[0]
    assert columns == (
        "| policy | verdict on | assumed effect | seeds for 80% power | "
        f"distance that {n_seeds} find | seeds for equivalent at 10% |"
    )
    assert table_rows == [f"| {row} |" for row in rows]
    assert hint == "For another effect: swarm-logistics study plan 'a study' --effect 0.2"


def test_at_a_terminal_a_table_has_a_rule_and_a_bold_head_and_folds_no_number_away(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    console = partial(Console, width=30, force_terminal=True, color_system="standard")
    monkeypatch.setattr(terminal, "Console", console)
    rows = [("swarm-dt\x1b", "123.456 [122.1, 125.9]"), ("a", "1")]
    terminal.show_table("P [x]", ("policy", "P [y]"), rows, "* [best]", "two\x07")
    rule, head, *lines = capsys.readouterr().out.splitlines()
    assert rule == f"P [x] \x1b[92m{'─' * 24}\x1b[0m"
    bold = re.findall(r"\x1b\[1m([^\x1b]*)\x1b\[0m", head)
    assert "".join(bold).split() == ["policy", "P", "[y]"]
    assert [line.split() for line in lines] == [
        [r"swarm-dt\x1b", "123.456", "[122.1,"], ["125.9]"], ["a", "1"], ["*", "[best]"],
        [r"two\x07"], [],
    ]  # fmt: skip
