"""Sheets as labs keep them: judged at once, or with the one option that the refusal names."""

from __future__ import annotations

import shlex
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from swarm_logistics_env import judge, spi
from swarm_logistics_env.study.trials import read_trials

openpyxl = pytest.importorskip("openpyxl")

Conditions = dict[tuple[int, str], list[float]]
# P of trials by robots and fault, one robot of eight, and by robots alone.
FAULTS: Conditions = {
    (8, "none"): [11.25, 11.5, 12.0, 12.5, 12.75, 13.0],
    (8, "wheel"): [8.5, 9.0, 9.75, 10.5],
    (8, "removed"): [10.0, 10.5, 11.0, 11.25],
}
SIZES: Conditions = {
    (4, "none"): [10.0, 10.5, 11.0, 12.0],
    (8, "none"): [18.0, 19.0, 20.0],
    (16, "none"): [33.0, 34.0, 35.0],
}
TIMES: Conditions = {
    (8, "none"): [1 / 110, 1 / 105, 1 / 102, 1 / 100, 1 / 98],
    (8, "wheel"): [1 / 300, 1 / 300, 1 / 300, 1 / 260, 1 / 250],
}


class Sheet(NamedTuple):
    """A text, or rows of a workbook; its trials, the option that is named, and what is told."""

    name: str
    content: str | list[tuple[object, ...]]
    expected: Conditions
    option: str = ""
    note: str = ""
    merged: tuple[str, ...] = ()


def lines(line: str, conditions: Conditions = FAULTS, **words: str) -> str:
    """Return a line for each trial: {n}, {fault}, {m}, {p} and {comma} are filled."""
    return "".join(
        line.format(
            n=n,
            fault=words.get(fault, fault),
            m=int(fault != "none"),
            p=p,
            comma=f"{p:05.2f}".replace(".", ","),
        )
        + "\n"
        for (n, fault), values in conditions.items()
        for p in values
    )


def wide(heading: str, conditions: Conditions, sign: str = ",") -> str:
    columns = zip_longest(*conditions.values(), fillvalue="")
    return "\n".join([heading, *(sign.join(map(str, row)) for row in columns)]) + "\n"


HEAD = "robots,fault,faulty,delivered\n"
LIMITED = "".join(
    f"8,{fault},{int(fault != 'none')},{round(1 / p)}\n"
    for (_, fault), values in TIMES.items()
    for p in values
)
SHEETS = [
    Sheet(
        "a column a size, of unequal length",
        wide("N=4,N=8,N=16", SIZES),
        SIZES,
        note="each of these columns is a condition: 'N=4' (robots 4), 'N=8' (robots 8), 'N=16' (r",
    ),
    Sheet("a column a number", wide("4;8;16", SIZES, ";"), SIZES, "--wide robots"),
    Sheet(
        "a column a fault, in French",
        wide("sans panne;wheel 1 de 8;retirés 1 de 8", FAULTS, ";"),
        FAULTS,
        note="'sans panne' (fault none, robots 8), 'wheel 1 de 8' (fault wheel, faulty 1, robots 8",
    ),
    Sheet(
        "German, with a point between thousands",
        "Versuchstag;Roboter;Ausfall;ausgefallen;geliefert\n"
        + lines(";{n};{fault};{m};1.0{comma}", none="kein", removed="entfernt"),
        {key: [1000 + p for p in values] for key, values in FAULTS.items()},
        note="'Ausfall' for fault, 'ausgefallen' for faulty, 'geliefert' for performance, 'kein' f",
    ),
    Sheet(
        "with gaps",
        HEAD + lines("{n},{fault},{m},{p}") + "8,none,0,NA\n8,wheel,1,\n8,wheel,-,9\n",
        FAULTS,
        "--skip-missing",
        note="3 of 17 rows lack a value and are left out: 1 in 'faulty', 2 in 'delivered'.",
    ),
    Sheet(
        "names merged over repetitions",
        [
            ("hall", "N=4", None, None, "N=8", None, None),
            (None, *(f"Versuch {k}" for k in (1, 2, 3) * 2)),
            ("A", 10, 11, 12, 19, 20, 18),
            ("B", 10.5, None, None, None, None, None),
        ],
        {key: values for key, values in SIZES.items() if key[0] < 16},
        "--ignore hall",
        merged=("B1:D1", "E1:G1"),
    ),
    Sheet(
        "with a time limit",
        "robots,fault,faulty,time to finish [s]\n" + LIMITED,
        TIMES,
        "--duration 300",
    ),
    Sheet(
        "with trials that did not finish",
        "robots,fault,faulty,completion_time,geschafft\n"
        + LIMITED.replace("\n", ",ja\n").replace("300,ja", "300,nein"),
        TIMES,
        note="3 of 10 trials were stopped before they finished, and nobody counted what was done",
    ),
    Sheet(
        "units, a sum and a note in rows of their own",
        "robots;fault;faulty;delivered\n-;;;[boxes]\n"
        + lines("{n};{fault};{m};{comma}")
        + "Mittelwert;;;11,02\nBatterie schwach am 3.5.;;;\n",
        FAULTS,
        note="'Batterie schwach am 3.5.' (line 18) is left out: a note below the trials.",
    ),
    Sheet("percent", HEAD + lines("{n},{fault},{m},{p} %"), FAULTS),
]


def reading(option: str) -> dict[str, Any]:
    """Return the arguments of `read_trials` that an option of the command line stands for."""
    name, _, value = option.partition(" ")
    (value,) = shlex.split(value) or ("",)
    readings: dict[str, dict[str, Any]] = {
        "--skip-missing": {"skip_missing": True},
        "--column": {"columns": dict([value.partition("=")[::2]])},
        "--ignore": {"ignore": [value]},
        "--wide": {"wide": value},
        "--duration": {"duration": float(value) if name == "--duration" else None},
    }
    return readings[name]


def write(folder: Path, sheet: Sheet) -> Path:
    if isinstance(sheet.content, str):
        path = folder / "sheet.csv"
        path.write_text(sheet.content)
        return path
    book = openpyxl.Workbook()
    for row in sheet.content:
        book.active.append(row)
    for cells in sheet.merged:
        book.active.merge_cells(cells)
    book.save(folder / "sheet.xlsx")
    return folder / "sheet.xlsx"


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: sheet.name)
def test_a_sheet_is_judged_at_once_or_with_the_option_that_is_named(
    sheet: Sheet, tmp_path: Path
) -> None:
    path = write(tmp_path, sheet)
    options = {}
    if sheet.option:
        with pytest.raises(spi.IndicatorError) as refused:
            read_trials(path)
        assert sheet.option in str(refused.value)
        options = reading(sheet.option)
    trials = read_trials(path, **options)
    read: Conditions = {}
    for row in trials.rows:
        read.setdefault((row.n_robots or 0, row.fault), []).append(row.performance)
    assert {key: sorted(values) for key, values in read.items()} == {
        key: pytest.approx(values) for key, values in sheet.expected.items()
    }
    assert sheet.note in " ".join(trials.notes)
    assert judge(path, **options).verdicts


def test_all_that_is_wrong_with_a_sheet_is_told_at_once_with_what_to_type(tmp_path: Path) -> None:
    path = tmp_path / "sheet.csv"
    path.write_text("robtos;boxes;fault;m;note\n8;1,204;none;0;\n8;998;wheel;1;battery low\n")
    with pytest.raises(spi.IndicatorError) as refused:
        read_trials(path)
    name, sign, note, performance = str(refused.value).splitlines()
    assert "has a column 'robtos'; did you mean 'robots'? Then say --column robots=robtos" in name
    assert "line 2, column 'boxes': '1,204': should be a number without" in sign
    assert "--decimal , where decimals have a comma, or --thousands , where" in sign
    assert "column 'note': 'battery low': should be a number" in note
    assert "else --ignore note," in note
    assert "no column 'performance'" in performance
    assert "say which it is by --column performance=boxes, or add it" in performance
    # A wide table whose names say less than what is needed.
    path.write_text(wide("ohne;wheel;entfernt", FAULTS, ";"))
    with pytest.raises(spi.IndicatorError, match="is a condition, --wide policy or --wide fault"):
        read_trials(path)
    with pytest.raises(spi.IndicatorError) as refused:
        read_trials(path, wide="fault")
    faulty, robots = str(refused.value).splitlines()
    assert "--column faulty=1 where one fails in each trial with a fault" in faulty
    assert "--column robots=8 where there are 8 in each trial" in robots
    trials = read_trials(path, wide="fault", columns={"faulty": "1", "robots": "8"})
    assert [row.faulty for row in trials.rows] == [0] * 6 + [1] * 8


def judged(path: Path, text: str) -> tuple[str, float, float, float]:
    """Return the word on the one question of a file, its value and its limits."""
    path.write_text("robots,fault,faulty,completion_time,finished\n" + text)
    (verdict,) = judge(path).verdicts
    interval = verdict.interval
    assert interval is not None
    assert interval.low is not None
    assert interval.high is not None
    return verdict.on_property.adjusted, interval.value, interval.low, interval.high


def test_a_verdict_holds_whatever_trials_that_were_stopped_would_have_done(tmp_path: Path) -> None:
    path = tmp_path / "sheet.csv"
    sound = "".join(f"8,none,0,{time},yes\n" for time in range(270, 300, 3))
    for limit, expected in ((300, "open"), (900, "refuted")):
        # All could have finished at once after the limit, or never.
        word, value, low, _ = judged(path, sound + f"8,wheel,1,{limit},no\n" * 10)
        assert word == expected
        assert low == pytest.approx(-1 + 1 / 8, abs=1e-6)
        assert value == pytest.approx(284 / limit - 1 + 1 / 8, abs=0.01)
    # Where sound ones were stopped, P_o is at most what is shown.
    sound += "8,none,0,300,no\n" * 3
    word, *_ = judged(path, sound + "".join(f"8,wheel,1,{280 + k},yes\n" for k in range(10)))
    assert word == "supported"
    word, value, _, high = judged(
        path, sound + "".join(f"8,wheel,1,{380 + k},yes\n" for k in range(10))
    )
    assert word == "open"
    assert value < 0.0 < high


def test_words_that_mean_a_missing_value_leave_out_no_more_than_said(tmp_path: Path) -> None:
    path = tmp_path / "sheet.csv"
    # An empty time is a trial that did not finish; to leave it out would be to leave out failures.
    path.write_text("robots,makespan\n4,90\n4,\n8,60\n8,50\n")
    with pytest.raises(spi.IndicatorError, match="of a trial that did not finish, columns should"):
        read_trials(path, skip_missing=True)
    assert read_trials(path, duration=100.0).rows[1].least == 0.0
    # The words of the file are said by --value.
    path.write_text("robots,p,note\n4,kaputt,\n4,9,x\n8,20,\n")
    trials = read_trials(path, ignore=["note"], values=["p:kaputt="], skip_missing=True)
    assert [row.performance for row in trials.rows] == [9.0, 20.0]
    path.write_text("robots,p\n4,NA\n,8\n")
    with pytest.raises(spi.IndicatorError, match="--skip-missing: no row of"):
        read_trials(path, skip_missing=True)


def test_an_empty_cell_of_a_wide_table_is_missing_unless_it_is_at_an_end(tmp_path: Path) -> None:
    path = tmp_path / "sheet.csv"
    path.write_text("N=4,N=8\n10,19\n,20\n11,\n")
    with pytest.raises(spi.IndicatorError, match="--skip-missing leaves out 1 row that lacks a"):
        read_trials(path)
    trials = read_trials(path, skip_missing=True)
    assert [row.performance for row in trials.rows] == [10.0, 11.0, 19.0, 20.0]
    assert "Empty cells at an end (1) are no trials." in trials.notes[0]
    # Of a time it says that the trial did not finish.
    with pytest.raises(spi.IndicatorError, match="of a trial that did not finish, columns should"):
        read_trials(path, columns={"time_to_finish": "cells"}, skip_missing=True)
    path.write_text("robots,run 1,run 2\n4,10,\n8,20,21\n")
    assert [row.n_robots for row in read_trials(path).rows] == [4, 8, 8]
    # Numbers of robots, or of one of them?
    path.write_text("trial;Roboter 1;Roboter 2\n1;3;4\n2;5;6\n")
    with pytest.raises(spi.IndicatorError, match="where each column is a condition, --wide robots"):
        read_trials(path)


def test_values_in_the_names_of_columns_are_a_parameter_with_their_unit(tmp_path: Path) -> None:
    path = tmp_path / "sheet.csv"
    path.write_text("robots;width=1,5 m;width=2 m\n4;5;6\n")
    trials = read_trials(path)
    assert [(row.parameters, row.performance) for row in trials.rows] == [
        ((("width [m]", 1.5),), 5.0),
        ((("width [m]", 2.0),), 6.0),
    ]
    assert "'width=1,5 m' (width [m] 1.5), 'width=2 m' (width [m] 2)" in trials.notes[0]


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("robots,day,load", "has no two columns that could be conditions: it has 'robots', 'day',"),
        ("robots,1 m,wide", "has a column 'wide': should have one number in its name, else say "),
        ("robots,1 m,2 to 3 m", "--wide policy or --wide fault, or leave it out by --ignore '2 to"),
    ],
)
def test_what_columns_differ_in_is_refused_where_their_names_do_not_tell_it(
    header: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "sheet.csv"
    path.write_text(f"{header}\n4,5,6\n4,7,8\n")
    with pytest.raises(spi.IndicatorError, match=rf"^--wide width: .*{words}"):
        read_trials(path, wide="width")


def test_a_german_column_that_may_tell_robots_apart_is_asked_about(tmp_path: Path) -> None:
    path = tmp_path / "sheet.csv"
    rows = "".join(f"{trial};{robot};{robot + trial}\n" for trial in (1, 2) for robot in (1, 2, 3))
    path.write_text(f"Versuch;Roboter;geliefert\n{rows}")
    with pytest.raises(spi.IndicatorError) as refused:
        read_trials(path)
    assert "by --sum-over Roboter" in str(refused.value)
    assert "say --column robots=Roboter" in str(refused.value)
