"""What callers hand to an environment: a reset's options, checked, and commands of any library."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import CommandError, SetupError
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Fault
from swarm_logistics_env.world.warehouse.failure_modes import failure_mode
from swarm_logistics_env.world.warehouse.faults import GRACE, checked_faults, failed_robots


def as_array(value: ArrayLike, name: str) -> NDArray[Any]:
    """Return `value` as an array; shape and dtype stay as they are.

    Args:
        value: an array, a list, a tensor on the CPU, ...
        name: the name of the value, for errors.

    Raises:
        CommandError: NumPy cannot read it, as a tensor of bfloat16, on a GPU or with a gradient.
    """
    try:
        return np.asarray(value)
    except Exception as error:  # tensors raise TypeError, RuntimeError, NotImplementedError, ...
        raise CommandError(
            f"{name} of type {type(value).__name__} cannot be read: should be numbers that "
            f"numpy.asarray takes, which says: {error}"
        ) from error


def numbers_of(value: ArrayLike, name: str, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return `value` as an array of numbers of that shape; see `as_array`.

    Raises:
        CommandError: it cannot be read, has another shape, or is not of real numbers.
    """
    array = as_array(value, name)
    if array.shape != shape or array.dtype.kind not in "fiub":
        raise CommandError(
            f"{name} of shape {array.shape} and type {array.dtype}: should be {shape} numbers"
        )
    return array


def gather_commands(
    actions: Mapping[str, ArrayLike],
    agents: Sequence[str],
    possible_agents: Sequence[str],
    shape: tuple[int, ...],
) -> NDArray[np.float64]:
    """Return the commands of `agents`, in their order, as rows of one array.

    Args:
        actions: agent -> command; those of other possible agents are ignored.
        agents: whose commands are wanted.
        possible_agents: who may be named in `actions`.
        shape: the shape of one command.

    Raises:
        CommandError: no dict; a command is missing, for an unknown agent, unreadable, of the wrong
            shape or no numbers.
    """
    if not isinstance(actions, Mapping):
        raise CommandError(
            f"actions of type {type(actions).__name__}: should be a dict of one command for every "
            "agent; step_arrays takes an array"
        )
    if actions.keys() != set(agents):
        if missing := set(agents) - actions.keys():
            raise CommandError(f"no command for {min(missing)!r}: should be one for every agent")
        if unknown := actions.keys() - set(possible_agents):
            raise CommandError(
                f"a command for {min(map(str, unknown))!r}, who is not there: should be among "
                f"{len(possible_agents)} possible agents"
            )
    rows: list[Any] = [actions[agent] for agent in agents]
    if not all(type(row) is np.ndarray and row.shape == shape for row in rows):  # seldom
        rows = [as_array(row, f"command of {agent!r}") for agent, row in zip(agents, rows)]
        for agent, row in zip(agents, rows):
            if row.shape != shape:
                raise CommandError(f"command of {agent!r} of shape {row.shape}: should be {shape}")
    try:
        # To concatenate is several times as fast as an array of arrays; numbers cannot be.
        commands = np.concatenate(rows if shape else [rows], dtype=np.float64, casting="same_kind")
    except TypeError as error:
        raise CommandError(f"commands should be numbers: {error}") from error
    return commands.reshape(len(rows), *shape)


OPTIONS = ("faults", "scenario")


def checked_options(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return a copy of the options as a dict; it is empty for None.

    Raises:
        SetupError: they are not a mapping, or one is nearly called as one of `OPTIONS`, or is a
            field of the scenario.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise SetupError(f"options = {options!r}: should be None or a dict with keys {OPTIONS}")
    for unknown in map(str, options.keys() - set(OPTIONS)):
        # Other libraries pass options of their own, which have no such name.
        is_near = get_close_matches(unknown.casefold(), OPTIONS, cutoff=0.8)
        if is_near or unknown in Scenario.model_fields:
            raise SetupError(
                f"there is no reset option {unknown!r}: should be 'faults', or 'scenario' with "
                "fields, as options={'scenario': {'n_robots': 40}}"
            )
    return dict(options)


def checked_count(name: str, value: int, least: int = 1) -> int:
    """Return the value as an int of at least `least`.

    Raises:
        SetupError: it is none.
    """
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if number < least or isinstance(value, bool):
        raise SetupError(f"{name} = {value!r}: should be a whole number of at least {least}")
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
        SetupError: they are not a sequence of faults.
        FaultError: one of them cannot be.
    """
    return checked_faults('options["faults"]', options.get("faults", default), SetupError)


def check_somebody_is_there(faults: Sequence[Fault], seed: int, scenario: Scenario) -> None:
    """Check that an episode with these faults begins with at least one robot.

    Raises:
        SetupError: they remove all at 0 s.
        FaultError: a fault names robots that are not there.
    """
    removed = set[int]()
    for fault in faults:
        mode = failure_mode(fault.mode)
        if fault.onset <= GRACE and not (mode.present or mode.returns):
            removed.update(failed_robots(fault, seed, scenario).tolist())
    if len(removed) == scenario.n_robots:
        raise SetupError(
            f"faults remove all {scenario.n_robots} robots at 0 s: should leave at least one to "
            "begin with"
        )
