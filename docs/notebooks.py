"""Runs the notebooks of docs/notebooks and records what they print: `python docs/notebooks.py`.

A test holds the recorded outputs. Only text is recorded, so that no kernel is needed: cells are
plain Python, run in their order in one namespace.
"""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any

NOTEBOOKS = Path(__file__).parent / "notebooks"


def recorded(text: str) -> str:
    """Run the cells of a notebook in an empty folder; return it with the outputs that came."""
    notebook = json.loads(text)
    names: dict[str, Any] = {"__name__": "notebook"}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
        for number, cell in enumerate(cells, start=1):
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile("".join(cell["source"]), f"cell {number}", "exec"), names)
            lines = out.getvalue().splitlines(keepends=True)
            said = {"name": "stdout", "output_type": "stream", "text": lines}
            cell |= {"execution_count": number, "outputs": [said] if lines else []}
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    for page in sorted(NOTEBOOKS.glob("*.ipynb")):
        page.write_text(recorded(page.read_text(encoding="utf-8")), encoding="utf-8")
