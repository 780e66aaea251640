"""The PettingZoo environment: the dict view of a Warehouse."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray
from pettingzoo import ParallelEnv

from swarm_logistics_env.central_state import global_state, global_state_bounds
from swarm_logistics_env.errors import CommandError, SetupError, suggest
from swarm_logistics_env.observations import bounds
from swarm_logistics_env.rewards import RewardTerms
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import generator
from swarm_logistics_env.warehouse import Fault, Warehouse

if TYPE_CHECKING:
    from swarm_logistics_env.rendering import Renderer

Observations = dict[str, NDArray[np.float32]]
Infos = dict[str, dict[str, Any]]
ArrayStep = tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]
_NOTHING_TO_SAY: dict[str, Any] = {}
_OPTIONS = ("faults", "scenario")


class SwarmLogisticsEnv(ParallelEnv[str, NDArray[np.float32], NDArray[np.float32]]):  # type: ignore[misc]  # PettingZoo ships no types
    """A swarm fetches requested items in a warehouse, each robot with its own sensors only.

    `reset_arrays` and `step_arrays` are the environment; `reset` and `step` are their dict view.

    Args:
        scenario: the conditions; default: the paper's.
        faults: what befalls which robots in every episode.
        rewards: reward term -> weight; default: 1 to everybody for each delivery.
        render_mode: None, "rgb_array" (`render` returns a picture) or "human" (a window).
        max_cycles: steps after which an episode is truncated, if sooner than the duration.
        **fields: fields of the scenario to replace, e.g. `n_robots=40`.

    Raises:
        ScenarioError, FaultError, SetupError: an argument is unknown or cannot be.

    Example:
        >>> env = SwarmLogisticsEnv(n_robots=3)
        >>> observations, infos = env.reset(seed=0)
        >>> sorted(observations)
        ['robot_0', 'robot_1', 'robot_2']
    """

    metadata: ClassVar[dict[str, Any]] = {
        "name": "swarm_logistics_v0",
        "render_modes": ["human", "rgb_array"],
        "render_fps": 10,  # of the default control period; an instance has its own
        "is_parallelizable": True,
    }

    def __init__(
        self,
        scenario: Scenario | None = None,
        *,
        faults: Sequence[Fault] = (),
        rewards: Mapping[str, float] | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **fields: Any,
    ) -> None:
        self.scenario = (scenario or Scenario()).replace(**fields)
        self.faults = tuple(faults)
        self.max_cycles = max_cycles
        modes = self.metadata["render_modes"]
        if render_mode is not None and render_mode not in modes:
            raise SetupError(f"render_mode = {render_mode!r}: should be None or one of {modes}")
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": 1.0 / self.scenario.control_period}
        self._renderer: Renderer | None = None
        self.warehouse = Warehouse(self.scenario)
        self.agents: list[str] = []
        self.possible_agents = _names(self.scenario.n_robots)
        self._covered = [self.scenario]
        self._rewards = RewardTerms(rewards)
        self._episode_seeds = np.random.default_rng()
        low, high = bounds(self.scenario)
        self._observation_space = Box(low, high, dtype=np.float32)
        self._action_space = Box(-1.0, 1.0, (4 + self.scenario.message_size,), dtype=np.float32)

    def observation_space(self, agent: str) -> Box:
        """Return the space of an observation row (D,), the same for every agent."""
        return self._observation_space

    def action_space(self, agent: str) -> Box:
        """Return the space of a command (4,): forward, left, turn, gripper; the same for all."""
        return self._action_space

    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin an episode and return the first observations (N, D).

        Args:
            seed: decides everything random in this episode, and in those that follow with seed
                None, each of which differs.
            options: for this episode: "scenario", fields to replace; "faults", instead of the
                environment's. Other keys are ignored with a warning.

        Raises:
            ScenarioError, FaultError: an option cannot be.
            SetupError: in such a scenario observations could leave the observation space, which
                is that of the environment's own (and of those given to `cover`).
        """
        options = dict(options or {})
        for unknown in options.keys() - set(_OPTIONS):
            warnings.warn(
                f"reset option {str(unknown)!r} is ignored{suggest(str(unknown), _OPTIONS)}",
                stacklevel=3,
            )
        scenario = self.scenario.replace(**options.get("scenario", {}))
        self._check_covered(scenario)
        faults = options.get("faults", self.faults)
        if seed is None:
            seed = int(self._episode_seeds.integers(2**63))
        else:
            self._episode_seeds = generator(seed, "episodes that follow")
        observations = self.warehouse.reset(seed, faults, scenario)
        self._rewards.begin(self.warehouse)
        if scenario.n_robots > len(self.possible_agents):
            self.possible_agents = _names(scenario.n_robots)
        self.agents = self._present()
        return observations

    def step_arrays(self, commands: ArrayLike) -> ArrayStep:
        """Take one control period.

        Args:
            commands: (N, 4), see `Warehouse.step`; rows of absent robots are ignored.

        Returns:
            Observations (N, D), rewards (N,), terminations (N,) and truncations (N,). A robot
            terminates when it is removed, all do when everything is delivered; all are truncated
            when the time is up.

        Raises:
            CommandError: wrong shape or not finite; nothing has happened then.
        """
        world = self.warehouse
        was_present = world.state.robot_present.copy()
        observations = world.step(commands)
        rewards = self._rewards.pay(world) * was_present
        terminations = was_present ^ world.state.robot_present
        if world.all_delivered:
            terminations |= was_present
        is_cut = self.max_cycles is not None and world.state.step >= self.max_cycles
        truncations = np.zeros_like(terminations)
        if world.is_over_time or is_cut:
            truncations = was_present & ~terminations
        return observations, rewards, terminations, truncations

    def cover(self, scenario: Scenario) -> None:
        """Widen the observation space so that episodes may also be played in `scenario`.

        For wrappers, when they are made: spaces must not change once they were handed out.

        Raises:
            SetupError: its rows or commands are longer or shorter than this environment's.
        """
        low, high = bounds(scenario)
        if low.shape != self._observation_space.shape:
            raise SetupError(
                f"message_size = {scenario.message_size}: should be the environment's own, "
                f"{self.scenario.message_size}, which its spaces are made for"
            )
        space = self._observation_space
        low, high = np.minimum(low, space.low), np.maximum(high, space.high)
        self._observation_space = Box(low, high, dtype=np.float32)
        self._covered.append(scenario)
        if scenario.n_robots > len(self.possible_agents):
            self.possible_agents = _names(scenario.n_robots)

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture (H, W, 3) in mode "rgb_array"; show the window in mode "human".

        Raises:
            SetupError: no render_mode was chosen, pygame is missing, or there is no display.
        """
        if self.render_mode is None:
            raise SetupError('render_mode = None: should be "rgb_array" or "human" to render')
        if self._renderer is None:
            from swarm_logistics_env.rendering import Renderer

            self._renderer = Renderer(self.scenario, self.render_mode)
        world = self.warehouse
        if self.render_mode == "rgb_array":
            return self._renderer.frame(world.state, world.scenario)
        self._renderer.show(world.state, world.scenario)
        return None

    def state(self) -> NDArray[np.float32]:
        """Return the whole warehouse as one vector, see `global_state`; for central critics."""
        n_items = max(scenario.n_items for scenario in self._covered)
        return global_state(self.warehouse, len(self.possible_agents), n_items)

    @property
    def state_space(self) -> Box:
        """The space of `state()`, for `possible_agents` robots and the most items there may be."""
        n_items = max(scenario.n_items for scenario in self._covered)
        lows, highs = zip(
            *(
                global_state_bounds(scenario, len(self.possible_agents), n_items)
                for scenario in self._covered
            ),
            strict=True,
        )
        return Box(np.min(lows, axis=0), np.max(highs, axis=0), dtype=np.float32)

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, Infos]:
        """Begin an episode; see `reset_arrays`. Returns observations and infos by agent."""
        rows = self.reset_arrays(seed, options)
        observations = {f"robot_{row}": rows[row] for row in self._rows()}
        return observations, self._infos(self.agents)

    def step(
        self, actions: Mapping[str, ArrayLike]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Take one control period; see `step_arrays`.

        Args:
            actions: one command (4,) for every agent in `agents`.

        Raises:
            CommandError: an agent's command is missing, for an unknown agent, of the wrong shape
                or not finite.
        """
        agents, rows = self.agents, self._rows()
        if not agents:
            return {}, {}, {}, {}, {}
        commands = np.zeros((self.warehouse.state.n_robots, *self._action_space.shape))
        commands[rows] = self._gathered(actions)
        outcome = self.step_arrays(commands)
        observations, rewards = outcome[0][rows], outcome[1][rows]
        terminations, truncations = outcome[2][rows], outcome[3][rows]
        infos = self._infos(agents)
        if (terminations | truncations).all():
            self.agents = []
            last = {"delivered": self.warehouse.state.delivered}
            infos = {agent: {**info, **last} for agent, info in infos.items()}
        elif terminations.any():
            self.agents = self._present()
        return (
            dict(zip(agents, observations, strict=True)),
            dict(zip(agents, rewards.tolist(), strict=True)),
            dict(zip(agents, terminations.tolist(), strict=True)),
            dict(zip(agents, truncations.tolist(), strict=True)),
            infos,
        )

    def close(self) -> None:
        """Release what rendering holds; harmless when called twice."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _check_covered(self, scenario: Scenario) -> None:
        low, high = bounds(scenario)
        space = self._observation_space
        if low.shape == space.shape and (low >= space.low).all() and (high <= space.high).all():
            return
        changed = [
            f"{name} = {value}"
            for name, value in scenario.model_dump().items()
            if value != getattr(self.scenario, name)
        ]
        raise SetupError(
            f"{', '.join(changed)}: observations could leave the observation space; should be "
            "within what the environment was built for, or announced by env.cover(scenario)"
        )

    def _rows(self) -> list[int]:
        return [int(agent[6:]) for agent in self.agents]

    def _present(self) -> list[str]:
        present = np.flatnonzero(self.warehouse.state.robot_present)
        return [f"robot_{row}" for row in present]

    def _gathered(self, actions: Mapping[str, ArrayLike]) -> NDArray[np.float64]:
        if actions.keys() != set(self.agents):
            for agent in actions:
                if agent not in self.agents:
                    raise CommandError(
                        f"a command for {agent!r}, who is not there"
                        f"{suggest(str(agent), self.agents)}"
                    )
            missing = next(agent for agent in self.agents if agent not in actions)
            raise CommandError(f"no command for {missing!r}: should be one for every agent")
        wanted = self._action_space.shape
        for agent in self.agents:
            if np.shape(actions[agent]) != wanted:
                raise CommandError(
                    f"command of {agent!r} of shape {np.shape(actions[agent])}: should be {wanted}"
                )
        try:
            return np.array([actions[agent] for agent in self.agents], dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise CommandError(f"commands should be numbers: {error}") from None

    def _infos(self, agents: Sequence[str]) -> Infos:
        # The robots are not told who failed; whoever trains or judges them is.
        modes = self.warehouse.state.failure_modes
        if not any(modes):
            return dict.fromkeys(agents, _NOTHING_TO_SAY)
        return {
            agent: {"failure_modes": modes[int(agent[6:])]}
            if modes[int(agent[6:])]
            else _NOTHING_TO_SAY
            for agent in agents
        }


def _names(count: int) -> list[str]:
    return [f"robot_{number}" for number in range(count)]
