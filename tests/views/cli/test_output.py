"""Output to terminals and pipes of any encoding, and to nobody."""

from __future__ import annotations

import errno
import io
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env.views.cli import app
from swarm_logistics_env.views.cli.output import prepare_output

TRIALS = "robots,width,delivered\n" + "".join(
    f"10,{width},{20 + width + k}\n" for width in (1, 2) for k in range(5 - width)
)
ENCODINGS = ["ascii", "cp1252", "cp437", "latin-1", "koi8-r", "shift_jis", "utf-8", "utf-16"]
COMMAND = [sys.executable, "-c", "from swarm_logistics_env.views.cli import app; app()"]
# Several commands of one process, then the last as the process itself ends.
COMMANDS = """
import sys
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.views.cli.output import prepare_output

prepare_output()
sys.modules["matplotlib"] = None  # a report without figures
*first, last = sys.argv[1:]
for words in first:
    if app.run(words.split()) != 0:
        sys.exit(f"failed: {words}")
sys.argv[1:] = last.split()
app()
"""


@given(st.text(), st.sampled_from(ENCODINGS))
def test_every_text_is_written_in_every_encoding(text: str, encoding: str) -> None:
    written = io.BytesIO()
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys, "stdout", io.TextIOWrapper(written, encoding))
        patched.setattr(sys, "stderr", io.TextIOWrapper(io.BytesIO(), encoding))
        prepare_output()
        sys.stdout.write(f"{text}→")
        sys.stdout.flush()
        shown = written.getvalue().decode(encoding)
    assert shown.endswith(("→", "->"))
    if text.encode(encoding, "ignore").decode(encoding) == text:
        assert shown[: len(text)] == text


def test_signs_that_an_encoding_lacks_are_spelled() -> None:
    written = io.BytesIO()
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys, "stdout", io.TextIOWrapper(written, "ascii"))
        patched.setattr(sys, "stderr", io.TextIOWrapper(io.BytesIO(), "ascii"))
        prepare_output()
        sys.stdout.write("→ – — − … † ∞ × ≤ ≥ ± µ μ 5° ─ ━ ü \U0001f916\n")
        sys.stdout.flush()
        shown = written.getvalue().decode("ascii")
    assert shown == r"-> - - - ... + inf x <= >= +/- u u 5 deg - - \xfc \U0001f916" + "\n"


# The other charmaps are written as cp1252 is; the test above takes all of them.
@pytest.mark.daily
@pytest.mark.parametrize(
    ("encoding", "is_terminal"),
    [("ascii", False), ("cp1252", True), ("utf-16", False), ("utf-8", False), ("utf-8", True)],
)
def test_every_command_prints_in_every_encoding(
    encoding: str, is_terminal: bool, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("ünï→.csv").write_text(TRIALS, encoding="utf-8")
    if is_terminal:
        monkeypatch.setenv("FORCE_COLOR", "1")  # tables, bars and rules of rich
    for name in ("stdout", "stderr"):
        buffer = io.BufferedWriter(io.FileIO(name, "w"))
        monkeypatch.setattr(sys, name, io.TextIOWrapper(buffer, encoding))
    prepare_output()
    for words in (
        "judge ünï→.csv --full --out o",
        "study report o",
        "study plan o",
        "study compare o o",
        "list scenario",
        "list faults",
        "judge --help",
    ):
        assert app.run(words.split()) == 0
    assert app.run(["judge", "→\udc80.csv"]) == 2
    for stream in (sys.stdout, sys.stderr):
        stream.close()
    printed = Path("stdout").read_bytes().decode(encoding)
    assert "width 1→2" in printed or "width 1->2" in printed
    assert "no such" in Path("stderr").read_bytes().decode(encoding).lower()


def run(*commands: str, **how: Any) -> int:
    done = subprocess.Popen([sys.executable, "-c", COMMANDS, *commands], **how)
    if done.stdout is not None:
        done.stdout.close()  # as `head` does that has read enough
    if done.stderr is not None:
        assert b"Traceback" not in done.stderr.read()
        done.stderr.close()
    return done.wait()


def closing(*numbers: int) -> Any:
    def close() -> None:
        for number in numbers:
            os.close(number)

    return close


@pytest.mark.daily
@pytest.mark.skipif(sys.platform == "win32", reason="closes streams as a POSIX shell does")
@pytest.mark.parametrize("closed", [(1,), (0, 1, 2), ()])
def test_nothing_is_lost_where_nobody_reads(closed: Sequence[int], folder: Path) -> None:
    Path("t.csv").write_text(TRIALS)
    streams: dict[str, Any] = {"preexec_fn": closing(*closed)}
    if not closed:
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    # If a text of ours was written into the store, no report can be made of it.
    assert run("judge t.csv --out o", "study report o", "judge nosuch.csv", **streams) == 2
    assert {"report.md", "study.sqlite"} <= {path.name for path in Path("o").iterdir()}


@pytest.mark.parametrize(
    ("platform", "number", "is_raised"),
    [("win32", errno.EINVAL, False), ("win32", errno.ENOSPC, True), ("linux", errno.EINVAL, True)],
)
def test_on_windows_an_invalid_argument_means_that_nobody_reads(
    platform: str, number: int, is_raised: bool, tmp_path: Path
) -> None:
    class Broken(io.FileIO):
        def write(self, data: Any) -> int:
            raise OSError(number, "broken")

    numbers: list[int | None] = []
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys, "stdout", io.TextIOWrapper(Broken(tmp_path / "stdout", "w")))
        patched.setattr(sys, "stderr", io.TextIOWrapper(io.BytesIO()))
        prepare_output()
        patched.setattr(sys, "platform", platform)
        try:
            sys.stdout.write("text")
            sys.stdout.flush()
        except OSError as error:
            numbers.append(error.errno)
            patched.setattr(Broken, "write", lambda self, data: len(data))  # it is closed in peace
    assert numbers == ([number] if is_raised else [])


@pytest.mark.parametrize("is_terminal", [True, False])
def test_whether_output_goes_to_a_terminal_stays_known(is_terminal: bool, tmp_path: Path) -> None:
    class Screen(io.FileIO):
        def isatty(self) -> bool:
            return is_terminal

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys, "stdout", io.TextIOWrapper(Screen(tmp_path / "screen", "w")))
        patched.setattr(sys, "stderr", None)  # as of a process without a console
        prepare_output()
        assert sys.stdout.isatty() is is_terminal
        sys.stderr.write("lost →")
        sys.stderr.flush()
        sys.stdout.close()
        sys.stderr.close()


def test_output_that_cannot_be_written_is_still_told(folder: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no device that is always full")
    with Path("/dev/full").open("w") as full:
        process = subprocess.run(
            [*COMMAND, "list", "faults"], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert process.returncode == 2
    assert "No space left" in process.stderr
