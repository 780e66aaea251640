"""A score card as an HTML page and as a badge; both are one file without a script."""

from __future__ import annotations

import math
from collections.abc import Iterator
from html import escape
from pathlib import Path

from swarm_logistics_env.spi.verdict_signs import SIGNS

from . import wording
from .report_files import write_text
from .score_card import Line, ScoreCard, explanation, others, rank

_WEAKEST_FIRST = ("refuted", "blocked", "inconclusive", "equivalent", "unaffected", "supported")
_WIDTH, _HEIGHT, _MARGIN = 340, 34, 8  # of the strip of a line [px]
_STYLE = Path(__file__).with_name("score_card.css")


def write_card(card: ScoreCard, directory: Path) -> tuple[Path, ...]:
    """Write card.html and badge.svg into a directory; return their paths.

    Raises:
        StudyError: a file cannot be written.
    """
    page, image = directory / "card.html", directory / "badge.svg"
    write_text(page, card_page(card))
    write_text(image, badge(card))
    return page, image


def card_page(card: ScoreCard) -> str:
    """Return the card as a page: a row a number, with the shipped policies on one axis."""
    title = f"Score card of {escape(card.policy)}"
    notes = "".join(f"<p>{escape(text)}</p>\n" for text in explanation(card))
    heads = ("", "value [95 %]", "verdict", "rank", "this policy (blue) among the shipped")
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>'
        '\n<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<style>\n{_STYLE.read_text(encoding='utf-8')}</style>\n</head>\n<body>\n<h1>{title}</h1>\n{badge(card)}\n"
        f'<div class="scroll">\n<table>\n<tr>{"".join(f"<th>{head}</th>" for head in heads)}</tr>\n'
        f"{''.join(_row(card, line) for line in card.lines)}</table>\n</div>\n{notes}</body>\n"
        "</html>\n"
    )


def _row(card: ScoreCard, line: Line) -> str:
    return (
        f"<tr><td><b>{escape(line.name)}</b><small>{escape(line.condition)}</small></td>"
        f'<td class="value">{escape(line.text)}</td><td class="value">{escape(line.said)}</td>'
        f'<td class="value">{rank(card, line)}</td><td>{_strip(card, line)}</td></tr>\n'
    )


def _strip(card: ScoreCard, line: Line) -> str:
    """Return a drawing of one axis: a dot for each shipped policy, and this one's interval."""
    beside = others(card, line)
    if not wording.is_known(line.value):
        return ""
    low, high = (limit if math.isfinite(limit) else line.value for limit in line.limits)
    ends = [low, high, *(value for value, _, _ in beside.values())]
    least, span = min(ends), (max(ends) - min(ends)) or 1.0

    def place(value: float) -> str:
        return f"{_MARGIN + (value - least) / span * (_WIDTH - 2 * _MARGIN):.1f}"

    middle = 10
    dots = "".join(
        f'<circle cx="{place(value)}" cy="{middle}" r="5"><title>{escape(name)}: {value:.3g}'
        "</title></circle>"
        for name, (value, _, _) in beside.items()
    )
    numbers = "".join(
        f'<text x="{place(end)}" y="{_HEIGHT - 1}" text-anchor="{anchor}">{end:.3g}</text>'
        for end, anchor in ((min(ends), "start"), (max(ends), "end"))
    )
    return (
        f'<svg class="strip" role="img" aria-label="{escape(line.name)} among the shipped policies"'
        f' width="{_WIDTH}" height="{_HEIGHT}">'
        f'<line x1="0" x2="{_WIDTH}" y1="{middle}" y2="{middle}"/>{numbers}{dots}'
        f'<line class="limits" x1="{place(low)}" x2="{place(high)}" y1="{middle}" y2="{middle}"/>'
        f'<circle class="own" cx="{place(line.value)}" cy="{middle}" r="6">'
        f"<title>{escape(card.policy)}: {escape(line.text)}</title></circle></svg>"
    )


def badge(card: ScoreCard) -> str:
    """Return the badge: P, the weakest verdict on each property, and the fault budget."""
    parts = list(_parts(card))
    widths = [12 + 7 * len(text) for text, _ in parts]
    pieces, left = [], 0
    for (text, colour), width in zip(parts, widths):
        pieces.append(
            f'<rect x="{left}" width="{width}" height="20" fill="{colour}"/>'
            f'<text x="{left + width / 2}" y="14" textLength="{width - 12}">{escape(text)}</text>'
        )
        left += width
    said = escape(" ".join(text for text, _ in parts))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{left}" height="20" role="img" '
        f'aria-label="{said}"><title>{escape(card.policy)}: {said}</title>'
        '<g fill="#fff" text-anchor="middle" font-size="11" '
        f'font-family="Verdana, DejaVu Sans, sans-serif">{"".join(pieces)}</g></svg>\n'
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
