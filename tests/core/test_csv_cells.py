"""Cells that no spreadsheet takes for a formula."""

from __future__ import annotations

import pytest

from swarm_logistics_env.core.csv_cells import inert, text_of_inert


@pytest.mark.parametrize(
    "text", ["=1+1", "+1+1", "-a", "@sum", "\t1", "\r1", "\n1", " =1", "'=1", "''-", "-", "-1,5"]
)
def test_what_a_spreadsheet_computes_has_an_apostrophe_before_it(text: str) -> None:
    assert inert(text) == f"'{text}"
    assert text_of_inert(f"'{text}") == text


@pytest.mark.parametrize(
    "text", ["", "a", "a=1", "-1", "+1.", "-.5", "-1.5e-3", "+2E+6", "1", "'a", "'", "it's"]
)
def test_numbers_and_harmless_texts_stay_as_they_are(text: str) -> None:
    assert inert(text) == text
    assert text_of_inert(text) == text
