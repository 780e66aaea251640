"""A PettingZoo parallel environment as a task."""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Callable, Mapping
from contextlib import closing
from importlib.metadata import packages_distributions, version
from types import MappingProxyType

import numpy as np
from gymnasium.spaces import flatten
from pydantic import ConfigDict, PositiveFloat, PositiveInt

from swarm_logistics_env.core.code_files import PACKAGE
from swarm_logistics_env.core.errors import FaultError, StudyError, suggest
from swarm_logistics_env.core.fingerprint import UNSTABLE, fingerprint, package_code
from swarm_logistics_env.core.records import Record, canonical_json
from swarm_logistics_env.policies.evaluation_mode import in_evaluation
from swarm_logistics_env.policies.policy import one_thread
from swarm_logistics_env.policies.spec import NO_MAKERS, Makers

from .outcome import Outcome
from .parallel_policies import (
    Gain,
    RandomActions,
    SumOfRewards,
    agent_actions,
    agents_by_row,
    in_words,
    observation_rows,
    performance_of,
)
from .parallel_wrappers import (
    PARALLEL_FAILURE_MODES,
    REMOVED_MODE,
    ByAgent,
    Env,
    FailingRobots,
    RobotFault,
    Value,
    failing_rows,
)
from .task import Case, Fields, TaskScenario, digest_of

# These files decide what a run in somebody else's environment gives.
ENVIRONMENT_CODE = (
    "core/streams.py",
    "study/tasks/parallel_policies.py",
    "study/tasks/parallel_task.py",
    "study/tasks/parallel_wrappers.py",
)
_codes: dict[str, str] = {}  # of tasks by their settings: one process answers once

_REWARDS = SumOfRewards()


class ParallelScenario(Record):
    """What is held fixed during a run: swarm size, duration [s] and the task's parameters."""

    model_config = ConfigDict(extra="allow")
    error_type = StudyError

    n_robots: PositiveInt
    duration: PositiveFloat

    def conditions(self) -> list[tuple[str, str, str]]:
        """Return name, value, and unit or meaning of each."""
        units = {"n_robots": "robots", "duration": "s"}
        return [
            (name, str(value), units.get(name, "argument of the environment"))
            for name, value in self.model_dump().items()
        ]


class ParallelTask:
    """Episodes of a PettingZoo parallel environment; see `Task` for its further attributes.

    Args:
        make_env: makes the environment, called as `make_env(**{size: N}, **parameters)`. What is
            random in an episode has to follow from the seed of its `reset`.
        name: part of a condition's identity.
        n_robots: the default swarm size.
        steps: a run ends after so many steps, or when no agent is left.
        size: name of the argument for the swarm size.
        parameters: further arguments with their defaults; studies vary the numbers among them.
        performance: what a step adds to P: `SumOfRewards`, `SumOfInfos`, or a function of the
            environment, the rewards and the infos, whose docstring says what P is.
        references: two scores, that which counts as P = 0 and that which counts as P = 1; None: the
            score itself is P.
        failures: the failure modes that studies may ask for, each with what it needs: the no-op
            action of "silent", the standard deviation of "noisy", for "removed" the name of the
            argument that takes the rows of the robots to leave out; None for "frozen" and "blind".
        period: length of a step [s].
        policies: what makes the task's own policies, by name; "random" is always one.

    A policy has `act(observations) -> actions`: observations (N, D) are flattened, actions are rows
    too. One with `reset(n_robots, seed)` is told that a run begins, one with `configure(env,
    agents)` before that which agent each row is, None where a robot was removed.

    Raises:
        StudyError: an argument cannot be.

    Example:
        >>> from pettingzoo.test.example_envs import generated_agents_parallel_v0
        >>> task = ParallelTask(
        ...     lambda n_robots: generated_agents_parallel_v0.env(),
        ...     name="generated", n_robots=4, steps=20, failures={"frozen": None},
        ... )
        >>> task.failure_modes
        {'frozen': 'repeats the last action from before its failure, or its first one'}
    """

    def __init__(
        self,
        make_env: Callable[..., Env],
        *,
        name: str,
        n_robots: int,
        steps: int,
        size: str = "n_robots",
        parameters: Mapping[str, Value] = MappingProxyType({}),
        performance: Gain = _REWARDS,
        references: tuple[float, float] | None = None,
        failures: Mapping[str, Value] = MappingProxyType({}),
        period: float = 1.0,
        policies: Makers = NO_MAKERS,
    ) -> None:
        self.name = name
        self._make_env = make_env
        self._size = size
        self._failures = dict(failures)
        self._gain = performance
        self._references = references
        self._period = period
        self._nonce = UNSTABLE + uuid.uuid4().hex
        for mode, value in failures.items():
            _check_failure(mode, value)
        if references is not None and references[0] == references[1]:
            raise StudyError(f"references = {references}: should be two different scores")
        self.policies: Makers = {"random": RandomActions, **policies}
        self.removed = REMOVED_MODE if REMOVED_MODE in failures else None
        self.performance = in_words(performance, references)
        self.failure_modes = {mode: PARALLEL_FAILURE_MODES[mode] for mode in failures}
        self._numbers = {
            name: type(value)
            for name, value in parameters.items()
            if isinstance(value, int | float) and not isinstance(value, bool)
        }
        self.fields = {
            "duration": "time at which a run ends at the latest [s]",
            **dict.fromkeys(self._numbers, "argument of the environment"),
        }
        self.default = ParallelScenario(n_robots=n_robots, duration=steps * period, **parameters)

    def code(self) -> str:
        """Return a digest of what decides a run: settings, code, and the libraries' versions.

        The code is the fingerprints of the factory and of the performance; the libraries are those
        that the environment's classes come from.
        """
        settings = canonical_json([
            self._fingerprint(self._make_env), self._fingerprint(self._gain), self._size,
            repr((self._references, self._failures, self._period, self.default)),
        ])  # fmt: skip
        if settings not in _codes:
            with closing(self._environment(self.default, ())) as env:
                classes = type(env.unwrapped).__mro__
            # This package's own code is known by its sources.
            modules = {kind.__module__.partition(".")[0] for kind in classes} - {PACKAGE.name}
            installed = packages_distributions()
            names = sorted({name for module in modules for name in installed.get(module, ())})
            versions = ", ".join(f"{name} {version(name)}" for name in names)
            digest = digest_of(settings, versions, package_code(*ENVIRONMENT_CODE))
            _codes[settings] = f"{digest[:16]} ({versions})"
        return _codes[settings]

    def _fingerprint(self, function: Value) -> Value:
        parts = fingerprint(function)
        # What cannot be compared is played again by another process, not by this one's workers.
        is_unstable = parts["value"].startswith(UNSTABLE)
        return parts | {"value": self._nonce} if is_unstable else parts

    def vary(self, base: TaskScenario, fields: Fields) -> ParallelScenario:
        """Return a scenario with some fields changed.

        Raises:
            StudyError: a field is unknown or cannot be.
        """
        assert isinstance(base, ParallelScenario)
        names = base.model_dump().keys()
        for name in fields:
            if name not in names:
                raise StudyError(f"task {self.name}: no field {name!r}{suggest(name, names)}")
        return base.replace(
            **{name: self._field_value(name, value) for name, value in fields.items()}
        )

    def fault(
        self, mode: str, robots: int, onset: float, duration: float | None, manner: Fields
    ) -> RobotFault:
        """Return the fault of some robots from `onset` on, for `duration` [s] or for good.

        Raises:
            FaultError: the task has no such failure mode, or robots are to be removed in mid-run.
        """
        if mode not in self._failures:
            raise FaultError(
                f"task {self.name}: no failure mode {mode!r}{suggest(mode, self._failures)}"
            )
        if mode == REMOVED_MODE and (onset or duration is not None):
            raise FaultError(
                f"task {self.name}: robots are removed from the start, not from {onset:g} s on, so "
                'FT is not defined here: should be asked for R alone, indicators = ["R"]'
            )
        return RobotFault(mode=mode, robots=robots, onset=onset, duration=duration, **manner)

    def play(self, case: Case, seed: int, policy_seed: int) -> Outcome:
        """Play one run; see `Task.play`."""
        scenario = case.scenario
        n_robots = case.scenario.n_robots
        assert isinstance(scenario, ParallelScenario)
        faults = [fault for fault in case.faults if isinstance(fault, RobotFault)]
        # The sets of one seed are nested: the largest holds them all.
        failed = failing_rows(seed, n_robots, max((fault.robots for fault in faults), default=0))
        absent = failed if any(fault.mode == REMOVED_MODE for fault in faults) else ()
        player: Value = case.policy.load(self.policies, case.identity)
        digest = hashlib.blake2b(digest_size=16)
        gains: list[float] = []
        with closing(self._environment(scenario, absent)) as env, one_thread():
            agents = agents_by_row(env, n_robots, absent)
            # Who is not there cannot fail otherwise.
            failing_env = FailingRobots(env, () if absent else faults, self._failures, self._period)
            if hasattr(player, "configure"):
                player.configure(env, agents)
            if hasattr(player, "reset"):
                player.reset(n_robots, policy_seed)
            steps = max(1, round(scenario.duration / self._period))
            observations, _ = failing_env.reset(seed=seed)
            rewards = ByAgent()
            while True:
                for agent, observation in sorted(failing_env.true_observations.items()):
                    flat = flatten(env.observation_space(agent), observation)
                    digest.update(np.asarray(flat).tobytes())
                digest.update(repr(sorted((a, float(r)) for a, r in rewards.items())).encode())
                if len(gains) == steps or not env.agents:
                    break
                with in_evaluation(player):
                    actions = player.act(observation_rows(env, agents, observations))
                observations, rewards, _, _, infos = failing_env.step(
                    agent_actions(env, agents, actions)
                )
                gains.append(float(self._gain(env, rewards, infos)))
        # What P counts need be in no observation and no reward.
        digest.update(np.array(gains).tobytes())
        return self._outcome(gains, digest.hexdigest(), failed)

    def _outcome(self, gains: list[float], digest: str, failed: tuple[int, ...]) -> Outcome:
        total = performance_of(gains, self._references)
        # Whole numbers are events, each at the end of its step.
        are_events = self._references is None and all(gain.is_integer() for gain in gains)
        ends = np.arange(1, len(gains) + 1) * self._period
        return Outcome(
            delivery_times=np.repeat(ends, np.array(gains, np.int64) if are_events else 0),
            ended_at=len(gains) * self._period,
            failed_robots=failed,
            anchoring_seconds=None,
            digest=digest,
            untimed=None if are_events else total,
        )

    def _environment(self, scenario: ParallelScenario, absent: tuple[int, ...]) -> Env:
        arguments = scenario.model_dump()
        del arguments["duration"]
        arguments[self._size] = arguments.pop("n_robots")
        if absent:
            arguments[self._failures[REMOVED_MODE]] = absent
        return self._make_env(**arguments)

    def _field_value(self, name: str, value: object) -> object:
        """Return the value of a field; one that is a number by default has to be one."""
        kind = self._numbers.get(name)
        if kind is None:
            return value
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise StudyError(f"task {self.name}: {name} = {value!r}: should be a number")
        if kind is int and value % 1:
            raise StudyError(f"task {self.name}: {name} = {value}: should be a whole number")
        return int(value) if kind is int else value


def _check_failure(mode: str, value: Value) -> None:
    """Raise StudyError unless a failure mode is known and has what it needs."""
    is_right = True
    requirement = ""
    if mode not in PARALLEL_FAILURE_MODES:
        raise StudyError(f"failures: no mode {mode!r}{suggest(mode, PARALLEL_FAILURE_MODES)}")
    if mode == "silent":
        is_right = value is not None
        requirement = "the action that counts as none"
    elif mode == "noisy":
        is_right = isinstance(value, int | float) and value > 0
        requirement = "a standard deviation above 0, in the observations' own units"
    elif mode == REMOVED_MODE:
        is_right = isinstance(value, str)
        requirement = "the name of the factory's argument that takes the robots to leave out"
    if not is_right:
        raise StudyError(f"failures[{mode!r}] = {value!r}: should be {requirement}")
