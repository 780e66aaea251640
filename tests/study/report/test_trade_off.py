"""P beside contacts: which conditions stand in the picture, and what it shows of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure as Canvas

from swarm_logistics_env import spi
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report.drawing import svg_image
from swarm_logistics_env.study.report.figures import trade_off_figure
from swarm_logistics_env.study.report.section import NOTHING
from swarm_logistics_env.study.report.tables import CONTACTS_HEADING, cell_tables
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.verdicts.results import StudyResults
from tests.conftest import figures_drawn
from tests.made_up import delivered, judged

pytestmark = pytest.mark.unmeasured


def results(sizes: list[int], missing: int | None = None) -> StudyResults:
    """Two policies, of which homing delivers more and has fewer contacts.

    Args:
        missing: the swarm size of which nobody counted them at seed 0.
    """
    study = Study(policies=["swarm-dt", "homing"], seeds=3, sizes=[{"values": sizes}])

    def play(policy: str, setting: Setting, seed: int) -> Outcome:
        counts = {"swarm-dt": (10, 8.0), "homing": (40, 0.0)}
        p, contacts = counts[policy]
        is_counted = seed > 0 or setting.value != missing
        return replace(
            delivered(p + seed),
            contacts_per_robot_minute=contacts + seed if is_counted else None,
            fast_contacts=0.5 if contacts + seed and is_counted else None,
        )

    return judged(study, play)


def test_each_condition_has_a_row_with_a_point_a_policy() -> None:
    pytest.importorskip("matplotlib", reason="needs the extra study")
    (figure,) = trade_off_figure(results([5, 10, 20]))
    assert figure.data["cell"].tolist() == ["N = 5", "N = 10", "N = 20"] * 2
    first = figure.data.iloc[0]
    assert (first["policy"], first["contacts"], first["mean"]) == ("swarm-dt", 9.0, 11.0)
    mean, contacts = (spi.mean_interval(runs) for runs in ([10, 11, 12], [8.0, 9.0, 10.0]))
    assert [*first] == ["swarm-dt", "N = 5", *contacts, *mean, 0.95]
    columns = ["policy", "cell", "contacts", "contacts_low", "contacts_high", "mean", "low", "high"]
    assert [*figure.data.columns] == [*columns, "confidence"]
    assert figure.height == pytest.approx(0.8 + 3 * 0.3)
    with figures_drawn("svg"):
        svg = svg_image(figure.draw, figure.height, figure.note)
    assert [svg.count(f">N = {n}<") for n in (5, 10, 20)] == [1, 1, 1]
    for text in (
        "performance P",
        "contacts per robot-minute",
        "homing",
        "95\N{NO-BREAK SPACE}% intervals",
    ):
        assert text in svg


def test_a_condition_with_a_run_that_nobody_counted_is_missing_not_0() -> None:
    mixed = results([5, 10, 20], missing=10)
    (figure,) = trade_off_figure(mixed)
    assert figure.data["cell"].tolist() == ["N = 5", "N = 20"] * 2
    cells = {(cell.policy, cell.words): cell for cell in mixed.cells}
    assert np.isnan(cells["homing", "N = 10"].contacts.value)
    assert cells["homing", "N = 10"].fast_contacts is None
    assert cells["homing", "N = 5"].fast_contacts == 0.5
    assert cells["homing", "N = 5"].mean_of("overlap_share") is None
    table = next(iter(cell_tables(mixed)))
    column = table.columns.index(CONTACTS_HEADING)
    assert [row[column] for row in table.rows] == ["9.0 [6.5, 11.5]", NOTHING, "9.0 [6.5, 11.5]"]


def test_conditions_without_a_contact_have_a_row() -> None:
    study = Study(policies=["homing"], seeds=3, sizes=[{"values": [5, 10]}])
    peaceful = judged(study, lambda *_: replace(delivered(7), contacts_per_robot_minute=0.0))
    (figure,) = trade_off_figure(peaceful)
    assert figure.data["contacts"].tolist() == [0.0, 0.0]
    for shown, title in ((figure, "homing"), (next(trade_off_figure(results([5, 10]))), "")):
        canvas = Canvas()
        shown.draw(canvas)
        assert [axes.get_title() for axes in canvas.axes] == [title, ""]


def test_without_any_count_there_is_neither_picture_nor_column() -> None:
    study = Study(policies=["homing"], seeds=3, sizes=[{"values": [5, 10]}])
    older = judged(study, lambda *_: delivered(7))
    assert list(trade_off_figure(older)) == []
    assert all(CONTACTS_HEADING not in table.columns for table in cell_tables(older))
