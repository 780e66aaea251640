"""A folder of files: one table of them all, with what the names of folders and files say."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

from swarm_logistics_env.spi.inputs import IndicatorError
from swarm_logistics_env.spi.trials.table import Table
from swarm_logistics_env.spi.trials.trial_columns import MEANING, bare

TRIAL_SUFFIXES = (".csv", ".tsv", ".txt", ".json", ".xlsx", ".parquet")


def read(folder: Path, read_file: Callable[[Path], Table]) -> Table:
    """Return the table of all files in a folder and in those within.

    A folder or file named NAME=VALUE is a column of that name, as other programs part their tables.
    Where the files name no policy, they are of the policy that the first folder names, or the file.

    Raises:
        IndicatorError: there is no file, one cannot be read, or they have different columns.
    """
    paths = sorted(
        path
        for path in folder.rglob("*")
        if path.suffix.lower() in TRIAL_SUFFIXES
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
    )
    if not paths:
        raise IndicatorError(
            f"{folder} holds no trials: should hold files of {', '.join(TRIAL_SUFFIXES)}"
        )
    tables = [read_file(path) for path in paths]
    first = tables[0]
    # What is left out anyhow, some files need not have.
    left_out = frozenset().union(*(table.left_out for table in tables))
    header = [*dict.fromkeys(name for table in tables for name in table.header)]
    for table in tables:
        if lacking := sorted({*header} - {*table.header} - left_out):
            raise IndicatorError(
                f"{table.source} has no column {', '.join(map(repr, lacking))}, as others in the "
                "folder: should have the same columns, or stand in a folder of its kind"
            )
    named = [_from_names(path.relative_to(folder)) for path in paths]
    labels = [*named[0]]
    for path, values in zip(paths, named):
        if [*values] != labels:
            raise IndicatorError(
                f"{path} names {_listed(values)}, but {paths[0]} {_listed(named[0])}"
            )
    if not any(MEANING.get(bare(name)) == "policy" for name in (*header, *labels)):
        policies = [_policy_of(path.relative_to(folder)) for path in paths]
        labels.append("policy")
        named = [{**values, "policy": policy} for values, policy in zip(named, policies)]
    labels = [label for label in labels if label not in header]
    cells, origins = [], []
    for table, values in zip(tables, named):
        order = [table.index.get(name) for name in header]
        for number_of_row, row in enumerate(table.cells):
            cells_of_file = ["" if number is None else row[number] for number in order]
            cells.append([*cells_of_file, *(values[name] for name in labels)])
            origins.append(table.location(number_of_row))
    digest = hashlib.sha256("".join(table.digest for table in tables).encode()).hexdigest()[:16]
    counts = f"{len(paths)} file{'s' * (len(paths) > 1)}: {len(cells)} rows."
    notes = dict.fromkeys(
        (f"The folder holds {counts}", *(note for table in tables for note in table.notes))
    )
    return Table(
        str(folder),
        digest,
        [*header, *labels],
        cells,
        range(1, len(cells) + 1),
        "row",
        first.kind and f"a folder of {first.kind}",
        first.meanings,
        left_out,
        first.decimal,
        tuple(notes),
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
