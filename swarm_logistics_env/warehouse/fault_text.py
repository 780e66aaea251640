"""Faults as callers write them: as `Fault`, as the dict of its arguments, or in one word.

The word is MODE[:ROBOTS[:ROLE]][@ONSET[+DURATION]].
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

from swarm_logistics_env.errors import FaultError, SwarmLogisticsError, suggest

from .faults import Fault

FaultLike: TypeAlias = Fault | Mapping[str, Any] | str

FORM = "MODE[:ROBOTS[:ROLE]][@ONSET[+DURATION]]"

_NUMBER = r"\d+\.?\d*|\.\d+"
_FAULT = re.compile(
    r"(?P<mode>\w+)(:(?P<robots>\d+)(:(?P<role>\w+))?)?"
    rf"(@(?P<onset>{_NUMBER})(\+(?P<duration>{_NUMBER}))?)?"
)


def checked_faults(
    name: str, faults: Any, refused: type[SwarmLogisticsError] = FaultError
) -> tuple[Fault, ...]:
    """Return faults as a tuple, whichever way each of them is written.

    Args:
        name: of the argument, for errors.
        faults: a sequence of `FaultLike`.
        refused: the error about what is no such sequence.

    Raises:
        FaultError: a text or a dict is not that of a fault that can be.

    Example:
        >>> checked_faults("faults", ["FM1:2", {"mode": "FM1", "robots": 2}])[0].robots
        2
    """
    is_list = isinstance(faults, Sequence) and not isinstance(faults, str)
    if not is_list or not all(isinstance(fault, Fault | Mapping | str) for fault in faults):
        raise refused(
            f'{name} = {faults!r}: should be a list of faults, as [Fault("FM1", 2)], ["FM1:2"] or '
            '[{"mode": "FM1", "robots": 2}]'
        )
    return tuple(_read(name, fault) for fault in faults)


def _read(name: str, given: FaultLike) -> Fault:
    if isinstance(given, Fault):
        return given
    if isinstance(given, str):
        return fault_of(given)
    known = Fault.model_fields
    for field in given:
        if field not in known:
            raise FaultError(f"{name}: a fault has no {field!r}{suggest(str(field), known)}")
    if "mode" not in given:
        raise FaultError(f'{name}: {dict(given)!r} has no "mode": should name one, as "FM1"')
    return Fault(**given)


def fault_of(text: str) -> Fault:
    """Return the fault that the text describes.

    Raises:
        FaultError: the text does not read so, or there is no such fault.

    Example:
        >>> fault_of("FM4:2:carrier@100+50").duration
        50.0
    """
    match = _FAULT.fullmatch(text)
    if match is None:
        raise FaultError(
            f"fault {text!r}: should be {FORM}, e.g. FM1:2@200, with ROBOTS a whole number and "
            "ONSET and DURATION in seconds"
        )
    return Fault(
        match["mode"],
        int(match["robots"] or 1),
        onset=float(match["onset"] or 0),
        duration=float(match["duration"]) if match["duration"] else None,
        role=match["role"],
    )


def text_of(fault: Fault) -> str | None:
    """Return the text that describes the fault; None: none does, as it has a factor, say."""
    role = f":{fault.role}" if fault.role else ""
    lasts = f"+{_digits(fault.duration)}" if fault.duration else ""
    onset = f"@{_digits(fault.onset)}{lasts}" if fault.onset or lasts else ""
    text = f"{fault.mode}:{fault.robots}{role}{onset}"
    return text if _FAULT.fullmatch(text) and fault_of(text) == fault else None


def _digits(seconds: float) -> str:
    return f"{seconds:.12f}".rstrip("0").rstrip(".")
