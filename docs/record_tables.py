"""Markdown tables, those of a record's fields among them, for the pages that are generated."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Container, Sequence

from pydantic_core import PydanticUndefined

from swarm_logistics_env.records import Record
from swarm_logistics_env.scenario import Scenario


def fields(record: type[Record], leave_out: Container[str] = ()) -> str:
    """Return a table of a record's fields with their defaults and what its docstring says."""
    said = meanings(record)
    rows = [
        (f"`{name}`", default(record, name), said.get(name, ""))
        for name in record.model_fields
        if name not in leave_out
    ]
    return table(("field", "default", "meaning"), rows)


def default(record: type[Record], name: str) -> str:
    """Return a field's default as TOML has it; "needed" where there is none."""
    value = record.model_fields[name].get_default(call_default_factory=True)
    if value is PydanticUndefined:
        return "needed"
    if value is None or value == {} or value == ():
        return "none"
    if isinstance(value, Scenario):
        changed = {k: v for k, v in value.model_dump().items() if v != getattr(Scenario(), k)}
        return ", ".join(f"`{k} = {json.dumps(v)}`" for k, v in changed.items()) or "the paper's"
    if isinstance(value, Record):
        return "see below"
    if isinstance(value, tuple) and len(value) > 20:
        return f"all {len(value)}"
    return f"`{json.dumps(value, default=str)}`"


def meanings(record: type[Record]) -> dict[str, str]:
    """Return what the docstrings of a record and its bases say of each field."""
    found: dict[str, str] = {}
    for kind in reversed(record.__mro__):
        # Python 3.13 takes the indent of a docstring away by itself.
        _, _, text = inspect.cleandoc(vars(kind).get("__doc__") or "").partition("Args:\n")
        text, _, _ = text.partition("\n\n")
        for names, meaning in re.findall(
            r"^ {4}([\w, ]+): (.*(?:\n {8}.*)*)", text + "\n", flags=re.MULTILINE
        ):
            sentence = " ".join(meaning.split())
            found |= dict.fromkeys(names.split(", "), sentence)
    return found


def summary(documented: object) -> str:
    """Return the first paragraph of a docstring, on one line."""
    return " ".join((documented.__doc__ or "").split("\n\n")[0].split())


def table(head: tuple[str, ...], rows: Sequence[tuple[object, ...]]) -> str:
    """Return a Markdown table."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(str(cell) for cell in line)} |" for line in lines)
