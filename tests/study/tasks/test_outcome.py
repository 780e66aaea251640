"""What a run gave, as stores and files can hold it."""

from __future__ import annotations

import pytest

from tests.made_up import delivered


@pytest.mark.parametrize(
    ("length", "kept_length"), [(19_999, 19_999), (20_000, 20_000), (99_999, 20_006)]
)
def test_of_an_endless_error_beginning_and_end_are_kept(length: int, kept_length: int) -> None:
    error = "begins" + "." * (length - 10) + "ends"
    text = str(delivered(0, error=error).error)
    assert (len(text), text[:6], text[-4:]) == (kept_length, "begins", "ends")
    assert (text == error) == (" [..] " not in text)
