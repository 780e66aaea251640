"""The orders that the page may give to a session."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.watch.session import Session
from swarm_logistics_env.watch.web.keys import press


class _Order(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _Press(_Order):
    do: Literal["press"]
    key: Annotated[str, Field(max_length=20)]

    def obey(self, session: Session) -> None:
        press(session, self.key)


class _Select(_Order):
    do: Literal["select"]
    robot: int | None

    def obey(self, session: Session) -> None:
        session.select(self.robot)


class _Toggle(_Order):
    do: Literal["toggle"]
    robot: int

    def obey(self, session: Session) -> None:
        session.toggle_robot(self.robot)


class _Choose(_Order):
    do: Literal["choose"]
    mode: Annotated[str, Field(max_length=100)]

    def obey(self, session: Session) -> None:
        session.choose_mode(self.mode)


class _Resize(_Order):
    do: Literal["resize"]
    n_robots: int

    def obey(self, session: Session) -> None:
        session.resize(self.n_robots)


class _Widen(_Order):
    do: Literal["widen"]
    delivery_width: Annotated[float, Field(allow_inf_nan=False)]

    def obey(self, session: Session) -> None:
        session.set_delivery_width(self.delivery_width)


Order = Annotated[
    _Press | _Select | _Toggle | _Choose | _Resize | _Widen, Field(discriminator="do")
]
_ORDERS: TypeAdapter[Order] = TypeAdapter(Order)


def obey(session: Session, text: bytes) -> None:
    """Do what an order, a JSON object such as {"do": "toggle", "robot": 3}, says.

    Raises:
        SetupError, FaultError: it says nothing that can be done.
    """
    try:
        order = _ORDERS.validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise SetupError(f"order {where}: {first['msg']}") from None
    order.obey(session)
