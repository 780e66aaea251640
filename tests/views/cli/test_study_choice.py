"""The study that a command line means asks its questions in another world."""

from __future__ import annotations

from typing import Any

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.core.errors import BodiesError, StudyError
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.task import task_of
from swarm_logistics_env.views.cli.study_choice import (
    ask_in_world,
    change_scenario,
    changes_in_words,
    switch_to_clearing,
)


@pytest.mark.parametrize(
    ("n_robots", "robots", "sizes"),
    [
        (1, None, None),  # the only robot may not fail
        (2, (1,), (1, 2, 4)),
        (3, (1,), (1, 3, 6)),
        (8, (1, 2), (3, 8, 16)),
        (9, (1, 2, 3), (4, 9, 18)),
        (25, (1, 2, 3), (10, 25, 50)),
        (50, (2, 4, 6), (20, 50, 100)),
    ],
)
def test_sizes_and_failures_follow_from_the_number_of_robots(
    n_robots: int, robots: tuple[int, ...] | None, sizes: tuple[int, ...] | None
) -> None:
    study = Study.preset("scorecard")
    ask_in_world(study, Scenario(n_robots=n_robots))
    specification = study.specification
    assert [factor.robots for factor in specification.faults] == (
        [] if robots is None else [robots]
    )
    if sizes is not None:
        assert [factor.values for factor in specification.sizes] == [sizes]
    study.plan()  # no question of it is impossible


def test_values_of_a_parameter_follow_from_its_value_there() -> None:
    study = Study.preset("scorecard")
    before = {factor.name: factor.values for factor in study.specification.parameters}
    ask_in_world(study, Scenario(delivery_width=1.0))
    after = {factor.name: factor.values for factor in study.specification.parameters}
    assert before["delivery_width"] == (2.0, 1.0)
    assert after["delivery_width"] == (1.0, 0.5)
    ask_in_world(study, Scenario(floor="aisles"))
    assert study.specification.parameters == ()


@pytest.mark.parametrize(
    ("n_robots", "width", "sizes"),
    [(25, 2.0, [(10, 25)]), (4, 1.0, [(2, 4)]), (1, 0.7, [])],
)
def test_swarms_that_do_not_fit_are_not_asked_about(
    n_robots: int, width: float, sizes: list[tuple[int, ...]]
) -> None:
    study = Study.preset("scorecard")
    ask_in_world(
        study,
        Scenario(
            n_robots=n_robots, n_items=1, warehouse_width=width, warehouse_height=width,
            delivery_width=0.4, restock=True,
        ),
    )  # fmt: skip
    assert [factor.values for factor in study.specification.sizes] == sizes


def test_a_study_of_clearing_has_no_items_that_come_back_and_no_published_values() -> None:
    study = Study.preset("paper")
    assert study.specification.reference is not None
    change_scenario(study, {"n_robots": 7})
    switch_to_clearing(study)
    specification = study.specification
    assert (specification.task, specification.reference) == ("clearing", None)
    default: Any = task_of("clearing").default
    assert specification.scenario == Scenario(n_robots=7, restock=False, duration=default.duration)


def test_what_changed_names_a_directory_in_short() -> None:
    fields = {"n_robots": 7, "floor": "a" * 60, "max_speed": 0.5}
    assert changes_in_words(fields) == ["n-robots-7", f"floor-{'a' * 34}", "max-speed-0-5"]


def test_a_floor_plan_takes_the_questions_of_sizes_out_of_a_study_and_says_so(
    capsys: pytest.CaptureFixture[str],
) -> None:
    study = Study.preset("scorecard")
    change_scenario(study, {"floor": None})
    names = [parameter.name for parameter in study.specification.parameters]
    assert names == ["delivery_width"]
    assert capsys.readouterr().out == ""
    change_scenario(study, {"floor": "aisles"})
    assert study.specification.parameters == ()
    assert isinstance(study.specification.scenario, Scenario)
    assert study.specification.scenario.floor == "aisles"
    text = "No question of delivery_width, which follows from the floor plan.\n"
    assert capsys.readouterr().out == text


def test_bodies_that_there_are_not_are_refused_before_a_study_has_them() -> None:
    study = Study.preset("scorecard")
    before = study.specification
    with pytest.raises(BodiesError, match="did you mean 'mujoco'"):
        ask_in_world(study, Scenario(bodies="mujoko"))
    assert study.specification is before


def test_no_rate_of_clearing_is_asked_of_another_task() -> None:
    study = Study(task="tests.study.tasks.lane:LANE", policies=["walker"])
    with pytest.raises(StudyError, match=r"for the task 'warehouse', not 'tests\.study"):
        switch_to_clearing(study)
