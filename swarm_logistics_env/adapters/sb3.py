"""Stable-baselines3's VecEnv over the array methods: every robot of every world is a row."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import SetupError, how_to_install
from swarm_logistics_env.core.streams import key
from swarm_logistics_env.environment.requests import checked_count, checked_options
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.wrappers.action_forms import STAY
from swarm_logistics_env.wrappers.wrapper import layers_of

from .worlds import RowsStep, TrainingWorld, Worlds, maker

try:
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import VecEnv
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"SwarmVecEnv needs stable-baselines3 ({error}): {how_to_install('train')}"
    ) from error

Infos: TypeAlias = list[dict[str, Any]]


class SwarmVecEnv(VecEnv):  # type: ignore[misc]  # not in the environment of the type check
    """Several worlds as one `VecEnv`: each robot is a row, so one policy is learned by all of them.

    World 0's robots come first, then world 1's, and so on: (sum N, D) observations, (sum N, 4)
    actions. A world that ends begins its next episode at once, as stable-baselines3 expects.
    Every random event follows from `seed` and the world's number alone: not from `n_worlds`, nor
    from `threads`.

    How rows end:

    * time up: done with `TimeLimit.truncated`, so that learners bootstrap the value;
    * everything delivered: done without it;
    * a robot that is removed, while its world goes on: done without it, once. Until the world ends
      its row is padding: zeros, reward 0, its action is ignored. So are rows of robots that are
      not in a world's episode, where a wrapper plays sizes smaller than its largest. When the
      world ends padding is done too, so that the padding is an episode by itself with return 0,
      of which nothing reaches the next one. `present` tells padding from robots.

    The info of a row is a dict of its own of numbers: `TimeLimit.truncated`, `padding`, `failed`
    (1 while any failure mode holds for the row's robot, else 0), `away` (1 until a robot that left
    the arena is back; its row is zeros, and no padding), `world`, `n_robots`, `delivered` (the
    paper's P, so far), and what wrappers add (see `wrappers.IndicatorReward`). A done row's
    has `terminal_observation` besides, as stable-baselines3 expects, and, where it was a robot's,
    `episode`: its return "r", length "l" [steps] and the world's "delivered". So learners log
    `rollout/ep_rew_mean` and `ep_len_mean` by themselves, and `evaluate_policy` and `EvalCallback`
    count robots alone, as by a `Monitor`. They wait for an episode of every row, so evaluate with
    no more `max_robots` than the largest swarm that is played. The means of a `VecMonitor` count
    padding as episodes of return 0. `learn(.., callback=LogDeliveries())` logs
    `rollout/delivered_mean` as well.

    Args:
        scenario: the conditions; default: the paper's.
        n_worlds: how many worlds run side by side.
        threads: how many of them step at the same time; the results are the same bits.
        n_robots: the swarm size, or several that the worlds have in turn, e.g. [5, 25, 50].
        make_env: instead of scenario and fields: world number -> environment, for wrappers.
        seed: of all episodes, as `seed()`; None: another one every time.
        **fields: arguments of `SwarmLogisticsEnv` and fields of the scenario.

    Attributes:
        worlds: the environments.

    Raises:
        SetupError: arguments that exclude each other or cannot be; environments whose rows or
            commands differ in length, or that are one and the same.
        ScenarioError, FaultError: a field cannot be.
        ModuleNotFoundError: stable-baselines3 is not installed.

    Example:
        >>> from stable_baselines3 import PPO
        >>> env = SwarmVecEnv(n_worlds=3, n_robots=[5, 10], duration=20.0)
        >>> env.num_envs
        20
        >>> PPO("MlpPolicy", env, n_steps=32, seed=0).learn(640).num_timesteps
        640
        >>> from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
        >>> from swarm_logistics_env.wrappers import FaultInjection
        >>> def make_env(world):
        ...     return FaultInjection(SwarmLogisticsEnv(n_robots=5), "FM1", robots=world + 1)
        >>> SwarmVecEnv(make_env=make_env, n_worlds=2).num_envs
        10
    """

    def __init__(
        self,
        scenario: Scenario | None = None,
        *,
        n_worlds: int = 8,
        threads: int = 1,
        n_robots: int | Sequence[int] | None = None,
        make_env: Callable[[int], TrainingWorld] | None = None,
        seed: int | None = None,
        **fields: Any,
    ) -> None:
        n_worlds = checked_count("n_worlds", n_worlds)
        threads = checked_count("threads", threads)
        make_env = maker(make_env, scenario, n_worlds, n_robots, fields)
        self._worlds = Worlds(make_env, n_worlds, threads)
        self.worlds = self._worlds.envs
        # What the next infos are copies of, unless a world has something to tell.
        self._abouts: Infos = [{} for _ in range(self._worlds.n_rows)]
        n_rows = self._worlds.n_rows
        # Of each row's episode: its rewards so far, and the step that it began with.
        self._returns = np.zeros(n_rows, np.float32)
        self._start_steps = np.zeros(n_rows, np.int64)
        self._n_steps = 0
        super().__init__(n_rows, self._worlds.observation_space, self._worlds.command_space)
        self.metadata = dict(self.worlds[0].metadata)
        if seed is not None:
            self.seed(seed)

    @property
    def present(self) -> NDArray[np.bool_]:
        """Which rows of the latest observations are a robot's, (num_envs,); others are zeros."""
        return self._worlds.present.copy()

    @property
    def rows_of_worlds(self) -> list[slice]:
        """The slice of the rows that each of `worlds` has."""
        return self._worlds.rows

    def seed(self, seed: int | None = None) -> list[int]:
        """Fix all episodes from the next `reset` on; return the seed of the world of each row.

        Raises:
            SetupError: the seed is no integer.
        """
        if seed is None:
            seed = int(np.random.default_rng().integers(2**63))
        self._seeds = [key(seed, "world", world) >> 1 for world in self._worlds.world_of.tolist()]
        return list(self._seeds)

    def set_options(
        self, options: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None
    ) -> None:
        """Set the options of the next `reset`.

        Args:
            options: the same for all worlds, or a list: one for each world, or for each row.

        Raises:
            SetupError: they are no dicts, one is nearly called as one that there is, the list has
                another length, or rows of one world differ.
        """
        if options is None or isinstance(options, Mapping):
            self._options = [checked_options(options)] * self.num_envs
            return
        by_row = list(options)
        if len(by_row) == len(self.worlds):
            by_row = [by_row[world] for world in self._worlds.world_of.tolist()]
        if len(by_row) != self.num_envs:
            raise SetupError(
                f"options for {len(by_row)}: should be for all, for each of {len(self.worlds)} "
                f"worlds or for each of {self.num_envs} rows"
            )
        for world, rows in enumerate(self._worlds.rows):
            if any(row != by_row[rows.start] for row in by_row[rows]):
                raise SetupError(
                    f"options of the rows of world {world}: should be the same, as they are one"
                )
        self._options = list(map(checked_options, by_row))

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode in every world; returns the observations (num_envs, D).

        Raises:
            ScenarioError, FaultError, SetupError: options that a world refuses; none has begun one.
        """
        for env, rows in zip(self.worlds, self._worlds.rows):
            seed = self._seeds[rows.start]
            options = self._options[rows.start]
            env.conditions_of(env.next_seed if seed is None else seed, options)
        observations = self._worlds.blank()
        self._returns[:] = 0.0
        self._start_steps[:] = self._n_steps
        for world, rows in enumerate(self._worlds.rows):
            seed = self._seeds[rows.start]
            self._worlds.begin(world, observations, seed, self._options[rows.start])
            self._note(world)
        self.reset_infos = list(map(dict.copy, self._abouts))
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: ArrayLike) -> None:
        """Take the commands (num_envs, 4) of the step that `step_wait` makes.

        Raises:
            CommandError: wrong shape, not readable or not finite; nothing has happened in any
                world then.
        """
        self._worlds.give(actions)

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], Infos]:
        """Step every world; returns observations, rewards and dones by row, and infos.

        The arrays and dicts are the caller's own.
        """
        step = self._worlds.step()
        self._n_steps += 1
        self._returns += step.rewards
        # In the order of the worlds, so that what episodes share does not depend on the threads.
        worlds = sorted(self._worlds.reported)
        for world in worlds:
            self._note(world)
        infos = list(map(dict.copy, self._abouts))
        dones = step.terminated | step.truncated
        for world in worlds:
            if self._worlds.is_over[world] or dones[self._worlds.rows[world]].any():
                self._end(world, step, dones, infos)
        return step.observations, step.rewards, dones, infos

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """Return an attribute of the world of each row."""
        return self._of_rows(lambda env: getattr(env, attr_name), indices)

    def set_attr(
        self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None
    ) -> None:
        """Set an attribute of the worlds of these rows, on the wrapper that has it."""

        def set_it(env: TrainingWorld) -> None:
            layers = layers_of(env)
            holders = (e for e in layers if attr_name in vars(e) or hasattr(type(e), attr_name))
            setattr(next(holders, env), attr_name, value)

        self._of_rows(set_it, indices)

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: int | Iterable[int] | None = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Call a method of the worlds of these rows, once each; returns the answer by row.

        The answer of `action_masks` is that of the row's robot; padding may only stay.
        """
        if method_name == "action_masks":
            masks = self._action_masks()
            return [masks[row] for row in self._get_indices(indices)]
        return self._of_rows(
            lambda env: getattr(env, method_name)(*method_args, **method_kwargs), indices
        )

    def env_is_wrapped(
        self, wrapper_class: type, indices: int | Iterable[int] | None = None
    ) -> list[bool]:
        """Return by row whether its world has such a wrapper around it.

        True of `Monitor`, because infos tell the episodes of robots as one would.
        """
        if wrapper_class is Monitor:
            return [True for _ in self._get_indices(indices)]
        return self._of_rows(
            lambda env: any(isinstance(layer, wrapper_class) for layer in layers_of(env)), indices
        )

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        """Return a picture (H, W, 3) of each world."""
        return [env.render() for env in self.worlds]

    def close(self) -> None:
        """Release threads and what rendering holds; harmless when called twice."""
        self._worlds.close()

    def _action_masks(self) -> NDArray[np.bool_]:
        masks = np.zeros((self.num_envs, self.action_space.n), np.bool_)
        masks[:, STAY] = True
        for env, rows in zip(self.worlds, self._worlds.rows):
            legal = env.action_masks()
            masks[rows.start : rows.start + len(legal)] = legal
        return masks

    def _of_rows(
        self, answer: Callable[[TrainingWorld], Any], indices: int | Iterable[int] | None
    ) -> list[Any]:
        worlds = self._worlds.world_of[list(self._get_indices(indices))].tolist()
        answers = {world: answer(self.worlds[world]) for world in dict.fromkeys(worlds)}
        return [answers[world] for world in worlds]

    def _note(self, world: int) -> None:
        """Note what there is to say of a world's rows, until it has something to tell again."""
        env = self.worlds[world]
        rows = self._worlds.rows[world]
        state = env.warehouse.state
        info = {
            "TimeLimit.truncated": False,
            "padding": False,
            "failed": 0,
            "away": 0,
            "world": world,
            "n_robots": state.n_robots,
            **env.episode_info,
        }
        infos: Infos = [info] * (rows.stop - rows.start)
        for robot in np.flatnonzero(state.failed).tolist():
            infos[robot] = {**info, "failed": 1}
        for robot in np.flatnonzero(state.robot_away).tolist():
            infos[robot] = {**infos[robot], "away": 1}
        for row in np.flatnonzero(~self._worlds.present[rows]).tolist():
            infos[row] = {**infos[row], "padding": True}
        self._abouts[rows] = infos

    def _end(self, world: int, step: RowsStep, dones: NDArray[np.bool_], infos: Infos) -> None:
        """Complete the infos of rows that are done; begin the next episode if the world is over."""
        rows = self._worlds.rows[world]
        if self._worlds.is_over[world]:
            dones[rows] = True
        for row in (rows.start + np.flatnonzero(dones[rows])).tolist():
            is_cut = bool(step.truncated[row] and not step.terminated[row])
            infos[row]["TimeLimit.truncated"] = is_cut
            infos[row]["terminal_observation"] = step.observations[row].copy()
            if not infos[row]["padding"]:
                infos[row]["episode"] = {
                    "r": float(self._returns[row]),
                    "l": int(self._n_steps - self._start_steps[row]),
                    "delivered": infos[row]["delivered"],
                }
            self._returns[row] = 0.0
            self._start_steps[row] = self._n_steps
        if self._worlds.is_over[world]:
            self._worlds.begin(world, step.observations)
        else:
            self._worlds.note_present(world)
        self._note(world)
