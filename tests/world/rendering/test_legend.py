from __future__ import annotations

from swarm_logistics_env import Scenario
from swarm_logistics_env.world.rendering.renderer import load_pygame

load_pygame()

from swarm_logistics_env.world.rendering.legend import legend  # noqa: E402 - wants pygame


def test_it_names_what_the_warehouse_has() -> None:
    room = set(legend(Scenario(n_robots=2, n_items=2), 16))
    assert room >= {"searching", "timer", "failed", "item", "requested item", "obstacle"}
    kinds = Scenario(n_robots=2, n_items=2).replace(robot_kinds="lifter, scout lifts=true")
    assert set(legend(kinds, 16)) - room == {"kind lifter", "kind scout"}
    hall = Scenario(floor="A.::#\nA.:=.\n+.:=.", n_robots=1, n_items=2)
    assert set(legend(hall, 16)) - room == {"dock", "rack", "wall", "storage", "start"}
    bare = Scenario(floor="A.:::\nA.:::\n...::", n_robots=1, n_items=2)
    assert set(legend(bare, 16)) - room == {"dock", "storage"}
