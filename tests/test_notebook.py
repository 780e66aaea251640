"""The notebook of the examples runs, and shows values rather than addresses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")
pytest.importorskip("ipykernel")

NOTEBOOK = Path(__file__).parents[1] / "examples" / "first_steps.ipynb"


def values(notebook: Any) -> list[dict[str, str]]:
    """Return what each cell of code showed as its value, by type."""
    outputs = [cell.get("outputs", []) for cell in notebook.cells if cell.cell_type == "code"]
    return [
        next((dict(o.data) for o in cell if o.output_type == "execute_result"), {})
        for cell in outputs
    ]


@pytest.mark.daily
def test_it_runs_and_shows_what_it_made(tmp_path: Path) -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(
        notebook, timeout=1200, resources={"metadata": {"path": tmp_path}}
    ).execute()
    delivered, video, _, study, findings, demonstrations, env = values(notebook)
    assert int(delivered["text/plain"]) > 0
    assert "<video" in video["text/html"]
    assert "60 of 60 runs done" in study["text/html"]
    assert "<table>" in findings["text/html"]
    assert "Forward" in findings["text/html"]
    assert "Demonstrations(homing: 1 episodes" in demonstrations["text/plain"]
    assert "SwarmLogisticsEnv(n_robots=5)" in env["text/html"]
    # A reader sees short text where a front end shows no HTML.
    texts = [cell["text/plain"] for cell in values(notebook) if cell]
    assert max(map(len, texts)) < 2_000
    assert not any(" at 0x" in text for text in texts)
