"""Drawings as parts of the page: colours, ids and numbers of each element."""

from __future__ import annotations

import pytest

from swarm_logistics_env.study.report.drawing import COLOURS, INK, PAPER
from swarm_logistics_env.study.report.inline_svg import inline

SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" {}</svg>'


DOTS = '<use style="fill: #d55e00; stroke: red"/><use style="fill: #d55e00; stroke: red"/>'
DOTS_OF_PAGE = '<use class="dot" data-seed="0" /><use class="dot" data-seed="12" />'


@pytest.mark.parametrize(
    ("drawing", "part_of_page"),
    [
        # A style would hold for the whole page.
        ("><defs><style>* {}</style></defs><style/>", "><defs />"),
        # What stands around text, its letters, and a turn by nothing.
        (
            '><text transform="rotate(-0 1 2)" style="x: 1;  font-family: Sans; y: 1"> P </text>\n',
            '><text style="x: 1; y: 1">P</text>',
        ),
        ('><text transform="rotate(-90 1.005 2.50)"/>', '><text transform="rotate(-90 1 2.5)" />'),
        (
            f'><path style="fill: {INK}; stroke: {PAPER}" d="M -0.5 100.0 L 3.14159 7"/>',
            '><path style="fill: var(--ink); stroke: var(--paper)" d="M -0.5 100 L 3.14 7" />',
        ),
        (
            f'><path style="fill: {COLOURS[0]}; stroke: {COLOURS[5]}"/>',
            '><path style="fill: var(--p0); stroke: var(--p5)" />',
        ),
        # Ids differ from those of other drawings; groups need none.
        (
            '><defs><path id="m" style="x: 1" d="M 0 0"/></defs><g id="axes"/><a href="x"/>',
            '><defs><path d="M 0 0" id="S-m" /></defs><g /><a href="x" />',
        ),
        (
            '><use xlink:href="#m"/><rect id="c" clip-path="url(#c)"/>',
            '><use href="#S-m" /><rect clip-path="url(#S-c)" id="S-c" />',
        ),
        (
            '><g id="question-7"/><path id="condition-12"/><g id="question-x"/>',
            '><g data-question="7"><title>R &lt; 0</title></g><path data-condition="12" /><g />',
        ),
        # Each dot names its seed, and all together have a colour.
        (
            f'><g id="condition-3-seeds-0-12"><g>{DOTS}</g></g>',
            f'><g data-condition="3" style="fill: var(--p1)"><g>{DOTS_OF_PAGE}</g></g>',
        ),
    ],
)  # fmt: skip
def test_a_drawing_becomes_a_part_of_the_page(drawing: str, part_of_page: str) -> None:
    size = 'width="9pt" height="8pt" version="1.1" viewBox="0 0 9.126 8"'
    svg = inline(SVG.format(f"{size}{drawing}"), "S", {"question-7": "R < 0"})
    assert svg == f'<svg viewBox="0 0 9.13 8" stroke-linejoin="round"{part_of_page}</svg>'
