"""Any command line: it runs, or one sentence says why not, and the exit code is not 0."""

from __future__ import annotations

import contextlib
import io
import random
import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env.views.cli import app

# Whatever else is asked, an episode stays short.
COMMANDS = ["run --set duration=0.2", "list", "study plan", "study run", "study report",
            "study export", "study merge", "study compare", "study", ""]  # fmt: skip
WORDS = [
    "--seed", "--set", "--preset", "--policy", "--fault", "--out", "--seeds", "--processes",
    "--engine", "--shard", "--to", "--json", "scenario", "faults", "--fail-if", "--effect",
    "--help", "--version", "0", "-1", "1.5", "nan", "1e400", "99999999999999999999", "", " ", "\n",
    "=", "x", "here", "nowhere/x", "mine.toml", "none.csv", "n_robots=0", "n_robots={}",
    "n_robots=[1", "duration=0.2", "duration=1e-300", "duration=null", "n_items=1e9", "local",
    "process", "ray", "1/2", "0/0", "x.csv", "x.parquet", "x.exe", "R < 0", "R <", "FM1", "FM1:0",
    "FM1:1@1e5", "FM1:9999999999999999999", "FM1@.", "é", "nobody", "nobody:Nothing",
    "n_robots=" + "[" * 50_000,
]  # fmt: skip
PRESETS = ["paper", "quick"]


@given(st.randoms(use_true_random=False))
@settings(max_examples=max(60, settings().max_examples // 2))
def test_any_command_line_runs_or_is_refused_in_one_sentence(source: random.Random) -> None:
    command = source.choice(COMMANDS)
    vocabulary = WORDS if command in ("study run", "study plan") else WORDS + PRESETS
    words = [source.choice(vocabulary) for _ in range(source.randint(0, 5))]
    out, err = io.StringIO(), io.StringIO()
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        code = app.run([*command.split(), *words])
        # `study run` and its kind may make the folder that they were given, nothing else.
        assert {path.name for path in Path().iterdir()} <= {word.split("/")[0] for word in words}
    assert code in (0, 2), (command, words, code)
    if code and not err.getvalue():  # no command was named
        assert command in ("study", "")
        assert "Commands" in out.getvalue()
    elif code:
        assert err.getvalue().startswith("swarm-logistics: ")
        assert len(err.getvalue().splitlines()) == 1, err.getvalue()
