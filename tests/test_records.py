from __future__ import annotations

from typing import Annotated, Any, ClassVar

import pytest
from pydantic import Field, PositiveFloat

from swarm_logistics_env.errors import PolicyError, SwarmLogisticsError
from swarm_logistics_env.records import Record


class Lamp(Record):
    error_type: ClassVar[type[SwarmLogisticsError]] = PolicyError

    power: float = Field(5.0, gt=0)
    colours: tuple[str, ...] = ("red",)
    name: str | None = None
    sizes: Annotated[tuple[PositiveFloat, ...], Field(min_length=2)] = (1.0, 2.0)


class Switch(Record):
    number: int


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"power": -1.0}, r"^Lamp.power = -1.0: should be greater than 0$"),
        ({"powr": 3}, r"Lamp has no field 'powr'; did you mean 'power'\?"),
        ({"xyz": 3}, "Lamp has no field 'xyz'; known: colours, name, power, sizes"),
        ({"colours": ("red", 7)}, r"Lamp.colours.1 = 7: "),
        ({"colours": "red"}, r"^Lamp.colours = 'red': should be a list$"),
        ({"sizes": [1.0]}, r"^Lamp.sizes = \[1.0\]: should have at least 2 items$"),
        # The item that is wrong, and not that without it the list is too short.
        ({"sizes": [1.0, -1.0]}, r"^Lamp.sizes.1 = -1.0: should be greater than 0$"),
    ],
)
def test_what_is_wrong_is_named_in_an_error_of_the_records_own_type(
    fields: dict[str, Any], said: str
) -> None:
    with pytest.raises(PolicyError, match=said):
        Lamp(**fields)
    with pytest.raises(SwarmLogisticsError, match=r"^Switch\.number is missing$"):
        Switch()  # type: ignore[call-arg]
    with pytest.raises(PolicyError) as refused:
        Lamp(power="x" * 10_000)  # type: ignore[arg-type]
    assert len(str(refused.value)) < 300


def test_replace_is_validated_like_a_new_record() -> None:
    lamp = Lamp(power=2.0)
    assert lamp.replace(name="a") == Lamp(power=2.0, name="a")
    assert lamp.name is None
    with pytest.raises(PolicyError, match="power = 0"):
        lamp.replace(power=0)
    with pytest.raises(PolicyError, match="no field 'nam'"):
        lamp.replace(nam="b")


def test_json_there_and_back() -> None:
    lamp = Lamp(power=0.1, colours=("a", "b"))
    assert Lamp.from_json(lamp.to_json()) == lamp
    assert Lamp.from_json(lamp.to_json().encode()) == lamp
    for text in ("nonsense", '{"power": 0}', '{"colour": 1}'):
        with pytest.raises(PolicyError, match="Lamp"):
            Lamp.from_json(text)
