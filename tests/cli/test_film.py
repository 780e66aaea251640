from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env.cli import app

SHORT = ["--until", "2", "--size", "100", "--fps", "5", "--set", "n_robots=4"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["film.mp4"],
        ["film.gif", "--fault", "FM4:2", "--twin"],
        ["film.mp4", "--policy", "swarm-dt", "--policy", "random-walk", "--trails", "--links"],
    ],
)
def test_film_is_written(
    arguments: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert app.run(["film", *arguments, *SHORT]) == 0
    printed = capsys.readouterr()
    assert printed.out.startswith(f"{arguments[0]}: 14 frames, 2.8 s, ")
    assert printed.err == ""
    [film] = tmp_path.iterdir()
    assert film.stat().st_size > 1000
    assert film.read_bytes()[:8].endswith(b"ftyp") == (film.suffix == ".mp4")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["film.avi"], "should end in .mp4 or .gif"),
        (["nowhere/film.mp4"], "a folder that can be written to"),
        (["film.mp4", "--twin"], "--fault should be given"),
        (["film.mp4", "--policy", "swarm-td"], "did you mean 'swarm-dt'?"),
        (["film.mp4", "--speed", "0"], "speed = 0"),
        (["film.mp4", "--size", "10"], "size = 10"),
        (["film.mp4", "--fault", "FM1:99"], "at most n_robots = 25"),
        (["film.mp4", *["--policy", "swarm-dt"] * 3, "--fault", "FM1", "--twin"], "1 to 4"),
        ([], "FILE"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_nothing(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert app.run(["film", *arguments]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert words in printed.err
    assert len(printed.err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
