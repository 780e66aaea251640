"""A score card as an HTML page and as a badge; both are one file without a script."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from swarm_logistics_env.spi.verdict_signs import SIGNS

from . import wording
from .report_files import missing_packages, template, write_text
from .score_card import Line, ScoreCard, explanation, others, rank

_WEAKEST_FIRST = ("refuted", "blocked", "inconclusive", "equivalent", "unaffected", "supported")
_WIDTH, _MARGIN = 340, 8  # of the strip of a line [px]


def write_card(card: ScoreCard, directory: Path) -> tuple[Path, ...]:
    """Write card.html and badge.svg into a directory; return their paths.

    They need the extra `study`: without it there is neither.

    Raises:
        StudyError: a file cannot be written.
    """
    if missing_packages():
        return ()
    page, image = directory / "card.html", directory / "badge.svg"
    write_text(page, card_page(card))
    write_text(image, badge(card))
    return page, image


def card_page(card: ScoreCard) -> str:
    """Return the card as a page: a row a number, with the shipped policies on one axis."""
    return template("card.html.jinja").render(
        card=card,
        badge=badge(card),
        rows=[(line, rank(card, line), _strip(card, line)) for line in card.lines],
        notes=explanation(card),
    )


def _strip(card: ScoreCard, line: Line) -> dict[str, Any] | None:
    """Return places on one axis [px]: of the shipped policies, and of this one's interval."""
    beside = others(card, line)
    if not wording.is_known(line.value):
        return None
    low, high = (limit if math.isfinite(limit) else line.value for limit in line.limits)
    ends = [low, high, *(value for value, _, _ in beside.values())]
    least, most = min(ends), max(ends)

    def place(value: float) -> str:
        share = (value - least) / ((most - least) or 1.0)
        return f"{_MARGIN + share * (_WIDTH - 2 * _MARGIN):.1f}"

    return {
        "width": _WIDTH,
        "ends": [(place(end), f"{end:.3g}") for end in (least, most)],
        "others": [(place(x), f"{name}: {x:.3g}") for name, (x, _, _) in beside.items()],
        "low": place(low),
        "high": place(high),
        "value": place(line.value),
    }


def badge(card: ScoreCard) -> str:
    """Return the badge: P, the weakest verdict on each property, and the fault budget."""
    parts: list[dict[str, Any]] = []
    left = 0
    for text, colour in _parts(card):
        width = 12 + 7 * len(text)
        parts.append({"text": text, "colour": colour, "left": left, "width": width})
        left += width
    said = " ".join(part["text"] for part in parts)
    return template("badge.svg.jinja").render(
        policy=card.policy, said=said, parts=parts, width=left
    )


def _parts(card: ScoreCard) -> Iterator[tuple[str, str]]:
    by_symbol: dict[str, list[Line]] = {}
    for line in card.lines:
        by_symbol.setdefault(line.name.partition(",")[0], []).append(line)
    (p,) = by_symbol["P"]
    yield "swarm", "#3a3f46"
    yield f"P {wording.number(p.value, 0)}", "#0057a8"
    for symbol in ("S", "R", "FT", "A"):
        said = {line.verdict for line in by_symbol[symbol]}
        # The weakest of several answers is the one that a reader may rely on.
        weakest = SIGNS[next(answer for answer in _WEAKEST_FIRST if answer in said)]
        yield f"{symbol} {weakest.mark}", weakest.light
    (budget,) = by_symbol["fault budget"]
    yield f"fault budget {budget.text}", "#3a3f46"
