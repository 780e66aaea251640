"""Gymnasium's VectorEnv over the array methods: every robot of every world is a row."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.core.streams import key
from swarm_logistics_env.environment.requests import checked_count, checked_options
from swarm_logistics_env.world.scenario import Scenario

from .worlds import RowsStep, TrainingWorld, Worlds, maker, with_episode_limit

RESET_MASK = "reset_mask"  # Gymnasium's option of a reset that begins some rows alone


class SwarmRows(VectorEnv[NDArray[np.float32], NDArray[Any], NDArray[Any]]):
    """Several worlds as one `VectorEnv`: each robot is a row, so one policy is learned by all.

    World 0's robots come first, then world 1's, and so on. `num_envs` as an argument counts worlds,
    because Gymnasium calls it so; as an attribute it counts rows. Every random event follows from
    the seed and the world's number alone, so not from the number of worlds.

    How rows end: time up truncates; everything delivered terminates. A robot that is removed while
    its world goes on terminates once, and is padding until its world ends: zeros, reward 0, its
    action is ignored. When the world ends, so does the padding. The next episode begins as
    `autoreset_mode` says, for all rows of a world at once:

    * NEXT_STEP: the step after the end ignores the world's actions and returns first observations;
    * SAME_STEP: the step that ends an episode returns first observations of the next; the infos
      have `final_obs` and `final_info`;
    * DISABLED: `reset(options={"reset_mask": mask})` begins it, where the mask is true for rows of
      a world that is over. A row of a world that goes on is no reason to begin it anew.

    Infos are arrays by row, each with its mask `_name`: `delivered` (the paper's P, so far),
    `failed`, `away`, `padding`, `world`, `n_robots`, and what wrappers add, such as `action_mask`.
    The row of a robot that is away is no padding: it goes on, with zeros until the robot is back.

    Args:
        num_envs: how many worlds run side by side.
        scenario: the conditions; default: the paper's.
        autoreset_mode: one of Gymnasium's, or its name.
        threads: how many worlds step at the same time; the results are the same bits.
        n_robots: the swarm size, or several that the worlds have in turn, e.g. [5, 25, 50].
        make_env: instead of scenario and fields: world number -> environment, for wrappers.
        **fields: arguments of `SwarmLogisticsEnv` and fields of the scenario.

    Attributes:
        worlds: the environments.
        present: (num_envs,) which rows of the latest observations are a robot's.

    Raises:
        SetupError: arguments that exclude each other or cannot be; environments whose rows or
            commands differ in length, or that are one and the same.
        ScenarioError, FaultError: a field cannot be.

    Example:
        >>> import gymnasium
        >>> env = gymnasium.make_vec(
        ...     "SwarmLogisticsRows-v0", 2, vectorization_mode="vector_entry_point", n_robots=3
        ... )
        >>> observations, infos = env.reset(seed=0)
        >>> observations.shape, env.action_space.shape
        ((6, 141), (6, 4))
    """

    def __init__(
        self,
        num_envs: int = 1,
        scenario: Scenario | None = None,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        n_robots: int | Sequence[int] | None = None,
        make_env: Callable[[int], TrainingWorld] | None = None,
        **fields: Any,
    ) -> None:
        self._mode = _mode_of(autoreset_mode)
        n_worlds = checked_count("num_envs", num_envs)
        make_env = maker(make_env, scenario, n_worlds, n_robots, fields)
        self._worlds = Worlds(make_env, n_worlds, checked_count("threads", threads))
        self.worlds = self._worlds.envs
        self.num_envs = self._worlds.n_rows
        self.single_observation_space = self._worlds.observation_space
        self.single_action_space = self._worlds.command_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.render_mode = self.worlds[0].render_mode
        self.metadata = {**self.worlds[0].metadata, "autoreset_mode": self._mode}
        self._observations = self._worlds.blank()

    @property
    def present(self) -> NDArray[np.bool_]:
        """Which rows of the latest observations are a robot's, (num_envs,); others are zeros."""
        return self._worlds.present.copy()

    @property
    def spec(self) -> EnvSpec | None:
        """How Gymnasium made it, with the steps of the longest episode as `max_episode_steps`."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = with_episode_limit(spec, self.worlds)

    _spec: EnvSpec | None = None

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode in every world, or in those that the option `reset_mask` names.

        Args:
            seed: of all episodes that follow; None: they follow from what was before.
            options: of every world, see `SwarmLogisticsEnv.reset_arrays`; and `reset_mask`.

        Raises:
            SetupError: the seed is no whole number; the mask is no boolean array (num_envs,), or
                has rows of robots whose world goes on.
            ScenarioError, FaultError, SetupError: options that a world refuses; none has begun one.
        """
        options = dict(options or {})
        mask = options.pop(RESET_MASK, None)
        options = checked_options(options)
        worlds = range(len(self.worlds)) if mask is None else self._worlds_of(mask)
        seeds: dict[int, int | None] = dict.fromkeys(worlds)
        if seed is not None:
            seed = checked_count("seed", seed, least=0)
            seeds = {world: key(seed, "world", world) >> 1 for world in worlds}
        for world in worlds:
            env = self.worlds[world]
            world_seed = seeds[world]
            env.conditions_of(env.next_seed if world_seed is None else world_seed, options)
        for world in worlds:
            self._worlds.begin(world, self._observations, seeds[world], options)
        return self._observations.copy(), self._infos()

    def step(
        self, actions: ArrayLike
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float64],
        NDArray[np.bool_],
        NDArray[np.bool_],
        dict[str, Any],
    ]:
        """Take one control period in every world whose episode goes on.

        Raises:
            CommandError: wrong shape, not readable or not finite; no world has changed then.
            SetupError: there was no reset; or, where nothing begins by itself, a world is over.
        """
        over = [world for world, is_over in enumerate(self._worlds.is_over) if is_over]
        if over and self._mode is AutoresetMode.DISABLED:
            raise SetupError(
                f"the episode of world {over[0]} is over: should begin anew by "
                'reset(options={"reset_mask": terminations | truncations})'
            )
        self._worlds.give(actions)
        step = self._worlds.step(waiting=frozenset(over))
        for world in range(len(self.worlds)):
            rows = self._worlds.rows[world]
            if world in over:
                self._worlds.begin(world, step.observations)
            elif self._worlds.is_over[world]:
                step.terminated[rows] |= ~step.truncated[rows]  # padding ends with its world
        infos = self._infos()
        ended = step.terminated | step.truncated
        if self._mode is AutoresetMode.SAME_STEP and ended.any():
            infos = self._begin_anew(step, ended, infos)
        for world, is_over in enumerate(self._worlds.is_over):
            if not is_over:
                self._worlds.note_present(world)
        self._observations = step.observations
        rewards = step.rewards.astype(np.float64)
        return step.observations.copy(), rewards, step.terminated, step.truncated, infos

    def render(self) -> tuple[Any, ...]:
        """Return a picture (H, W, 3) of each row's world, as recorders of Gymnasium expect."""
        pictures = [env.render() for env in self.worlds]
        return tuple(pictures[world] for world in self._worlds.world_of)

    def close_extras(self, **kwargs: Any) -> None:
        """Release threads and what rendering holds."""
        self._worlds.close()

    def _worlds_of(self, mask: object) -> list[int]:
        """Return the worlds that are over and have rows in the mask."""
        if not (isinstance(mask, np.ndarray) and mask.dtype == np.bool_):
            raise SetupError(f'options["{RESET_MASK}"] = {mask!r}: should be a boolean array')
        if mask.shape != (self.num_envs,):
            raise SetupError(
                f'options["{RESET_MASK}"] of shape {mask.shape}: should be ({self.num_envs},)'
            )
        named: NDArray[np.int64] = self._worlds.world_of[mask]
        going_on = self._worlds.world_of[mask & self._worlds.present].tolist()
        for world in dict.fromkeys(going_on):
            if not self._worlds.is_over[world]:
                raise SetupError(
                    f'options["{RESET_MASK}"] has robots of world {world}, whose episode goes on: '
                    "should be terminations | truncations of the step before"
                )
        return [world for world in np.unique(named).tolist() if self._worlds.is_over[world]]

    def _begin_anew(
        self, step: RowsStep, ended: NDArray[np.bool_], infos: dict[str, Any]
    ) -> dict[str, Any]:
        """Begin the next episode of worlds that are over; return the infos of this step."""
        final_observations = np.full(self.num_envs, None, dtype=object)
        for row in np.flatnonzero(ended).tolist():
            final_observations[row] = step.observations[row].copy()
        for world, is_over in enumerate(self._worlds.is_over):
            if is_over:
                self._worlds.begin(world, step.observations)
        return self._infos() | {
            "final_obs": final_observations,
            "_final_obs": ended.copy(),
            "final_info": infos,
            "_final_info": ended.copy(),
        }

    def _infos(self) -> dict[str, Any]:
        columns: dict[str, NDArray[Any]] = {
            "failed": np.zeros(self.num_envs, np.int64),
            "away": np.zeros(self.num_envs, np.int64),
            "padding": ~self._worlds.present,
            "world": self._worlds.world_of.copy(),
            "n_robots": np.zeros(self.num_envs, np.int64),
        }
        for env, rows in zip(self.worlds, self._worlds.rows):
            state = env.warehouse.state
            columns["failed"][rows.start : rows.start + state.n_robots] = state.failed
            columns["away"][rows.start : rows.start + state.n_robots] = state.robot_away
            columns["n_robots"][rows] = state.n_robots
            for name, value in env.episode_info.items():
                columns.setdefault(name, np.full(self.num_envs, np.nan))[rows] = value
            for name, robots in env.robot_info.items():
                blank = np.zeros((self.num_envs, *robots.shape[1:]), robots.dtype)
                columns.setdefault(name, blank)[rows.start : rows.start + len(robots)] = robots
        everybody = np.ones(self.num_envs, np.bool_)
        return columns | {f"_{name}": everybody.copy() for name in columns}


def _mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return mode if isinstance(mode, AutoresetMode) else AutoresetMode[str(mode).upper()]
    except KeyError:
        names = ", ".join(member.name for member in AutoresetMode)
        raise SetupError(f"autoreset_mode = {mode!r}: should be one of {names}") from None
