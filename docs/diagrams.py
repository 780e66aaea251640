"""Draws the diagrams at the top of pages into docs/media: `python docs/diagrams.py`.

Each is an SVG of some boxes with arrows between them, or of the four verdicts, without a library.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

MEDIA = Path(__file__).parent / "media"

Box = tuple[str, str]  # what it is; below it, in small letters, more about it
FLOWS: Mapping[str, Sequence[Box]] = {
    "api": (
        ("Scenario, Fault", "conditions of a run"),
        ("run_episode", "one policy, one seed"),
        ("Study", "policies, seeds, store"),
        ("spi", "indicators, intervals"),
    ),
    "ecosystem": (
        ("swarm_logistics_v0", "one array a step"),
        ("its forms", "PettingZoo, Gymnasium, SB3"),
        ("your trainer", "TorchRL, RLlib, ..."),
    ),
    "extending": (
        ("your class", "policy, wrapper, mode, ..."),
        ("testing.check_...", "commands, spaces, seeds"),
        ("judge, study", "its score card, its report"),
    ),
    "onnx": (
        ("policy.safetensors", "written by train"),
        ("policy.onnx", "weights and card"),
        ("a robot", "C, C++, no Python"),
    ),
    "promises": (
        ("a promise", "in one sentence"),
        ("its tests", "named beside it"),
        ("make test", "runs them all"),
    ),
    "questions": (
        ("a question", "a sentence of the field"),
        ("its study", "examples/questions"),
        ("play_questions.py", "fresh seeds, kept runs"),
        ("its page", "tables, figure, limits"),
    ),
    "study_files": (
        ("study.toml", "policies, seeds, factors"),
        ("study plan", "conditions, time"),
        ("study run", "kept run by run"),
        ("report", "tables, figures, verdicts"),
    ),
    "tasks": (
        ("any swarm", "a PettingZoo environment"),
        ("ParallelTask", "what P is, what fails"),
        ("Study", "S, R, FT, A with intervals"),
    ),
    "training_files": (
        ("training.toml", "worlds, faults, PPO"),
        ("train", "goes on where it stopped"),
        ("policy.safetensors", "weights, card, scores"),
    ),
    "trials": (
        ("robots, simulators", "trials as people type them"),
        ("trials.csv", "robots, fault, delivered"),
        ("judge", "S, R, FT, A, verdicts"),
        ("report", "HTML, LaTeX, CSV"),
    ),
}
_INK, _SOFT, _EDGE, _FILL = "#1b1b1b", "#5b6068", "#0072b2", "#eef5fa"
_BOX, _HEIGHT, _GAP = 190, 64, 44  # px


def flow(boxes: Sequence[Box]) -> str:
    """Return boxes from left to right, with arrows between them."""
    parts = []
    for place, (title, below) in enumerate(boxes):
        left = 1 + place * (_BOX + _GAP)
        middle = left + _BOX / 2
        parts += [
            _box(left, 1, _BOX, _HEIGHT, f'rx="8" fill="{_FILL}" stroke="{_EDGE}"'),
            _text(middle, 28, title, "bold 15px", _INK),
            _text(middle, 49, below, "13px", _SOFT),
        ]
        if place:
            start, end, y = left - _GAP + 6, left - 6, 1 + _HEIGHT / 2
            parts.append(
                f'<path d="M{start} {y}H{end}m-7 -5l7 5l-7 5" fill="none" stroke="{_EDGE}" '
                'stroke-width="2"/>'
            )
    return _svg(len(boxes) * (_BOX + _GAP) - _GAP + 2, _HEIGHT + 2, parts)


def verdicts() -> str:
    """Return four intervals and a threshold, with the verdict that each gives."""
    threshold, margin, rows = 300, 45, 4
    height = 34 * rows + 34
    parts = [
        _box(threshold - margin, 6, 2 * margin, 34 * rows, 'fill="#f1f2f4"'),
        f'<path d="M{threshold} 6V{34 * rows + 6}" stroke="{_INK}" stroke-width="1.5"/>',
        _text(threshold, height - 8, "threshold, and what is too near to matter", "13px", _SOFT),
    ]
    intervals = (
        ("supported", "all of it above", 330, 430, "#006b4c"),
        ("refuted", "all of it below", 130, 250, "#a84300"),
        ("equivalent", "too near to matter", 270, 325, "#005b94"),
        ("inconclusive", "more seeds would tell", 210, 400, _SOFT),
    )
    for place, (name, why, low, high, colour) in enumerate(intervals):
        y = 24 + 34 * place
        parts += [
            f'<path d="M{low} {y}H{high}" stroke="{colour}" stroke-width="3"/>',
            f'<circle cx="{(low + high) / 2}" cy="{y}" r="6" fill="{colour}"/>',
            _text(540, y + 5, name, "bold 15px", colour),
            _text(690, y + 5, why, "13px", _SOFT),
        ]
    return _svg(780, height, parts)


def _box(left: float, top: float, width: float, height: float, more: str) -> str:
    return f'<rect x="{left}" y="{top}" width="{width}" height="{height}" {more}/>'


def _text(x: float, y: float, text: str, font: str, colour: str) -> str:
    weight, size = ("bold", font[5:]) if font.startswith("bold") else ("normal", font)
    return (
        f'<text x="{x}" y="{y}" text-anchor="middle" font-weight="{weight}" '
        f'font-size="{size}" fill="{colour}">{escape(text)}</text>'
    )


def _svg(width: int, height: int, parts: Sequence[str]) -> str:
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        f'height="{height}" font-family="system-ui, Helvetica, sans-serif">\n{body}\n</svg>\n'
    )


def drawings() -> dict[str, str]:
    """Return every diagram by the name of its file."""
    found = {f"flow-{page}.svg": flow(boxes) for page, boxes in FLOWS.items()}
    return {**found, "verdicts.svg": verdicts()}


if __name__ == "__main__":
    for name, drawing in drawings().items():
        (MEDIA / name).write_text(drawing, encoding="utf-8")
