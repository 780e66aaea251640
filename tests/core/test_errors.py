from __future__ import annotations

import json

import pytest

from swarm_logistics_env.core import errors
from swarm_logistics_env.core.errors import users_line

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
