"""A study as a command that is killed by SIGKILL and run again."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.runs import FILE_NAME, Runs


def run_killed_and_resumed(file: Path, folder: Path, *options: str, kept: int) -> None:
    """Kill the study once it has kept some runs; the rest is played, and all rows are the same.

    Args:
        kept: how many runs have to be kept before it is killed.
    """

    def command(out: Path) -> list[str]:
        start = "from swarm_logistics_env.cli import app; app()"
        run = ["study", "run", str(file), "--processes", "1", *options, "--out", str(out)]
        return [sys.executable, "-c", start, *run]

    killed, whole = folder / "killed", folder / "whole"
    process = subprocess.Popen(command(killed), stdout=subprocess.DEVNULL)
    while not (killed / FILE_NAME).is_file() or n_runs(killed) < kept:
        assert process.poll() is None
        time.sleep(0.005)
    process.kill()
    process.wait()
    left = n_runs(killed)
    subprocess.run(command(whole), check=True, stdout=subprocess.DEVNULL)
    assert kept <= left < n_runs(whole)
    done = subprocess.run(command(killed), capture_output=True, text=True, check=True)
    assert f"{n_runs(whole) - left} runs played" in done.stdout
    assert rows(killed) == rows(whole)


def n_runs(directory: Path) -> int:
    try:
        with Runs.existing(directory) as runs:
            return len(runs.succeeded())
    except StudyError:  # the tables are being made
        return 0


def rows(directory: Path) -> list[dict[Any, Any]]:
    with Runs.existing(directory) as runs:
        return runs.frame().to_dict("records")
