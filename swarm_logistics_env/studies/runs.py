"""Runs: what was played, one row a run, in one SQLite file that many processes may open."""

from __future__ import annotations

import hashlib
import json
import re
import sqlite3
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Self

from pydantic import TypeAdapter

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.records import becoming, canonical_json
from swarm_logistics_env.spi.trials_table import inert
from swarm_logistics_env.tasks.task import Outcome, Run

if TYPE_CHECKING:
    import pandas as pd

FILE_NAME = "study.sqlite"
SCHEMA_VERSION = 4
TIMEOUT = 60.0  # s, for other processes that write
APPLICATION_ID = 0x53574C47  # "SWLG": marks the file as ours

_SCHEMA = (
    "CREATE TABLE notes (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID",
    """CREATE TABLE runs (
        key TEXT PRIMARY KEY,    -- digest of all that decides the outcome
        run TEXT NOT NULL,       -- JSON: policy, conditions, code and seed
        failed INTEGER NOT NULL,
        outcome TEXT NOT NULL,   -- JSON: all of it but the wall time
        wall_seconds REAL NOT NULL
    )""",
)
# One statement, as another process may be making the tables.
_HEADER = """SELECT application_id, user_version, (SELECT count(*) FROM sqlite_master)
    FROM pragma_application_id, pragma_user_version"""
# A run that failed before is replaced, one that succeeded stays.
_REPLACE = """ON CONFLICT (key) DO UPDATE SET failed = excluded.failed, outcome = excluded.outcome,
    wall_seconds = excluded.wall_seconds WHERE runs.failed"""
_CLASH = """SELECT key, json_extract(runs.run, '$.seed') FROM main.runs JOIN other.runs AS theirs
    USING (key) WHERE NOT (runs.failed OR theirs.failed) AND runs.outcome != theirs.outcome"""

_OUTCOME = TypeAdapter(Outcome)

Outcomes = Mapping[tuple[str, int], Outcome]  # by the key of the case, and the seed


class Runs:
    """The finished runs of a study. A run is kept from the moment that `add` returns.

    Every error of SQLite becomes a StudyError that names the file.

    Args:
        path: the file, made with its folder where it is missing; None: kept in memory only.
        read_only: write nothing, neither into the file nor beside it, for a file that nobody else
            writes.

    Raises:
        StudyError: the file is not a store, its schema is not this version's, or its folder cannot
            be made.
    """

    def __init__(self, path: Path | None, *, read_only: bool = False) -> None:
        self.path = path
        place = str(path or ":memory:")
        if path is not None and read_only:
            # SQLite makes two files beside a database in WAL mode, even to read it, but for this.
            place = f"{path.absolute().as_uri()}?immutable=1"
        elif path is not None:
            _make_folder(path.parent)
        with self._explained():
            # Autocommit: transactions are opened by hand, one per run.
            self._connection = sqlite3.connect(
                place, timeout=TIMEOUT, isolation_level=None, uri=read_only
            )
            try:
                self._prepare()
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
    def new(cls, out: Path, way: str) -> Iterator[Self]:
        """Yield an empty store; what was written into it is that of `out` once the block ends well.

        Killed or failed before, it leaves nothing that looks like a store.

        Args:
            way: what is done, for errors, e.g. "merge".

        Raises:
            StudyError: `out` holds a study, or cannot be written.
        """
        path = out / FILE_NAME
        if path.exists():
            raise StudyError(f"{out} holds a study already: {way} into a new directory")
        _make_folder(out)
        with becoming(path, StudyError) as part, cls(part) as runs:
            yield runs

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def __len__(self) -> int:
        return len(self._execute("SELECT key FROM runs"))

    def add(self, run: Run, outcome: Outcome) -> None:
        """Keep a finished run; one that failed before is replaced, one that succeeded stays."""
        result = _OUTCOME.dump_json(outcome, exclude={"wall_seconds"}).decode()
        failed = outcome.error is not None
        row = (run.key, canonical_json(_described(run)), failed, result, outcome.wall_seconds)
        with self._transaction():
            self._execute(f"INSERT INTO runs VALUES (?, ?, ?, ?, ?) {_REPLACE}", row)

    def absorb(self, path: Path) -> None:
        """Add the runs of another store, to which `add`'s rule applies.

        Raises:
            StudyError: the file is not a store, or has another result of a run that is here.
        """
        Runs(path).close()
        self._execute("ATTACH ? AS other", (str(path),))
        try:
            with self._transaction():
                for key, seed in self._execute(_CLASH):
                    raise StudyError(
                        f"{path} has another result than the stores before it for the run {key} "
                        f"(seed {seed}), of the same scenario, policy and code"
                    )
                self._execute(f"INSERT INTO runs SELECT * FROM other.runs WHERE true {_REPLACE}")
        finally:
            self._execute("DETACH other")

    def succeeded(self) -> set[str]:
        """Return the keys of the runs that need not run again."""
        return {key for (key,) in self._execute("SELECT key FROM runs WHERE NOT failed")}

    def outcomes(self, runs: Iterable[Run]) -> dict[tuple[str, int], Outcome]:
        """Return the outcomes of those of `runs` that finished, by the case's key and the seed."""
        wanted = {run.key: (run.case.key, run.seed) for run in runs}
        with self._sound():
            return {
                wanted[key]: _OUTCOME.validate_json(outcome)
                for key, outcome in self._execute("SELECT key, outcome FROM runs")
                if key in wanted
            }

    def frame(self, keys: Iterable[str] | None = None) -> pd.DataFrame:
        """Return one row a run, sorted by key, without wall times.

        Args:
            keys: of the runs wanted; None: all.

        Returns:
            The columns `run` (key), `policy`, `policy_identity`, `task`, `scenario`, `faults`,
            `behaviour`, `code`, `seed`, `delivered` and those of `Outcome`; `scenario` and
            `faults` are JSON, `delivery_times` lists [s]; the fields of an outcome are None where
            the run failed.
        """
        import pandas as pd

        wanted = None if keys is None else set(keys)
        found = []
        with self._sound():
            for key, run, text in self._execute("SELECT key, run, outcome FROM runs ORDER BY key"):
                if wanted is None or key in wanted:
                    outcome = _OUTCOME.validate_json(text)
                    result = json.loads(text) | {"delivered": outcome.delivered}
                    if outcome.error is not None:
                        result = dict.fromkeys(result) | {"error": outcome.error}
                    case = json.loads(run)
                    case |= {name: canonical_json(case[name]) for name in ("scenario", "faults")}
                    found.append({"run": key} | case | result)
        return pd.DataFrame(found, dtype=object)

    def note(self, name: str, value: str) -> None:
        """Note a fact about the study; an earlier one of this name is replaced."""
        with self._transaction():
            self._execute("INSERT OR REPLACE INTO notes VALUES (?, ?)", (name, value))

    def notes(self) -> dict[str, str]:
        """Return what was noted about the study, by name."""
        return {row[0]: row[1] for row in self._execute("SELECT name, value FROM notes")}

    def _execute(self, statement: str, values: tuple[object, ...] = ()) -> list[tuple[str, ...]]:
        with self._explained():
            return self._connection.execute(statement, values).fetchall()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """Keep all that the block writes or, if it fails, nothing of it."""
        with self._explained(), self._connection:
            self._execute("BEGIN IMMEDIATE")
            yield

    @contextmanager
    def _sound(self) -> Iterator[None]:
        try:
            yield
        except (TypeError, ValueError) as error:  # of JSON and of pydantic
            reason = str(error).splitlines()[-1].strip()
            raise StudyError(
                f"the store {self.path} is damaged: a run in it does not read ({reason})"
            ) from error

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise StudyError(f"cannot use the store {self.path}: {error}") from error

    def _prepare(self) -> None:
        ((application, version, tables),) = self._execute(_HEADER)
        is_ours = int(application) == APPLICATION_ID
        if not is_ours and int(tables):
            raise StudyError(f"{self.path} is a database, but not the store of a study")
        if is_ours and int(version) != SCHEMA_VERSION:
            raise StudyError(
                f"{self.path} has store schema {version}, this version of the package reads "
                f"schema {SCHEMA_VERSION}: export it with the version that wrote it"
            )
        # A process that is killed loses nothing; a power cut at most the latest runs.
        self._change_to_wal()
        self._execute("PRAGMA synchronous = NORMAL")
        if is_ours:
            return
        with self._transaction():
            # Another process may have made the tables since: two shards start at once.
            if not self._execute("SELECT 1 FROM sqlite_master"):
                for statement in _SCHEMA:
                    self._execute(statement)
                self._execute(f"PRAGMA application_id = {APPLICATION_ID}")
                self._execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

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


def _described(run: Run) -> dict[str, object]:
    """Return what a store says of a run besides its outcome, as JSON holds it."""
    case = run.case
    return {
        "policy": case.policy.title,
        "policy_identity": case.identity,
        "task": case.task.name,
        "scenario": case.scenario.model_dump(mode="json"),
        "faults": [fault.model_dump(mode="json") for fault in case.faults],
        "behaviour": case.behaviour,
        "code": run.code,
        "seed": run.seed,
    }


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
    write_csv(path, frame)
    return len(frame), hashlib.sha256(path.read_bytes()).hexdigest()


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table as CSV with Unix line ends; floats in shortest exact form.

    A text that a spreadsheet would compute as a formula has an apostrophe before it, and a line in
    it ends in the Unix way, or it would end the row.

    Raises:
        StudyError: the file cannot be written.
    """
    texts = table.select_dtypes(exclude="number")
    harmless = texts.map(
        lambda cell: inert("\n".join(re.split(r"\r\n?", cell))) if isinstance(cell, str) else cell
    )
    with becoming(path, StudyError) as part:
        table.assign(**harmless).to_csv(part, index=False, lineterminator="\n")
