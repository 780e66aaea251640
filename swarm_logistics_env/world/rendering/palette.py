"""Colours and marks, and what of a robot they show; pictures and the page in the browser use them.

Colours are told apart by every kind of colour vision, and by lightness in print.

Hues are Okabe and Ito's ("Color Universal Design", 2008). What has to be told apart at a glance
differs in lightness or shape as well: grey levels of the three robot states are 213, 158 and 87.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import FAILURE_MODES
from swarm_logistics_env.world.warehouse.state import NOBODY, WarehouseState

RGB = tuple[int, int, int]

INK: RGB = (30, 30, 30)
SURROUNDINGS: RGB = (236, 236, 236)
FLOOR: RGB = (255, 255, 255)
FLOOR_LINE: RGB = (240, 240, 240)
DELIVERY_AREA: RGB = (226, 241, 235)
DELIVERY_HATCH: RGB = (196, 222, 211)
DELIVERY_WORD: RGB = (120, 150, 138)
OBSTACLE: RGB = (196, 196, 196)

SEARCHING: RGB = (86, 180, 233)  # sky blue
SHUFFLING: RGB = (0, 114, 178)  # blue
DELIVERING: RGB = (240, 228, 66)  # yellow
TIMER: RGB = (0, 158, 115)  # bluish green
REQUESTED: RGB = (213, 94, 0)  # vermillion
LINK: RGB = (158, 67, 117)  # reddish purple, darkened: thin things need contrast
BEAM: RGB = (230, 159, 0)  # orange
ITEM: RGB = (214, 214, 214)
ITEM_EDGE: RGB = (120, 120, 120)
TRAIL: RGB = (150, 150, 150)

# All of them by name, for films and for the page in the browser, whose scripts use these names.
ROBOT_COLOURS: dict[str, RGB] = {
    name: colour for name, colour in dict(globals()).items() if isinstance(colour, tuple)
}

# Of floor plans; apart, so that films of empty rooms keep the colours that they have.
PLAN_COLOURS: dict[str, RGB] = {
    "STORAGE": (247, 248, 250), "START": (238, 240, 244), "START_CROSS": (184, 190, 200),
    "WALL": (78, 84, 92), "RACK": (238, 229, 211), "RACK_SLAT": (211, 197, 170),
    "RACK_EDGE": (146, 126, 94), "SHADOW": (222, 223, 226),
}  # fmt: skip
# Of docks A, B and so on; further ones begin anew.
DOCK_HUES = ("TIMER", "LINK", "BEAM", "SHUFFLING")
ACTIVITIES = {"searching": SEARCHING, "shuffling": SHUFFLING, "delivering": DELIVERING}

# The same for a page on a dark screen: what lies behind is dark, what moves keeps its hue.
DARK_COLOURS: dict[str, RGB] = {
    **ROBOT_COLOURS, "INK": (236, 236, 236), "SURROUNDINGS": (22, 24, 27), "FLOOR": (34, 37, 41),
    "FLOOR_LINE": (46, 50, 55), "DELIVERY_AREA": (28, 54, 47), "DELIVERY_HATCH": (40, 74, 64),
    "DELIVERY_WORD": (128, 170, 156), "OBSTACLE": (78, 84, 92), "SHUFFLING": (38, 134, 204),
    "LINK": (214, 120, 172), "ITEM": (96, 101, 108), "ITEM_EDGE": (160, 164, 170),
    "TRAIL": (120, 124, 130), "STORAGE": (38, 42, 47), "START": (46, 51, 58),
    "START_CROSS": (92, 100, 112), "WALL": (136, 142, 150), "RACK": (92, 82, 64),
    "RACK_SLAT": (116, 104, 82), "RACK_EDGE": (160, 142, 110), "SHADOW": (20, 22, 25),
}  # fmt: skip

# Curves of runs side by side, and how thick they are [px].
RUN_NAMES = (("REQUESTED", 3.0), ("SHUFFLING", 1.5))

LOW_CHARGE = 0.3  # of a battery, below which it is drawn in another colour

# The mark on a robot that fails in a mode. Who is out of the arena is not drawn, so it has none.
MARKS = {name: mode.mark for name, mode in FAILURE_MODES.items() if mode.mark}

# What lies behind, and what stands before it; smooth edges between the two take four steps.
_BEHIND = (FLOOR, DELIVERY_AREA, INK)
_BEFORE = (INK, SEARCHING, SHUFFLING, DELIVERING, TIMER, REQUESTED, LINK)


def film_colours(has_plan: bool) -> list[RGB]:
    """Return the colours of pictures that may have only a few, with a plan or not: under 128."""
    edges = [np.linspace(behind, before, 6)[1:-1] for behind in _BEHIND for before in _BEFORE]
    smooth = np.rint(np.concatenate(edges)).astype(int).tolist()
    colours = [*ROBOT_COLOURS.values(), *((red, green, blue) for red, green, blue in smooth)]
    if has_plan:
        colours += PLAN_COLOURS.values()
        colours += [colour for hue in DOCK_HUES for colour in dock_colours(hue)]
    return list(dict.fromkeys(colours))


def dock_colours(hue: str) -> tuple[RGB, RGB, RGB]:
    """Return the colours of a dock: its floor, the hatching on it, and its letter."""
    colour = ROBOT_COLOURS[hue]
    return _mixed(colour, FLOOR, 0.13), _mixed(colour, FLOOR, 0.28), _mixed(colour, INK, 0.75)


def _mixed(colour: RGB, other: RGB, share: float) -> RGB:
    red, green, blue = (
        round(share * value + (1.0 - share) * other_value)
        for value, other_value in zip(colour, other, strict=True)
    )
    return red, green, blue


def mark(modes: tuple[str, ...]) -> str:
    """Return the mark of a robot that fails in these modes, as `1+V`; other modes by name."""
    return "+".join(MARKS.get(mode, mode) for mode in modes)


def activity(state: WarehouseState, robot: int) -> str:
    """Return the activity of a robot, a key of `ACTIVITIES`."""
    if state.robot_item[robot] == NOBODY:
        return "searching"
    return "delivering" if state.carries_requested[robot] else "shuffling"


def leader_of(state: WarehouseState, scenario: Scenario, robot: int) -> int:
    """Return the neighbour whose timer is the lowest that `robot` hears, or NOBODY.

    If several tell the same, it is the nearest of them.
    """
    if not (state.robot_present[robot] and state.hears[robot]):
        return NOBODY
    offset = state.robot_position - state.robot_position[robot]
    square = (offset * offset).sum(axis=1)
    heard = state.robot_present & state.sends & (square <= scenario.radio_range**2)
    heard &= ~np.isnan(state.robot_told)
    heard[robot] = False
    leader = int(np.lexsort((square, state.robot_told, ~heard))[0])
    return leader if heard[leader] else NOBODY


class Event(NamedTuple):
    """A robot that failed or was repaired, or another change: a mark on the time axis."""

    time: float  # [s]
    robot: int | None = None
    mode: str | None = None  # None if the robot was repaired
    note: str = ""  # what changed, if it was no robot

    @property
    def label(self) -> str:
        """The text of the mark."""
        if self.robot is None:
            return "i"
        return "ok" if self.mode is None else mark((self.mode,))

    @property
    def words(self) -> str:
        """What happened."""
        if self.robot is None:
            return self.note
        if self.mode is None:
            return f"robot {self.robot} is repaired"
        return f"robot {self.robot} fails in mode {self.mode}"
