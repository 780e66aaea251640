"""Runs: what was played, one row a run, in one SQLite file that many processes may open."""

from __future__ import annotations

import hashlib
import re
import sqlite3
import threading
import time
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.core.records import atomic_write, canonical_json, plain, write_csv
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Run

from .rows import OF_ORDERS, StoredRow, case_of, content_of, outcome_of, record_of, row_digest

if TYPE_CHECKING:
    import pandas as pd

FILE_NAME = "study.sqlite"
SCHEMA_VERSION = 5
_WITHOUT_DIGESTS = 4  # as version 0.3.0 wrote it; read, and given digests where runs are added
_CACHE_KIB = 128 * 1024
TIMEOUT = 60.0  # s, for other processes that write
APPLICATION_ID = 0x53574C47  # "SWLG": marks the file as ours

_SCHEMA = (
    """CREATE TABLE notes (name TEXT PRIMARY KEY, value TEXT NOT NULL, digest TEXT NOT NULL)
        WITHOUT ROWID""",
    """CREATE TABLE runs (
        key TEXT PRIMARY KEY,    -- digest of all that decides the outcome
        run TEXT NOT NULL,       -- JSON: policy, conditions, code and seed
        failed INTEGER NOT NULL,
        outcome TEXT NOT NULL,   -- JSON: all of it but the wall time
        wall_seconds REAL NOT NULL,
        digest TEXT NOT NULL     -- of all of these but the last, see `rows`
    )""",
)
# One statement, as another process may be making the tables.
_HEADER = """SELECT application_id, user_version, (SELECT count(*) FROM sqlite_master)
    FROM pragma_application_id, pragma_user_version"""
# A run that failed before is replaced, one that succeeded stays.
_ADD = """INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?) ON CONFLICT (key) DO UPDATE SET
    failed = excluded.failed, outcome = excluded.outcome, wall_seconds = excluded.wall_seconds,
    digest = excluded.digest WHERE runs.failed"""
# What SQLite finds wrong with an index, or with a value: no row but the damaged ones is concerned.
_OF_ROWS = re.compile(r"(row \d+ missing from index|non-unique entry in index|NULL value in) ")


class Runs:
    """The finished runs of a study. A run is kept from the moment that `add` returns.

    Every error of SQLite becomes a StudyError that names the file. A row that is not as it was
    written, by its digest, counts as not played: `damage` tells of it.

    Args:
        path: the file, made with its folder where it is missing; None: kept in memory only.
        read_only: write neither into the file nor beside it; nobody else may write it.

    Raises:
        StudyError: the file is no store of this version, damaged beyond rows, or has no folder.
    """

    def __init__(self, path: Path | None, *, read_only: bool = False) -> None:
        self.path = path
        self._damaged: list[str] | None = None  # keys of damaged rows; None: not looked for
        database = str(path or ":memory:")
        if path is not None and read_only:
            # SQLite makes two files beside a database in WAL mode, even to read it, but for this.
            database = f"{path.absolute().as_uri()}?immutable=1"
        elif path is not None:
            _make_folder(path.parent)
        with self._explained():
            # Autocommit: transactions are opened by hand, one per run, and by one thread at a time.
            self._writing = threading.RLock()
            self._connection = sqlite3.connect(
                database, TIMEOUT, isolation_level=None, uri=read_only, check_same_thread=False
            )
            # What is not UTF-8 is damaged, and told by its digest.
            self._connection.text_factory = lambda text: text.decode("utf-8", "backslashreplace")
            try:
                self._prepare(read_only=read_only)
            except BaseException:
                self._connection.close()
                raise

    @classmethod
    def existing(cls, directory: Path) -> Self:
        """Open the store of a study that was run before, to read it.

        Raises:
            StudyError: there is none.
        """
        path = directory / FILE_NAME
        if not path.is_file():
            raise StudyError(f"no study in {directory}: there is no file {path}")
        # A log is there while somebody writes, and after they were killed: it is merged by writing.
        # Without one, a full or locked folder is no matter; a file without the mark is being made.
        with path.open("rb") as file:
            mark = file.read(72)[68:]
        is_made = mark == APPLICATION_ID.to_bytes(4, "big")
        return cls(path, read_only=is_made and not path.with_name(f"{path.name}-wal").exists())

    @classmethod
    @contextmanager
    def new(cls, out: Path, verb: str) -> Iterator[Self]:
        """Yield an empty store; what was written into it is that of `out` once the block ends well.

        Killed or failed before, it leaves nothing that looks like a store.

        Args:
            verb: what is done, for errors, e.g. "merge".

        Raises:
            StudyError: `out` holds a study, or cannot be written.
        """
        path = out / FILE_NAME
        if path.exists():
            raise StudyError(f"{out} holds a study already: {verb} into a new directory")
        _make_folder(out)
        with atomic_write(path, StudyError) as part, cls(part) as runs:
            runs._execute("PRAGMA journal_mode = DELETE")  # with a log all would be written twice
            yield runs

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def __len__(self) -> int:
        ((count,),) = self._execute("SELECT count(*) FROM runs NOT INDEXED")
        return int(count)

    def add(self, runs: Iterable[tuple[Run, Outcome]]) -> None:
        """Keep finished runs, all or none of them.

        One that failed before is replaced, one that succeeded stays.
        """
        with self._transaction():
            for content, seconds in ((content_of(*run), run[1].wall_seconds) for run in runs):
                self._connection.execute(_ADD, (*content, seconds, row_digest(*content)))

    def absorb(self, other: Runs) -> None:
        """Add the runs of another store, to which `add`'s rule applies; not those damaged there.

        Raises:
            StudyError: the other store has another result of a run that is here.
        """
        with self._transaction():
            for row in other._rows():
                before = self._execute(
                    "SELECT outcome FROM runs WHERE key = ? AND NOT failed", (row.key,)
                )
                if before and not row.failed and before[0][0] != row.outcome:
                    raise StudyError(
                        f"{other.path} has another result than the stores before it for the run "
                        f"{row.key} (seed {case_of(row.run)['seed']}), of the same scenario, "
                        "policy and code"
                    )
                digest = row_digest(*row.content)
                self._execute(_ADD, (*row.content, row.wall_seconds, digest))

    def damage(self) -> str | None:
        """Return which rows are damaged, in a sentence, as a terminal may show it; None: none."""
        if self._damaged is None:
            self._damaged = [str(row.key) for row in self._rows(sound=False)]
        keys = sorted(plain(key)[:12] for key in self._damaged)
        if not keys:
            return None
        runs = "1 run of {} is" if len(keys) == 1 else f"{len(keys)} runs of {{}} are"
        more = ", .." if len(keys) > 3 else ""
        named = f"{', '.join(keys[:3])}{more}"
        return f"{runs.format(self.path)} damaged and left out ({named})"

    def discard_damaged(self) -> str | None:
        """Take damaged rows out, so that they can be played again; return what `damage` did."""
        damage = self.damage()
        if damage is not None:
            with self._transaction():
                for row in list(self._rows(sound=False)):
                    self._execute("DELETE FROM runs WHERE rowid = ?", (row.rowid,))
            self._damaged = None
        return damage

    def succeeded(self) -> set[str]:
        """Return the keys of the runs that need not run again."""
        return {row.key for row in self._rows() if not row.failed}

    def outcomes(self, runs: Iterable[Run]) -> dict[tuple[str, int], Outcome]:
        """Return the outcomes of those of `runs` that finished, by the case's key and the seed."""
        wanted = {run.key: (run.case.key, run.seed) for run in runs}
        outcomes, damaged = {}, list[str]()
        for row in self._all_rows():
            if not row.is_sound:
                damaged.append(str(row.key))
            elif row.key in wanted:
                outcomes[wanted[row.key]] = outcome_of(row.outcome)
        self._damaged = damaged
        return outcomes

    def frame(self, keys: Iterable[str] | None = None) -> pd.DataFrame:
        """Return one row a run, sorted by key, without wall times.

        Args:
            keys: of the runs wanted; None: all.

        Returns:
            The columns `run` (key), `policy`, `policy_identity`, `task`, `scenario`, `faults`,
            `behaviour`, `code`, `seed`, those of `Outcome`, `delivered`, `longest_standstill` [s]
            and `stands_still`; `scenario` and `faults` are JSON, `delivery_times` lists [s]; the
            fields of an outcome are None where the run failed, those of `ContactMeasures` also
            where nobody counted. Those of `OrderMeasures` are there where any run has them.
        """
        import pandas as pd

        rows = sorted(self._rows(None if keys is None else set(keys)), key=lambda row: row.key)
        table = pd.DataFrame([record_of(row) for row in rows], dtype=object)
        without_values = [name for name in OF_ORDERS if name in table and table[name].isna().all()]
        return table.drop(columns=without_values)

    def note(self, name: str, value: str) -> None:
        """Note a fact about the study; an earlier one of this name is replaced."""
        with self._transaction():
            row = (name, value, row_digest(name, value))
            self._execute("INSERT OR REPLACE INTO notes VALUES (?, ?, ?)", row)

    def notes(self) -> dict[str, str]:
        """Return what was noted about the study, by name.

        Raises:
            StudyError: a note is damaged.
        """
        rows = self._execute(f"SELECT name, value, {self._digest_column} FROM notes")
        for name, value, digest in rows:
            if digest not in (None, row_digest(name, value)):
                raise StudyError(
                    f"the store {self.path} is damaged: a note in it is not as it was written; its "
                    "runs can be exported (swarm-logistics study export)"
                )
        return {name: value for name, value, _ in rows}

    def _rows(
        self, keys: Collection[str] | None = None, *, sound: bool = True
    ) -> Iterator[StoredRow]:
        """Yield the rows that are sound, or else those that are not.

        Args:
            keys: of the rows wanted; None: all.
        """
        for row in self._all_rows():
            if (keys is None or row.key in keys) and row.is_sound == sound:
                yield row

    def _all_rows(self) -> Iterator[StoredRow]:
        # Without the index, which may be damaged by itself.
        statement = (
            "SELECT rowid, key, run, failed, outcome, wall_seconds, "
            f"{self._digest_column} FROM runs NOT INDEXED"
        )
        with self._explained():
            yield from map(StoredRow._make, self._connection.execute(statement))

    def _execute(self, statement: str, values: tuple[object, ...] = ()) -> list[tuple[Any, ...]]:
        with self._explained():
            return self._connection.execute(statement, values).fetchall()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """Keep all that the block writes or, if it fails, nothing of it."""
        with self._writing, self._explained():
            try:
                self._execute("BEGIN IMMEDIATE")
                yield
                self._connection.commit()
            except BaseException:
                # After a Ctrl-C before the block's first line the store may be closed already.
                with suppress(sqlite3.ProgrammingError):
                    self._connection.rollback()
                raise

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, UnicodeDecodeError) as error:  # sqlite3 decodes what is damaged
            raise StudyError(f"cannot use the store {self.path}: {error}") from error

    def _prepare(self, *, read_only: bool) -> None:
        ((application, version, tables),) = self._execute(_HEADER)
        is_ours = int(application) == APPLICATION_ID
        if not is_ours and int(tables):
            raise StudyError(f"{self.path} is a database, but not the store of a study")
        if is_ours and version not in (_WITHOUT_DIGESTS, SCHEMA_VERSION):
            raise StudyError(
                f"{self.path} has store schema {version}, this version of the package reads "
                f"schema {SCHEMA_VERSION}: export it with the version that wrote it"
            )
        if is_ours:
            self._check(version)
        # What stands for the digest where there is none.
        self._digest_column = "digest"
        if is_ours and version == _WITHOUT_DIGESTS and read_only:
            self._digest_column = "NULL"
        # A process that is killed loses nothing; a power cut at most the latest runs.
        self._change_to_wal()
        self._execute("PRAGMA synchronous = NORMAL")
        # Keys come in no order: the whole index of a million runs is written to all the time.
        self._execute(f"PRAGMA cache_size = -{_CACHE_KIB}")
        if is_ours and (read_only or version == SCHEMA_VERSION):
            return
        with self._transaction():
            # Another process may have made the tables since: two shards start at once.
            ((_, version, tables),) = self._execute(_HEADER)
            if not tables:
                for statement in _SCHEMA:
                    self._execute(statement)
                self._execute(f"PRAGMA application_id = {APPLICATION_ID}")
            elif version == _WITHOUT_DIGESTS:
                self._add_digests()
            self._execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    def _check(self, version: int) -> None:
        """Raise StudyError if SQLite finds damage that no digest would: rows that are lost."""
        columns = {name for (name,) in self._execute("SELECT name FROM pragma_table_info('runs')")}
        problems = [text for (text,) in self._execute("PRAGMA integrity_check") if text != "ok"]
        worst = [text for text in problems if not _OF_ROWS.match(text)]
        if ("digest" in columns) != (version == SCHEMA_VERSION):
            worst.append(f"schema {version} with other columns")
        if worst:
            raise StudyError(
                f"the store {self.path} is damaged ({worst[0].splitlines()[-1]}): should be "
                "replaced by a copy, or the study run into a new directory"
            )
        if problems:
            with suppress(StudyError):  # it may be read-only
                self._execute("REINDEX")

    def _add_digests(self) -> None:
        """Give every row that reads its digest; one that does not will count as damaged."""
        for table in ("runs", "notes"):
            self._execute(f"ALTER TABLE {table} ADD COLUMN digest TEXT NOT NULL DEFAULT ''")
        self._digest_column = "NULL"
        for row in list(self._rows()):
            values = (row_digest(*row.content), row.rowid)
            self._execute("UPDATE runs SET digest = ? WHERE rowid = ?", values)
        self._digest_column = "digest"
        for name, value in self._execute("SELECT name, value FROM notes"):
            values = (row_digest(name, value), name)
            self._execute("UPDATE notes SET digest = ? WHERE name = ?", values)

    def _change_to_wal(self) -> None:
        give_up = time.monotonic() + TIMEOUT
        while True:
            try:
                self._connection.execute("PRAGMA journal_mode = WAL")
                return
            except sqlite3.OperationalError as error:
                # When two processes change a new file at once, SQLite refuses one without waiting.
                if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > give_up:
                    raise
                time.sleep(0.01)


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"cannot write to {folder}: {error.strerror}") from error


def export(runs: Runs, path: Path) -> tuple[int, str]:
    """Write every stored run, sorted by key, without wall times, as CSV.

    Returns:
        How many runs, and the SHA-256 of the file.

    Raises:
        StudyError: another suffix, or the file cannot be written.
    """
    if path.suffix != ".csv":
        raise StudyError(f"cannot export to {path}: should end in .csv")
    frame = runs.frame()
    if len(frame):
        frame["failed_robots"] = frame["failed_robots"].map(canonical_json)
        frame["delivery_times"] = frame["delivery_times"].map(
            lambda times: " ".join(map(repr, times)), na_action="ignore"
        )
    write_csv(path, frame, StudyError)
    return len(frame), hashlib.sha256(path.read_bytes()).hexdigest()
