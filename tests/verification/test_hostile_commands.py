"""Any command line: it runs, or one sentence says why not, and the exit code is not 0."""

from __future__ import annotations

import contextlib
import io
import os
import random
import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env.cli import app

COMMANDS = [["run"], ["list"], ["study", "plan"], ["study", "run"], ["study", "report"],
            ["study", "export"], ["study", "merge"], ["study", "compare"],
            ["study"], []]  # fmt: skip
WORDS = [
    "--seed", "--set", "--preset", "--policy", "--fault", "--out", "--seeds", "--processes",
    "--engine", "--shard", "--to", "--json", "scenario",
    "faults", "--fail-if", "--effect", "--help",
    "--version", "0", "-1", "1.5", "nan", "1e400", "99999999999999999999", "", " ", "\n", "=", "x",
    "here", "nowhere/x", "mine.toml", "none.csv", "paper", "quick", "n_robots=0", "n_robots={}",
    "n_robots=[1", "duration=0.2", "duration=1e-300", "duration=null", "n_items=1e9", "local",
    "process", "ray", "1/2", "0/0", "x.csv", "x.parquet", "x.exe", "R < 0", "R <", "FM1", "FM1:0",
    "FM1:1@1e5", "FM1:9999999999999999999", "FM1@.", "é", "nobody", "nobody:Nothing",
    "n_robots=" + "[" * 50_000,
]  # fmt: skip
CHEAP = ["--set", "duration=0.2"]


@given(st.randoms(use_true_random=False))
@settings(max_examples=max(60, settings().max_examples // 2))
def test_any_command_line_runs_or_is_refused_in_one_sentence(source: random.Random) -> None:
    command = source.choice(COMMANDS)
    words = [source.choice(WORDS) for _ in range(source.randint(0, 5))]
    if command == ["run"]:
        words = [*CHEAP, *words]  # whatever else is asked, an episode stays short
    elif command in (["study", "run"], ["study", "plan"]):
        words = [word for word in words if word not in ("paper", "quick")]
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            out, err = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                code = app.run([*command, *words])
        finally:
            os.chdir(before)
        assert code in (0, 2), (command, words, code)
        said = err.getvalue()
        if code and not said:  # no command was named
            assert command in (["study"], [])
            assert "Commands" in out.getvalue()
        elif code:
            assert said.startswith("swarm-logistics: "), said
            assert len(said.splitlines()) == 1, said
        # `study run` and its kind may make the folder that they were given, nothing else.
        asked = {word.split("/")[0] for word in words}
        assert {path.name for path in Path(folder).iterdir()} <= asked
