"""A folder of files: one table of them all, with what the names of folders and files say."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from pathlib import Path

from swarm_logistics_env.spi.inputs import IndicatorError
from swarm_logistics_env.study.trials.column_name import ColumnName
from swarm_logistics_env.study.trials.table import NoTrialsError, Table
from swarm_logistics_env.study.trials.words import MEANING

TRIAL_SUFFIXES = (".csv", ".tsv", ".txt", ".json", ".xlsx", ".xlsm", ".parquet")
# What editors and systems put beside files: locks, drafts, pictures of a folder.
_HIDDEN = re.compile(r"[.~].*|__MACOSX|thumbs\.db|desktop\.ini", re.IGNORECASE)
# How names of copies look, beside "day1 (1).csv": "day1 - Copy.csv", "backup/day1.csv".
_COPY = re.compile(r"(?<![a-z])(copy|kopie|copie|backup|bak|old|orig)(?![a-z])", re.IGNORECASE)
_NUMBER_OF_COPY = re.compile(r" ?\(\d+\)$")  # which browsers add
_FEWEST_OF_COPY = 4  # different rows that two files do not share by chance


def read(
    folder: Path,
    read_file: Callable[[Path], Table],
    columns: Mapping[str, str],
    ignore: Sequence[str],
) -> Table:
    """Return the table of all files of trials in a folder and in those within.

    A folder or file named NAME=VALUE is a column of that name, as other programs part their tables.
    Where the files name no policy, they are of the policy that the first folder names, or the file.
    Files without trials, and a second copy of a file, are left out; notes name them.

    Args:
        columns: what a column is to its name, as somebody says.
        ignore: names of columns that files need not have.

    Raises:
        IndicatorError: there is no file of trials, one cannot be read, or they have different
            columns.
    """
    notes: list[str] = []
    tables = _tables(folder, read_file, columns, notes)
    if not tables:
        suffixes = ", ".join(TRIAL_SUFFIXES)
        reasons = f"; --column says what a column is. {' '.join(notes)}" if notes else ""
        raise IndicatorError(f"{folder} holds no trials: should hold files of {suffixes}{reasons}")
    named = {path: _from_names(path.relative_to(folder)) for path in tables}
    notes += _leave_copies_out(folder, tables, named)
    return _joined(folder, tables, named, columns, ignore, notes)


def _tables(
    folder: Path,
    read_file: Callable[[Path], Table],
    columns: Mapping[str, str],
    notes: list[str],
) -> dict[Path, Table]:
    """Return the table of each file of trials; notes say which files hold none."""
    tables = {}
    other_files = []
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if any(_HIDDEN.fullmatch(part) for part in name.parts) or not path.is_file():
            continue
        if path.suffix.lower() not in TRIAL_SUFFIXES:
            other_files.append(str(name))
            continue
        try:
            table = read_file(path)
        except NoTrialsError as error:
            reason = str(error).removeprefix(f"{path}").lstrip(": ").partition(": should")[0]
            notes.append(f"{name} is left out: it {reason}.")
            continue
        except IndicatorError:
            if path.suffix.lower() == ".txt" and not _has_columns(_first_line(path), columns):
                notes.append(f"{name} is left out: it is no table.")
                continue
            raise
        if not table.meanings and not _has_columns(table.header, columns):
            names = ", ".join(map(repr, table.header[:5]))
            notes.append(f"{name} is left out: none of its columns is known: {names}.")
        elif not table.cells:
            notes.append(f"{name} is left out: it holds no trial.")
        else:
            tables[path] = table
    if other_files:
        names = ", ".join(other_files[:5])
        if len(other_files) > 5:
            names += ", .."
        notes.append(f"Files of other kinds are left out: {names}.")
    return tables


def _has_columns(header: Sequence[str], columns: Mapping[str, str]) -> bool:
    return any(ColumnName(name).bare in MEANING or name in columns.values() for name in header)


def _first_line(path: Path) -> list[str]:
    """Return the cells of a text's first line with any, whatever stands between them."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    line = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    return re.split(r"[;\t,|]", line)


def _leave_copies_out(
    folder: Path, tables: dict[Path, Table], named: dict[Path, dict[str, str]]
) -> Iterator[str]:
    """Take files out whose rows another one begins with, and yield which.

    Files of few rows may be alike by chance: their names have to say that one is a copy.
    """
    rows_of = {path: _comparable(table) for path, table in tables.items()}
    # The longest come first, and of equal ones those whose names are the shortest.
    order = sorted(
        tables, key=lambda path: (-len(rows_of[path]), len(path.parts), len(path.name), path)
    )
    counted: dict[Hashable, list[Path]] = {}
    for path in order:
        rows = rows_of[path]
        is_telling = len({*rows[1:]}) >= _FEWEST_OF_COPY
        alike = counted.setdefault((*named[path].items(), rows[:2]), [])
        for first in alike:
            is_copy = is_telling or _is_copy(path.relative_to(folder), first.relative_to(folder))
            if is_copy and rows_of[first][: len(rows)] == rows:
                yield (
                    f"{path.relative_to(folder)} holds rows of {first.relative_to(folder)} alone, "
                    "which count once."
                )
                del tables[path]
                break
        else:
            alike.append(path)


def _is_copy(path: Path, other_path: Path) -> bool:
    """Return whether one of two files is a copy of the other by their names."""
    if _COPY.search(str(path)) or _COPY.search(str(other_path)):
        return True
    stems = path.stem, other_path.stem
    plain_stems = [_NUMBER_OF_COPY.sub("", stem) for stem in stems]
    is_one_name = plain_stems[0] == stems[1] or plain_stems[1] == stems[0]
    return is_one_name and path.parent == other_path.parent


def _comparable(table: Table) -> tuple[tuple[str, ...], ...]:
    """Return the names and rows of a table in one order and spelling, of whatever kind of file."""
    names = sorted({*table.header} - {""})
    columns = [map(_spelled, table.columns[name].texts) for name in names]
    return (*names,), *zip(*columns)


def _spelled(cell: str) -> str:
    try:
        return repr(float(cell.replace(",", ".")))
    except ValueError:
        return cell


def _joined(
    folder: Path,
    tables: Mapping[Path, Table],
    named: Mapping[Path, dict[str, str]],
    columns: Mapping[str, str],
    ignore: Sequence[str],
    notes: Sequence[str],
) -> Table:
    """Return one table of those of several files, and of what their names say."""
    first_path, first = next(iter(tables.items()))
    # What is left out anyhow, some files need not have.
    left_out = frozenset().union(*(table.left_out for table in tables.values()))
    header = [*dict.fromkeys(name for table in tables.values() for name in table.header)]
    for path, table in tables.items():
        if lacking := sorted({*header} - {*table.header} - left_out - {*ignore, ""}):
            raise IndicatorError(
                f"{table.source} has no column {', '.join(map(repr, lacking))}, as others in the "
                "folder: should have the same columns, or stand in a folder of its kind; "
                f"--ignore {lacking[0]!r} leaves one out of all"
            )
        if [*named[path]] != [*named[first_path]]:
            names = _listed(named[path])
            first_names = _listed(named[first_path])
            raise IndicatorError(f"{path} names {names}, but {first_path} {first_names}")
    labels = [*named[first_path]]
    names_policy = any(
        MEANING.get(ColumnName(name).bare) == "policy" for name in (*header, *labels, *columns)
    )
    labels += [] if names_policy else ["policy"]
    labels = [label for label in labels if label not in header]
    cells = []
    origins = []
    for path, table in tables.items():
        values = {"policy": _policy_of(path.relative_to(folder)), **named[path]}
        order = [table.index.get(name) for name in header]
        for number_of_row, row in enumerate(table.cells):
            cells_of_file = ["" if number is None else row[number] for number in order]
            cells.append([*cells_of_file, *(values[name] for name in labels)])
            origins.append(table.location(number_of_row))
    digests = "".join(table.digest for table in tables.values())
    files = "1 file" if len(tables) == 1 else f"{len(tables)} files"
    all_notes = dict.fromkeys(
        (
            f"The folder holds {files}: {len(cells)} rows.",
            *notes,
            *(note for table in tables.values() for note in table.notes),
        )
    )
    return Table(
        str(folder),
        hashlib.sha256(digests.encode()).hexdigest()[:16],
        [*header, *labels],
        cells,
        range(1, len(cells) + 1),
        "row",
        first.kind and f"a folder of {first.kind}",
        first.meanings,
        left_out,
        first.decimal,
        tuple(all_notes),
        origins,
    )


def _from_names(path: Path) -> dict[str, str]:
    """Return what the names of folders and file say, as NAME=VALUE."""
    names = [*path.parts[:-1], path.stem]
    pairs = [name.partition("=") for name in names if "=" in name]
    return {name.strip(): value.strip() for name, _, value in pairs}


def _policy_of(path: Path) -> str:
    plain = [name for name in path.parts[:-1] if "=" not in name]
    return plain[0] if plain else path.name.partition(".")[0]


def _listed(values: dict[str, str]) -> str:
    return " and ".join(values) or "nothing"
