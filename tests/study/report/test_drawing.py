from __future__ import annotations

import os
import subprocess
import sys

import pytest

DRAW = """
import os
from swarm_logistics_env.study.report.drawing import svg_image

svg = svg_image(lambda canvas: canvas.subplots().plot([1, 2]), 2.0)
import matplotlib
assert svg.startswith("<?xml")
print(os.environ["MPLBACKEND"], matplotlib.rcParams["backend"])
"""


@pytest.mark.parametrize(
    ("backend", "left"),
    [
        ("module://matplotlib_inline.backend_inline", None),  # of a notebook, not installed here
        ("TkAgg", "tkagg"),
    ],
)
def test_figures_are_drawn_whatever_backend_is_set(backend: str, left: str | None) -> None:
    done = subprocess.run(
        [sys.executable, "-c", DRAW],
        env={**os.environ, "MPLBACKEND": backend}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    named, used = done.stdout.split()
    assert named == backend
    assert left is None or used.lower() == left


def test_thirty_six_series_have_marks_of_their_own() -> None:
    from swarm_logistics_env.study.report.drawing import COLOURS, marker_of

    marks = {(COLOURS[index % len(COLOURS)], marker_of(index)) for index in range(36)}
    assert len(marks) == 36
