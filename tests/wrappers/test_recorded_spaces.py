"""The bounds of every observation and action, column by column, in worlds of all kinds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import groupby, product
from typing import Any

from gymnasium.spaces import Box, Space

from swarm_logistics_env import Scenario
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import DiscreteActions, MotionFrame, Wrapper
from tests.conftest import Check

SCENARIOS = {
    name: Scenario.preset(name) for name in ("paper", "realistic", "dotbots", "orders", "day")
} | {
    "messages and obstacles": Scenario(message_size=2, n_obstacles=3, view_range=3.0),
    "two docks": Scenario(floor="two_docks", request_docks="random"),
    "slow and lame": Scenario(max_speed=0.3, max_acceleration=0.1, handling_time=5.0),
}
FORMS: dict[str, Callable[[SwarmLogisticsEnv], SwarmLogisticsEnv | Wrapper]] = {
    "rows": lambda env: env,
    "motion": MotionFrame,
    "numbers": DiscreteActions,
    "motion by numbers": lambda env: DiscreteActions(MotionFrame(env)),
}


def in_words(space: Space[Any]) -> Iterator[str]:
    """Yield the bounds of a box, with how many columns in a row have them; else the space."""
    if not isinstance(space, Box):
        yield str(space)
        return
    bounds = zip(space.low.tolist(), space.high.tolist(), strict=True)
    for (low, high), columns in groupby(bounds):
        yield f"{len([*columns])} x [{low:.7g}, {high:.7g}]"


def test_spaces_are_as_recorded(check_recorded: Check) -> None:
    lines = []
    for (name, scenario), (form, wrap) in product(SCENARIOS.items(), FORMS.items()):
        env = wrap(SwarmLogisticsEnv(scenario))
        agent = env.possible_agents[-1]
        for kind in ("observation", "action"):
            space = getattr(env, f"{kind}_space")(agent)
            lines.append(f"{name}, {form}, {kind}: {', '.join(in_words(space))}")
    check_recorded("spaces.txt", lines)
