"""The orders that the page may give to a session."""

from __future__ import annotations

import json
from collections.abc import Callable

from pydantic import ConfigDict, ValidationError, validate_call

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.watch.session import Session
from swarm_logistics_env.watch.web.keys import press

_checked = validate_call(config=ConfigDict(strict=True, arbitrary_types_allowed=True))
# Orders by name; the rest of an order is the arguments, which have to be of the right types.
_ORDERS: dict[str, Callable[..., object]] = {
    "press": _checked(press),
    "select": _checked(Session.select),
    "toggle": _checked(Session.toggle_robot),
    "choose": _checked(Session.choose_mode),
    "resize": _checked(Session.resize),
    "widen": _checked(Session.set_delivery_width),
}


def obey(session: Session, text: bytes) -> None:
    """Do what an order, a JSON object such as {"do": "toggle", "robot": 3}, says.

    Raises:
        SetupError, FaultError: it says nothing that can be done.
    """
    try:
        arguments = json.loads(text, parse_constant=_refuse)
        act = _ORDERS[arguments.pop("do")]
    except (ValueError, RecursionError, LookupError, TypeError, AttributeError):
        raise SetupError(
            f'order: should be a JSON object whose "do" is one of {", ".join(_ORDERS)}'
        ) from None
    try:
        act(session, **arguments)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise SetupError(f"order {where}: {first['msg']}") from None


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no JSON")
