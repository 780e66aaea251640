"""Store: one SQLite file per study, one transaction per finished run."""

from __future__ import annotations

import json
import os
import sqlite3
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import metadata
from swarm_logistics_env.studies.runs import Run
from swarm_logistics_env.tasks.task import Outcome

FILE_NAME = "study.sqlite"
SCHEMA_VERSION = 3
TIMEOUT = 60.0  # s, for other processes that write
APPLICATION_ID = 0x53574C47  # "SWLG": marks the file as ours

_SCHEMA = """
CREATE TABLE notes (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE conditions (
    condition TEXT PRIMARY KEY,
    policy TEXT NOT NULL,
    policy_identity TEXT NOT NULL,
    scenario TEXT NOT NULL,  -- JSON
    faults TEXT NOT NULL,    -- JSON
    behaviour INTEGER NOT NULL DEFAULT 0
) WITHOUT ROWID;
CREATE TABLE runs (
    run TEXT PRIMARY KEY,
    condition TEXT NOT NULL REFERENCES conditions,
    code TEXT NOT NULL,
    seed INTEGER NOT NULL,
    delivered INTEGER,           -- P, a REAL where a task measures fractions; NULL: the run failed
    delivery_times BLOB,         -- float64, little-endian [s]; NULL: no times are known
    ended_at REAL,               -- [s]
    all_delivered INTEGER,
    failed_robots TEXT,          -- JSON
    anchoring_seconds REAL,
    digest TEXT,                 -- of the trajectory; equal: the same run
    error TEXT,                  -- traceback
    wall_seconds REAL NOT NULL,
    UNIQUE (condition, code, seed)
) WITHOUT ROWID;
"""

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


class Store:
    """The finished runs of a study. A run is kept from the moment that `add` returns.

    Args:
        path: the file, made where it is missing; None: kept in memory only.
        read_only: write nothing, neither into the file nor beside it.

    Raises:
        StudyError: the file is not a store, or its schema is not this version's.
    """

    def __init__(self, path: Path | None, *, read_only: bool = False) -> None:
        self.path = path
        self._read_only = read_only
        place = str(path or ":memory:")
        if path is not None and read_only:
            _refuse_unmerged(path)
            # SQLite makes two files beside a database in WAL mode, even to read it, but for this.
            place = f"{path.absolute().as_uri()}?immutable=1"
        with self._explained():
            # Autocommit: transactions are opened by hand, one per run.
            self._database = sqlite3.connect(
                place, timeout=TIMEOUT, isolation_level=None, uri=read_only
            )
            try:
                self._prepare()
            except BaseException:
                self._database.close()
                raise

    @classmethod
    def existing(cls, directory: Path) -> Self:
        """Open the store of a study that was run before; to read, where it may not be written.

        Raises:
            StudyError: there is none.
        """
        path = directory / FILE_NAME
        if not path.is_file():
            raise StudyError(f"no study in {directory}: there is no file {path}")
        may_write = os.access(path, os.W_OK) and os.access(directory, os.W_OK)
        return cls(path, read_only=not may_write)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def add(self, run: Run, outcome: Outcome) -> None:
        """Keep a finished run; one that failed before is replaced, one that succeeded stays."""
        condition = run.condition
        failed = outcome.error is not None
        result: tuple[object, ...] = (
            outcome.delivered,
            outcome.delivery_times.astype("<f8").tobytes(),
            outcome.ended_at,
            int(outcome.all_delivered),
            json.dumps(outcome.failed_robots),
            outcome.anchoring_seconds,
            outcome.digest,
        )
        if outcome.untimed is not None:
            known = result[2:] if outcome.digest else (None,) * (len(result) - 2)
            result = (outcome.untimed, None, *known)
        with self._transaction():
            self._database.execute(
                "INSERT OR IGNORE INTO conditions VALUES (?, ?, ?, ?, ?, ?)",
                (
                    condition.key,
                    condition.policy.label,
                    condition.policy.identity,
                    condition.scenario_json,
                    condition.faults_json,
                    condition.behaviour,
                ),
            )
            self._database.execute(
                "DELETE FROM runs WHERE run = ? AND error IS NOT NULL", (run.key,)
            )
            self._database.execute(
                "INSERT OR IGNORE INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    run.key,
                    condition.key,
                    run.code,
                    run.seed,
                    *((None,) * len(result) if failed else result),
                    outcome.error,
                    outcome.wall_seconds,
                ),
            )

    def __len__(self) -> int:
        with self._explained():
            (count,) = self._database.execute("SELECT count(*) FROM runs").fetchone()
            return int(count)

    @property
    def size(self) -> int:
        """Size of the database [bytes]."""
        with self._explained():
            (pages,) = self._database.execute("PRAGMA page_count").fetchone()
            (page,) = self._database.execute("PRAGMA page_size").fetchone()
            return int(pages) * int(page)

    def absorb(self, path: Path) -> None:
        """Add the runs of another store, to which `add`'s rule applies.

        Raises:
            StudyError: the file is not a store, or has another result of a run that is here.
        """
        Store(path).close()  # is it one, of this schema?
        with self._explained():
            self._database.execute("ATTACH ? AS other", (str(path),))
        try:
            with self._transaction():
                clash = self._database.execute(_CLASH).fetchone()
                if clash is not None:
                    raise StudyError(
                        f"{path} has another result than the stores before it for the run "
                        f"{clash[0]} (seed {clash[1]}), of the same scenario, policy and code"
                    )
                for statement in _ABSORB:
                    self._database.execute(statement)
        finally:
            self._database.execute("DETACH other")

    def succeeded(self) -> set[str]:
        """Return the keys of the runs that need not run again."""
        with self._explained():
            rows = self._database.execute("SELECT run FROM runs WHERE error IS NULL")
            return {run for (run,) in rows}

    def outcomes(self, runs: Iterable[Run]) -> dict[str, Outcome]:
        """Return the outcomes of those of `runs` that finished, by key."""
        wanted = {run.key for run in runs}
        found = {}
        with self._explained(), self._sound():
            rows = self._database.execute(f"SELECT run, {_RESULT}, error, wall_seconds FROM runs")
            for run, *result, error, wall in rows:
                if run not in wanted:
                    continue
                count, times, ended_at, all_delivered, robots, anchoring, digest = result
                if error is not None:
                    found[run] = Outcome(run, error=str(error), wall_seconds=float(wall))
                    continue
                if times is None and digest is None:  # imported
                    found[run] = Outcome(run, untimed=_performance(count))
                    continue
                found[run] = Outcome(
                    run,
                    delivery_times=np.empty(0) if times is None else _times(times, count),
                    ended_at=float(ended_at),
                    all_delivered=bool(all_delivered),
                    failed_robots=tuple(json.loads(robots)),
                    anchoring_seconds=None if anchoring is None else float(anchoring),
                    digest=None if digest is None else str(digest),
                    wall_seconds=float(wall),
                    untimed=_performance(count) if times is None else None,
                )
        return found

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield every stored run as one flat row, sorted by key, without wall times.

        `delivery_times` is a list [s]; the fields of a result are None where the run failed.
        """
        with self._explained(), self._sound():
            cursor = self._database.execute(_ROWS)
            names = [column[0] for column in cursor.description]
            for values in cursor:
                row = dict(zip(names, values))
                if row["delivery_times"] is not None:
                    row["delivery_times"] = _times(row["delivery_times"], row["delivered"]).tolist()
                yield row

    def note(self, name: str) -> str | None:
        """Return what was noted under `name`."""
        with self._explained():
            row = self._database.execute(
                "SELECT value FROM notes WHERE name = ?", (name,)
            ).fetchone()
        if row is None:
            return None
        if not metadata.reads(name, row[0]):
            raise StudyError(f"the store {self.path} is damaged: its note {name!r} does not read")
        return str(row[0])

    def set_note(self, name: str, value: str) -> None:
        """Note a fact about the study."""
        with self._transaction():
            self._database.execute("INSERT OR REPLACE INTO notes VALUES (?, ?)", (name, value))

    def _prepare(self) -> None:
        # One moment's answers: another process may be making the tables.
        self._database.execute("BEGIN")
        try:
            (version,) = self._database.execute("PRAGMA user_version").fetchone()
            (application,) = self._database.execute("PRAGMA application_id").fetchone()
            (tables,) = self._database.execute("SELECT count(*) FROM sqlite_master").fetchone()
        finally:
            self._database.execute("ROLLBACK")
        if application != APPLICATION_ID and tables:
            raise StudyError(f"{self.path} is a database, but not the store of a study")
        if application == APPLICATION_ID and version != SCHEMA_VERSION:
            raise StudyError(
                f"{self.path} has store schema {version}, this version of the package reads "
                f"schema {SCHEMA_VERSION}: export it with the version that wrote it"
            )
        if self._read_only:
            if (application, version) != (APPLICATION_ID, SCHEMA_VERSION):
                raise StudyError(
                    f"{self.path} may not be written: should be a store of schema "
                    f"{SCHEMA_VERSION} to be read there; copy it to where it may"
                )
            return
        # A process that is killed loses nothing; a power cut at most the latest runs.
        self._change_to_wal()
        self._database.execute("PRAGMA synchronous = NORMAL")
        if application == APPLICATION_ID:
            return
        with self._transaction():
            # Another process may have made the tables since: two shards start at once.
            (tables,) = self._database.execute("SELECT count(*) FROM sqlite_master").fetchone()
            if tables:
                return
            for statement in _SCHEMA.split(";\n"):
                self._database.execute(statement)
            self._database.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            self._database.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    def _change_to_wal(self) -> None:
        give_up = time.monotonic() + TIMEOUT
        while True:
            try:
                self._database.execute("PRAGMA journal_mode = WAL")
            except sqlite3.OperationalError as error:
                # When two processes change a new file at once, SQLite refuses one without waiting.
                if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > give_up:
                    raise
                time.sleep(0.01)
            else:
                return

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._explained():
            self._database.execute("BEGIN IMMEDIATE")
            try:
                yield
            except BaseException:
                if self._database.in_transaction:
                    self._database.execute("ROLLBACK")
                raise
            self._database.execute("COMMIT")

    @contextmanager
    def _sound(self) -> Iterator[None]:
        try:
            yield
        except (KeyError, OverflowError, TypeError, ValueError) as error:
            raise StudyError(
                f"the store {self.path} is damaged: a run in it does not read ({error!r})"
            ) from error

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise StudyError(f"cannot use the store {self.path}: {error}") from error


def _refuse_unmerged(path: Path) -> None:
    log = path.with_name(f"{path.name}-wal")
    if log.is_file() and log.stat().st_size:
        raise StudyError(
            f"{path} may not be written, and its latest runs are still in {log.name}: copy both "
            "to where they may"
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
