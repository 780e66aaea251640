"""What reports say of made-up studies of every kind, word by word, as recorded."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pytest

from swarm_logistics_env import __version__
from swarm_logistics_env import judge as judge_trials
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.drawing import svg_image
from swarm_logistics_env.study.report.latex import latex_tables
from swarm_logistics_env.study.report.page import html
from swarm_logistics_env.study.report.write import markdown
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from tests.conftest import Check, figures_drawn
from tests.made_up import delivered, judged, limited, paper

RECORDED_WITH = "3.11.2"  # of matplotlib, whose versions draw otherwise

TWO = ["homing", "swarm-dt"]
EDGE: dict[str, Any] = {
    "seeds": 12,
    "policies": ["swarm-dt"],
    "sizes": [{"values": [5, 10, 20, 40]}],
}


def outcome_of(policy: str, setting: Setting, seed: int) -> Outcome:
    """Return a run of some deliveries, whose mean goes with the policy and the setting's name."""
    rng = np.random.default_rng([seed, *map(ord, f"{policy} {setting}")])
    mean = 8.0 + sum(map(ord, f"{policy} {setting.name}")) % 40
    n_delivered = int(rng.poisson(mean)) if rng.random() > 0.08 else 0
    times = np.sort(rng.uniform(0.0, 500.0, n_delivered)).round(1)
    return Outcome(
        delivery_times=times,
        ended_at=500.0,
        anchoring_seconds=float(rng.poisson(30.0)),
        on_time=2 * n_delivered // 3,
        share_on_time=0.6 if n_delivered else 0.0,
        mean_tardiness=float(rng.poisson(20.0)),
        p95_tardiness=float(rng.poisson(90.0)),
        longest_queue=int(rng.poisson(7.0)),
        turned_away=int(rng.poisson(1.0)),
        contacts_per_robot_minute=float(rng.poisson(50.0)),
        overlap_share=0.01 * float(rng.poisson(3.0)),
        digest=f"{policy} {setting} {seed}",
    )


def with_failures(policy: str, setting: Setting, seed: int) -> Outcome:
    if seed == 1 and setting.kind != "size":
        return Outcome(error="Traceback\nValueError: nothing is right")
    return outcome_of(policy, setting, seed)


def until_empty(policy: str, setting: Setting, seed: int) -> Outcome:
    """Return a run that delivers all of twelve items, or some of them."""
    outcome = outcome_of(policy, setting, seed)
    times = outcome.delivery_times[:12]
    is_done = len(times) == 12
    ended_at = float(times[-1]) if is_done else 500.0
    return Outcome(delivery_times=times, ended_at=ended_at, all_delivered=is_done)


def collapsing(_: str, setting: Setting, seed: int) -> Outcome:
    """Return a run of a swarm that collapses the more often the larger it is."""
    size = int(setting.value or 5)
    collapses = seed < size / 4
    return Outcome(delivery_times=np.arange(1.0 + seed % 2 if collapses else 2.0 * size + seed % 3))


def of_trainings() -> StudyResults:
    """Return a study of a policy that was trained seven times."""
    plan = Study(policies=["ppo-robust@all"], seeds=3, sizes=[{"values": [4, 8]}]).plan()
    outcomes = {}
    for run in plan.runs:
        n_robots = run.case.scenario.n_robots
        rng = np.random.default_rng([run.seed, n_robots, *map(ord, run.case.policy.name)])
        outcomes[run.case.key, run.seed] = delivered(rng.poisson(20) + 3 * n_robots)
    return judge(plan, outcomes)


def of_trials() -> StudyResults:
    """Return trials of three policies."""
    noise = {"a": (0, 3, 1, 4), "b": (2, 2, 0, 1), "c": (4, 0, 3, 3)}
    rows = [
        (policy, n_robots, 3 * n_robots + (number + n_robots) % 5)
        for policy, numbers in noise.items()
        for n_robots in (4, 8)
        for number in numbers
    ]
    return judge_trials(pd.DataFrame(rows, columns=["policy", "robots", "P"]))


def studies() -> Iterator[tuple[str, StudyResults]]:
    """Yield results by a name."""
    yield "paper, one seed", paper(seeds=1)
    for preset, policies in (("resilience", ["homing"]), ("day", TWO), ("orders", TWO)):
        yield preset, judged(Study.preset(preset, seeds=6, policies=policies), outcome_of)
    yield "failures", judged(Study.preset("quick", seeds=4, policies=TWO), with_failures)
    yield "empty", judged(Study.preset("quick", seeds=6, policies=["homing"]), until_empty)
    yield "edge", judged(Study(**EDGE), collapsing)
    yield "limited", limited()
    damage = "3 rows are damaged"
    yield "flagged", replace(limited(), exploratory=True, late_margin=True, damage=damage)
    yield "trainings", of_trainings()
    yield "trials", of_trials()


@pytest.fixture(scope="module")
def made_up() -> dict[str, StudyResults]:
    return dict(studies())


def without_versions(text: str) -> str:
    """Return a text without what changes with any code: digests, and the package's version."""
    return re.sub(r"\b[0-9a-f]{12,}\b", "DIGEST", text.replace(__version__, "VERSION"))


def lines_of_page(page: str) -> list[str]:
    """Return the lines of a page without scripts, styles, versions and drawings."""
    page = re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.DOTALL)
    page = re.sub(r"base64,[^\"]+", "", without_versions(page))
    return [line for line in page.replace("><", ">\n<").splitlines() if line.strip()]


def test_pages_are_as_recorded(made_up: dict[str, StudyResults], check_recorded: Check) -> None:
    lines = []
    for name in ("day", "edge"):
        report = document(made_up[name])
        drawings = {f.name: svg_image(f.draw, f.height, f.note) for f in report.figures}
        lines += [f"#### {name}", *lines_of_page(html(report, drawings, latex=""))]
    check_recorded("pages.txt", lines)


@pytest.mark.skipif(matplotlib.__version__ != RECORDED_WITH, reason="of another matplotlib")
def test_drawings_are_as_recorded(made_up: dict[str, StudyResults], check_recorded: Check) -> None:
    lines = []
    with figures_drawn("svg"):
        for name in ("day", "edge"):
            for figure in document(made_up[name]).figures:
                svg = svg_image(figure.draw, figure.height, figure.note)
                lines += [f"#### {name}, {figure.name}", *svg.splitlines()]
    check_recorded("drawings.txt", lines)


def test_reports_are_as_recorded(made_up: dict[str, StudyResults], check_recorded: Check) -> None:
    lines = []
    for name, results in made_up.items():
        report = document(results)
        text = markdown(report)
        if name in ("day", "edge", "failures"):
            text += f"\n{latex_tables(report.paper)}"
        if name in ("limited", "flagged", "trainings", "trials"):
            text = re.sub(r"\n## Set-up.*?(?=\n## Methods)", "", text, flags=re.DOTALL)
        lines += [f"#### {name}", *filter(None, without_versions(text).splitlines())]
        lines.append(f"figures: {', '.join(figure.name for figure in report.figures)}")
        lines.append(report.runs.note)
        for table, panel in report.runs.panels.items():
            means = [f"{p.series} {p.category} {p.value:.4g} {p.link}" for p in panel.points]
            lines.append(f"panel {table}: {panel.x_label}: {'; '.join(means)}")
    check_recorded("reports.txt", lines)
