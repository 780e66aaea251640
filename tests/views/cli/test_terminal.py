"""What is printed of a study: the same at every width, in a pipe and in a file."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from rich.console import Console

from swarm_logistics_env.core.progress_bar import clock
from swarm_logistics_env.study.report.document import Document, document
from swarm_logistics_env.study.runs.engines import Tally
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from swarm_logistics_env.views.cli import terminal
from swarm_logistics_env.views.cli.terminal import what_the_rest_takes
from tests.made_up import delivered, looked_at, paper


def console_of(width: int | None) -> Callable[..., Console]:
    """Return what stands for the console: a terminal of a width; None: a pipe or a file."""
    return partial(Console, width=width, force_terminal=width is not None)


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
        printed = capsys.readouterr().out
        text, _, _ = printed.partition("\nReport: ")
        assert "\x1b" not in printed
        assert width is None or max(map(len, text.splitlines())) <= width
        unfolded = " ".join(text.split())
        study_answer = report.answer
        for sentence in (*study_answer.head, *study_answer.notes):
            assert sentence in unfolded
        rows = text.splitlines()
        for line in study_answer.lines:
            numbers = "  ".join(filter(None, [line.value, study_answer.interval(line)]))
            ends = rf"^.*{re.escape(numbers)} .*{re.escape(line.verdict.in_words)}$"
            shown = [row for row in rows if re.fullmatch(ends, row)]
            # A narrow terminal has room for the ends of a question alone.
            question = line.question if width in (120, None) else line.question.partition(" ")[0]
            assert any(row.startswith(question) for row in shown), line


def test_at_a_terminal_text_is_folded_and_a_command_stands_whole_on_its_own_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text, command = "More seeds, which nobody has seen:", "judge homing --out mine-40"
    printed = {
        None: f"{text} {command}\nAn end.\n",
        20: f"More seeds, which\nnobody has seen:\n{command}\nAn end.\n",
    }
    for width, expected in printed.items():
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


def test_how_long_the_rest_takes_is_told_and_of_a_slow_policy_what_fewer_seeds_would_tell() -> None:
    study = Study(seeds=60, until_clear=True, faults=[{"modes": ["FM1"], "robots": [1, 2]}])
    plan = study.plan()
    runs = [run for run in plan.runs if not run.case.faults and run.seed < 10]
    outcomes = {(run.case.key, run.seed): delivered(40 + 4 * (run.seed % 3)) for run in runs}
    results = judge(plan, outcomes)
    n_left = 10 * (len(plan.cases) - 1), 60 * len(plan.cases) - 10
    fast = what_the_rest_takes(results, 0.1)
    first, most = (clock(0.1 * n) for n in n_left)
    assert fast.startswith(f"The first look comes in {first}, the whole takes at most {most} ")
    slow = what_the_rest_takes(results, 4.0)
    first, most = (clock(4.0 * n) for n in n_left)
    assert slow.startswith(f"The first look comes in {first}, the whole takes at most {most} ")
    assert "A run takes 4.0 s: --seeds 10 ends after the first look and tells effects of" in slow
    effects = [float(number) for number in re.findall(r"about (\d\.\d\d)", slow)]
    assert effects[0] == pytest.approx(effects[1] * 6**0.5, abs=0.02)
    assert "--seeds" not in fast
