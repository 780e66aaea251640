from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any, ClassVar

import pytest
from pydantic import Field, JsonValue, PositiveFloat, PositiveInt

from swarm_logistics_env.core.errors import PolicyError, SwarmLogisticsError
from swarm_logistics_env.core.records import (
    Record,
    atomic_write,
    canonical_json,
    file_name,
    has_control_signs,
    plain,
    read_table,
    remove_parts,
)


class Lamp(Record):
    error_type: ClassVar[type[SwarmLogisticsError]] = PolicyError

    power: float = Field(5.0, gt=0)
    colours: tuple[str, ...] = ("red",)
    name: str
    sizes: Annotated[tuple[PositiveFloat, ...], Field(min_length=2)] = (1.0, 2.0)
    watts: PositiveInt | Annotated[tuple[int, ...], Field(min_length=1)] | None = None
    is_on: bool = True
    notes: dict[str, JsonValue] = Field(default_factory=dict)
    share: float = Field(0.5, ge=0.25, le=0.75)


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"power": -1.0}, r"^Lamp.power = -1.0: should be greater than 0$"),
        ({"powr": 3}, r"Lamp has no field 'powr'; did you mean 'power'\?"),
        ({"xyz": 3}, "Lamp has no field 'xyz'; known: colours, is_on, name, notes, power, share"),
        ({"power ": 3}, r"Lamp has no field 'power '; did you mean 'power'\?"),
        ({"lamp.power": 3}, r"Lamp has no field 'lamp.power'; did you mean 'power'\?"),
        ({"power": True}, "^Lamp.power = True: should have a number, not a bool$"),
        ({"watts": [5, False]}, r"^Lamp.watts = \[5, False\]: should have a number, not a bool$"),
        ({"sizes": (True, 2)}, "^Lamp.sizes = .*: should have a number, not a bool$"),
        ({"colours": ("red", 7)}, "^Lamp.colours.1 = 7: should be a text$"),
        ({"colours": "red"}, r"^Lamp.colours = 'red': should be a list$"),
        ({"sizes": [1.0]}, r"^Lamp.sizes = \[1.0\]: should have at least 2 items$"),
        ({"sizes": [1.0, -1.0]}, r"^Lamp.sizes.1 = -1.0: should be greater than 0; Lamp.sizes = "),
        ({"power": "x" * 10_000}, rf"^Lamp.power = '{'x' * 76}\.\.\.: should be a number$"),
        ({"power": "x" * 78}, rf"^Lamp.power = '{'x' * 78}': should be a number$"),
        ({"power": [1]}, r"^Lamp.power = \[1\]: should be a number$"),
        ({"is_on": "maybe"}, "^Lamp.is_on = 'maybe': should be true or false$"),
        ({"is_on": [1]}, r"^Lamp.is_on = \[1\]: should be true or false$"),
        ({"watts": 1.5}, "^Lamp.watts = 1.5: should be a whole number, or be a list$"),
        ({"watts": "x"}, "^Lamp.watts = 'x': should be a whole number, or be a list$"),
        ({"watts": ()}, r"^Lamp.watts = \(\): should be a whole number, or have at least 1 item$"),
        ({"share": -0.1}, "^Lamp.share = -0.1: should be at least 0.25$"),
        ({"share": 2.0}, "^Lamp.share = 2.0: should be at most 0.75$"),
        (
            {"notes": {"a": ["b", "\x1b"]}},
            r"^Lamp.notes.a.1 = '\\x1b': should be plain text, witho",
        ),
        (
            {"notes": {"a\x07": 1}},
            r"^Lamp.notes = 'a\\x07': should be plain text, without control s",
        ),
        ({"notes": {"\x07": ("\u202e",)}}, r"^Lamp.notes.\\x07.0 = '\\u202e': should be plain"),
    ],
)
def test_what_is_wrong_is_named_in_an_error_of_the_records_own_type(
    fields: dict[str, Any], reason: str
) -> None:
    with pytest.raises(PolicyError, match=reason):
        Lamp(name="a", **fields)
    with pytest.raises(PolicyError, match=reason):
        Lamp(name="b").replace(**fields)
    with pytest.raises(PolicyError, match=r"^Lamp\.name is missing$"):
        Lamp()  # type: ignore[call-arg]


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("a b", "a b"),
        ("Grün → 1\xa0m", "Grün → 1\xa0m"),
        ("a\nb\t", r"a\nb\t"),
        ("\x1b[31m", r"\x1b[31m"),
        ("\u202e\u2028\u2029\udc80\xad", r"\u202e\u2028\u2029\udc80\xad"),
    ],
)
def test_signs_that_steer_a_terminal_are_shown_as_escapes(text: str, shown: str) -> None:
    assert plain(text) == shown
    assert has_control_signs(text) is (text != shown)
    assert not has_control_signs(shown)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("a b/ü?c", "a-b-c"),
        ("..a.b-", "a.b"),
        ("-_A9", "_A9"),
        ("ü", "unnamed"),
        ("", "unnamed"),
        ("x" * 99, "x" * 80),
    ],
)
def test_any_text_becomes_the_name_of_a_file(text: str, name: str) -> None:
    assert file_name(text) == name


def test_equal_values_are_one_json_text() -> None:
    assert canonical_json({"b": [1, 2.5], "a": "ü"}) == r'{"a":"\u00fc","b":[1,2.5]}'


def test_a_bool_stays_one_where_it_may_be() -> None:
    lamp = Lamp(name="a", is_on=False, notes={"new": True})
    assert Lamp.from_json(lamp.to_json()) == lamp
    with pytest.raises(PolicyError, match="watts = True: should have a number"):
        Lamp.from_json('{"name": "a", "watts": true}')


def test_json_there_and_back() -> None:
    lamp = Lamp(power=0.1, colours=("a", "b"), name="a")
    assert Lamp.from_json(lamp.to_json()) == Lamp.from_json(lamp.to_json().encode()) == lamp
    assert lamp.replace(name="b") == Lamp(power=0.1, colours=("a", "b"), name="b")
    reasons = {
        "nonsense": "Lamp: ",
        "[" * 100_000: "Lamp: ",
        '{"colour": 1}': "Lamp has no field 'colour'",
        '{"power": 0}': "Lamp.power = 0: ",
    }
    for text, reason in reasons.items():
        with pytest.raises(PolicyError, match=reason):
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
        reason = rf"^the lamp .*{name} is not UTF-8 text: save it as UTF-8$"
        with pytest.raises(PolicyError, match=reason):
            read_table(file, "lamp", PolicyError)


def test_a_file_that_holds_a_list_is_no_table(tmp_path: Path) -> None:
    file = tmp_path / "lamps.json"
    file.write_text('[{"name": "a"}]')
    with pytest.raises(PolicyError, match=r"^the lamp .*json should hold a table of fields$"):
        read_table(file, "lamp", PolicyError)


WRITE = """
import sys
from pathlib import Path
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.records import atomic_write

for number in range(200):
    with atomic_write(Path("x.csv"), PolicyError) as part:
        with part.open("w") as file:
            for _ in range(100):
                file.write(sys.argv[1])
"""


def test_processes_that_write_one_file_at_once_all_succeed(tmp_path: Path) -> None:
    command = [sys.executable, "-c", WRITE]
    writing = [subprocess.Popen([*command, sign], cwd=tmp_path) for sign in "abcd"]
    assert [process.wait() for process in writing] == [0] * 4
    assert (tmp_path / "x.csv").read_text() in [100 * sign for sign in "abcd"]
    assert [path.name for path in tmp_path.iterdir()] == ["x.csv"]


WRITE_AND_DIE = """
import os, signal, sys
from pathlib import Path
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.records import atomic_write

with atomic_write(Path(sys.argv[1]), PolicyError) as part:
    part.with_name(f"{part.name}-journal").touch()
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.unmeasured
@pytest.mark.skipif(sys.platform == "win32", reason="locks of POSIX")
def test_what_a_killed_writer_left_is_removed_once_nobody_writes(tmp_path: Path) -> None:
    for name in ("x[1].csv", "x.csv", "x.csv"):
        command = [sys.executable, "-c", WRITE_AND_DIE, name]
        assert subprocess.run(command, cwd=tmp_path, check=False).returncode == -signal.SIGKILL
    assert len([*tmp_path.iterdir()]) == 4
    own_file = tmp_path / ".mine.csv"
    own_file.touch()
    with atomic_write(tmp_path / "x.csv", PolicyError) as part:
        assert {path.name[:5] for path in tmp_path.iterdir()} == {".x[1]", ".mine", part.name[:5]}
        with atomic_write(tmp_path / "x[1].csv", PolicyError), remove_parts(tmp_path):
            assert len([*tmp_path.glob(".x*")]) == 4  # somebody may be at work on them
    with remove_parts(tmp_path):
        assert {path.name for path in tmp_path.iterdir()} == {".mine.csv", "x.csv", "x[1].csv"}


@pytest.mark.skipif(sys.platform == "win32", reason="links and modes of POSIX")
def test_a_file_that_is_written_goes_through_no_link_and_has_the_usual_mode(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    victim = tmp_path / "victim"
    victim.write_text("mine")
    monkeypatch.setattr("secrets.token_hex", lambda length: "00")
    (tmp_path / ".x.00.part.csv").symlink_to(victim)
    (tmp_path / ".x.part.csv").symlink_to(victim)
    with (
        pytest.raises(PolicyError, match=r"cannot write .*x\.csv"),
        atomic_write(tmp_path / "x.csv", PolicyError) as part,
    ):
        part.write_text("theirs")
    monkeypatch.undo()
    before = os.umask(0o027)
    try:
        with atomic_write(tmp_path / "x.csv", PolicyError) as part:
            part.write_text("theirs")
    finally:
        os.umask(before)
    assert victim.read_text() == "mine"
    assert (tmp_path / "x.csv").stat().st_mode & 0o777 == 0o640
    assert (tmp_path / ".x.00.part.csv").is_symlink()  # and is not removed either


def test_a_block_that_fails_leaves_nothing_beside_the_older_file(tmp_path: Path) -> None:
    file = tmp_path / ("ü" * 100 + ".csv")
    file.write_text("older")

    def fail() -> None:
        with atomic_write(file, PolicyError) as part:
            assert part.suffix == ".csv"
            part.write_text("newer")
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert [path.read_text() for path in tmp_path.iterdir()] == ["older"]
