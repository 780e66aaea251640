"""Rows of a store: what is written of a run, and the digest by which damage is seen."""

from __future__ import annotations

import hashlib
import json
from dataclasses import fields
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias

from pydantic import TypeAdapter

from swarm_logistics_env.core.records import canonical_json
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Case, Run
from swarm_logistics_env.world.warehouse.contacts import ContactMeasures
from swarm_logistics_env.world.warehouse.orders import OrderMeasures

_OUTCOME = TypeAdapter(Outcome)
_FIELDS = {field.name for field in fields(Outcome)} - {"wall_seconds"}
# Left out where they are missing: older rows have none of them.
OF_ORDERS = tuple(measure.name for measure in fields(OrderMeasures))
COUNTED = (*(measure.name for measure in fields(ContactMeasures)), *OF_ORDERS)
_OPTIONAL = (*COUNTED, "least")
_FOLLOWING = ("delivered", "longest_standstill", "stands_still")  # from an outcome
_DESCRIBED = {
    "policy", "policy_identity", "task", "scenario", "faults", "behaviour", "code", "seed"
}  # fmt: skip

Content: TypeAlias = tuple[str, str, int, str]  # key, run, whether it failed, outcome


class StoredRow(NamedTuple):
    """A row as it is in the file, where anything may be damaged."""

    rowid: int
    key: Any
    run: Any
    failed: Any
    outcome: Any
    wall_seconds: Any
    digest: Any

    @property
    def content(self) -> Content:
        """What its digest is of; the wall time is no part of the result."""
        return self.key, self.run, self.failed, self.outcome

    @property
    def is_sound(self) -> bool:
        """Whether it is as it was written; if it has no digest (None), whether it reads."""
        types = type(self.key), type(self.run), type(self.outcome)
        if types != (str, str, str) or self.failed not in (0, 1):
            return False
        if self.digest is not None:
            return bool(self.digest == row_digest(*self.content))
        try:
            case_of(self.run)
            return bool((outcome_of(self.outcome).error is not None) == self.failed)
        except ValueError:  # of JSON and of pydantic
            return False


def row_digest(*values: object) -> str:
    """Return the digest of a row's values, 64 hexadecimal digits."""
    texts = list(map(str, values))
    lengths = " ".join(map(str, map(len, texts)))
    return hashlib.sha256(f"{lengths}\n{''.join(texts)}".encode()).hexdigest()


def content_of(run: Run, outcome: Outcome) -> Content:
    """Return what a store keeps of a run and its outcome besides the wall time."""
    missing = {name for name in _OPTIONAL if getattr(outcome, name) is None}
    result = _OUTCOME.dump_json(outcome, exclude={"wall_seconds", *missing}).decode()
    before, after = _described(run.case, run.code)
    return run.key, f"{before}{run.seed}{after}", int(outcome.error is not None), result


@lru_cache(1000)
def _described(case: Case, code: str) -> tuple[str, str]:
    """Return what a store says of a case's runs besides their outcomes: JSON around the seed."""
    description = {
        "policy": case.policy.title,
        "policy_identity": case.identity,
        "task": case.task.name,
        "scenario": case.scenario.model_dump(mode="json"),
        "faults": [fault.model_dump(mode="json") for fault in case.faults],
        "behaviour": case.behaviour,
        "code": code,
        "seed": 0,
    }
    before, seed, after = canonical_json(description).rpartition('"seed":0')
    return before + seed[:-1], after


@lru_cache(256)  # trials that others recorded often have one of a few numbers
def outcome_of(text: str) -> Outcome:
    """Return the outcome that was stored.

    Raises:
        ValueError: it does not read, or a field is unknown or missing: P is never guessed.
    """
    outcome = _OUTCOME.validate_json(text, strict=True)
    # Unknown fields were refused; quotes within a text are escaped.
    if not all(f'"{name}":' in text for name in _FIELDS.difference(_OPTIONAL)):
        raise ValueError(f"an outcome should have the fields {sorted(_FIELDS)}")
    return outcome


def case_of(text: str) -> dict[str, Any]:
    """Return what is stored of a run besides its outcome.

    Raises:
        ValueError: it does not read, or a field is unknown or missing.
    """
    case = json.loads(text)
    if not isinstance(case, dict) or case.keys() != _DESCRIBED:
        raise ValueError(f"a run should have the fields {sorted(_DESCRIBED)}")
    return case


def record_of(row: StoredRow) -> dict[str, Any]:
    """Return a run and its outcome by name, as a table of runs has them; None: it has none.

    Raises:
        ValueError: as `case_of` and `outcome_of` raise it.
    """
    outcome = outcome_of(row.outcome)
    result = json.loads(row.outcome)
    result |= {name: result.get(name) for name in COUNTED}
    result |= {name: getattr(outcome, name) for name in _FOLLOWING}
    if outcome.error is not None:
        result = dict.fromkeys(result) | {"error": outcome.error}
    case = case_of(row.run)
    case |= {name: canonical_json(case[name]) for name in ("scenario", "faults")}
    return {"run": row.key, **case, **result}
