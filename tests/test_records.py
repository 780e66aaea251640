from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, ClassVar

import pytest
from pydantic import Field, PositiveFloat

from swarm_logistics_env.errors import PolicyError, SwarmLogisticsError
from swarm_logistics_env.records import Record, read_table


class Lamp(Record):
    error_type: ClassVar[type[SwarmLogisticsError]] = PolicyError

    power: float = Field(5.0, gt=0)
    colours: tuple[str, ...] = ("red",)
    name: str
    sizes: Annotated[tuple[PositiveFloat, ...], Field(min_length=2)] = (1.0, 2.0)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"power": -1.0}, r"^Lamp.power = -1.0: should be greater than 0$"),
        ({"powr": 3}, r"Lamp has no field 'powr'; did you mean 'power'\?"),
        ({"xyz": 3}, "Lamp has no field 'xyz'; known: colours, name, power, sizes"),
        ({"colours": ("red", 7)}, r"Lamp.colours.1 = 7: "),
        ({"colours": "red"}, r"^Lamp.colours = 'red': should be a list$"),
        ({"sizes": [1.0]}, r"^Lamp.sizes = \[1.0\]: should have at least 2 items$"),
        ({"sizes": [1.0, -1.0]}, r"^Lamp.sizes.1 = -1.0: should be greater than 0; Lamp.sizes = "),
        ({"power": "x" * 10_000}, r"^Lamp.power = .{,200}$"),
    ],
)
def test_what_is_wrong_is_named_in_an_error_of_the_records_own_type(
    fields: dict[str, Any], said: str
) -> None:
    with pytest.raises(PolicyError, match=said):
        Lamp(name="a", **fields)
    with pytest.raises(PolicyError, match=said):
        Lamp(name="b").replace(**fields)
    with pytest.raises(PolicyError, match=r"^Lamp\.name is missing$"):
        Lamp()  # type: ignore[call-arg]


def test_json_there_and_back() -> None:
    lamp = Lamp(power=0.1, colours=("a", "b"), name="a")
    assert Lamp.from_json(lamp.to_json()) == Lamp.from_json(lamp.to_json().encode()) == lamp
    assert lamp.replace(name="b") == Lamp(power=0.1, colours=("a", "b"), name="b")
    for text in ("nonsense", '{"power": 0}', '{"colour": 1}'):
        with pytest.raises(PolicyError, match="Lamp"):
            Lamp.from_json(text)


TABLES = {"lamp.toml": 'name = "Grün"\r\n', "lamp.json": '{"name": "Grün"}\r\n'}


@pytest.mark.parametrize("name", TABLES)
def test_a_table_is_read_as_editors_save_it_or_told_how_to_save(name: str, tmp_path: Path) -> None:
    file = tmp_path / name
    for encoding in ("utf-8", "utf-8-sig"):
        file.write_text(TABLES[name], encoding=encoding, newline="")
        assert read_table(file, "lamp", PolicyError) == {"name": "Grün"}
    for encoding in ("utf-16", "utf-16-le", "utf-16-be", "utf-32", "cp1252", "cp437"):
        file.write_text(TABLES[name], encoding=encoding, newline="")
        said = rf"^the lamp .*{name} is not UTF-8 text: save it as UTF-8$"
        with pytest.raises(PolicyError, match=said):
            read_table(file, "lamp", PolicyError)
