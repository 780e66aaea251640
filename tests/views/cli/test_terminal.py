"""What is printed of a study: the same at every width, in a pipe and in a file."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from rich.console import Console

from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.views.cli import terminal
from tests.made_up import looked_at, paper


def console_of(width: int | None) -> Callable[..., Console]:
    """Return what stands for the console: a terminal of a width; None: a pipe or a file."""
    return partial(Console, width=width, force_terminal=width is not None)


@pytest.mark.parametrize("width", [60, 80, 120, None])
def test_terminal_pipe_and_file_have_the_same_content_and_no_row_is_folded(
    width: int | None,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(terminal, "Console", console_of(width))
    monkeypatch.setattr(terminal, "write_document", lambda *_: [tmp_path])
    for results in (paper(seeds=4, policies=["swarm-dt", "swarm-dt-follow"]), looked_at()):
        terminal.show_report(results, tmp_path, full=False)
        printed = capsys.readouterr().out
        text, _, _ = printed.partition("\nReport: ")
        assert "\x1b" not in printed
        assert width is None or max(map(len, text.splitlines())) <= width
        unfolded = " ".join(text.split())
        study_answer = answer(results)
        for sentence in (*study_answer.head, study_answer.notes):
            assert sentence in unfolded
        rows = text.splitlines()
        for line in study_answer.lines:
            numbers = "  ".join(filter(None, [line.value, line.interval]))
            ends = rf"^.*{re.escape(numbers)} .*{re.escape(line.verdict.in_words)}$"
            shown = [row for row in rows if re.fullmatch(ends, row)]
            # A narrow terminal has room for the ends of a question alone.
            question = line.question if width in (120, None) else line.question.partition(" ")[0]
            assert any(row.startswith(question) for row in shown), line
