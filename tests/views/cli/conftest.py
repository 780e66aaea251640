"""The command line as the tests type it, in an empty folder of their own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from swarm_logistics_env.views.cli import app

Command = Callable[..., str]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder: empty, and where modules are found."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


@pytest.fixture
def command(folder: Path, capsys: pytest.CaptureFixture[str]) -> Command:
    """Runs words that are typed, checks the exit code and returns what was printed.

    Of what is refused, which ends with code 2, it returns the one sentence that says why.
    """

    def run(words: str, *, code: int = 0) -> str:
        assert app.run(words.split()) == code
        printed = capsys.readouterr()
        if code != 2:
            return printed.out
        (sentence,) = printed.err.splitlines()
        return sentence

    return run
