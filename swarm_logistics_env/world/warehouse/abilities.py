"""Abilities: what each robot can do now, by its kind and by the faults that hold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.world.scenario import Scenario

from .failure_modes import Capabilities, FailureMode
from .faults import Occurrence
from .state import WarehouseState

# Capabilities that a mode takes away as a whole: each is a field of both.
LOST_AS_A_WHOLE = tuple(
    name for name in Capabilities._fields if getattr(FailureMode, name, None) is True
)


def apply_faults(
    state: WarehouseState, scenario: Scenario, occurrences: Sequence[Occurrence]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Give every robot what the faults that hold at `state.time` leave it.

    Returns:
        Which robots faults take out of the arena for good (N,), and which of all others now (N,).
    """
    # By what robots do and see as faults begin, so that those of one moment choose alike.
    for occurrence in occurrences:
        occurrence.choose_by_role(state)
    able = state.able
    speed = np.resize(scenario.speed_mix, state.n_robots)
    sensing = np.resize(scenario.sensing_mix, state.n_robots)
    able.max_speed[:] = scenario.of_robots("max_speed") * speed
    able.max_turn_rate[:] = scenario.of_robots("max_turn_rate") * speed
    able.max_acceleration[:] = scenario.of_robots("max_acceleration")
    able.is_holonomic[:] = scenario.of_robots("drive") == "holonomic"
    able.ranger_range[:] = scenario.of_robots("ranger_range") * sensing
    able.view_range[:] = scenario.of_robots("view_range") * sensing
    able.battery[:] = 0.0 if scenario.battery is None else scenario.of_robots("battery")
    able.ranger_bias[:] = 0.0
    able.radio_delay[:] = 0
    for name in LOST_AS_A_WHOLE:
        getattr(able, name)[:] = True
    able.lifts[:] = scenario.of_robots("lifts")
    is_removed = np.zeros(state.n_robots, np.bool_)
    is_away = np.zeros(state.n_robots, np.bool_)
    modes: list[list[str]] = [[] for _ in range(state.n_robots)]
    for occurrence in occurrences:
        mode = occurrence.mode
        robots = occurrence.holds_for(state.time)
        left = occurrence.remaining_factors(state.time, scenario.duration)
        able.max_speed[robots] *= left["speed"]
        able.max_turn_rate[robots] *= left["speed"]
        able.view_range[robots] *= left["view"]
        able.battery[robots] *= left["battery"]
        able.ranger_range[robots] *= mode.rangers
        able.ranger_bias[robots] += mode.ranger_bias
        delay = round(mode.radio_delay / scenario.control_period)
        able.radio_delay[robots] = np.maximum(able.radio_delay[robots], delay)
        for name in LOST_AS_A_WHOLE:
            getattr(able, name)[robots] &= getattr(mode, name)
        is_removed[robots] |= not (mode.present or mode.returns)
        is_away[robots] |= mode.returns
        for robot in robots.tolist():
            modes[robot].append(occurrence.fault.mode)
    state.failure_modes = tuple(map(tuple, modes))
    state.failed = np.array([bool(names) for names in modes])
    return is_removed, is_away & ~is_removed
