"""An episode that is stopped at the onset of faults, and played on with some of them."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import NamedTuple

from swarm_logistics_env.episode import Play
from swarm_logistics_env.errors import FaultError
from swarm_logistics_env.policies import Policy
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import Fault
from swarm_logistics_env.warehouse.faults import GRACE, Occurrence
from swarm_logistics_env.warehouse.roles import roles_of
from swarm_logistics_env.warehouse.state import NOBODY


class AfterOnset(NamedTuple):
    """What happened from the onset to the end of one copy.

    Attributes:
        delivered: items delivered.
        blocked_seconds: for which the requested item was held by a robot that failed [s].
        anchoring_seconds: robot-seconds that working robots spent touching failed ones.
        is_capped: whether every item was delivered, so that more could not have been.
    """

    delivered: int
    blocked_seconds: float
    anchoring_seconds: float
    is_capped: bool


class Fork:
    """A world at the onset of faults, before any robot has failed.

    Args:
        policy: it is copied with the world, so that it should hold all that it remembers.
        onset: [s]; the episode is played until then without faults.

    Attributes:
        roles: what each robot is doing at the onset, shape (N,), see `roles_of`.

    Raises:
        FaultError: the episode ends before the onset.
    """

    def __init__(self, scenario: Scenario, policy: Policy, seed: int, onset: float) -> None:
        play = Play(scenario, copy.deepcopy(policy), seed)
        while not play.is_over and play.world.state.time < onset - GRACE:
            play.step()
        if play.is_over:
            raise FaultError(
                f"onset = {onset:g} s, but the episode of seed {seed} ended at "
                f"{play.world.state.time:g} s: should be earlier"
            )
        # Copies are made of a world that has just been rebuilt, which has no commands to replay.
        play.world.set_faults(())
        self._play = play
        self.roles = roles_of(play.world.state)

    def robots_of(self, fault: Fault) -> tuple[int, ...]:
        """Return the numbers of the robots that a fault affects at the onset, ascending.

        Raises:
            FaultError: as `failed_robots`.
        """
        state = self._play.world.state
        # It holds now, however short it is and whatever the sum of the control periods.
        holding = fault.replace(onset=0.0, duration=None)
        occurrence = Occurrence(holding, self._play.seed, state.n_robots)
        occurrence.choose_by_role(state)
        return tuple(occurrence.robots.tolist())

    def go_on(self, faults: Sequence[Fault] = ()) -> AfterOnset:
        """Play a copy to the end, with these faults from now on.

        Every copy's bodies are rebuilt, that without faults as well: copies differ by their faults
        alone, and two copies with equal faults are equal.
        """
        play = copy.deepcopy(self._play)
        world = play.world
        world.set_faults(faults)
        state = world.state
        delivered, anchoring, blocked = state.delivered, state.anchoring_seconds, 0
        while not play.is_over:
            play.step()
            asked = state.requested
            carrier = int(state.item_carrier[asked]) if asked != NOBODY else NOBODY
            blocked += carrier != NOBODY and bool(state.failed[carrier])
        return AfterOnset(
            delivered=state.delivered - delivered,
            blocked_seconds=blocked * world.scenario.control_period,
            anchoring_seconds=state.anchoring_seconds - anchoring,
            is_capped=world.all_delivered,
        )
