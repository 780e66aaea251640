"""Database: the SQLite file of a store, which many processes may open."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from swarm_logistics_env.errors import StudyError

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


# SQLite's codes of a write that did not fit: of the file itself, of its log, of the log's index.
_FULL = (
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR_WRITE,
    sqlite3.SQLITE_IOERR_SHMSIZE,
    sqlite3.SQLITE_IOERR_SHMOPEN,
)


class FullDiskError(StudyError):
    """A store that cannot be written, because there is no room on its disk."""


class Database:
    """A connection to a store's file; every error of SQLite becomes a StudyError that names it.

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
            self._connection = sqlite3.connect(
                place, timeout=TIMEOUT, isolation_level=None, uri=read_only
            )
            self._connection.row_factory = sqlite3.Row
            try:
                self._prepare()
            except BaseException:
                self._connection.close()
                raise

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def read(self, query: str, *values: object) -> list[sqlite3.Row]:
        """Return the rows of a query; their values have names."""
        with self._explained():
            return self._connection.execute(query, values).fetchall()

    def number(self, query: str) -> int:
        """Return the one number that a query gives."""
        ((number,),) = self.read(query)
        return int(number)

    @contextmanager
    def transaction(self) -> Iterator[Callable[..., object]]:
        """Keep all that the block writes with what it is given, or, if it fails, nothing of it."""
        with self._explained():
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield self._connection.execute
            except BaseException:
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")
                raise
            self._connection.execute("COMMIT")

    @contextmanager
    def attached(self, path: Path) -> Iterator[None]:
        """Attach another store as `other` while the block runs.

        Raises:
            StudyError: it is none, or its schema is another version's.
        """
        Database(path).close()
        with self._explained():
            self._connection.execute("ATTACH ? AS other", (str(path),))
        try:
            yield
        finally:
            self._connection.execute("DETACH other")

    def _prepare(self) -> None:
        # One moment's answers: another process may be making the tables.
        self._connection.execute("BEGIN")
        try:
            version = self.number("PRAGMA user_version")
            application = self.number("PRAGMA application_id")
            tables = self.number("SELECT count(*) FROM sqlite_master")
        finally:
            if self._connection.in_transaction:  # a full disk has ended it already
                self._connection.execute("ROLLBACK")
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
        self._connection.execute("PRAGMA synchronous = NORMAL")
        if application == APPLICATION_ID:
            return
        with self.transaction() as write:
            # Another process may have made the tables since: two shards start at once.
            if self.number("SELECT count(*) FROM sqlite_master"):
                return
            for statement in _SCHEMA.split(";\n"):
                write(statement)
            write(f"PRAGMA application_id = {APPLICATION_ID}")
            write(f"PRAGMA user_version = {SCHEMA_VERSION}")

    def _change_to_wal(self) -> None:
        give_up = time.monotonic() + TIMEOUT
        while True:
            try:
                self._connection.execute("PRAGMA journal_mode = WAL")
            except sqlite3.OperationalError as error:
                # When two processes change a new file at once, SQLite refuses one without waiting.
                if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > give_up:
                    raise
                time.sleep(0.01)
            else:
                return

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            reason = f"cannot use the store {self.path}: {error}"
            if getattr(error, "sqlite_errorcode", None) in _FULL:
                raise FullDiskError(f"{reason}: there is no room on its disk") from error
            raise StudyError(reason) from error


def _refuse_unmerged(path: Path) -> None:
    log = path.with_name(f"{path.name}-wal")
    if log.is_file() and log.stat().st_size:
        raise StudyError(
            f"{path} may not be written, and its latest runs are still in {log.name}: copy both "
            "to where they may"
        )
