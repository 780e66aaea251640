from __future__ import annotations

import json
from pathlib import Path

import pytest

from swarm_logistics_env.core import errors
from swarm_logistics_env.core.errors import how_to_install, suggest, users_line

OWN = 'File "/home/ann/mine.py", line 3, in act\n'
PACKAGE = f'File "{errors.__file__}", line 5, in load\n'
PYTHON = f'File "{json.__file__}", line 9, in loads\n'


@pytest.mark.parametrize(
    ("traceback", "line"),
    [
        (OWN + PACKAGE + PYTHON, ("/home/ann/mine.py", "3")),
        (PYTHON + PACKAGE, (errors.__file__, "5")),  # no line is the user's own: the last one
        ("ZeroDivisionError", None),
    ],
)
def test_a_traceback_names_the_users_line_before_those_of_libraries(
    traceback: str, line: tuple[str, str] | None
) -> None:
    assert users_line(traceback) == line


EIGHT = [f"{number} Runs" for number in range(8)]


@pytest.mark.parametrize(
    ("name", "names", "end"),
    [
        ("homin", ["swarm-dt", "homing-stock", "homing"], "; did you mean 'homing'?"),
        ("fm4", ["FM4_jam", "FM1", "FM4"], "; did you mean 'FM4' or 'FM4_jam'?"),
        ("A", ["far", "car", "bar"], "; did you mean 'bar', 'car' or 'far'?"),
        (
            "s",
            EIGHT,
            f"; did you mean {', '.join(f'{name!r}' for name in EIGHT[:7])} or '7 Runs'?",
        ),
        ("s", [*EIGHT, "8 Runs"], f"; known: {', '.join([*EIGHT, '8 Runs'])}"),
        ("", ["b", "a"], "; known: a, b"),
        ("nothing", ["b", "a"], "; known: a, b"),
    ],
)
def test_an_unknown_name_is_told_with_what_was_meant_or_all_there_is(
    name: str, names: list[str], end: str
) -> None:
    assert suggest(name, names) == end


@pytest.mark.parametrize("is_clone", [True, False])
def test_how_to_install_an_extra_is_told_as_it_was_installed(
    is_clone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = Path(errors.__file__).parents[2]
    monkeypatch.setattr(Path, "is_file", lambda path: is_clone and path == root / "constraints.txt")
    watch, train = (
        f"-c constraints.txt -e '.[{extra}]'" if is_clone else f"'swarm-logistics-env[{extra}]'"
        for extra in ("watch", "train")
    )
    assert how_to_install("watch") == f"pip install {watch}"
    assert how_to_install("train") == (
        f"pip install {train}, or without 5 GB of CUDA: uv pip install --torch-backend cpu {train}"
    )
