"""Checks of a reset's options, for the environment and its wrappers."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from typing import Any

from swarm_logistics_env.errors import FaultError, SetupError, suggest
from swarm_logistics_env.warehouse import Fault
from swarm_logistics_env.warehouse.failure_modes import failure_mode
from swarm_logistics_env.warehouse.faults import GRACE, failed_robots

OPTIONS = ("faults", "scenario")


def checked_options(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return a copy of the options as a dict; it is empty for None.

    Raises:
        SetupError: they are not a mapping.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise SetupError(f"options = {options!r}: should be None or a dict with keys {OPTIONS}")
    return dict(options)


def checked_seed(seed: int) -> int:
    """Return the seed as an int.

    Raises:
        SetupError: it is not an integer.
    """
    try:
        return operator.index(seed)
    except TypeError:
        raise SetupError(f"seed = {seed!r}: should be None or an integer") from None


def checked_count(name: str, value: int) -> int:
    """Return the value as an int of at least 1.

    Raises:
        SetupError: it is none.
    """
    try:
        number = operator.index(value)
    except TypeError:
        number = 0
    if number < 1:
        raise SetupError(f"{name} = {value!r}: should be a whole number of at least 1")
    return number


def scenario_fields(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of the scenario that the options replace.

    Raises:
        SetupError: they are not a mapping from names.
    """
    fields = options.get("scenario", {})
    if not isinstance(fields, Mapping) or not all(isinstance(name, str) for name in fields):
        raise SetupError(
            f'options["scenario"] = {fields!r}: should be a dict of fields, as {{"n_robots": 40}}'
        )
    return dict(fields)


def faults_among(options: Mapping[str, Any], default: Sequence[Fault]) -> tuple[Fault, ...]:
    """Return the faults of the options, or `default` if there are none.

    Raises:
        SetupError, FaultError: as `checked_faults`.
    """
    return checked_faults('options["faults"]', options.get("faults", default))


def checked_faults(name: str, faults: Any) -> tuple[Fault, ...]:
    """Return faults as a tuple; a dict of a fault's arguments, as JSON and YAML have it, is one.

    Raises:
        SetupError: they are not a sequence of faults.
        FaultError: a dict is not that of a fault that can be.
    """
    is_list = isinstance(faults, Sequence) and not isinstance(faults, str)
    if not is_list or not all(isinstance(fault, Fault | Mapping) for fault in faults):
        raise SetupError(
            f'{name} = {faults!r}: should be a list of faults, as [Fault("FM1", 2)] or '
            '[{"mode": "FM1", "robots": 2}]'
        )
    return tuple(fault if isinstance(fault, Fault) else _fault_of(name, fault) for fault in faults)


def _fault_of(name: str, fields: Mapping[str, Any]) -> Fault:
    known = Fault.model_fields
    for field in fields:
        if field not in known:
            raise FaultError(f"{name}: a fault has no {field!r}{suggest(str(field), known)}")
    if "mode" not in fields:
        raise FaultError(f'{name}: {dict(fields)!r} has no "mode": should name one, as "FM1"')
    return Fault(**fields)


def check_somebody_is_there(faults: Sequence[Fault], seed: int, n_robots: int) -> None:
    """Check that an episode with these faults begins with at least one robot.

    Raises:
        SetupError: they remove all at 0 s.
        FaultError: a fault names robots that are not there.
    """
    gone = set[int]()
    for fault in faults:
        if fault.onset <= GRACE and not failure_mode(fault.mode).present:
            gone.update(failed_robots(fault, seed, n_robots).tolist())
    if len(gone) == n_robots:
        raise SetupError(
            f"faults remove all {n_robots} robots at 0 s: should leave at least one to begin with"
        )
