"""Several environments in one process, whose robots are the rows of common arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import CommandError, SetupError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import numbers_of
from swarm_logistics_env.environment.reward_terms import pay_worlds
from swarm_logistics_env.environment.spaces import ArrayStep
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.thread_pool import WorldThreadPool
from swarm_logistics_env.wrappers.wrapper import Wrapper, layers_of

TrainingWorld: TypeAlias = SwarmLogisticsEnv | Wrapper


class RowsStep(NamedTuple):
    """The outcome of a step of all worlds; the caller may change the arrays."""

    observations: NDArray[np.float32]  # (R, D)
    rewards: NDArray[np.float32]  # (R,)
    terminated: NDArray[np.bool_]  # (R,)
    truncated: NDArray[np.bool_]  # (R,)


class Worlds:
    """Worlds whose robots are R rows: world 0's possible agents first, then world 1's, ...

    Rows without a robot are zeros, and those of a robot that is away. The caller begins the next
    episode of a world that is over, so that one thread alone touches what worlds share.

    Args:
        make_env: world number -> environment.
        n_worlds: how many.
        threads: how many step at the same time; the results are the same bits.

    Attributes:
        envs: the environments.
        rows: of each world, the slice of its rows.
        world_of: (R,) the world of each row.
        is_over: of each world, whether its episode is.
        present: (R,) which rows of the latest observations are a robot's, maybe one that is away.
        reported: the worlds whose latest step had more to tell than observations and rewards; ends
            of all others are zeros.
        observation_space, command_space: of every row.

    Raises:
        SetupError: no environments, one twice, or rows or commands that differ in length.
    """

    def __init__(
        self, make_env: Callable[[int], TrainingWorld], n_worlds: int, threads: int
    ) -> None:
        self.envs = [make_env(world) for world in range(n_worlds)]
        self.observation_space, self.command_space = _spaces(self.envs)
        sizes = [len(env.possible_agents) for env in self.envs]
        ends = np.cumsum(sizes).tolist()
        self.rows = [slice(end - size, end) for end, size in zip(ends, sizes)]
        self.n_rows: int = ends[-1]
        self.world_of = np.repeat(np.arange(n_worlds), sizes)
        self.is_over = [False] * n_worlds
        self.present = np.zeros(self.n_rows, np.bool_)
        self._n_robots = [0] * n_worlds
        self.reported: list[int] = []
        self._commands = np.zeros((self.n_rows, *self.command_space.shape))
        self._layers = [layers_of(env) for env in self.envs]
        # The largest worlds are stepped first, so that all threads end at about the same time.
        order = sorted(range(n_worlds), key=lambda world: -sizes[world])
        self._shared_out = [w for w in order if _can_be_shared_out(self._layers[w])]
        self._alone = [world for world in order if world not in self._shared_out]
        # The thread that asks for a step works as well.
        self._n_helpers = max(min(threads, len(self._shared_out)) - 1, 0)
        self._begin_work()

    def _begin_work(self) -> None:
        self._pool = WorldThreadPool(
            [self._layers[world][-1].warehouse for world in self._shared_out],
            [self.rows[world].start for world in self._shared_out],
            self._n_helpers,
        )

    def blank(self) -> NDArray[np.float32]:
        """Return zeros for the observations of all rows, (R, D)."""
        return np.zeros((self.n_rows, *self.observation_space.shape), np.float32)

    def begin(
        self,
        world: int,
        observations: NDArray[np.float32],
        seed: int | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        """Begin an episode and write its first observations into those of all rows."""
        rows = self.rows[world]
        first = self.envs[world].reset_arrays(seed, options)
        observations[rows] = 0.0
        observations[rows.start : rows.start + len(first)] = first
        self._n_robots[world] = len(first)
        self.is_over[world] = False
        self.note_present(world)

    def note_present(self, world: int) -> None:
        """Update which rows of a world are robots that take part."""
        in_episode = self.envs[world].warehouse.state.in_episode
        rows = self.rows[world]
        self.present[rows] = False
        self.present[rows.start : rows.start + len(in_episode)] = in_episode

    def give(self, commands: ArrayLike) -> None:
        """Take the commands (R, 4) of the next step.

        Raises:
            CommandError: wrong shape, not readable or not finite.
            SetupError: no episode was begun.
        """
        if not any(self._n_robots):
            raise SetupError("step before reset: call reset() first")
        numbers = numbers_of(commands, "actions", self._commands.shape)
        self._commands[:] = numbers
        if not np.isfinite(self._commands).all():
            row = np.argwhere(~np.isfinite(self._commands))[0, 0]
            raise CommandError(f"actions[{row}] = {numbers[row]}: should be finite")

    def step(self, waiting: frozenset[int] = frozenset()) -> RowsStep:
        """Take one control period in every world but those `waiting`, with the commands given."""
        # New arrays, because the caller may still hold those of the step before.
        terminated, truncated = np.zeros((2, self.n_rows), np.bool_)
        rewards = np.zeros(self.n_rows, np.float32)
        outcome = RowsStep(self.blank(), rewards, terminated, truncated)
        self.reported = []
        if self._shared_out and not waiting:
            outcome = self._step_together(outcome)
        alone = [w for w in range(len(self.envs)) if w not in waiting] if waiting else self._alone
        for world in alone:
            robots = self._robots(world)
            step = self.envs[world].step_arrays(self._commands[robots].copy())
            outcome.observations[robots] = step[0]
            self._take(world, step, outcome)
        return outcome

    def close(self) -> None:
        """Release threads and what rendering holds; harmless when called twice."""
        self._pool.close()
        for env in self.envs:
            env.close()

    def _step_together(self, outcome: RowsStep) -> RowsStep:
        stacks = [self._layers[world] for world in self._shared_out]
        self._pool.is_watched[:] = [
            core.is_watched or any(map(_reads_steps, wrappers)) for *wrappers, core in stacks
        ]
        for world, (*wrappers, _) in zip(self._shared_out, stacks):
            for wrapper in filter(_changes_commands, wrappers):
                robots = self._robots(world)
                self._commands[robots] = wrapper.before_step(self._commands[robots].copy())
        # The worlds keep what they sensed, whatever the wrappers make of it.
        changed_rows: dict[int, NDArray[np.float32]] = {}

        def take_over(index: int, sensed: NDArray[np.float32]) -> None:
            world = self._shared_out[index]
            *wrappers, core = self._layers[world]
            step = core.outcome(sensed)
            for wrapper in reversed(wrappers):
                step = wrapper.after_step(step)
            if step[0] is not sensed:
                changed_rows[world] = step[0]
            self._take(world, step, outcome)

        self._pool.step(self._commands, outcome.observations, take_over)
        self._pay_others(outcome.rewards)
        if changed_rows:
            outcome = outcome._replace(observations=outcome.observations.copy())
            for world, rows in changed_rows.items():
                outcome.observations[self._robots(world)] = rows
        return outcome

    def _pay_others(self, rewards: NDArray[np.float32]) -> None:
        """Fill the rewards of those worlds whose step `_take` was not told of."""
        reported = set(self.reported)
        paid = []
        for world in self._shared_out:
            core = self._layers[world][-1]
            if world not in reported and core.steady_pay is not None:
                paid.append((core.warehouse.address, core.steady_pay, self.rows[world].start))
        if paid:
            pay_worlds(np.array(paid, np.int64), rewards)

    def _take(self, world: int, step: ArrayStep, outcome: RowsStep) -> None:
        robots = self._robots(world)
        _, rewards, terminated, truncated = step
        outcome.rewards[robots] = rewards
        outcome.terminated[robots] = terminated
        outcome.truncated[robots] = truncated
        self.is_over[world] = not self.envs[world].agents
        self.reported.append(world)

    def _robots(self, world: int) -> slice:
        first = self.rows[world].start
        return slice(first, first + self._n_robots[world])

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_pool": None}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        self.__dict__.update(saved)
        self._begin_work()


def _changes_commands(wrapper: Wrapper) -> bool:
    return type(wrapper).before_step is not Wrapper.before_step


def _reads_steps(wrapper: Wrapper) -> bool:
    kind = type(wrapper)
    return (kind.after_step, kind.episode_info) != (Wrapper.after_step, Wrapper.episode_info)


def _can_be_shared_out(layers: list[Any]) -> bool:
    *wrappers, core = layers
    is_plain = all(type(wrapper).step_arrays is Wrapper.step_arrays for wrapper in wrappers)
    return type(core) is SwarmLogisticsEnv and is_plain


def _spaces(worlds: Sequence[TrainingWorld]) -> tuple[Box, Box]:
    for env in worlds:
        if not hasattr(env, "reset_arrays"):
            raise SetupError(
                f"make_env gave {env!r}: should be a SwarmLogisticsEnv or a wrapper of one"
            )
    if len({id(env.unwrapped) for env in worlds}) < len(worlds):
        raise SetupError("make_env gave the same environment twice: should make one each time")
    observation_spaces = [env.observation_space("robot_0") for env in worlds]
    command_spaces = [env.action_space("robot_0") for env in worlds]
    row_shapes = [space.shape for space in observation_spaces]
    command_shapes = [space.shape for space in command_spaces]
    if len(set(zip(row_shapes, command_shapes))) > 1:
        raise SetupError(
            f"observations {row_shapes} and commands {command_shapes}: should be of one length in "
            "all worlds, so of one message_size"
        )
    low = np.min([space.low for space in observation_spaces], axis=0)
    high = np.max([space.high for space in observation_spaces], axis=0)
    return Box(low, high, dtype=np.float32), command_spaces[0]


def maker(
    make_env: Callable[[int], TrainingWorld] | None,
    scenario: Scenario | None,
    n_worlds: int,
    n_robots: int | Sequence[int] | None,
    fields: Mapping[str, Any],
) -> Callable[[int], TrainingWorld]:
    """Return what makes the environments: `make_env`, or plain ones of the sizes in turn.

    Raises:
        SetupError: there are no sizes, or more than worlds; or there is both.
    """
    if make_env is not None:
        if scenario is not None or n_robots is not None or fields:
            raise SetupError(
                "make_env and conditions: should be one or the other; make_env decides what its "
                "environments are like"
            )
        return make_env
    sizes = [None] if n_robots is None else np.atleast_1d(n_robots).tolist()
    if not 1 <= len(sizes) <= n_worlds:
        raise SetupError(
            f"n_robots = {n_robots!r}: should be 1 to {n_worlds} sizes, as there are {n_worlds} "
            "worlds to have them"
        )

    def make_plain_env(world: int) -> TrainingWorld:
        size = sizes[world % len(sizes)]
        size_field = {} if size is None else {"n_robots": size}
        return SwarmLogisticsEnv(scenario, **size_field, **fields)

    return make_plain_env


def with_episode_limit(spec: EnvSpec | None, envs: Iterable[TrainingWorld]) -> EnvSpec | None:
    """Return Gymnasium's description of environments, with the most steps that episodes take.

    Learners read it. The environments count time themselves, so that no wrapper has to.
    """
    if spec is None:
        return None
    most = max(steps_of(env, scenario) for env in envs for scenario in env.scenarios)
    return replace(spec, max_episode_steps=most)


def steps_of(env: TrainingWorld, scenario: Scenario) -> int:
    """Return the number of steps after which an episode in `scenario` is truncated."""
    steps = math.ceil(scenario.duration / scenario.control_period - 1e-9)
    return steps if env.max_cycles is None else min(steps, env.max_cycles)
