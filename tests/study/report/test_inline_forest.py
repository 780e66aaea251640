"""Rows of the page's answer: where values and intervals lie on their axis, and how they look."""

from __future__ import annotations

import re

import pytest

from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report.answer import Answer, answer
from swarm_logistics_env.study.report.inline_forest import Group, groups_of
from swarm_logistics_env.study.report.points import Point
from tests.made_up import P_BY_SEED, delivered, judged

POINT = Point("", 0, "", 0.5, 0.0, 1.0, 0.25, decided=True, link="question-7")
FAR = POINT._replace(value=99.0, low=-0.5, high=None)
CUT = POINT._replace(low=-9.0, high=9.0, published=0.0, decided=False)
NOTHING = Point("", 0, "", None, None, None)
# Percents of numbers on the axis.
EVEN = ["0 5.36", "0.2 23.21", "0.4 41.07", "0.6 58.93", "0.8 76.79", "1 94.64"]
TO_100 = ["\N{MINUS SIGN}1 16.78", "0 37.48", "1 58.17", "10 78.87", "100 99.56"]
AGAINST = "homing against swarm-dt"
TIMES = ["0.5 5.41", "1 32.26", "2 59.10", "5 94.59"]


@pytest.fixture(scope="module")
def all_questions() -> Answer:
    study = Study(
        policies=["homing", "swarm-dt"], seeds=4, sizes=[{"values": [5, 10, 20]}], indicators=["S"],
        compares_policies=True,
    )  # fmt: skip
    return answer(
        judged(study, lambda policy, at, seed: delivered(at.value * P_BY_SEED[policy][seed] - seed))
    )


def groups(all_questions: Answer, subject: str, points: list[Point]) -> tuple[Group, ...]:
    """Return the groups of the first questions of a policy, with these values."""
    lines = [line for line in all_questions.lines if line.subject == subject]
    return groups_of(all_questions._replace(lines=tuple(lines[: len(points)])), points)


def test_questions_stand_in_groups_by_policy_and_indicator(all_questions: Answer) -> None:
    parts = groups_of(all_questions, [POINT] * len(all_questions.lines))
    assert [(part.heading, [row.name for row in part.rows]) for part in parts] == [
        ("homing against swarm-dt: times P", ["N = 5", "N = 10", "N = 20"]),
        ("homing: Scalability S", ["N 5→10", "N 10→20"]),
        ("swarm-dt: Scalability S", ["N 5→10", "N 10→20"]),
    ]
    assert [row.line for part in parts for row in part.rows] == [*all_questions.lines]


@pytest.mark.parametrize(
    ("subject", "points", "numbers", "middle"),
    [
        ("homing", [POINT], EVEN, "5.36"),
        ("homing", [POINT, FAR], TO_100, "37.48"),
        (AGAINST, [CUT], TIMES, "32.26"),
        (AGAINST, [NOTHING], ["1 50.00"], "50.00"),
    ],
)
def test_the_axis_has_numbers_at_which_lines_cross_the_rows(
    subject: str, points: list[Point], numbers: list[str], middle: str, all_questions: Answer
) -> None:
    (group,) = groups(all_questions, subject, points)
    places = [number.split()[1] for number in numbers]
    ticks = "".join(
        f'<line class="axis" x1="{x}%" x2="{x}%" y1="14" y2="18"/>'
        f'<text x="{x}%" y="11">{number.split()[0]}</text>'
        for number, x in zip(numbers, places)
    )
    line = '<line class="axis" x1="0" x2="100%" y1="17.5" y2="17.5"/>'
    assert group.axis == f'<svg height="18" aria-hidden="true">{line}{ticks}</svg>'
    lines = [f'grid" x1="{x}%" x2="{x}%' for x in places]
    lines.append(f'threshold" x1="{middle}%" x2="{middle}%')
    crossing = "".join(f'<line class="{line}" y1="0" y2="20"/>' for line in lines)
    for row in group.rows:
        assert row.svg.startswith(f'<svg height="20" aria-hidden="true">{crossing}<')


def mark_of(all_questions: Answer, subject: str, points: list[Point]) -> str:
    """Return what the last row shows of its value."""
    (group,) = groups(all_questions, subject, points)
    return re.sub(".*?(<g .*|</svg>)", r"\1", group.rows[-1].svg)


def test_a_value_is_drawn_with_its_interval_threshold_and_question(all_questions: Answer) -> None:
    assert mark_of(all_questions, "homing", [NOTHING]) == "</svg>"
    assert mark_of(all_questions, "homing", [POINT]) == (
        '<g class="supported" data-question="7">'
        "<title>N 5 -&gt; 10: 1.038 [1.000, 1.075], supported, n &lt; 10</title>"
        '<line x1="5.36%" x2="94.64%" y1="10" y2="10"/>'
        '<line class="end" x1="5.36%" x2="5.36%" y1="7.5" y2="12.5"/>'
        '<line class="end" x1="94.64%" x2="94.64%" y1="7.5" y2="12.5"/>'
        '<line class="threshold" x1="27.68%" x2="27.68%" y1="5.5" y2="14.5"/>'
        '<use href="#mark-o" x="50.00%" y="10"/></g></svg>'
    )
    # Half an interval is none.
    assert mark_of(all_questions, "homing", [POINT, FAR]).endswith(
        '</title><line class="threshold" x1="42.65%" x2="42.65%" y1="5.5" y2="14.5"/>'
        '<use href="#mark-o" x="99.47%" y="10"/></g></svg>'
    )


@pytest.mark.parametrize(
    ("subject", "verdict", "title", "x"),
    [
        (
            "homing",
            "supported",
            "N 5 -&gt; 10: 1.038 [1.000, 1.075], supported, n &lt; 10",
            "58.93",
        ),
        (AGAINST, "open", "times P, N = 5: 0.80 [0.51, 1.23], open", "5.41"),
    ],
)
def test_an_interval_that_leaves_the_axis_ends_in_arrows(
    subject: str, verdict: str, title: str, x: str, all_questions: Answer
) -> None:
    assert mark_of(all_questions, subject, [CUT]) == (
        f'<g class="{verdict}" data-question="7"><title>{title}</title>'
        '<line x1="0.00%" x2="100.00%" y1="10" y2="10"/>'
        '<use href="#arrow-left" x="0.00%" y="10"/><use href="#arrow-right" x="100.00%" y="10"/>'
        f'<use href="#mark-o" class="hollow" x="{x}%" y="10"/></g></svg>'
    )
