"""What a spreadsheet does to cells: merged, hidden, computed and rounded ones."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.study.trials import Trials, read_trials

openpyxl = pytest.importorskip("openpyxl")

HEADER = ("policy", "robots", "fault", "faulty", "delivered")
WHOLE = [("A", 10, "none", 0, 20 + k) for k in range(3)]
BROKEN = [("A", 10, "FM1", 2, 10 + k) for k in range(3)]


def workbook(
    path: Path,
    rows: Any,
    change: Callable[[Any], object] = lambda sheet: None,
    header: tuple[str | None, ...] = HEADER,
) -> Path:
    book = openpyxl.Workbook()
    for row in (header, *rows):
        book.active.append(row)
    change(book.active)
    book.save(path)
    return path


def conditions(trials: Trials) -> list[tuple[object, ...]]:
    return [(t.policy, t.n_robots, t.fault, t.faulty, t.performance) for t in trials.rows]


def merge(*ranges: str) -> Callable[[Any], None]:
    def change(sheet: Any) -> None:
        for cells in ranges:
            sheet.merge_cells(cells)

    return change


def put(cell: str, value: object) -> Callable[[Any], None]:
    return lambda sheet: sheet.__setitem__(cell, value)


@pytest.mark.parametrize(
    "ranges",
    [
        ("C5:C7", "D5:D7"),
        ("A2:A7",),
        ("A2:A7", "B2:B4", "B5:B7"),
        ("A2:B2",),
        ("A9:B12",),  # of nothing
        ("A9:B10", "C9:D10", "A11:B12", "C11:D12", "A13:B14", "A2:A7"),  # in any order
    ],
)
def test_a_merged_range_has_its_value_in_every_row(tmp_path: Path, ranges: tuple[str, ...]) -> None:
    expected = [*WHOLE, *BROKEN]
    if ranges == ("A2:B2",):  # across columns it is the first one's
        with pytest.raises(spi.IndicatorError, match="row 2, column 'robots': nothing"):
            read_trials(workbook(tmp_path / "t.xlsx", expected, merge(*ranges)))
        return
    trials = read_trials(workbook(tmp_path / "t.xlsx", expected, merge(*ranges)))
    assert conditions(trials) == expected
    assert trials.notes == ()


def test_names_may_be_merged_with_the_row_below_them_but_not_with_each_other(
    tmp_path: Path,
) -> None:
    rows = [(None,) * 5, *WHOLE]
    down = merge(*(f"{column}1:{column}2" for column in "ABCDE"))
    assert conditions(read_trials(workbook(tmp_path / "t.xlsx", rows, down))) == WHOLE
    with pytest.raises(spi.IndicatorError, match="has two columns 'faulty'"):
        read_trials(workbook(tmp_path / "t.xlsx", WHOLE, merge("D1:E1")))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (merge("E2:E4"), "row 3, column 'delivered': '20': should be of one trial alone"),
        (put("E3", "=E2*2"), "row 3, column 'delivered': '=E2*2': should be a value, as nobody"),
        (put("A3", "=A2"), "row 3, column 'policy': '=A2': should be a value, as nobody comp"),
        (put("C5", "#N/A"), "row 5, column 'fault': '#N/A': should be a value, where a spreads"),
        (put("E5", "#DIV/0!"), "row 5, column 'delivered': '#DIV/0!': should be a value, where"),
        (put("E8", "=AVERAGE(E2:E7)"), "row 8, column 'delivered': '=AVERAGE(E2:E7)'"),
        (put("E8", 15), "row 8, column 'policy': nothing: should be there in each row"),
        (put("B4", "NA"), "row 4, column 'robots': 'NA': should be a whole number"),
        (put("C5", "NA"), "row 5, column 'fault': 'NA': should name what failed, as other"),
    ],
)
def test_a_cell_without_a_value_of_its_own_is_refused(
    tmp_path: Path, change: Callable[[Any], object], words: str
) -> None:
    path = workbook(tmp_path / "t.xlsx", [*WHOLE, *BROKEN], change)
    with pytest.raises(spi.IndicatorError) as caught:
        read_trials(path)
    assert str(caught.value).startswith(f"{path}, {words}")


def test_a_formula_counts_once_a_spreadsheet_has_computed_it(tmp_path: Path) -> None:
    def saved(name: str, replaced: dict[str, str]) -> Path:
        """Return the workbook with other words in its parts, as other programs write them."""
        path = workbook(tmp_path / "t.xlsx", WHOLE, put("E3", "=E2+1"))
        with zipfile.ZipFile(path) as old, zipfile.ZipFile(tmp_path / name, "w") as new:
            for entry in old.namelist():
                part = old.read(entry).decode()
                for text, other_text in replaced.items():
                    part = part.replace(text, other_text)
                new.writestr(entry, part)
        return tmp_path / name

    value = {
        "<f>E2+1</f><v />": "<f>E2+1</f><v>21</v>",
        "<f>E2+1</f><v></v>": "<f>E2+1</f><v>21</v>",
    }
    computed = {**value, 'fullCalcOnLoad="1"': ""}
    assert conditions(read_trials(saved("computed.xlsx", computed))) == WHOLE
    # A program that computes nothing writes 0 or anything, and asks for the value by this word.
    with pytest.raises(spi.IndicatorError, match=r"row 3, column 'delivered': '=E2\+1'"):
        read_trials(saved("asked.xlsx", value))


def test_what_is_not_read_may_hold_errors(tmp_path: Path) -> None:
    rows = [(*row, "ok") for row in WHOLE]
    path = workbook(tmp_path / "t.xlsx", rows, put("F3", "#REF!"), (*HEADER, "note"))
    assert conditions(read_trials(path, ignore=["note"])) == WHOLE


def test_na_is_a_name_like_any_other(tmp_path: Path) -> None:
    rows = [(name, *row[1:]) for name in ("NA", "N/A", "None") for row in WHOLE]
    assert conditions(read_trials(workbook(tmp_path / "t.xlsx", rows))) == rows
    text = "robots,map,p\n4,NA,1\n4,hall,2\n8,NA,3\n8,hall,4\n"
    (tmp_path / "t.csv").write_text(text)
    assert [row.seed for row in read_trials(tmp_path / "t.csv").rows] == [0, 1, 0, 1]
    (tmp_path / "t.csv").write_text(text.replace("hall", "7"))
    with pytest.raises(spi.IndicatorError, match="line 2, column 'map': 'NA': should be a number"):
        read_trials(tmp_path / "t.csv")


def test_hidden_rows_and_sheets_are_left_out_and_hidden_columns_read(tmp_path: Path) -> None:
    def hide(sheet: Any) -> None:
        sheet.title = "trials"
        sheet.row_dimensions[3].hidden = sheet.row_dimensions[99].hidden = True  # 99 is empty
        sheet.column_dimensions["D"].hidden = True
        lists = sheet.parent.create_sheet("lists", 0)
        lists.append(["robots", "delivered"])
        lists.sheet_state = "hidden"

    trials = read_trials(workbook(tmp_path / "t.xlsx", [*WHOLE, *BROKEN], hide))
    assert conditions(trials) == [WHOLE[0], WHOLE[2], *BROKEN]
    assert trials.notes == (
        (
            "Hidden rows of t.xlsx are left out, as a filter or a group hides them: 1 (rows 3). "
            "Show them in the sheet if they count."
        ),
        "Hidden columns of t.xlsx are read: 'faulty'. --ignore NAME leaves one out.",
        "Hidden sheets of t.xlsx are left out: 'lists'.",
    )

    def hide_all(sheet: Any) -> None:
        sheet.sheet_state = "hidden"
        sheet.parent.create_sheet("empty")

    with pytest.raises(spi.IndicatorError, match="content in hidden sheets alone"):
        read_trials(workbook(tmp_path / "t.xlsx", WHOLE, hide_all))

    def hide_six(sheet: Any) -> None:
        for line in range(2, 8):
            sheet.row_dimensions[line].hidden = True

    trials = read_trials(workbook(tmp_path / "t.xlsx", [*WHOLE, *WHOLE, *WHOLE], hide_six))
    assert conditions(trials) == WHOLE
    assert "6 (rows 2, 3, 4, 5, 6, ..). Show" in trials.notes[0]


def test_numbers_that_a_spreadsheet_rounds_are_no_seeds(tmp_path: Path) -> None:
    header = ("robots", "seed", "delivered")
    for seed, is_exact in (
        (3.0, True),
        (2**53 - 1, True),
        (2**53 + 1, False),
        (1234567890123450, False),  # the last digit is not there any more
        ("9007199254740993", True),  # a text
    ):
        path = workbook(tmp_path / "t.xlsx", [(4, seed, 1), (8, seed, 2)], header=header)
        if is_exact:
            assert [row.seed for row in read_trials(path).rows] == [int(seed)] * 2
        else:
            with pytest.raises(spi.IndicatorError, match=r"row 2, column 'seed': .*all its digits"):
                read_trials(path)
    # A trial is told from another by its label, too.
    (tmp_path / "t.csv").write_text("trial,robots,time\n2.0240305E+16,4,1\n2.0240305E+16,4,2\n")
    with pytest.raises(spi.IndicatorError, match=r"line 2, column 'trial': .*all its digits"):
        read_trials(tmp_path / "t.csv")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("policy,robots,p\nA,4,1\n,4,2\nB,4,3\n", "line 3, column 'policy': nothing: should be th"),
        ("robots,p\n4,1\n4,2\n,1.5\n", "line 4, column 'robots': nothing: should be there in ea"),
        ("robots,table,p\n4,I,1\n4,,2\n", "line 3, column 'table': nothing: should be there in e"),
        ("robots,fault,faulty,p\n4,none,0,1\n4,FM1,1,2\n4,,,2\n", "line 4, column 'fault': nothi"),
        ("robots,fault,faulty,p\n4,NA,,1\n4,FM1,1,2\n", "line 2, column 'fault': 'NA': should nam"),
        ("robots,fault,faulty,p\n4,FM1,,1\n4,removed,1,2\n", "line 2, column 'faulty': nothing: s"),
        (
            "robots,fault,faulty,onset,duration,p\n4,FM1,1,20,60,1\n4,FM1,1,,60,2\n",
            "line 3, column 'onset': nothing: should be there in each row",
        ),
        ("robots,seed,map,p\n4,0,hall,1\n4,1,,2\n", "line 3, column 'map': nothing: should be th"),
        ("policy,robots,p\nA,4,1\n=A2,4,2\n", "line 3, column 'policy': '=A2': should be a value"),
        ("trial,seed,robots,time\n1,0,4,2\n,0,4,3\n", "line 3, column 'trial': nothing: should"),
        (
            "robots,fault,faulty,p\n,none,0,1\n,FM1,1,2\n",
            "line 3, column 'robots': nothing: should be the swarm's size, or R is undefined",
        ),
    ],
)
def test_a_label_that_a_row_lacks_is_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text(text)
    with pytest.raises(spi.IndicatorError) as caught:
        read_trials(path)
    assert str(caught.value).startswith(f"{path}, {words}")


def test_an_empty_label_is_filled_where_somebody_says_so(tmp_path: Path) -> None:
    text = "policy,robots,fault,faulty,p\nA,4,,,1\n,4,FM1,1,2\n"
    (tmp_path / "t.csv").write_text(text)
    trials = read_trials(tmp_path / "t.csv", values=["policy:=A", "fault:=none"])
    assert conditions(trials) == [("A", 4, "none", 0, 1.0), ("A", 4, "FM1", 1, 2.0)]
    # An empty fault is none where the row itself says that no robot failed.
    (tmp_path / "t.csv").write_text(text.replace("A,4,,,1\n,", "A,4,,0,1\nA,"))
    trials = read_trials(tmp_path / "t.csv")
    assert [row.fault for row in trials.rows] == ["none", "FM1"]
    assert trials.notes == ("An empty cell in 'fault' is taken for no fault.",)


@pytest.mark.parametrize(
    ("faults", "note"),
    [
        (
            ["calm,0", "wheel,1"],
            (
                "The fault 'calm' is taken for no fault, as no robot fails by it; --value "
                "fault:calm=none says so."
            ),
        ),
        (["none,0", *["wheel,1"] * 2, "Wheel,1"], "The faults wheel and Wheel are taken for one."),
        (["NA,0", "wheel,1"], "'NA' in 'mode' is taken for no fault."),
        (["none,0", "wheel,1"], ""),
    ],
)
def test_what_a_fault_is_taken_for_is_told(faults: list[str], note: str, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("robots,mode,faulty,p\n" + "".join(f"4,{fault},9\n" for fault in faults))
    trials = read_trials(path)
    assert trials.notes == ((note,) if note else ())
    assert {row.fault for row in trials.rows} == {"none", "wheel"}


def test_days_are_blocks_however_they_are_written(tmp_path: Path) -> None:
    for first, second in (
        ("2024-03-05", "2024-03-06"), ("05.03.2024", "06.03.2024"), ("5.3.24", "6.3.24"),
        ("5.3.", "6.3."), ("3/5/24", "3/6/24"), ("5. 3. 2024", "6. 3. 2024"),
    ):  # fmt: skip
        rows = [f"{day},{n},1" for n in (4, 8) for day in (first, second)]
        (tmp_path / "t.csv").write_text("\n".join(["day,robots,p", *rows]))
        assert [row.seed for row in read_trials(tmp_path / "t.csv").rows] == [0, 1, 0, 1]


def test_damaged_tables_are_refused_by_name(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    frame = pd.DataFrame({"robots": [4, 8] * 20, "policy": ["A"] * 40, "p": range(40)})
    frame.to_parquet(tmp_path / "good.parquet", write_page_checksum=True)
    frame.to_excel(tmp_path / "good.xlsx", index=False)
    for name, stride in (("good.parquet", 41), ("good.xlsx", 211)):
        content = (tmp_path / name).read_bytes()
        path = tmp_path / f"damaged{Path(name).suffix}"
        expected = conditions(read_trials(tmp_path / name))
        messages = []
        for byte in range(4, len(content), stride):
            damaged = bytearray(content)
            damaged[byte] ^= 1 << byte % 8
            path.write_bytes(damaged)
            try:
                trials = conditions(read_trials(path))
            except spi.IndicatorError as error:
                messages.append(str(error))
            else:
                assert [(*row[1:],) for row in trials] == [(*row[1:],) for row in expected]
        assert messages
        assert all(str(path) in message for message in messages)
