"""Episodes as Gymnasium's and stable-baselines3's Monitor writes them: a line of JSON, then CSV."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

from swarm_logistics_env.study.trials.column_name import ColumnName
from swarm_logistics_env.study.trials.table import Table
from swarm_logistics_env.study.trials.words import MEANING

from . import csv_text

_EPISODE = ("r", "l", "t")  # its reward, its length in steps, when it ended [s]


def read(path: Path, content: bytes, digest: str) -> Table | None:
    """Return the table of a Monitor's file, a row an episode; None: it is none.

    P is the reward of an episode, unless a column that was added means performance; the length and
    the time are left out.
    """
    first, _, rest = content.partition(b"\n")
    if not first.startswith(b"#{") or not rest.startswith(b"r,l,t"):
        return None
    try:
        environment = json.loads(first[1:]).get("env_id")
    except (ValueError, RecursionError):
        return None
    table = csv_text.read(path, rest, digest)
    chosen = [name for name in table.header if MEANING.get(ColumnName(name).bare) == "performance"]
    performance = chosen[0] if chosen else "r"
    of_environment = f" of {environment}" if environment else ""
    note = (
        f"These are episodes that a Monitor wrote{of_environment}: P "
        f"is {performance!r}; --column performance=NAME takes another."
    )
    return replace(
        table,
        lines=[line + 1 for line in table.lines],
        kind="episodes of a Monitor",
        meanings={"performance": performance},
        left_out=frozenset(_EPISODE),
        decimal=".",
        notes=(note,),
    )
