"""The study that a command line means: a file or a preset, with what its options change."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from more_itertools import partition

from swarm_logistics_env.core.errors import ScenarioError, StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.policies.sb3_files import SB3_SUFFIX
from swarm_logistics_env.study.questions.specification import Parameter
from swarm_logistics_env.study.report.section import slug
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.world.bodies.bodies import load_bodies
from swarm_logistics_env.world.floor.floor_plan import PLAN_SIZES
from swarm_logistics_env.world.scenario import CHIPMUNK, Scenario

from .terminal import say


def study_of(
    study_name: str,
    out: Path | None,
    seeds: int | None,
    policies: Sequence[PolicySpec],
    trust_code: bool,
    **fields: object,
) -> Study:
    """Return the study of a file or a preset with the options and fields that are given, not None.

    Args:
        policies: instead of those that it names, if any.

    Raises:
        StudyError: there is no such file or preset, or it cannot be.
    """
    options = {"seeds": seeds, "policies": tuple(policies) or None, **fields}
    fields = {name: value for name, value in options.items() if value is not None}
    for policy in policies:
        # What is typed names a class on purpose; a file may look like any other.
        if policy.name.endswith(SB3_SUFFIX) and not trust_code:
            raise StudyError(
                f"--policy {policy.name}: reading a model of stable-baselines3 executes the code "
                "in it: should be allowed by --trust-code"
            )
    if study_name.endswith(".toml") or Path(study_name).is_file():
        return Study.from_file(study_name, out=out, trust_code=trust_code, **fields)
    return Study.preset(study_name, out=out, **fields)


def switch_to_clearing(study: Study) -> None:
    """Let P be the rate at which the items of a study's warehouse are cleared.

    Raises:
        StudyError: the study plays another task.
    """
    from swarm_logistics_env.study.tasks.task import DEFAULT, task_of

    specification = study.specification
    if specification.task != DEFAULT:
        task_name = specification.task
        raise StudyError(f"--clearing: should be for the task {DEFAULT!r}, not {task_name!r}")
    task = task_of("clearing")
    changes = {"restock": False, "duration": task.default.duration}
    scenario = task.vary(specification.scenario, changes)
    # What is published is of another P.
    study.specification = specification.replace(task="clearing", scenario=scenario, reference=None)


def changes_in_words(fields: Mapping[str, Any]) -> list[str]:
    """Return what names the directory of a study with these fields changed."""
    return [slug(name, value)[:40] for name, value in fields.items()]


def ask_in_world(study: Study, scenario: Scenario) -> None:
    """Ask a study's questions in another world.

    Swarm sizes and numbers of failed robots follow from the number of robots in proportion, where
    the robots fit and at most a third of them fails; values of a parameter from its value there.

    Raises:
        SwarmLogisticsError: a package that the robots' bodies need is not installed.
    """
    if scenario.bodies != CHIPMUNK:
        load_bodies(scenario.bodies)  # what is wrong with them is said before anything is written
    specification = study.specification
    original = specification.scenario
    n_robots = scenario.n_robots
    share = n_robots / original.n_robots
    sizes = [
        factor.replace(values=values)
        for factor in specification.sizes
        if len(values := _sizes_that_fit(scenario, [share * size for size in factor.values])) > 1
    ]
    faults = []
    for factor in specification.faults:
        numbers = [m * max(1, round(share)) for m in factor.robots]
        # The fewest fail in a small swarm as well, as long as a robot is left.
        fewest = numbers[0] if numbers[0] < n_robots else None
        robots = [m for m in numbers if m == fewest or 3 * m <= n_robots]
        faults += [factor.replace(robots=tuple(robots))] if robots else []
    parameters = []
    for parameter in specification.parameters:
        scale = getattr(scenario, parameter.name) / getattr(original, parameter.name)
        values = tuple(scale * value for value in parameter.values)
        parameters.append(parameter.replace(values=values))
    if scenario.floor is not None:
        parameters = _without_sizes_of_plan(parameters)
    study.specification = specification.replace(
        scenario=scenario, sizes=tuple(sizes), faults=tuple(faults), parameters=tuple(parameters)
    )


def _sizes_that_fit(scenario: Scenario, sizes: Iterable[float]) -> tuple[int, ...]:
    """Return the sizes, rounded, ascending and each once, of swarms that fit into the world."""
    fitting = set()
    for size in sizes:
        n_robots = max(1, round(size))
        with contextlib.suppress(ScenarioError):
            fitting.add(scenario.replace(n_robots=n_robots).n_robots)
    return tuple(sorted(fitting))


def _without_sizes_of_plan(parameters: Iterable[Parameter]) -> list[Parameter]:
    """Return the parameters that do not follow from a floor plan; tell which ones do."""
    from_plan, remaining = partition(lambda parameter: parameter.name not in PLAN_SIZES, parameters)
    for parameter in from_plan:
        say(f"No question of {parameter.name}, which follows from the floor plan.")
    return list(remaining)


def change_scenario(study: Study, fields: Mapping[str, Any]) -> None:
    """Change fields of the scenario in every condition of a study.

    Raises:
        SwarmLogisticsError: the task's scenario has no such field, its value cannot be, or a
            package that it needs is not installed.
    """
    if not fields:
        return
    if "bodies" in fields:
        load_bodies(fields["bodies"])  # what is wrong with them is said before anything is written
    specification = study.specification
    if fields.get("floor") is not None:
        remaining = _without_sizes_of_plan(specification.parameters)
        specification = specification.replace(parameters=tuple(remaining))
    study.specification = specification.varying(fields)
