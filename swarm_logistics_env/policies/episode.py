"""One episode from the first command to the last, which is what every measurement counts."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import CommandError, PolicyError
from swarm_logistics_env.policies.evaluation_mode import in_evaluation
from swarm_logistics_env.policies.policy import Policy, decide_in_use, one_thread, start
from swarm_logistics_env.world.scenario import CHIPMUNK, Scenario
from swarm_logistics_env.world.warehouse import Warehouse
from swarm_logistics_env.world.warehouse.contacts import ContactMeasures
from swarm_logistics_env.world.warehouse.faults import FaultLike
from swarm_logistics_env.world.warehouse.orders import OrderMeasures

_MOST_STEPS = 100  # in one call: the interpreter answers a Ctrl-C between calls


@dataclass(frozen=True)
class Episode:
    """The results of one run.

    Attributes:
        seed: the seed it was run with.
        delivery_times: (P,) when each item was delivered [s], ascending.
        ended_at: the duration, or when the last item was delivered [s].
        all_delivered: nothing was left to ask for, so P is capped by the number of items.
        failed_robots: the robots that any fault named, ascending.
        anchoring_seconds: robot-seconds that working robots spent touching failed ones.
        digest: hash of every robot's position at every control step and of all deliveries, in
            hexadecimal. Runs of equal digest went the same way, whatever their timers said.
        contacts: how often robots ran into each other, how deep, and their accelerations.
        orders: how late they were served, and how many waited.
        charge: (N,) what was left in the batteries at the end, as shares; empty: there were none.
    """

    seed: int
    delivery_times: NDArray[np.float64]
    ended_at: float
    all_delivered: bool
    failed_robots: tuple[int, ...]
    anchoring_seconds: float
    digest: str
    contacts: ContactMeasures = field(default_factory=ContactMeasures)
    orders: OrderMeasures = field(default_factory=OrderMeasures)
    charge: tuple[float, ...] = ()

    @property
    def delivered(self) -> int:
        """Items delivered in the order requested: the paper's performance P."""
        return len(self.delivery_times)


class Play:
    """An episode that is played step by step; the caller may change its world in between.

    Args:
        seed: decides the layout, the requests and which robots fail.
        policy_seed: decides the policy's own randomness; `seed` does if it is None.

    Attributes:
        world: the world; its scenario and faults may be changed between two steps.

    Raises:
        FaultError: a fault names robots that are not there.
        PolicyError: `policy` is no policy.
        ScenarioError: robots, items and obstacles do not find room.
    """

    def __init__(
        self,
        scenario: Scenario,
        policy: Policy,
        seed: int,
        faults: Sequence[FaultLike] = (),
        policy_seed: int | None = None,
    ) -> None:
        self._policy = policy
        wrap = getattr(policy, "wrap", None)
        if wrap is None:
            self._env = None
            self.world = Warehouse(scenario)
            self._rows = self.world.reset(seed, faults)
        else:
            self._env, self._rows = _begun(wrap, scenario, seed, faults)
            self.world = self._env.warehouse
        start(policy, scenario, seed if policy_seed is None else policy_seed)
        is_in_compiled_code = self._env is None and scenario.bodies == CHIPMUNK
        # Of its class: a policy that passes attributes on to another one may act otherwise.
        plays_steps = is_in_compiled_code and hasattr(type(policy), "play_steps")
        self._play_steps = policy.play_steps if plays_steps else None  # type: ignore[attr-defined]

    @property
    def is_over(self) -> bool:
        """Whether the time is up or everything is delivered."""
        if self._env is not None and not self._env.agents:
            return True
        return self.world.is_over_time or self.world.all_delivered

    def step(self) -> None:
        """Take one control period, or do nothing once the episode is over.

        Raises:
            PolicyError: the policy returned commands of the wrong shape, or not finite.
        """
        if not self.is_over:
            if self._env is None:
                self._rows = self.world.observe()  # others, if the caller changed the world
            with one_thread(), in_evaluation(self._policy):
                self._advance()

    def _advance(self) -> None:
        """Do as `step` within what it does, where nobody changed the world and it is not over."""
        world = self.world
        commands = decide_in_use(self._policy, self._rows, world.state)
        try:
            if self._env is None:
                self._rows = world.step(commands)
            else:
                self._rows = self._env.step_arrays(commands)[0]
        except CommandError as error:
            raise self._error_about(error) from error

    def advance_to_event(self, positions: NDArray[np.float64]) -> int:
        """Do as `step` until something happens, in one call where the policy plays many steps.

        It is for who changes nothing in the world, and has seen that the episode is not over.

        Args:
            positions: (K, N, 2), filled with the robots' positions after each step [m].

        Returns:
            The number of steps, K or fewer.
        """
        if self._play_steps is None:
            self._advance()
            n_steps = 1
        else:
            world = self.world
            rows = self._rows
            n_steps, is_eventful = self._play_steps(world.address, rows, positions)
            try:
                world.take(rows, is_eventful)
            except CommandError as error:
                raise self._error_about(error) from error
        # Who is taken out as a fault begins has no position any more.
        positions[n_steps - 1] = self.world.state.robot_position
        return n_steps

    def _error_about(self, error: CommandError) -> PolicyError:
        when = f"at {self.world.state.time:g} s"
        return PolicyError(f"{type(self._policy).__name__} {when}: {error}")


def _begun(
    wrap: Callable[[Any], Any], scenario: Scenario, seed: int, faults: Sequence[FaultLike]
) -> tuple[Any, NDArray[np.float32]]:
    """Return the environment that a policy plays in, and its first rows (N, D)."""
    from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv

    core = SwarmLogisticsEnv(scenario, faults=faults)
    env = wrap(core)
    if getattr(env, "unwrapped", None) is not core or not hasattr(env, "reset_arrays"):
        raise PolicyError(
            f"wrap made {env!r} of the environment: should be wrappers around it (wrappers.Wrapper)"
        )
    rows = env.reset_arrays(seed, {"scenario": {"n_robots": scenario.n_robots}})
    if (core.warehouse.scenario, core.warehouse.faults) != (scenario, core.faults):
        raise PolicyError(
            "wrap changed the conditions of the episode: should add sensors, rewards or actions, "
            "and leave scenario and faults to the study"
        )
    return env, rows


def run_episode(
    scenario: Scenario,
    policy: Policy,
    seed: int,
    faults: Sequence[FaultLike] = (),
    policy_seed: int | None = None,
) -> Episode:
    """Play `policy` in `scenario` to the end.

    The same arguments give the same bits, in any process and beside any other world.

    Args:
        seed: decides the layout, the requests, which robots fail and the policy's own randomness.
        faults: the faults that are scheduled in the episode, each as `Warehouse.reset` takes it.
        policy_seed: decides the policy's own randomness instead of `seed`; the same world with
            another behaviour.

    Raises:
        FaultError: a fault names robots that are not there.
        PolicyError: `policy` is none, or returned commands of the wrong shape, or not finite.

    Example:
        >>> from swarm_logistics_env import policies
        >>> run_episode(Scenario(duration=10.0), policies.load("swarm-dt"), seed=0).ended_at
        10.0
    """
    digest = hashlib.blake2b(digest_size=16)
    with one_thread():  # once for all steps, as each change takes a while
        play = Play(scenario, policy, seed, faults, policy_seed)
        world = play.world
        positions = np.empty((_MOST_STEPS, *world.state.robot_position.shape))
        with in_evaluation(policy):
            while not play.is_over:
                n_steps = play.advance_to_event(positions)
                digest.update(positions[:n_steps].data)
    state = world.state
    delivery_times = np.array(state.delivery_times, dtype=np.float64)
    digest.update(delivery_times.tobytes())
    return Episode(
        seed=seed,
        delivery_times=delivery_times,
        ended_at=round(state.time, 9),
        all_delivered=world.all_delivered,
        failed_robots=world.struck_robots,
        anchoring_seconds=round(state.anchoring_seconds, 9),
        digest=digest.hexdigest(),
        contacts=state.contact_measures,
        orders=state.order_measures,
        charge=() if scenario.battery is None else tuple(state.robot_charge.round(9).tolist()),
    )
