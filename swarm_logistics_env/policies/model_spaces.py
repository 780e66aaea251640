"""Whether the rows that a model reads, and what it gives, are those of the warehouse."""

from __future__ import annotations

from typing import Any

from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.world.motion.actions import ACTIONS, MOTION_ACTIONS
from swarm_logistics_env.world.motion.frame import OUTPUTS
from swarm_logistics_env.world.motion.network_inputs import INPUTS
from swarm_logistics_env.world.observations import N_COLUMNS, N_NEIGHBOURS


def width_of(part: object) -> int | None:
    """Return how many numbers a network or a normalizer reads of each row; None: unknown."""
    width: int | None = getattr(part, "width", None)
    return width


def check_width(about: str, width: int | None, frame: bool) -> None:
    """Check that a row of as many numbers is met where a network will play.

    Args:
        about: what reads such rows.
        width: of a row; None: any.
        frame: as `policies.of`.

    Raises:
        PolicyError: it is not.
    """
    if width is None or (frame and width == len(INPUTS)):
        return
    if frame:
        raise PolicyError(
            f"{about} takes rows of shape {(width,)}: with frame=True, or --frame, should be "
            f"{len(INPUTS)} inputs, as MotionFrame makes them"
        )
    if width == len(INPUTS):
        raise PolicyError(
            f"{about} takes rows of shape {(width,)} and not {(N_COLUMNS,)}, so it learned through "
            "MotionFrame: should be read with frame=True, or --frame"
        )
    if not _is_observation(width):
        raise PolicyError(
            f"{about} takes rows of shape {(width,)}: should be {(N_COLUMNS,)}, as observations "
            f"without messages, or with frame=True {(len(INPUTS),)}; wrappers in which it learned "
            "are named by --env, or policies.within"
        )


def _is_observation(width: int) -> bool:
    """Return whether an observation can have as many numbers, with messages or without."""
    return width >= N_COLUMNS and (width - N_COLUMNS) % N_NEIGHBOURS == 0


def check_statistics(width: int | None, network_width: int | None, frame: bool) -> None:
    """Check that statistics of rows are of those that a network reads; None: of any width.

    Raises:
        PolicyError: they are of others.
    """
    expected = len(INPUTS) if frame else network_width
    if width is None or width == expected:
        return
    if expected is not None or not _is_observation(width):
        raise PolicyError(
            f"normalize: its statistics have shape {(width,)}, and rows here "
            f"{(expected or N_COLUMNS,)}: should be those that were saved with the network, which "
            f"have {(len(INPUTS),)} with frame=True, or --frame"
        )


def check_spaces(about: str, model: Any, frame: bool) -> None:
    """Check that a model of stable-baselines3 maps what it will be given to what is taken.

    Raises:
        PolicyError: it does not.
    """
    rows = model.observation_space.shape
    commands = model.action_space.shape
    if rows is not None and len(rows) == 1:
        check_width(about, rows[0], frame)
    if rows is None or commands is None:
        raise PolicyError(
            f"{about} maps {model.observation_space} to {model.action_space}: should map a row of "
            "observations, in one Box, to a row of commands or to one number"
        )
    n_actions = getattr(model.action_space, "n", None)
    is_number = commands == () and n_actions == len(MOTION_ACTIONS if frame else ACTIONS)
    is_box = hasattr(model.action_space, "low") and len(commands) == 1
    n_messages = commands[0] - 4 if is_box and not frame else 0
    expected = (len(INPUTS),) if frame else (N_COLUMNS + N_NEIGHBOURS * n_messages,)
    taken = (len(OUTPUTS),) if frame else (4 + n_messages,)
    is_taken = is_number or (is_box and n_messages >= 0 and commands == taken)
    if rows != expected or not is_taken:
        raise PolicyError(
            f"{about} maps observations {rows} to {model.action_space}: should map "
            f"({N_COLUMNS},) to (4,), or through MotionFrame ({len(INPUTS)},) to "
            f"({len(OUTPUTS)},), or to one of {len(ACTIONS)} or {len(MOTION_ACTIONS)} actions of "
            "DiscreteActions; wrappers in which it learned are named by --env, or policies.within"
        )
