"""The README's numbers: they are those of the tables, each in the sentence that tells it."""

from __future__ import annotations

import re
from itertools import chain
from pathlib import Path

import pytest

from research import front_page
from research.tables import ROOT
from tests.conftest import figures_drawn

README = front_page.README.read_text(encoding="utf-8")
RESULTS = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")


def test_readme_says_of_results_what_their_page_says() -> None:
    assert front_page.readme_text() == README, "stale: run `python -m research.front_page`"
    intervals = [*chain.from_iterable(front_page.intervals().values())]
    assert len(intervals) >= 6
    assert all(interval in RESULTS for interval in intervals)
    for study in ("policies", "clearing", "leans"):
        rows = front_page.values(front_page.read("estimates"), study).values()
        assert all(value.text in RESULTS for row in rows for value in row.values())


def test_readme_calls_undecided_what_its_interval_leaves_open() -> None:
    estimates = front_page.values(front_page.read("estimates"), "realistic")
    low, high = estimates[front_page.SHARE]["ppo-robust"].interval[1:]
    assert low is not None
    assert high is not None
    assert ("times as much (undecided)" in README) == (low < 1.0 < high)


def test_numbers_go_into_their_sentence_and_nowhere_else() -> None:
    text = "* **A** has 1.0 [0.5, 1.5] at N = 25.\n* **B** has 2 [1, 3] and 4 [3, 5].\n"
    pattern = front_page._INTERVAL
    changed = front_page.with_numbers(text, "* **B**", pattern, ["-6.0 [-7.0, ∞]", "8 [7, 9]"])
    assert changed == text.replace("2 [1, 3] and 4 [3, 5]", "-6.0 [-7.0, ∞] and 8 [7, 9]")
    for beginning, numbers in (("* **B**", ["1 [0, 2]"]), ("* **C**", [])):
        with pytest.raises(SystemExit, match=re.escape(beginning)):
            front_page.with_numbers(text, beginning, pattern, numbers)


def test_links_can_have_an_address() -> None:
    page = front_page.with_address(README, "https://forge.example/swarm")
    for link in ("raw/main/docs/media/fm4.gif", "blob/main/docs/training.md"):
        assert f"https://forge.example/swarm/{link}" in page
    assert not re.search(r'(?:\]\(|src=")(?!https://)', page)


def test_the_picture_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs the extra study")
    rows = front_page.values(front_page.read("estimates"), "policies")
    with figures_drawn("svg"):
        front_page.draw(rows, tmp_path / "anew.svg")
    assert (tmp_path / "anew.svg").stat().st_size > 10_000
