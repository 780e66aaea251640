"""The keys of the page in the browser."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from swarm_logistics_env.watch.session import WIDTH_STEP, Session


@dataclass(frozen=True)
class Key:
    """A key, by the name that browsers have for it, what it means, and what it does.

    `act` is None if the page itself does it, by the key's `name`.
    """

    name: str
    meaning: str
    act: Callable[[Session], None] | None

    @property
    def label(self) -> str:
        """The name of the key in the help."""
        return {" ": "space", "ArrowRight": "right arrow", "Escape": "Esc"}.get(
            self.name, self.name
        )


def _by(robots: int) -> Callable[[Session], None]:
    return lambda session: session.resize(session.scenario.n_robots + robots)


def _wider(metres: float) -> Callable[[Session], None]:
    return lambda session: session.set_delivery_width(session.scenario.delivery_width + metres)


HELP, TRAILS, LINKS = "h", "t", "l"

KEYS: tuple[Key, ...] = (
    Key(" ", "pause, or go on", lambda session: session.pause()),
    Key("ArrowRight", "one step", lambda session: session.step()),
    Key("+", "faster", lambda session: session.faster()),
    Key("-", "slower", lambda session: session.slower()),
    Key("n", "next seed", lambda session: session.next_seed()),
    Key("0", "this seed again", lambda session: session.restart()),
    Key("m", "next failure mode", lambda session: session.next_mode()),
    Key("M", "failure mode before", lambda session: session.next_mode(forward=False)),
    Key("b", "break the selected robot", lambda session: session.break_robot()),
    Key("r", "repair the selected robot", lambda session: session.repair_robot()),
    Key("Escape", "select no robot", lambda session: session.select(None)),
    Key("]", "swarm + 1", _by(1)),
    Key("[", "swarm - 1", _by(-1)),
    Key("}", "swarm + 10", _by(10)),
    Key("{", "swarm - 10", _by(-10)),
    Key("w", "delivery area wider", _wider(WIDTH_STEP)),
    Key("W", "delivery area narrower", _wider(-WIDTH_STEP)),
    Key(TRAILS, "trails", None),
    Key(LINKS, "links of all robots", None),
    Key(HELP, "this help", None),
)
MOUSE: tuple[tuple[str, str], ...] = (
    ("click", "select a robot: what it senses"),
    ("right or shift click", "break it in the chosen mode, or repair it"),
)


def press(session: Session, key: str) -> bool:
    """Do what the key of that name does to a session; return False if it does nothing to it."""
    for known in KEYS:
        if known.name == key and known.act is not None:
            known.act(session)
            return True
    return False
