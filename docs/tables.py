"""Blocks of a page between markers, and Markdown tables to put there."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Container, Mapping, Sequence

from pydantic_core import PydanticUndefined

from swarm_logistics_env.records import Record
from swarm_logistics_env.scenario import Scenario

BLOCK = "<!-- tables: {name} -->"
END = "<!-- end of tables -->"


def block_of(text: str, name: str) -> str:
    """Return what stands between the markers of a block.

    Raises:
        SystemExit: the page has no such block.
    """
    _, found, rest = text.partition(BLOCK.format(name=name))
    block, ended, _ = rest.partition(END)
    if not (found and ended):
        raise SystemExit(f"the page has no {BLOCK.format(name=name)} followed by {END}")
    return block.strip()


def rewritten(text: str, blocks: Mapping[str, str]) -> str:
    """Return a page with other text between the markers of each block.

    Raises:
        SystemExit: a block has no pair of markers.
    """
    for name, block in blocks.items():
        block_of(text, name)  # it is there
        before, start, rest = text.partition(BLOCK.format(name=name))
        text = f"{before}{start}\n\n{block}\n\n{END}{rest.partition(END)[2]}"
    return text


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
