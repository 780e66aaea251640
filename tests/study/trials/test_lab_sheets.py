"""Sheets as labs keep them: judged at once, or with the one option that the refusal names."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from swarm_logistics_env import judge, spi
from swarm_logistics_env.study.trials import Trials, read_trials

openpyxl = pytest.importorskip("openpyxl")

Row = tuple[object, ...]
# P of trials of eight robots, by the fault of one of them.
TRIALS = {
    "none": [12.5, 11.25, 13.0, 12.0, 12.75, 11.5],
    "wheel": [10.5, 9.75, 8.5, 9.0],
    "removed": [10.5, 11.0, 10.0, 11.25],
}
SIZES = {4: [10.0, 11.0, 12.0, 10.5], 8: [19.0, 20.0, 18.0], 16: [35.0, 36.0, 34.0, 33.0]}
TIMES = {"none": [100, 110, 105, 98, 102], "wheel": [250, 260, 300, 300, 300]}
READING = {
    "--column": lambda value: {"columns": dict([value.split("=", 1)])},
    "--wide": lambda value: {"wide": value},
    "--duration": lambda value: {"duration": float(value)},
}


def reading(option: str) -> dict[str, Any]:
    """Return the arguments of `read_trials` that an option of the command line stands for."""
    if option == "--skip-missing":
        return {"skip_missing": True}
    name, value = shlex.split(option)
    return READING[name](value)


def csv(*rows: Row, sign: str = ",") -> Callable[[Path], None]:
    text = "".join(sign.join(map(str, row)) + "\n" for row in rows)
    return lambda path: path.with_suffix(".csv").write_text(text) and None


def workbook(*rows: Row, merged: tuple[str, ...]) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        book = openpyxl.Workbook()
        for row in rows:
            book.active.append(row)
        for cells in merged:
            book.active.merge_cells(cells)
        book.save(path.with_suffix(".xlsx"))

    return write


def rows(
    word_of: Callable[[float], object] = str, sound: str = "none", removed: str = "removed"
) -> list[Row]:
    """Return robots, fault, faulty and P of each trial."""
    words = {"none": sound, "removed": removed}
    return [
        (8, words.get(fault, fault), int(fault != "none"), word_of(p))
        for fault, values in TRIALS.items()
        for p in values
    ]


def comma(p: float) -> str:
    return str(p).replace(".", ",")


def by_fault(trials: Trials) -> dict[str, list[float]]:
    return {
        fault: trials.performance(fault=fault, n_robots=8).tolist()
        for fault in dict.fromkeys(row.fault for row in trials.rows)
    }


def by_size(trials: Trials) -> dict[int, list[float]]:
    return {n: trials.performance(n_robots=n).tolist() for n in SIZES}


def tenfold(trials: Trials) -> dict[str, list[float]]:
    return {fault: [p / 10 for p in values] for fault, values in by_fault(trials).items()}


def times(trials: Trials) -> dict[str, list[float]]:
    return {fault: [round(1 / p) for p in values] for fault, values in by_fault(trials).items()}


class Sheet(NamedTuple):
    """A file, what its trials are, the option that its refusal names, and what is told of it."""

    name: str
    write: Callable[[Path], None]
    trials: Callable[[Trials], object]
    expected: object
    option: str = ""
    note: str = ""


HEAD = ("robots", "fault", "faulty", "delivered")
WIDE_FAULTS = [
    tuple("" if p is None else p for p in row) for row in zip_longest(*TRIALS.values())
]
WIDE_SIZES = [tuple("" if p is None else p for p in row) for row in zip_longest(*SIZES.values())]
TIMED = [
    (8, fault, int(fault != "none"), time) for fault, values in TIMES.items() for time in values
]
SHEETS = [
    Sheet(
        "a column a size, of unequal length",
        csv(("N=4", "N=8", "N=16"), *WIDE_SIZES),
        by_size,
        SIZES,
        note="'N=4' (robots 4), 'N=8' (robots 8), 'N=16' (robots 16). Their cells are read as P",
    ),
    Sheet(
        "a column a number",
        csv(("day", 4, 8, 16), *(("Mon", *row) for row in WIDE_SIZES)),
        lambda trials: {n: sorted(values) for n, values in by_size(trials).items()},
        {n: sorted(values) for n, values in SIZES.items()},
        "--wide robots",
    ),
    Sheet(
        "a column a fault, in French",
        csv(("sans panne", "wheel 1 de 8", "retirés 1 de 8"), *WIDE_FAULTS, sign=";"),
        by_fault,
        TRIALS,
        note="'retirés 1 de 8' (fault removed, faulty 1, robots 8)",
    ),
    Sheet(
        "German, with points between thousands",
        csv(
            ("Versuch", "Roboter", "Ausfall", "ausgefallen", "geliefert"),
            *(
                (k, *row[:3], f"1.{row[3]}")
                for k, row in enumerate(
                    rows(lambda p: f"{10 * p:07.3f}".replace(".", ","), "kein", "entfernt")
                )
            ),
            sign=";",
        ),
        lambda trials: {k: [(p - 1000) / 10 for p in v] for k, v in by_fault(trials).items()},
        TRIALS,
        note="'Ausfall' for fault, 'ausgefallen' for faulty, 'geliefert' for performance, 'kein'",
    ),
    Sheet(
        "with gaps",
        csv(HEAD, *rows(), (8, "none", 0, "NA"), (8, "wheel", 1, ""), (8, "wheel", "-", 9)),
        by_fault,
        TRIALS,
        "--skip-missing",
        note="3 of 17 rows lack a value and are left out: 1 in 'faulty', 2 in 'delivered'.",
    ),
    Sheet(
        "names merged over repetitions",
        workbook(
            ("", "N=4", "", "", "N=8", "", ""),
            ("", *(f"run {k}" for k in (1, 2, 3)) * 2),
            ("hall", 10, 11, 12, 19, 20, 18),
            merged=("B1:D1", "E1:G1"),
        ),
        lambda trials: by_size(trials) | {16: None},
        {},
    ),
]
