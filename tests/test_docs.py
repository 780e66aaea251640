"""The committed page of the environment is what the code says."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def test_the_page_is_the_generated_one() -> None:
    page = runpy.run_path(str(DOCS / "generate.py"))["page"]()
    committed = (DOCS / "environment.md").read_text(encoding="utf-8")
    assert committed == page, "stale: run `python docs/generate.py`"


def test_the_example_on_the_page_runs() -> None:
    text = (DOCS / "environment.md").read_text(encoding="utf-8")
    found = re.search(r"```python\n(.*?)```", text, re.DOTALL)
    assert found
    example = found[1].replace("n_robots=5", "n_robots=5, duration=2.0")
    namespace: dict[str, object] = {}
    exec(example, namespace)
    assert set(namespace["terminations"]) | set(namespace["truncations"])  # type: ignore[call-overload]
