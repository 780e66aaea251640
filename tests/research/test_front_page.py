"""The README's numbers: they are those of the tables, each in the sentence that tells it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from research import front_page
from research.tables import ROOT
from tests.conftest import figures_drawn

README = front_page.README.read_text(encoding="utf-8")
RESULTS = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")


def test_readme_says_of_results_what_their_page_says() -> None:
    assert front_page.readme_text() == README, "stale: run `python -m research.front_page`"
    for study in ("policies", "clearing", "leans"):
        rows = front_page.values(front_page.read("estimates"), study).values()
        assert all(value.text in RESULTS for row in rows for value in row.values())


def test_readme_says_of_an_order_no_more_than_its_interval_shows() -> None:
    estimates = front_page.values(front_page.read("estimates"), "realistic")
    _, _, high = estimates[front_page.SHARE]["ppo-robust"].interval
    assert high is not None
    assert ("`ppo-robust` delivers less than `homing-stock`" in README) == (high < 1.0)


def test_numbers_go_into_their_sentence_and_nowhere_else() -> None:
    text = "* **A** has 1.5 of 25.\n* **B** has 2 of 4 %.\n"
    pattern = front_page._NUMBER
    changed = front_page.with_numbers(text, "* **B**", pattern, ["6.5", "8.1 %"])
    assert changed == text.replace("2 of 4 %", "6.5 of 8.1 %")
    for beginning, numbers in (("* **B**", ["1"]), ("* **C**", [])):
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
