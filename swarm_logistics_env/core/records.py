"""The base of every validated record, and files that are written whole or not at all.

A record is frozen, has no unknown fields, and says in one sentence what is wrong.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import sys
import tomllib
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, get_args, get_origin

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from swarm_logistics_env.core.csv_cells import inert
from swarm_logistics_env.core.errors import SwarmLogisticsError, suggest

if sys.platform != "win32":
    import fcntl

if TYPE_CHECKING:
    import pandas as pd


@contextmanager
def atomic_write(path: Path, error_type: type[SwarmLogisticsError]) -> Iterator[Path]:
    """Give the path of an empty file beside `path`, of the same ending, which takes its place.

    Nobody else has that file, whoever writes `path` at the same time. If the block fails, an older
    file at `path` stays as it was, and nothing is left beside it. What a writer of `path` left who
    was killed is removed. What is no plain file, as /dev/stdout, is written itself.

    Raises:
        The `error_type`: the file cannot be written; names it and the reason.
    """
    is_plain = path.is_file() or not path.exists()
    target = path.resolve()  # a link stays a link
    stem = path.stem[:40]
    name = f".{stem}.{secrets.token_hex(8)}.part{path.suffix}"
    part = target.with_name(name) if is_plain else path
    # A store that is written has a journal beside it.
    parts = rf"\.{re.escape(stem)}\.[0-9a-f]{{16}}\.part{re.escape(path.suffix)}(-\w+)?"
    try:
        with remove_parts(target.parent, parts) if is_plain else nullcontext():
            if is_plain:  # with the usual rights, and never through a link
                os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            try:
                yield part
                if is_plain:
                    part.replace(target)
            finally:
                if is_plain:
                    part.unlink(missing_ok=True)
    except OSError as error:
        raise error_type(f"cannot write {path}: {error.strerror or error}") from error


@contextmanager
def remove_parts(folder: Path, parts: str = r"\..+\.[0-9a-f]{16}\.part.*") -> Iterator[None]:
    """Remove what writers left in a folder who were killed; nothing while anybody writes there.

    A writer holds a lock of the folder until it ends, or its process does; so does this block.
    Where there are no such locks, as on Windows, nothing is removed.

    Args:
        parts: a regular expression of the names of what is removed.
    """
    with ExitStack() as stack:
        if sys.platform != "win32":
            with suppress(OSError):  # no such folder, or no locks in it
                lock = os.open(folder, os.O_RDONLY)
                stack.callback(os.close, lock)
                with suppress(BlockingIOError):
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    _remove(path for path in folder.iterdir() if re.fullmatch(parts, path.name))
                fcntl.flock(lock, fcntl.LOCK_SH)
        yield


def _remove(files: Iterable[Path]) -> None:
    for file in files:
        with suppress(OSError):  # of somebody else
            file.unlink()


_LONGEST_NAME = 80  # of a file [characters]; with an ending it fits every file system


def write_csv(path: Path, table: pd.DataFrame, error_type: type[SwarmLogisticsError]) -> None:
    """Write a table as CSV with Unix line ends; floats in shortest exact form.

    A text that a spreadsheet would compute as a formula has an apostrophe before it, and a line in
    it ends in the Unix way, or it would end the row.

    Raises:
        The `error_type`: the file cannot be written.
    """
    texts = table.select_dtypes(exclude="number")
    harmless = texts.map(
        lambda cell: inert("\n".join(re.split(r"\r\n?", cell))) if isinstance(cell, str) else cell
    )
    with atomic_write(path, error_type) as part:
        table.assign(**harmless).to_csv(part, index=False, lineterminator="\n")


class Record(BaseModel):
    """A frozen, hashable set of named values, validated when it is made.

    Raises:
        The class's `error_type` (a `ValueError`), which names each bad field, its value and what
        would be right. For an unknown field it suggests the nearest known one. Text with signs that
        steer a terminal or a page (`has_control_signs`) is refused in every field, however deep.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True
    )
    error_type: ClassVar[type[SwarmLogisticsError]] = SwarmLogisticsError

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise self.error_type(self._sentence(error)) from None

    @model_validator(mode="before")
    @classmethod
    def _of_plain_text(cls, fields: object) -> object:
        for field, text in _texts(cls.__name__, fields):
            if has_control_signs(text):
                raise ValueError(
                    f"{field} = {_short(text)}: should be plain text, without control signs"
                )
        return fields

    @model_validator(mode="before")
    @classmethod
    def _truth_is_no_number(cls, fields: object) -> object:
        # Python and pydantic take True for 1; in TOML and JSON it is another kind of value.
        values = fields if isinstance(fields, dict) else {}
        for name, field in cls.model_fields.items():
            value = values.get(name)
            if _has_truth(value) and _is_of_numbers(field.annotation):
                raise ValueError(
                    f"{cls.__name__}.{name} = {_short(value)}: should have a number, not a bool"
                )
        return fields

    def replace(self, **fields: Any) -> Self:
        """Return a copy with `fields` changed, validated like a new record."""
        return type(self)(**{**dict(self), **fields})

    def to_json(self) -> str:
        """Return the record as JSON text; `from_json` reads it back unchanged."""
        return self.model_dump_json()

    @classmethod
    def from_json(cls, text: str | bytes) -> Self:
        """Return the record that `to_json` wrote.

        Raises:
            The class's `error_type` if `text` is not JSON or is not such a record.
        """
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise cls.error_type(cls._sentence(error)) from None

    @classmethod
    def _sentence(cls, error: ValidationError) -> str:
        # A value that may be of several kinds has a problem for each: "should be .., or be ..".
        wishes: dict[str, list[str]] = {}
        for sentence in dict.fromkeys(cls._problem(dict(problem)) for problem in error.errors()):
            subject, separator, wish = sentence.partition(": should ")
            wishes.setdefault(subject + separator, []).append(wish)
        return "; ".join(subject + ", or ".join(texts) for subject, texts in wishes.items())

    @classmethod
    def _problem(cls, problem: dict[str, Any]) -> str:
        # Parts such as "constrained-int", or "int" at the end, name a branch of a union.
        parts = [str(part) for part in problem["loc"]]
        if problem["type"] == "extra_forbidden" and len(parts) == 1:
            (unknown,) = parts
            return f"{cls.__name__} has no field {unknown!r}{suggest(unknown, cls.model_fields)}"
        names = [part for part in parts if part.isidentifier() or part.isdigit()]
        if parts and parts[-1] in _TYPES:
            names.pop()
        name = ".".join(names)
        field = f"{cls.__name__}.{name}" if name else cls.__name__
        message = _in_plain_words(problem)
        if message.startswith(f"{cls.__name__}"):
            return message
        if not name:
            return f"{field}: {message}"
        if problem["type"] == "missing":
            return f"{field} is missing"
        return f"{field} = {_short(problem['input'])}: {message}"


def one_of(record: type[Record]) -> Callable[[object], object]:
    """Return what makes a record of a table, and leaves anything else as it is."""
    # The record's own constructor raises errors that suggest the field that was meant.
    return lambda value: record(**value) if isinstance(value, dict) else value


def each_of(record: type[Record]) -> Callable[[object, ValidationInfo], object]:
    """Return what makes a tuple of records of a list of tables."""
    make = one_of(record)

    def build(values: object, info: ValidationInfo) -> object:
        if isinstance(values, dict):
            raise ValueError(f"should be a list of tables: [[{info.field_name}]] in a TOML file")
        return tuple(map(make, values)) if isinstance(values, list | tuple) else values

    return build


def read_table(path: Path, what: str, error_type: type[SwarmLogisticsError]) -> dict[str, Any]:
    """Return the table in a TOML file, or in a file whose name ends in .json.

    Args:
        what: names it in errors, e.g. "study file".

    Raises:
        The `error_type`: the file cannot be read, is neither, or holds no table.
    """
    kind, parse = ("JSON", json.loads) if path.suffix == ".json" else ("TOML", tomllib.loads)
    try:
        text = path.read_text(encoding="utf-8-sig")  # Windows' editors put a mark first
        if "\0" in text:  # UTF-16 without its mark
            raise UnicodeError
        table = parse(text)
    except OSError as error:
        raise error_type(f"cannot read the {what} {path}: {error.strerror}") from error
    except UnicodeError:
        raise error_type(f"the {what} {path} is not UTF-8 text: save it as UTF-8") from None
    except ValueError as error:  # of JSON and TOML
        reason = str(error).splitlines()[0]
        raise error_type(f"the {what} {path} is not {kind}: {reason}") from error
    except RecursionError:
        raise error_type(f"the {what} {path} is nested too deep") from None
    if not isinstance(table, dict):
        raise error_type(f"the {what} {path} should hold a table of fields")
    return table


def has_control_signs(text: str) -> bool:
    """Return whether a text has signs that steer a terminal or turn the direction of writing."""
    return not text.isprintable() and any(
        unicodedata.category(sign) in ("Cc", "Cf", "Cs", "Zl", "Zp") for sign in text
    )


def plain(text: str) -> str:
    """Return a text as a terminal may show it: signs that steer it are written as escapes."""
    return "".join(repr(sign)[1:-1] if has_control_signs(sign) else sign for sign in text)


def _texts(path: str, value: object) -> Iterator[tuple[str, str]]:
    """Yield every text in a value as JSON and TOML have it, names in tables too, after its path."""
    waiting = [(path, value)]  # no recursion: a file may be nested deep
    while waiting:
        match waiting.pop():
            case path, str() as text:
                yield path, text
            case path, dict() as table:
                waiting += [(path, name) for name in table]
                waiting += [(f"{path}.{plain(str(name))}", table[name]) for name in table]
            case path, list() | tuple() as values:
                waiting += [(f"{path}.{number}", part) for number, part in enumerate(values)]


# A name from a file that becomes part of a path: letters, digits, - and _, and points within.
FileName = Annotated[
    str, Field(pattern=r"^[A-Za-z0-9_-][A-Za-z0-9._-]*$", max_length=_LONGEST_NAME)
]


def file_name(text: str) -> str:
    """Return a `FileName` made of any text; other signs become hyphens."""
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", text).strip("-.")[:_LONGEST_NAME]
    return name or "unnamed"


def canonical_json(value: object) -> str:
    """Return JSON in one form: equal values give equal texts."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"))


_TYPES = ("bool", "float", "int", "str")
# By pydantic's names of problems; numbers are its limits.
_PLAIN_WORDS = {
    "tuple_type": "should be a list",
    "model_type": "should be a table of fields",
    "string_type": "should be a text",
    "bool_type": "should be true or false",
    "bool_parsing": "should be true or false",
    "float_type": "should be a number",
    "float_parsing": "should be a number",
    "int_type": "should be a whole number",
    "int_parsing": "should be a whole number",
    "int_from_float": "should be a whole number",
    "greater_than_equal": "should be at least {ge:.12g}",
    "less_than_equal": "should be at most {le:.12g}",
}


def _in_plain_words(problem: dict[str, Any]) -> str:
    if problem["type"] in _PLAIN_WORDS:
        return _PLAIN_WORDS[problem["type"]].format(**problem.get("ctx", {}))
    if problem["type"] == "too_short":
        least = problem["ctx"]["min_length"]
        noun = "item" if least == 1 else "items"
        return f"should have at least {least} {noun}"
    message = str(problem["msg"]).removeprefix("Value error, ")
    return re.sub("^(Input|String) should", "should", message)


def _has_truth(value: object) -> bool:
    """Return whether a value is a bool, or a list or tuple with one, however deep."""
    if isinstance(value, list | tuple):
        return any(map(_has_truth, value))
    return isinstance(value, bool)


def _is_of_numbers(annotation: Any) -> bool:
    """Return whether a field of this type takes numbers and, beside them, at most text or none."""
    kinds = set[Any]()
    waiting = [annotation]
    while waiting:
        kind = waiting.pop()
        is_annotated = get_origin(kind) is Annotated
        parts = get_args(kind)[:1] if is_annotated else get_args(kind)
        waiting += parts
        kinds |= set() if parts else {kind}
    return bool(kinds & {int, float}) and kinds <= {int, float, str, type(None), ...}


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
