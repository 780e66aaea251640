"""Failure modes: what a robot that fails in one of them has lost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import FaultError, suggest


class Capabilities(NamedTuple):
    """What each robot can do now; failures take from it."""

    max_speed: Annotated[NDArray[np.float64], "N"]  # [m/s]
    max_turn_rate: Annotated[NDArray[np.float64], "N"]  # [rad/s]
    max_acceleration: Annotated[NDArray[np.float64], "N"]  # [m/s2]
    is_holonomic: Annotated[NDArray[np.bool_], "N"]  # False: no sideways motion
    ranger_range: Annotated[NDArray[np.float64], "N"]  # [m], 0 when blind
    view_range: Annotated[NDArray[np.float64], "N"]  # [m]
    lifts: Annotated[NDArray[np.bool_], "N"]  # False: takes up no item
    delivers: Annotated[NDArray[np.bool_], "N"]  # False: nothing that it brings counts
    sends: Annotated[NDArray[np.bool_], "N"]  # False: nobody hears its timer and message
    hears: Annotated[NDArray[np.bool_], "N"]  # False: it hears no timer and no message
    hears_requests: Annotated[NDArray[np.bool_], "N"]  # False: is told of no request or delivery
    honest: Annotated[NDArray[np.bool_], "N"]  # False: tells timer 0 always
    obeys: Annotated[NDArray[np.bool_], "N"]  # False: ignores its commands, the gripper's too
    releases_inside: Annotated[NDArray[np.bool_], "N"]  # False: lets nothing go inside the area
    rangers_refresh: Annotated[NDArray[np.bool_], "N"]  # False: its rangers repeat one reading
    messages_refresh: Annotated[NDArray[np.bool_], "N"]  # False: it repeats its last message
    messages_mean: Annotated[NDArray[np.bool_], "N"]  # False: its messages are random numbers
    messages_true: Annotated[NDArray[np.bool_], "N"]  # False: it tells the opposite
    ranger_bias: Annotated[NDArray[np.float64], "N"]  # [m] that its rangers read too far
    radio_delay: Annotated[NDArray[np.int64], "N"]  # control steps that its broadcasts lag
    battery: Annotated[NDArray[np.float64], "N"]  # [J] that its battery holds, if it has any


@dataclass(frozen=True)
class FailureMode:
    """What a robot that fails in this mode has lost.

    Attributes:
        description: in a sentence.
        mark: what its robots wear in pictures, one or two letters; none: the mode's name.
        speed: factor in [0, 1] on its top speed and turn rate.
        view: factor in [0, 1] on its cameras' range.
        battery: factor in [0, 1] on what its battery holds.
        factor: "speed", "view" or "battery": which of them a fault's own factor replaces; or None.
        wears: whether the speed, or what the battery holds, falls linearly, from all at the fault's
            onset to that factor at the end of the episode.
        rangers: False: they report nothing near.
        ranger_bias: what they read too far [m].
        radio_delay: how late its broadcasts come [s].
        present: False: it is out of the arena.
        returns: who is out of the arena comes back when the fault ends; else it is out for good.
        lifts, delivers, sends, hears, hears_requests, honest, obeys, releases_inside,
            rangers_refresh, messages_refresh, messages_mean, messages_true: see `Capabilities`.
        title: in two words, for tables of verdicts; none: the mode's name says it.
    """

    description: str
    mark: str = ""
    speed: float = 1.0
    view: float = 1.0
    battery: float = 1.0
    factor: str | None = None
    wears: bool = False
    rangers: bool = True
    ranger_bias: float = 0.0
    radio_delay: float = 0.0
    present: bool = True
    returns: bool = False
    lifts: bool = True
    delivers: bool = True
    sends: bool = True
    hears: bool = True
    hears_requests: bool = True
    honest: bool = True
    obeys: bool = True
    releases_inside: bool = True
    rangers_refresh: bool = True
    messages_refresh: bool = True
    messages_mean: bool = True
    messages_true: bool = True
    title: str = ""


# Sending and hearing are the robots' own radio, i.e. timers and messages. What the warehouse tells
# all robots, i.e. the requests and the deliveries, which clear their memories, reaches robots in
# FM3 as well: the paper's "cannot communicate with their neighbours". `FM3_isolated` loses both.
FAILURE_MODES: dict[str, FailureMode] = {
    "FM1": FailureMode(
        "always tells timer 0, as if it were in the delivery area, so that others follow it",
        mark="1",
        title="false timer",
        honest=False,
    ),
    "FM2": FailureMode("never picks up", mark="2", title="lifts nothing", lifts=False),
    "FM3": FailureMode(
        "neither sends nor hears, but is told of requests and deliveries",
        mark="3",
        title="no radio",
        sends=False,
        hears=False,
    ),
    "FM3_send": FailureMode("does not send", mark="3s", title="mute", sends=False),
    "FM3_hear": FailureMode("does not hear", mark="3h", title="deaf", hears=False),
    "FM3_isolated": FailureMode(
        "as FM3, and is told of no request and no delivery",
        mark="3i",
        sends=False,
        hears=False,
        hears_requests=False,
    ),
    "FM4": FailureMode(
        "delivers nothing when it enters the delivery area",
        mark="4",
        title="no delivery",
        delivers=False,
    ),
    "FM4_jam": FailureMode(
        "as FM4, and what it holds inside the delivery area it cannot let go",
        mark="4j",
        title="holds on",
        delivers=False,
        releases_inside=False,
    ),
    "motor_slow": FailureMode(
        "drives and turns at half its speed, or at the fault's factor of it",
        mark="S",
        speed=0.5,
        factor="speed",
    ),
    "motor_wear": FailureMode(
        "drives and turns ever slower, at half its speed or the fault's factor of it in the end",
        mark="W",
        speed=0.5,
        factor="speed",
        wears=True,
    ),
    "motor_dead": FailureMode("stands still", mark="M", speed=0.0),
    "cell_fades": FailureMode(
        "its battery holds ever less, half as much or the fault's factor of it in the end",
        mark="C",
        battery=0.5,
        factor="battery",
        wears=True,
    ),
    "view_reduced": FailureMode(
        "sees half as far with its cameras, or the fault's factor of it",
        mark="V",
        view=0.5,
        factor="view",
    ),
    "rangers_blind": FailureMode("its rangers report nothing near", mark="R", rangers=False),
    "rangers_frozen": FailureMode(
        "its rangers repeat what they read when they failed", mark="F", rangers_refresh=False
    ),
    "rangers_biased": FailureMode("its rangers read 0.2 m too far", mark="B", ranger_bias=0.2),
    "radio_delayed": FailureMode("what it broadcasts comes 2 s late", mark="D", radio_delay=2.0),
    "message_frozen": FailureMode(
        "repeats the message that it broadcast when it failed", mark="mf", messages_refresh=False
    ),
    "message_random": FailureMode(
        "broadcasts random numbers as its message", mark="mr", messages_mean=False
    ),
    "message_lying": FailureMode(
        "broadcasts its message with the opposite sign", mark="ml", messages_true=False
    ),
    "dead": FailureMode(
        "stands still, senses, sends and lifts nothing, keeps what it carries",
        mark="X",
        speed=0.0,
        view=0.0,
        rangers=False,
        lifts=False,
        delivers=False,
        sends=False,
        hears=False,
        obeys=False,
    ),
    "late": FailureMode(
        "has not begun to work: stands as a dead robot does until the fault ends",
        mark="L",
        speed=0.0,
        view=0.0,
        rangers=False,
        lifts=False,
        delivers=False,
        sends=False,
        hears=False,
        obeys=False,
    ),
    "removed": FailureMode(
        "out of the arena, what it carried is put down where it was", present=False
    ),
    "away": FailureMode(
        "out of the arena, as if removed, until the fault ends; then back where it stood",
        present=False,
        returns=True,
    ),
}


def failure_mode(name: str) -> FailureMode:
    """Return the failure mode of that name.

    Raises:
        FaultError: there is no such mode.
    """
    if name not in FAILURE_MODES:
        raise FaultError(f"no failure mode {name!r}{suggest(name, FAILURE_MODES)}")
    return FAILURE_MODES[name]
