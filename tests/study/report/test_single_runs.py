"""Single runs: what the page's script reads of seeds, conditions and questions; and the dots."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from swarm_logistics_env import judge
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report import single_runs as module
from swarm_logistics_env.study.report.section import Sentence
from swarm_logistics_env.study.report.single_runs import SingleRuns, single_runs
from swarm_logistics_env.study.tasks.outcome import Outcome
from tests.made_up import judged


def play(_: str, setting: Setting, seed: int) -> Outcome:
    """Play a run of a delivery a robot, but for a failed one, and one without times."""
    if (setting.value, seed) == (2.0, 0):
        return Outcome(error="Traceback")
    if (setting.value, seed) == (3.0, 0):
        return Outcome(untimed=2.5)
    return Outcome(np.array([1.4, 2.6, 9.5])[: int(setting.value)] + seed)


def of_three_seeds() -> SingleRuns:
    study = Study(policies=["homing"], seeds=3, sizes=[{"values": [2, 3]}], indicators=["S"])
    return single_runs(judged(study, play), [Sentence("Scalable?", "S = 1.", "open", "open")])


def test_the_page_reads_seeds_conditions_and_questions() -> None:
    data = of_three_seeds().data
    conditions = data.pop("conditions")
    assert data == {
        "seeds": [0, 1, 2],
        "paired": True,
        "questions": [
            {
                "table": "Scalability",
                "head": "Scalable?",
                "text": "S = 1.",
                "arms": [["P_N", "N = 2", 0], ["P_N+m", "N = 3", 1]],
            }
        ],
    }
    assert isinstance(conditions, list)
    two, three = conditions
    assert isinstance(two, dict)
    assert isinstance(three, dict)
    assert (two["name"], three["name"]) == ("homing, N = 2", "homing, N = 3")
    assert (two["end"], two["p"], three["p"]) == (500.0, [None, 2.0, 2.0], [2.5, 3.0, 3.0])
    assert two["curves"] == [None, [2, 2], [3, 2]]
    assert three["curves"] == [None, [2, 2, 6], [3, 2, 7]]
    assert two["command"] == "swarm-logistics watch --policy homing --set n_robots=2"


def test_a_seed_that_a_script_would_round_is_a_text() -> None:
    largest = 2**53 - 1
    rows = [(n, seed, n + seed % 7) for n in (4, 8) for seed in (5, largest, largest + 1)]
    results = judge(pd.DataFrame(rows, columns=["robots", "seed", "P"]))
    shown = single_runs(results, [Sentence("", "", "open", "open")])
    assert shown.data["seeds"] == [5, largest, str(largest + 1)]


@pytest.mark.parametrize(
    ("most", "runs", "words"),
    [
        (20, [(None, 2.0, 2.0), (2.5, 3.0, 3.0)], "one seed, click it"),
        (5, [(None, 2.0), (2.5, 3.0)], "one seed of the first 2, click it"),
        (1, [(None,), (2.5,)], "one seed of the first 1, click it"),
    ],
)
def test_each_run_is_a_dot_as_far_as_there_is_room(
    most: int,
    runs: list[tuple[float | None, ...]],
    words: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "_MOST_DOTS", most)
    shown = of_three_seeds()
    assert shown.note == f"Means; bars: 95 % intervals; dots: {words}."
    panel = shown.panels["Scalability"]
    assert (panel.x_label, panel.y_label) == ("swarm size N", "performance P")
    assert [point.runs for point in panel.points] == runs
    assert [point.category for point in panel.points] == ["2", "3"]
    assert [point.link for point in panel.points] == ["condition-0", "condition-1"]
