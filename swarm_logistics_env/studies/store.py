"""Store: one SQLite file per study, one transaction per finished run; its export to one file."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.records import becoming
from swarm_logistics_env.tasks.task import Outcome

from .database import Database, FullDiskError
from .runs import Run

if TYPE_CHECKING:
    import pandas as pd


FILE_NAME = "study.sqlite"

_RESULT = (
    "delivered, delivery_times, ended_at, all_delivered, failed_robots, anchoring_seconds, digest"
)
_CLASH = f"""
SELECT run, seed FROM main.runs JOIN (SELECT run, {_RESULT} FROM other.runs WHERE error IS NULL)
    AS theirs USING (run)
WHERE error IS NULL AND ({", ".join(f"runs.{name}" for name in _RESULT.split(", "))})
    IS NOT ({", ".join(f"theirs.{name}" for name in _RESULT.split(", "))})
"""
_ABSORB = (
    "INSERT OR IGNORE INTO main.conditions SELECT * FROM other.conditions",
    """DELETE FROM main.runs
    WHERE error IS NOT NULL AND run IN (SELECT run FROM other.runs WHERE error IS NULL)""",
    "INSERT OR IGNORE INTO main.runs SELECT * FROM other.runs",
)

_ROWS = """
SELECT run, condition, policy, policy_identity, code, seed, delivered, ended_at, all_delivered,
       anchoring_seconds, digest, failed_robots, delivery_times, scenario, faults, behaviour, error
FROM runs JOIN conditions USING (condition) ORDER BY run
"""


class Store(Database):
    """The finished runs of a study. A run is kept from the moment that `add` returns.

    Args:
        path: the file, made where it is missing; None: kept in memory only.
        read_only: write nothing, neither into the file nor beside it.

    Raises:
        StudyError: the file is not a store, or its schema is not this version's.
    """

    @classmethod
    def existing(cls, directory: Path) -> Self:
        """Open the store of a study that was run before; to read, where it may not be written.

        Raises:
            StudyError: there is none.
        """
        path = directory / FILE_NAME
        if not path.is_file():
            raise StudyError(f"no study in {directory}: there is no file {path}")
        if os.access(path, os.W_OK) and os.access(directory, os.W_OK):
            with contextlib.suppress(FullDiskError):  # which it can be read on
                return cls(path)
        return cls(path, read_only=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def add(self, run: Run, outcome: Outcome) -> None:
        """Keep a finished run; one that failed before is replaced, one that succeeded stays."""
        condition = run.condition
        result: tuple[object, ...] = (
            outcome.delivered,
            outcome.delivery_times.astype("<f8").tobytes() if outcome.untimed is None else None,
            outcome.ended_at,
            int(outcome.all_delivered),
            json.dumps(outcome.failed_robots),
            outcome.anchoring_seconds,
            outcome.digest,
        )
        if outcome.untimed is not None and outcome.digest is None:  # nothing but P is known
            result = (outcome.untimed, *(None,) * 6)
        if outcome.error is not None:
            result = (None,) * len(result)
        conditions = (
            condition.key,
            condition.policy.label,
            condition.policy.identity,
            condition.scenario_json,
            condition.faults_json,
            condition.behaviour,
        )
        runs = (
            run.key, condition.key, run.code, run.seed, *result, outcome.error, outcome.wall_seconds
        )  # fmt: skip
        with self.transaction() as write:
            write("INSERT OR IGNORE INTO conditions VALUES (?, ?, ?, ?, ?, ?)", conditions)
            write("DELETE FROM runs WHERE run = ? AND error IS NOT NULL", (run.key,))
            write("INSERT OR IGNORE INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", runs)

    def __len__(self) -> int:
        return self.number("SELECT count(*) FROM runs")

    def absorb(self, path: Path) -> None:
        """Add the runs of another store, to which `add`'s rule applies.

        Raises:
            StudyError: the file is not a store, or has another result of a run that is here.
        """
        with self.attached(path), self.transaction() as write:
            for clash in self.read(_CLASH):
                raise StudyError(
                    f"{path} has another result than the stores before it for the run "
                    f"{clash['run']} (seed {clash['seed']}), of the same scenario, policy and code"
                )
            for statement in _ABSORB:
                write(statement)

    def succeeded(self) -> set[str]:
        """Return the keys of the runs that need not run again."""
        rows = self.read("SELECT run FROM runs WHERE error IS NULL")
        return {row["run"] for row in rows}

    def outcomes(self, runs: Iterable[Run]) -> dict[str, Outcome]:
        """Return the outcomes of those of `runs` that finished, by key."""
        wanted = {run.key for run in runs}
        rows = self.read(f"SELECT run, {_RESULT}, error, wall_seconds FROM runs")
        with self._sound():
            return {row["run"]: _outcome(row) for row in rows if row["run"] in wanted}

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield every stored run as one flat row, sorted by key, without wall times.

        `delivery_times` is a list [s]; the fields of a result are None where the run failed.
        """
        with self._sound():
            for row in map(dict, self.read(_ROWS)):
                if row["delivery_times"] is not None:
                    row["delivery_times"] = _times(row["delivery_times"], row["delivered"]).tolist()
                yield row

    def note(self, notes: Mapping[str, str]) -> None:
        """Note facts about the study, by name; earlier ones of these names are replaced."""
        with self.transaction() as write:
            for row in notes.items():
                write("INSERT OR REPLACE INTO notes VALUES (?, ?)", row)

    def notes(self) -> dict[str, object]:
        """Return what was noted about the study, by name."""
        rows = self.read("SELECT name, value FROM notes")
        return {row["name"]: row["value"] for row in rows}

    @contextmanager
    def _sound(self) -> Iterator[None]:
        try:
            yield
        except (KeyError, OverflowError, TypeError, ValueError) as error:
            raise StudyError(
                f"the store {self.path} is damaged: a run in it does not read ({error!r})"
            ) from error


def _outcome(row: Any) -> Outcome:
    if row["error"] is not None:
        return Outcome(row["run"], error=str(row["error"]), wall_seconds=float(row["wall_seconds"]))
    times, digest, anchoring = row["delivery_times"], row["digest"], row["anchoring_seconds"]
    untimed = _performance(row["delivered"]) if times is None else None
    if times is None and digest is None:  # nothing but P is known
        return Outcome(row["run"], untimed=untimed)
    return Outcome(
        row["run"],
        delivery_times=np.empty(0) if times is None else _times(times, row["delivered"]),
        ended_at=float(row["ended_at"]),
        all_delivered=bool(row["all_delivered"]),
        failed_robots=tuple(json.loads(row["failed_robots"])),
        anchoring_seconds=None if anchoring is None else float(anchoring),
        digest=None if digest is None else str(digest),
        wall_seconds=float(row["wall_seconds"]),
        untimed=untimed,
    )


def _performance(number: object) -> float:
    if not isinstance(number, int | float) or not 0 <= number < float("inf"):
        raise ValueError(f"delivered = {number!r}")
    return number


def _times(blob: bytes, delivered: object) -> NDArray[np.float64]:
    """Return the delivery times that a row holds, if they are what `add` can have written."""
    times = np.frombuffer(blob, dtype="<f8")
    if len(times) != _performance(delivered):
        raise ValueError(f"{len(times)} delivery times of {delivered} items")
    if not (np.isfinite(times).all() and (np.diff(times, prepend=0.0) >= 0.0).all()):
        raise ValueError("delivery times that do not rise")
    return times


def refuse_study_in(out: Path, way: str) -> None:
    """Raise StudyError if `out` holds a study; `way`, e.g. "merge", says what was to be done."""
    if (out / FILE_NAME).exists():
        raise StudyError(f"{out} holds a study already: {way} into a new directory")


@contextmanager
def new_store(out: Path) -> Iterator[Store]:
    """Yield an empty store; what was written into it is that of `out` once the block ends well.

    Killed or failed before, it leaves nothing that looks like a store.

    Raises:
        StudyError: `out` cannot be written.
    """
    unfinished = out / f"{FILE_NAME}.unfinished"
    try:
        out.mkdir(parents=True, exist_ok=True)
        unfinished.unlink(missing_ok=True)
    except OSError as error:
        raise StudyError(f"cannot write to {out}: {error.strerror}") from error
    try:
        with Store(unfinished) as store:
            yield store
        unfinished.rename(out / FILE_NAME)
    finally:
        for left in out.glob(f"{unfinished.name}*"):
            left.unlink()


def export(store: Store, path: Path) -> tuple[int, str]:
    """Write every stored run, sorted by key, without wall times, as CSV.

    Returns:
        How many runs, and the SHA-256 of the file.

    Raises:
        StudyError: another suffix, or the file cannot be written.
    """
    import pandas as pd

    if path.suffix != ".csv":
        raise StudyError(f"cannot export to {path}: should end in .csv")
    runs = pd.DataFrame(store.rows(), dtype=object)
    if not runs.empty:
        runs["delivery_times"] = runs["delivery_times"].map(
            lambda times: " ".join(map(repr, times)), na_action="ignore"
        )
    write_csv(path, runs)
    return len(runs), hashlib.sha256(path.read_bytes()).hexdigest()


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table as CSV with Unix line ends; floats in shortest exact form.

    Raises:
        StudyError: the file cannot be written.
    """
    with becoming(path, StudyError) as part:
        table.to_csv(part, index=False, lineterminator="\n")
