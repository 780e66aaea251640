"""A fault in one word, as `--fault` takes it: MODE[:ROBOTS[:ROLE]][@ONSET[+DURATION]]."""

from __future__ import annotations

import re

from swarm_logistics_env.errors import FaultError
from swarm_logistics_env.warehouse.faults import Fault

FORM = "MODE[:ROBOTS[:ROLE]][@ONSET[+DURATION]]"

_NUMBER = r"\d+\.?\d*|\.\d+"
_FAULT = re.compile(
    r"(?P<mode>\w+(\[[\w,]+\])?)(:(?P<robots>\d+)(:(?P<role>\w+))?)?"
    rf"(@(?P<onset>{_NUMBER})(\+(?P<duration>{_NUMBER}))?)?"
)


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
        raise FaultError(f"--fault {text}: should be {FORM}, e.g. FM1:2@200")
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
