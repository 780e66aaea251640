"""The built-in tasks.

Robots deliver items for a time, or until the warehouse is cleared. Recorded trials are conditions
that were met elsewhere, and cannot be played again.
"""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from types import MappingProxyType
from typing import Any

from swarm_logistics_env.core.errors import ScenarioError, StudyError
from swarm_logistics_env.core.fingerprint import package_code
from swarm_logistics_env.core.records import Record
from swarm_logistics_env.policies.episode import run_episode
from swarm_logistics_env.policies.spec import NO_MAKERS
from swarm_logistics_env.world.scenario import SCENARIO_PRESETS, Scenario, kinds_text
from swarm_logistics_env.world.warehouse import FAILURE_MODES, Fault
from swarm_logistics_env.world.warehouse.faults import failed_robots, text_of

from .outcome import Outcome
from .task import Case, Fields, TaskFault, TaskScenario
from .task_world import TaskWorld

_MOST_CHANGES = 4  # of a preset that is still named

# What decides an episode. The other files hold messages, validation, statistics and pictures, and
# "!" excludes those that name, read, record and check policies: a policy's identity tells what was
# read.
EPISODE_CODE = (
    "compiler/*.py", "core/streams.py", "world/**/*.py", "!world/rendering/*.py",
    "world/floor/plans/*.txt", "policies/*.py", "!policies/__init__.py", "!policies/spec.py",
    "!policies/catalogue.py", "!policies/files.py", "!policies/models.py",
    "!policies/model_spaces.py", "!policies/networks.py", "!policies/normalizers.py",
    "!policies/sb3_files.py", "!policies/demonstrations.py", "!policies/testing.py",
    "!policies/c_*.py",
)  # fmt: skip


class WarehouseTask(TaskWorld):
    """Episodes of `run_episode`; see `Task` and `TaskWorld` for its attributes."""

    name = "warehouse"
    removed: str | None = "removed"
    performance = "the number of items delivered in the order requested"
    counted = "items"
    default = Scenario()
    policies = NO_MAKERS

    # The scenario's numeric fields but `n_robots`, each with unit, meaning and source.
    fields: Mapping[str, str] = {
        name: str(field.description)
        for name, field in Scenario.model_fields.items()
        if isinstance(field.default, int | float) and not isinstance(field.default, bool)
        if name != "n_robots"
    }

    @property
    def failure_modes(self) -> dict[str, str]:
        """The failure modes of `FAILURE_MODES`, each with what it does to a robot."""
        return {mode: FAILURE_MODES[mode].description for mode in FAILURE_MODES}

    def code(self) -> str:
        """Return the digest of the code that decides an episode, 16 hexadecimal digits.

        Its files are `EPISODE_CODE`.
        """
        return package_code(*EPISODE_CODE)

    def vary(self, base: TaskScenario, fields: Fields) -> Scenario:
        """Return `base` with `fields` changed; "preset" starts from that preset instead.

        Raises:
            ScenarioError: there is no such preset, or a field cannot be.
        """
        changes = dict(fields)
        if "preset" in changes:
            base = Scenario.preset(str(changes.pop("preset")))
        assert isinstance(base, Scenario)
        return base.replace(**changes)

    def fault(
        self, mode: str, robots: int, onset: float, duration: float | None, manner: Fields
    ) -> Fault:
        """Return the fault of some robots from `onset` on; `manner` is its further fields."""
        further: dict[str, Any] = dict(manner)
        return Fault(mode, robots, onset, duration, **further)

    def play(self, case: Case, seed: int, policy_seed: int) -> Outcome:
        """Play one episode; see `Task.play`."""
        assert isinstance(case.scenario, Scenario)
        faults = [fault for fault in case.faults if isinstance(fault, Fault)]
        # A policy of its own: one that remembers must not make rows depend on the order of runs.
        episode = run_episode(
            case.scenario, case.policy.load(planned=case.identity), seed, faults, policy_seed
        )
        return Outcome(
            delivery_times=episode.delivery_times,
            ended_at=episode.ended_at,
            all_delivered=episode.all_delivered,
            failed_robots=episode.failed_robots,
            anchoring_seconds=episode.anchoring_seconds,
            digest=episode.digest,
            **asdict(episode.contacts),
            **asdict(episode.orders),
        )

    def mode_title(self, mode: str) -> str:
        """Return `FailureMode.title`."""
        return FAILURE_MODES[mode].title if mode in FAILURE_MODES else ""

    def world_in_words(self, scenario: TaskScenario) -> str:
        """Return size, items and robots of the warehouse."""
        assert isinstance(scenario, Scenario)
        drive = "" if scenario.drive == "holonomic" else f" and {scenario.drive} drive"
        handling = f" that lift in {scenario.handling_time:g} s" if scenario.handling_time else ""
        floor = f" (floor {scenario.floor})" if scenario.floor else ""
        kinds = f" ({kinds_text(scenario.robot_kinds)})" if scenario.robot_kinds else ""
        batteries = ""
        if scenario.battery is not None:
            n_stations = len(scenario.stations)
            batteries = f", batteries of {scenario.battery:g} J, charging stations: {n_stations}"
        restock = " that come back" if scenario.restock else ""
        return (
            f"a warehouse of {scenario.warehouse_width:g} m x {scenario.warehouse_height:g} m"
            f"{floor} with {scenario.n_items} items{restock}, robots of {scenario.max_speed:g} m/s"
            f"{drive}{handling}{kinds}{batteries}"
        )

    def preset_in_words(self, scenario: TaskScenario) -> str:
        """Return the preset that is nearest, with what differs, unless that is much."""
        assert isinstance(scenario, Scenario)
        values = scenario.model_dump()
        differing = {
            name: [field for field, value in preset if value != getattr(scenario, field)]
            for name, preset in SCENARIO_PRESETS.items()
        }
        nearest = min(differing, key=lambda name: len(differing[name]))
        fields = [field for field in differing[nearest] if field != "bodies"]
        if len(fields) > _MOST_CHANGES:
            return ""
        changes = " and ".join(f"{field} = {values.get(field, 'none')}" for field in fields)
        return f"preset {nearest} with {changes}" if changes else f"preset {nearest}"

    def check_faults(self, scenario: TaskScenario, faults: Sequence[TaskFault]) -> None:
        """Raise FaultError if a fault names a kind that the scenario has not, or too many of it."""
        assert isinstance(scenario, Scenario)
        for fault in faults:
            if isinstance(fault, Fault):
                failed_robots(fault, 0, scenario)

    def engine(self, scenario: TaskScenario) -> str:
        """Return the engine of the bodies."""
        assert isinstance(scenario, Scenario)
        return scenario.bodies

    def largest_performance(self, scenario: TaskScenario) -> float:
        """Return the number of items; infinite where delivered ones come back."""
        assert isinstance(scenario, Scenario)
        return math.inf if scenario.restock else scenario.n_items

    def watch_command(self, case: Case) -> str | None:
        """Return the `swarm-logistics watch` of a case; None: a text says no policy or fault so."""
        if case.behaviour or not case.policy.is_text:
            return None
        words = ["swarm-logistics", "watch", "--policy", case.policy.name]
        # A class that is typed is trusted by that; the code in a file is not.
        if case.policy.runs_code and ":" not in case.policy.name:
            words.append("--trust-code")
        default = self.default.model_dump(mode="json")
        for name, value in case.scenario.model_dump(mode="json").items():
            if value != default.get(name):
                text = value if isinstance(value, str) else json.dumps(value, separators=(",", ":"))
                words += ["--set", f"{name}={text}"]
        for fault in case.faults:
            text_of_fault = text_of(fault) if isinstance(fault, Fault) else None
            if text_of_fault is None:
                return None
            words += ["--fault", text_of_fault]
        return shlex.join(words)


class ClearingTask(WarehouseTask):
    """Episodes until every item is delivered: P is the rate, which no number of items caps.

    A run that is not done when the time is up counts with its rate until then, which is too high
    rather than too low, as the last items take longest.
    """

    name = "clearing"
    performance = "the items delivered per minute until all are delivered, or until the time is up"
    counted = ""
    default = Scenario(duration=3_000.0)

    def vary(self, base: TaskScenario, fields: Fields) -> Scenario:
        """Return `base` with `fields` changed; a preset keeps the time of this task.

        Raises:
            ScenarioError: a field cannot be, or items would come back.
        """
        if "preset" in fields:
            fields = {"duration": self.default.duration, **fields}
        varied = super().vary(base, fields)
        if varied.restock:
            raise ScenarioError(
                "restock = True: should be False in the task 'clearing', which ends when every "
                "item is delivered"
            )
        return varied

    def play(self, case: Case, seed: int, policy_seed: int) -> Outcome:
        """Play one episode; see `Task.play`."""
        outcome = super().play(case, seed, policy_seed)
        return replace(outcome, untimed=60.0 * len(outcome.delivery_times) / outcome.ended_at)

    def largest_performance(self, scenario: TaskScenario) -> float:
        """Return infinity: it is a rate."""
        return math.inf

    def watch_command(self, case: Case) -> None:
        """Return None: `watch` shows runs of the warehouse's own task."""


class RecordedScenario(Record):
    """What a file says of the conditions of a trial.

    Args:
        n_robots: swarm size N; 0: the file does not say.
        duration: of a trial [s]; 0: the file does not say.
        table: which of the file's own tables it stands in, where each has runs of its own.
        parameters: name and value of whatever else varies.
    """

    error_type = StudyError

    n_robots: int = 0
    duration: float = 0.0
    table: str = ""
    parameters: tuple[tuple[str, float], ...] = ()

    def conditions(self) -> list[tuple[str, str, str]]:
        """Return name, value and unit of every condition."""
        return [(name, f"{value:g}", "") for name, value in self.parameters]


class RecordedFault(Record):
    """A failure mode of any name, in so many robots from `onset` [s] on."""

    error_type = StudyError

    mode: str
    robots: int
    onset: float = 0.0


_CANNOT_BE_PLAYED = "recorded trials cannot be played again: give a file with more of them"


class RecordedTrials:
    """Trials of real robots, another simulator or a paper; see `Task` for the attributes."""

    name = "recorded trials"
    removed: str | None = "removed"
    performance = "what the file holds for each trial"
    default = RecordedScenario()
    policies = NO_MAKERS
    fields: Mapping[str, str] = MappingProxyType({})
    failure_modes: Mapping[str, str] = MappingProxyType({})

    def code(self) -> str:
        """Return a word in place of a code version: none made these runs."""
        return "imported"

    def vary(self, base: TaskScenario, fields: Fields) -> RecordedScenario:
        """Return the scenario of a file, of which nothing is varied by a study."""
        assert isinstance(base, RecordedScenario)
        return base.replace(**fields)

    def fault(
        self, mode: str, robots: int, onset: float, duration: float | None, manner: Fields
    ) -> RecordedFault:
        """Raise, as `play` does."""
        raise StudyError(_CANNOT_BE_PLAYED)

    def play(self, case: Case, seed: int, policy_seed: int) -> Outcome:
        """Raise: what was recorded cannot be played again.

        Raises:
            StudyError: always.
        """
        raise StudyError(_CANNOT_BE_PLAYED)


WAREHOUSE = WarehouseTask()
CLEARING = ClearingTask()
RECORDED = RecordedTrials()
