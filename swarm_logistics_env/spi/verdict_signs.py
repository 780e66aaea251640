"""The sign and colour that each verdict has: in a terminal, a report and `print(estimate)`."""

from __future__ import annotations

from typing import NamedTuple


class Sign(NamedTuple):
    """How a verdict is shown.

    Attributes:
        mark: one character, which tells it without colour.
        word: what the mark is called in a legend.
        colour: of a terminal, by ANSI's names.
        light, dark: hexadecimal colours on white and on black paper, after Okabe and Ito.
    """

    mark: str
    word: str
    colour: str
    light: str
    dark: str


SIGNS = {
    "supported": Sign("✓", "supported", "green", "#006b4c", "#3fc79a"),
    "refuted": Sign("✗", "refuted", "red", "#a84300", "#f5915a"),
    "equivalent": Sign("≈", "equivalent", "cyan", "#005b94", "#6cb8ee"),
    "inconclusive": Sign("?", "open", "yellow", "#5b6068", "#a9afb8"),
    "unaffected": Sign("=", "same runs", "default", "#5b6068", "#a9afb8"),
    "blocked": Sign("!", "blocked", "magenta", "#a84300", "#f5915a"),
}
