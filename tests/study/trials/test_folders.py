"""Folders of trials, with what stands beside trials in any lab."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.study.trials import read_trials

DAY = "policy,robots,delivered\nA,10,20\nA,10,21\nA,5,12\nA,5,11\n"
OTHER_DAY = DAY.replace("20", "25")


UNKNOWN = "is left out: none of its columns is known:"
NO_RESULTS = (
    "config.json is left out: it should be results as POGEMA writes them (a list of metrics, "
    "env_grid_search and algorithm) or as marl-eval does (environment > task > algorithm > run); "
    "else save the trials as CSV."
)


def write(folder: Path, **files: str) -> Path:
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    return folder


@pytest.mark.parametrize(
    ("name", "content", "note"),
    [
        ("~$day1.xlsx", "\x05owner", ""),
        (".~lock.day1.csv#", "someone", ""),
        ("._day1.csv", "\x00\x05", ""),
        ("__MACOSX/day1.csv", "\x00", ""),
        ("Thumbs.db", "", ""),
        (
            "README.txt",
            "Trials of May.\n\nSee the lab book.\n",
            f"README.txt {UNKNOWN} 'Trials of May.'.",
        ),
        ("README.txt", 'In May, we\n"go, and\n', "README.txt is left out: it is no table."),
        ("config.json", '{"speed": 1.0}', NO_RESULTS),
        ("battery.csv", "voltage,current\n1,2\n", f"battery.csv {UNKNOWN} 'voltage', 'current'."),
        ("b.csv", "a,b,c,d,e,f\n1,2,3,4,5,6\n", f"b.csv {UNKNOWN} 'a', 'b', 'c', 'd', 'e'."),
        ("day2.csv", "", "day2.csv is left out: it is empty."),
        ("day2.csv", "policy,robots,delivered\n", "day2.csv is left out: it holds no trial."),
        ("plot.png", "", "Files of other kinds are left out: plot.png."),
        ("old/plot.png", "", "Files of other kinds are left out: old/plot.png."),
    ],
)
def test_what_holds_no_trials_is_left_out(
    tmp_path: Path, name: str, content: str, note: str
) -> None:
    write(tmp_path, **{"day1.csv": DAY, name: content})
    trials = read_trials(tmp_path)
    assert len(trials.rows) == 4
    assert trials.notes == ("The folder holds 1 file: 4 rows.", *([note] if note else []))
    (tmp_path / "day1.csv").unlink()
    with pytest.raises(spi.IndicatorError) as caught:
        read_trials(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path} holds no trials: should hold files of .csv, .tsv, .txt, .json, .xlsx, .xlsm, "
        f".parquet{f'; --column says what a column is. {note}' if note else ''}"
    )


def test_trials_that_cannot_be_read_are_never_left_out(tmp_path: Path) -> None:
    for name, content, words in (
        ("day2.csv", DAY.replace("A,10,20", '"A,10,20'), r"day2\.csv, line 2: opens a quote"),
        ("day2.txt", DAY.replace("A,10,20", "A,10,20,1"), r"day2\.txt, line 2: has 4 values"),
        ("day2.json", "{", r"day2\.json is no JSON"),
        ("day2.csv", DAY.replace("delivered", "boxes"), "has no column 'boxes', as others in"),
    ):
        write(tmp_path, **{"day1.csv": OTHER_DAY, name: content})
        with pytest.raises(spi.IndicatorError, match=words):
            read_trials(tmp_path)
        (tmp_path / name).unlink()


def test_of_many_files_of_other_kinds_five_are_named(tmp_path: Path) -> None:
    write(tmp_path, **{"day1.csv": DAY, **{f"{number}.png": "" for number in range(6)}})
    note = "Files of other kinds are left out: 0.png, 1.png, 2.png, 3.png, 4.png, ..."
    assert read_trials(tmp_path).notes[1] == note


@pytest.mark.parametrize("name", ["day1 (1).csv", "day1 - Copy.csv", "backup/day1.csv", "b.csv"])
def test_a_second_copy_of_a_file_does_not_count(tmp_path: Path, name: str) -> None:
    text = DAY.replace("policy,", "").replace("A,", "")  # so that files name the policies
    write(tmp_path, **{"day1.csv": text, name: text})
    trials = read_trials(tmp_path)
    note = f"{name} holds rows of day1.csv alone, which count once."
    if name == "b.csv":
        note = "day1.csv holds rows of b.csv alone, which count once."
    assert trials.notes == ("The folder holds 1 file: 4 rows.", note)
    assert {row.policy for row in trials.rows} == {"b" if name == "b.csv" else "day1"}


def test_a_name_may_say_the_policy_by_that_word(tmp_path: Path) -> None:
    text = DAY.replace("policy,", "").replace("A,", "")
    write(tmp_path, **{"policy=ours/day1.csv": text, "policy=base/day1.csv": text})
    assert {row.policy for row in read_trials(tmp_path).rows} == {"ours", "base"}


def test_a_workbook_beside_its_csv_counts_once(tmp_path: Path) -> None:
    pytest.importorskip("openpyxl")
    write(tmp_path, **{"day1.csv": DAY.replace(",", ";").replace("20", "20,50")})
    frame = pd.read_csv(tmp_path / "day1.csv", sep=";", decimal=",")
    frame.to_excel(tmp_path / "day1.xlsx", index=False)
    trials = read_trials(tmp_path, decimal=",")
    assert [row.performance for row in trials.rows] == [20.5, 21.0, 12.0, 11.0]


def test_an_older_copy_of_a_file_that_grew_does_not_count(tmp_path: Path) -> None:
    write(tmp_path, **{"day1.csv": DAY, "day1 (1).csv": f"{DAY}A,5,13\n"})
    trials = read_trials(tmp_path)
    assert [row.performance for row in trials.rows] == [20.0, 21.0, 12.0, 11.0, 13.0]
    assert trials.notes[1] == "day1.csv holds rows of day1 (1).csv alone, which count once."


def test_files_of_single_trials_may_be_alike_but_for_copies(tmp_path: Path) -> None:
    rows = {"A/1.csv": "10,20", "A/2.csv": "10,20", "A/t (1).csv": "5,11", "A/t (2).csv": "5,11"}
    write(tmp_path, **{name: f"robots,delivered\n{row}\n" for name, row in rows.items()})
    assert [row.performance for row in read_trials(tmp_path).rows] == [20.0, 20.0, 11.0, 11.0]
    for name in ("A/2 (1).csv", "A/2_backup.csv", "A/Copy of 2.csv", "old/A/2.csv", "A/2.txt"):
        write(tmp_path, **{name: "robots,delivered\n10,20\n"})
        assert len(read_trials(tmp_path).rows) == 4
        (tmp_path / name).unlink()
    # The same rows under other conditions are others.
    for robots in (4, 8):
        write(tmp_path / "swarm", **{f"robots={robots}/0.csv": "delivered\n0\n"})
    assert [row.n_robots for row in read_trials(tmp_path / "swarm").rows] == [4, 8]


def test_a_column_that_is_left_out_need_not_be_in_all_files(tmp_path: Path) -> None:
    remarks = OTHER_DAY.replace("delivered", "delivered,note").replace(",25", ",25,slipped")
    write(tmp_path, **{"day1.csv": DAY, "day2.csv": remarks})
    with pytest.raises(
        spi.IndicatorError, match=r"day1\.csv has no column 'note'.*--ignore 'note'"
    ):
        read_trials(tmp_path)
    assert len(read_trials(tmp_path, ignore=["note"]).rows) == 8


def test_files_whose_names_say_different_things_are_refused(tmp_path: Path) -> None:
    write(tmp_path, **{"day=1.csv": DAY, "other.csv": OTHER_DAY})
    with pytest.raises(spi.IndicatorError) as caught:
        read_trials(tmp_path)
    first = tmp_path / "day=1.csv"
    assert str(caught.value) == f"{tmp_path / 'other.csv'} names nothing, but {first} day"


def test_folders_name_policies_and_values_and_rows_are_counted_through(tmp_path: Path) -> None:
    sized = {f"{policy}/width={width}/map= hall .csv": "robots,P\n4,1\n8,2\n"
             for policy, width in (("ours", 2), ("base", 3))}  # fmt: skip
    trials = read_trials(write(tmp_path / "lab", **sized))
    assert (trials.file, trials.notes[0]) == ("lab", "The folder holds 2 files: 4 rows.")
    assert [(row.policy, row.n_robots, row.line, row.parameters) for row in trials.rows] == [
        ("base", 4, 1, (("width", 3.0),)), ("base", 8, 2, (("width", 3.0),)),
        ("ours", 4, 3, (("width", 2.0),)), ("ours", 8, 4, (("width", 2.0),)),
    ]  # fmt: skip
    wrong = write(tmp_path / "wrong", **{"a/b.csv": "robots,P\n4,1\n8,two\n"})
    with pytest.raises(spi.IndicatorError, match=r"^.*a/b\.csv, line 3, column 'P': 'two': should"):
        read_trials(wrong)


def test_a_file_whose_columns_are_named_by_hand_counts(tmp_path: Path) -> None:
    write(tmp_path, **{"day1.csv": "swarm,boxes\n4,20\n8,35\n"})
    trials = read_trials(tmp_path, columns={"robots": "swarm", "performance": "boxes"})
    assert [(row.n_robots, row.performance) for row in trials.rows] == [(4, 20.0), (8, 35.0)]
