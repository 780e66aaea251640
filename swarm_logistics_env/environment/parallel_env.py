"""The PettingZoo environment: the dict view of a Warehouse."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import ArgumentError, SetupError, suggest
from swarm_logistics_env.core.streams import key
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Warehouse
from swarm_logistics_env.world.warehouse.faults import Fault, FaultLike, checked_faults
from swarm_logistics_env.world.warehouse.one_thread import Lock, in_one_thread, used_elsewhere

from .requests import (
    OPTIONS,
    as_array,
    check_somebody_is_there,
    checked_count,
    checked_options,
    faults_among,
    scenario_fields,
)
from .rewards import RewardTerms
from .spaces import ArrayStep, DictView, Spaces, agent_names, global_state

if TYPE_CHECKING:
    from swarm_logistics_env.world.rendering import Renderer


class SwarmLogisticsEnv(DictView):
    """A swarm fetches requested items in a warehouse; each robot uses only its own sensors.

    `reset_arrays` and `step_arrays` are the environment; `reset` and `step` are their dict view.

    Args:
        scenario: the conditions; the paper's by default.
        faults: the faults that are scheduled in every episode, each a `Fault`, a text, as
            "FM1:2@200", or a dict of its arguments, as `{"mode": "FM1", "robots": 2}`.
        rewards: reward term -> weight; by default each robot gets 1 for each delivery.
        render_mode: None, "rgb_array" (`render` returns a picture) or "human" (a window).
        max_cycles: steps after which an episode is truncated, if sooner than the duration.
        max_robots: the largest swarm that a reset's options may ask for; n_robots by default.
        **fields: fields of the scenario to replace, e.g. `n_robots=40`.

    Attributes:
        next_seed: the seed of the next episode if a reset gives none; it follows from the seed
            of the episode before.
        is_begun: whether there was a reset.

    Raises:
        ArgumentError: there is no such argument; it is a ScenarioError and a TypeError.
        ScenarioError, FaultError, SetupError: an argument is not allowed.

    Example:
        >>> env = SwarmLogisticsEnv(n_robots=3)
        >>> observations, infos = env.reset(seed=0)
        >>> sorted(observations)
        ['robot_0', 'robot_1', 'robot_2']
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  # PettingZoo has it on the class as well
        "name": "swarm_logistics_v0",
        "render_modes": ["human", "rgb_array"],
        "render_fps": 10,  # of the default control period; an instance has its own
        "is_parallelizable": True,
    }

    def __init__(
        self,
        scenario: Scenario | None = None,
        *,
        faults: Sequence[FaultLike] = (),
        rewards: Mapping[str, float] | None = None,
        render_mode: Literal["human", "rgb_array"] | None = None,
        max_cycles: int | None = None,
        max_robots: int | None = None,
        **fields: Any,
    ) -> None:
        self.scenario = _scenario_of(scenario, fields)
        largest = self.scenario
        if max_robots is not None:
            most = checked_count("max_robots", max_robots, largest.n_robots)
            largest = largest.replace(n_robots=most)
        self.faults = checked_faults("faults", faults, SetupError)
        self.max_cycles = None if max_cycles is None else checked_count("max_cycles", max_cycles)
        modes = self.metadata["render_modes"]
        if render_mode is not None and render_mode not in modes:
            raise SetupError(f"render_mode = {render_mode!r}: should be None or one of {modes}")
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": 1.0 / self.scenario.control_period}
        self._renderer: Renderer | None = None
        self.warehouse = Warehouse(self.scenario)
        self.agents: list[str] = []
        self.is_begun = False
        self.possible_agents = agent_names(range(largest.n_robots))
        self._spaces = Spaces(self.scenario)
        self._spaces.declared.add(largest)
        self._rewards = RewardTerms(rewards)
        self.next_seed = int(np.random.default_rng().integers(2**63))
        self.max_robots = max_robots

    def __repr__(self) -> str:
        changed = self.scenario.model_dump(exclude_defaults=True)
        fields = ", ".join(f"{name}={value!r}" for name, value in changed.items())
        return f"{type(self).__name__}({fields})"

    def observation_space(self, agent: str) -> Box:
        """Return the space of an observation row (D,), the same for every agent."""
        return self._spaces.observation

    def action_space(self, agent: str) -> Box:
        """Return the space of a command (4,): forward, left, turn, gripper; the same for all."""
        return self._spaces.action

    @in_one_thread
    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin an episode and return the first observations (N, D).

        Args:
            seed: decides everything random in this episode, and in later ones that begin with
                seed None; these differ from each other.
            options: conditions of this episode. "scenario" has the fields to replace; "faults"
                replaces the environment's faults. Other keys are ignored with a warning, unless
                they are nearly one of these.

        Raises:
            ScenarioError, FaultError: an option is not allowed.
            SetupError: a seed or option is of the wrong type; an option is nearly called as one
                that there is; no robot would be present; or the
                scenario has more robots than `possible_agents`, or observations or states that
                could leave the spaces. Spaces hold the environment's own scenario and those given
                to `declare_spaces`.
        """
        options = checked_options(options)
        for unknown in options.keys() - set(OPTIONS):
            warnings.warn(
                f"reset option {str(unknown)!r} is ignored{suggest(str(unknown), OPTIONS)}",
                stacklevel=3,
            )
        seed = self.next_seed if seed is None else seed
        scenario, faults = self.conditions_of(seed, options)
        observations = self.warehouse.reset(seed, faults, scenario)
        self.next_seed = key(seed, "the episode that follows") >> 1
        self._rewards.begin(self.warehouse)
        self.is_begun = True
        self._present = self.warehouse.state.robot_present.copy()
        self._in_episode = self.warehouse.state.in_episode
        self.agents = agent_names(np.flatnonzero(self._in_episode).tolist())
        return observations

    def scenario_of(self, seed: int, options: Mapping[str, Any]) -> Scenario:
        """Return the scenario of the episode that such a reset would begin; it begins nothing.

        Raises:
            ScenarioError, SetupError: as `reset_arrays`.
        """
        return self.scenario.replace(**scenario_fields(options))

    def conditions_of(
        self, seed: int, options: Mapping[str, Any]
    ) -> tuple[Scenario, tuple[Fault, ...]]:
        """Return scenario and faults of the episode that such a reset would begin.

        It begins nothing. What it takes `reset_arrays` takes, but for items or robots that find no
        room.

        Raises:
            ScenarioError, FaultError, SetupError: as `reset_arrays`.
        """
        scenario = self.scenario_of(seed, options)
        self._spaces.check(scenario, len(self.possible_agents))
        faults = faults_among(options, self.faults)
        check_somebody_is_there(faults, seed, scenario)
        return scenario, faults

    @property
    def scenarios(self) -> tuple[Scenario, ...]:
        """The scenarios that episodes are played in, unless a reset's options say otherwise."""
        return (self.scenario,)

    def step_arrays(self, commands: ArrayLike) -> ArrayStep:
        """Take one control period.

        Args:
            commands: (N, 4), see `Warehouse.step`; rows of absent robots are ignored.

        Returns:
            Observations (N, D), rewards (N,), terminations (N,) and truncations (N,). A robot
            terminates when it is removed; all terminate when everything is delivered, and all are
            truncated when the time is up. `agents` are those that go on. One that is away goes on:
            until it is back its observation is zeros, its reward 0, and its command is ignored.

        Raises:
            CommandError: the commands have the wrong shape, cannot be read or are not finite; the
                world has not changed then.
            SetupError: there was no reset; the episode is over: nobody is left in `agents`; or
                another thread is using the environment.
        """
        lock = self.warehouse.lock
        if not lock.acquire(False):  # as `in_one_thread`, within a tenth of a microsecond
            raise used_elsewhere()
        try:
            if not self.agents:
                self.refuse_to_step()
            if not isinstance(commands, np.ndarray):
                commands = as_array(commands, "commands")
            return self.outcome(self.warehouse.step(commands))
        finally:
            lock.release()

    @property
    def lock(self) -> Lock:
        """Held by the thread that uses the environment, which refuses others."""
        return self.warehouse.lock

    @property
    def is_watched(self) -> bool:
        """Whether a step needs `outcome` in which no event happens: it may end the episode here.

        Or a reward term of one's own may pay; `steady_pay` tells of all others.
        """
        return self.max_cycles is not None or not self._rewards.are_compiled

    @property
    def steady_pay(self) -> int | None:
        """What `reward_terms.pay_worlds` reads, if a step without an event may pay; or None."""
        return self._rewards.address if self._rewards.pays_steadily else None

    def outcome(self, observations: NDArray[np.float32]) -> ArrayStep:
        """Return the result of `step_arrays` for the step that the warehouse has just taken."""
        world = self.warehouse
        state = world.state
        was_in_episode = self._in_episode
        n = len(was_in_episode)
        terminations = np.zeros(n, np.bool_)
        truncations = np.zeros(n, np.bool_)
        if not (world.is_eventful or self.is_watched or self._rewards.pays_steadily):
            return observations, np.zeros(n), terminations, truncations
        rewards = self._rewards.pay(world)
        if not self._present.all():
            rewards *= self._present
        is_cut = self.max_cycles is not None and world.state.step >= self.max_cycles
        is_over_time = is_cut or world.is_over_time
        self._present = state.robot_present.copy()
        self._in_episode = state.in_episode
        is_changed = np.count_nonzero(self._in_episode) != len(self.agents)
        if is_over_time or world.all_delivered or is_changed:
            terminations |= was_in_episode & (~self._in_episode | world.all_delivered)
            if is_over_time:
                truncations |= was_in_episode & ~terminations
            is_left = was_in_episode & ~(terminations | truncations)
            self.agents = agent_names(np.flatnonzero(is_left).tolist())
        return observations, rewards, terminations, truncations

    def change_rewards(self, rewards: Mapping[str, float]) -> None:
        """Pay by other weights of the terms from the next step on, e.g. as a training goes on.

        Raises:
            SetupError: a term is unknown, or a weight is no finite number.
        """
        RewardTerms(rewards)  # which checks them
        self._rewards.reweigh(rewards)

    @property
    def episode_info(self) -> dict[str, float]:
        """The entries of every agent's infos that are about the episode; keys never change.

        "delivered": items delivered so far, the paper's performance P.
        """
        return {"delivered": self.warehouse.state.delivered}

    @property
    def declared_scenarios(self) -> frozenset[Scenario]:
        """The scenarios that spaces hold: its own, and those given to `declare_spaces`."""
        return frozenset(self._spaces.declared)

    def declare_spaces(self, scenario: Scenario) -> None:
        """Widen the observation space so that episodes may also be played in `scenario`.

        Wrappers call it when they are made; later spaces must not change any more.

        Raises:
            SetupError: the rows or commands of `scenario` have another length than this
                environment's.
        """
        names = agent_names(range(max(len(self.possible_agents), scenario.n_robots)))
        self._spaces.widen(scenario)
        self.possible_agents = names

    @in_one_thread
    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture (H, W, 3) in mode "rgb_array"; show the window in mode "human".

        Raises:
            SetupError: no render_mode was chosen, pygame is missing, or there is no display.
        """
        if self.render_mode is None:
            raise SetupError('render_mode = None: should be "rgb_array" or "human" to render')
        if self._renderer is None:
            from swarm_logistics_env.world.rendering import Renderer

            self._renderer = Renderer(self.scenario, self.render_mode)
        world = self.warehouse
        if self.render_mode == "rgb_array":
            return self._renderer.frame(world.state, world.scenario)
        self._renderer.show(world.state, world.scenario)
        return None

    @in_one_thread
    def state(self) -> NDArray[np.float32]:
        """Return the whole warehouse as one vector, see `global_state`; for central critics."""
        return global_state(self.warehouse, len(self.possible_agents), self._spaces.most["n_items"])

    @property
    def state_space(self) -> Box:
        """The space of `state()`, for `possible_agents` robots and the most items there may be."""
        return self._spaces.state(len(self.possible_agents))

    def close(self) -> None:
        """Release what rendering holds; harmless when called twice."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def __getstate__(self) -> dict[str, Any]:
        # A copy opens a window of its own.
        return {**self.__dict__, "_renderer": None}


def _scenario_of(scenario: Scenario | None, fields: Mapping[str, Any]) -> Scenario:
    if scenario is not None and not isinstance(scenario, Scenario):
        raise SetupError(
            f"scenario = {scenario!r}: should be a Scenario; its fields are arguments of their "
            "own, as n_robots=40"
        )
    for name in fields:
        if name not in Scenario.model_fields:
            hint = suggest(name, Scenario.model_fields)
            raise ArgumentError(
                f"the environment got an unexpected keyword argument {name!r}{hint}"
            )
    return (scenario or Scenario()).replace(**fields)
