"""Commands as arrays, whatever library they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.errors import CommandError


def as_array(given: ArrayLike, name: str) -> NDArray[Any]:
    """Return what was given as an array, of whatever shape and dtype it has.

    Args:
        given: an array, a list, a tensor on the CPU, ...
        name: what it is, for errors.

    Raises:
        CommandError: NumPy cannot read it, as a tensor of bfloat16, on a GPU or with a gradient;
            names its type, dtype and device.
    """
    try:
        return np.asarray(given)
    except Exception as error:  # tensors raise TypeError, RuntimeError, NotImplementedError, ...
        traits = [f"{trait} {getattr(given, trait)}" for trait in _TRAITS if hasattr(given, trait)]
        kind = ", ".join([f"type {type(given).__name__}", *traits])
        reason = str(error).strip().partition("\n")[0]
        raise CommandError(
            f"{name} ({kind}) cannot be read: should be numbers that numpy.asarray takes, which "
            f"says: {reason}"
        ) from error


def gathered(
    actions: Mapping[str, ArrayLike],
    agents: Sequence[str],
    possible_agents: Sequence[str],
    wanted: tuple[int, ...],
) -> NDArray[np.float64]:
    """Return the commands of `agents`, in their order, as rows of one array.

    Args:
        actions: agent -> command; those of other possible agents are ignored.
        agents: whose commands are wanted.
        possible_agents: who may be named in `actions`.
        wanted: the shape of one command.

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
        _check_names(actions, agents, possible_agents)
    rows: list[Any] = [actions[agent] for agent in agents]
    if not all(type(row) is np.ndarray and row.shape == wanted for row in rows):  # seldom
        rows = [as_array(row, f"command of {agent!r}") for agent, row in zip(agents, rows)]
        for agent, row in zip(agents, rows):
            if row.shape != wanted:
                raise CommandError(f"command of {agent!r} of shape {row.shape}: should be {wanted}")
    try:
        # To concatenate is several times as fast as an array of arrays; numbers cannot be.
        given = np.concatenate(rows) if wanted else np.array(rows)
    except TypeError as error:
        raise CommandError(f"commands should be numbers: {error}") from error
    if given.dtype.kind not in "fiub":
        raise CommandError(f"commands should be numbers: real ones, not {given.dtype}")
    return given.reshape(len(rows), *wanted).astype(np.float64)


def _check_names(
    actions: Mapping[str, ArrayLike], agents: Sequence[str], possible_agents: Sequence[str]
) -> None:
    possible = set(possible_agents)
    for agent in actions:
        if agent not in possible:
            raise CommandError(
                f"a command for {agent!r}, who is not there: should be among {len(possible)} "
                f"possible agents, {possible_agents[0]} to {possible_agents[-1]}"
            )
    for agent in agents:
        if agent not in actions:
            raise CommandError(f"no command for {agent!r}: should be one for every agent")


_TRAITS = ("dtype", "device", "requires_grad")
