"""Reading trials as people type them."""

from __future__ import annotations

import codecs
import csv
import io
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env import spi
from swarm_logistics_env.core.csv_cells import inert
from swarm_logistics_env.study.trials import Trials, read_trials


def read(tmp_path: Path, text: str, **options: Any) -> Trials:
    path = tmp_path / "trials.csv"
    path.write_bytes(text.encode(errors="surrogateescape"))
    return read_trials(path, **options)


# Semicolons, decimal commas, a unit, a fault of its own, a note, no seeds.
COMMAS = """trial;robots;fault;faulty;delivered;width [m];note
1;8;none;;12,5;2;
2;8;none;;11,25;2;battery
3;8;wheel;1;10,5;2;
4;8;none;;9,5;1,5;
"""


def test_a_file_with_decimal_commas_is_read(tmp_path: Path) -> None:
    trials = read(tmp_path, COMMAS, ignore=["note"], decimal=",")
    assert (trials.paired, len(trials.rows)) == (False, 4)
    sound = {"n_robots": 8, "width [m]": 2.0}
    assert trials.performance(fault="none", **sound).tolist() == [12.5, 11.25]
    assert trials.performance(fault="wheel", faulty=1).tolist() == [10.5]
    assert trials.performance(**{"width [m]": 1.5}).tolist() == [9.5]
    with pytest.raises(spi.IndicatorError, match="no trial with fault = 'wheal'"):
        trials.performance(fault="wheal")


def test_a_mode_is_one_mode_however_it_is_typed(tmp_path: Path) -> None:
    trials = read(tmp_path, "robots,fault,faulty,p\n4,none,0,9\n4,Fm1,1,7\n4,FM1,1,6\n4,fm1,1,5\n")
    assert [row.fault for row in trials.rows] == ["none", "FM1", "FM1", "FM1"]
    assert trials.notes[0] == "The faults FM1 and Fm1 are taken for one."


def test_columns_of_other_names_are_mapped(tmp_path: Path) -> None:
    columns = {"performance": "boxes", "n_robots": "swarm"}
    text = "swarm,boxes,weather,p\n4,5,sun,.5\n8,9,rain,.7\n"
    rows = read(tmp_path, text, columns=columns, ignore=["weather"]).rows
    assert [(row.n_robots, row.performance) for row in rows] == [(4, 5.0), (8, 9.0)]
    assert [row.parameters for row in rows] == [(("p", 0.5),), (("p", 0.7),)]


def test_seeds_pair_whatever_the_order(tmp_path: Path) -> None:
    trials = read(tmp_path, "robots,seed,p\n4,7,1\n4,3,2\n8,3,30\n8,7,10\n")
    assert trials.paired
    assert trials.performance(n_robots=4).tolist() == [2, 1]
    assert trials.performance(n_robots=8).tolist() == [30, 10]


def test_an_event_log_counts_deliveries_and_keeps_their_times(tmp_path: Path) -> None:
    text = (
        "trial,robots,fault,faulty,onset,time [s]\n"
        "1,4,none,0,,30.5\n1,4,none,0,,12.25\n2,4,none,0,,\n3,4,jam,1,20,50\n"
    )
    rows = read(tmp_path, text, duration=60.0).rows
    assert [row.times for row in rows] == [(12.25, 30.5), (), (50.0,)]
    assert [row.performance for row in rows] == [2.0, 0.0, 1.0]
    assert rows[2].onset == 20.0


def test_without_a_fault_an_onset_tells_no_conditions_apart(tmp_path: Path) -> None:
    text = "robots,fault,faulty,onset,p\n8,none,,,9\n8,none,,20,8\n8,jam,1,20,7\n8,jam,1,30,6\n"
    rows = read(tmp_path, text).rows
    assert [row.onset for row in rows] == [0.0, 0.0, 20.0, 30.0]
    assert len({row.condition for row in rows}) == 3


def test_a_policy_is_named_by_a_column_and_not_by_a_number(tmp_path: Path) -> None:
    with pytest.raises(spi.IndicatorError, match="has no column '5'"):
        read(tmp_path, "robots,P\n4,9\n4,8\n", columns={"policy": "5"})


HEAD = "trial,robots,fault,faulty,delivered\n"
GOOD = "1,8,none,,10\n"
JAM = "trial,robots,fault,faulty,onset,time\n1,4,jam,1,20,30\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty: should have a row of column names"),
        (" \n;;\n", "is empty: should have a row of column names"),
        (HEAD, "holds no trial"),
        ("robots,p\n4,\udc81\n", "is text neither in UTF-8 nor in Windows-1252: save it as CSV"),
        ("robots,p\n4,\x001\n", r"line 2: holds '\x00': should be plain text"),
        ("trial,robots\n1,8\n", "has no column 'performance', or time"),
        ("robots,fault,broken,boxes\n4,jam,1,2\n", "column 'faulty', for how many robots fail: it"),
        ("robots,p,items\n4,1,1\n", "has columns 'p' and 'items', both performance"),
        ("robots,fualt,p\n4,none,1\n", "has a column 'fualt'; did you mean 'fault'?"),
        (HEAD + GOOD + "2,8,none,,ten\n", "line 3, column 'delivered': 'ten': should be a number"),
        (HEAD + "1,8,none,,12,5\n", "line 2: has 6 values, more values than the 5 columns"),
        # Each would swallow what is below it, or lose a sign.
        (HEAD + GOOD + '"2,8,none,,7\n' + GOOD, "line 3: opens a quote that is not closed at its"),
        (HEAD + '1,8,"no"ne,,7\n', "line 2: opens a quote that is not closed at its cell's end"),
        (HEAD + GOOD + '2,8,"none,,7\n3,8,"x",,1\n', "line 3: opens a quote that is not closed"),
        (HEAD + '1,8,none,,"7\n2,8,none,,8\n3,8,none,,"\n', "line 2: opens a quote that holds who"),
        # 1200 or 1.2?
        ("robots;p\n4;50\n4;9.999\n4;1.200\n", "line 4, column 'p': '1.200': is 1200 or 1.2"),
        (
            "robots;p\n4;980\n4;1.200\n",
            "line 3, column 'p': '1.200': is 1200 or 1.2, beside 980 in",
        ),
        ("robots;p\n4;10\n4;2\n4;1.000\n", "line 4, column 'p': '1.000': is 1000 or 1, beside 10"),
        (
            "robots;p;x\n4;1;980\n4;2;1.250\n",
            "line 3, column 'x': '1.250': is 1250 or 1.25, beside",
        ),
        ("robots;p\n4;1.204.000\n", "'1.204.000': should be a number, 0 or more without a sign be"),
        ("robots,seed,p\n4,1e3,1\n", "column 'seed': '1e3': should be a whole number with all its"),
        ("robots,seed,p\n4,9007199254740993.0,1\n", "should be a whole number with all its digits"),
        (f"robots,p\n{'9' * 5000},1\n", "should be a whole number, 1 or more"),
        ("robots,seed,p\n4,7.5,1\n", "column 'seed': '7.5': should be a whole number, 0 or more"),
        ('robots,p\n4,"1,204"\n8,998\n', "line 2, column 'p': '1,204': should be a number, 0 or"),
        ("robots,p,note\n4,1,a\n8,2,b\n", "line 2, column 'note': 'a': should be a number, as"),
        (HEAD + GOOD + "2,8,jam,,7\n", "line 3, column 'faulty': nothing: should be how many"),
        (HEAD + GOOD + "2,8,none,2,7\n", "line 3, column 'faulty': '2': should be 0 without"),
        (HEAD + GOOD + "2,8,jam,8,7\n", "column 'faulty': '8': should be less than the 8 robots"),
        (
            "fault,faulty,p\njam,1,7\n",
            "no column 'robots', for the swarm's size, without which R is",
        ),
        (HEAD + GOOD + "1,8,none,,7\n", "line 3, column 'trial': '1': is in line 2 too"),
        ("robots,onset,duration,p\n4,60,60,1\n", "'60': should be before the trial ends at 60 s"),
        ("robots,seed,p\n4,0,1\n8,,2\n", "line 3: has no seed"),
        ("robots,seed,p\n4,0,1\n4,0,2\n", "line 3: has seed 0 like line 2"),
        ("robots,p,duration\n4,1,60\n8,2,90\n", "line 3: is not as long as line 2"),
        (
            "robots,time\n4,1\n",
            "line 2: trial is missing: should say which run a delivery belongs to",
        ),
        ("trial,robots,time,p\n1,4,1,1\n", "column 'p': '1': should not stand beside times"),
        (JAM, "line 2: duration is missing: should say when a trial ends"),
        ("trial,duration,time\n1,60,70\n", "column 'time': '70': should not be after its duration"),
    ],
)
def test_a_broken_file_is_refused_by_line_column_and_remedy(
    tmp_path: Path, text: str, words: str
) -> None:
    with pytest.raises(spi.IndicatorError) as caught:
        read(tmp_path, text)
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "trials.csv"))
    # A file that lacks two columns is told of both.
    assert len(str(caught.value).splitlines()) == (2 if "broken" in text else 1)


def test_a_number_that_splits_the_trials_is_named(tmp_path: Path) -> None:
    text = "robots,temperature,p\n4,20,1\n4,20,2\n8,20,2\n8,21,3\n"
    assert "4 trials in 3 conditions, told apart by temperature" in read(tmp_path, text).notes[0]
    assert read(tmp_path, text, ignore=["temperature"]).notes == ()


def test_a_fault_that_is_nearly_another_is_named(tmp_path: Path) -> None:
    text = "robots,fault,faulty,p\n6,none,0,9\n6,R motor,1,7\n6,R motor,1,6\n6,R motr,1,6\n"
    (note,) = read(tmp_path, text).notes
    correction = note.partition("--value '")[2].partition("'")[0]
    assert correction == "fault:R motr=R motor"
    assert read(tmp_path, text, values=[correction]).notes == ()


def test_a_column_that_is_left_out_is_named_if_it_differs_between_conditions(
    tmp_path: Path,
) -> None:
    text = "robots,tags,p\n4,32,1\n4,32,2\n8,64,2\n8,64,3\n"
    (note,) = read(tmp_path, text, ignore=["tags"]).notes
    assert note.startswith("'tags' is left out, though it differs between conditions")


def test_a_mapping_that_cannot_be_is_refused(tmp_path: Path) -> None:
    for options, words in (
        ({"columns": {"performanse": "delivered"}}, "did you mean 'performance'?"),
        ({"ignore": ["faultz"]}, "no column 'faultz': did you mean 'fault'"),
        ({"decimal": ";"}, "--decimal ;: should be . or ,"),
    ):
        with pytest.raises(spi.IndicatorError) as caught:
            read(tmp_path, HEAD + GOOD, **options)
        assert words in str(caught.value)
    with pytest.raises(spi.IndicatorError, match=r"cannot read .*nowhere\.csv: No such file"):
        read_trials(tmp_path / "nowhere.csv")


ROBOTS = "{},robots,fault,faulty,delivered{}\n" + "".join(
    f"{{}}{robot},8,{fault},{5 + robot}{{}}\n"
    for fault in ("none,0", "jam,1")
    for robot in range(4)
)


@pytest.mark.parametrize(
    "name", ["robot", "Robot ID", "robot_no", "agent_id", "Agent", "drone [-]"]
)
def test_a_row_a_robot_is_refused_with_and_without_its_column(tmp_path: Path, name: str) -> None:
    text = ROBOTS.format(name, *[""] * 17)
    for ignored in ([], [name]):
        with pytest.raises(spi.IndicatorError) as caught:
            read(tmp_path, text, ignore=ignored)
        assert "the unit is the trial, never the robot; sum the deliveries of" in str(caught.value)
        assert "--ignore" not in str(caught.value)
    # It may as well be the swarm's size, or say which robot failed in each trial.
    assert read(tmp_path, f"{name},p\n4,1\n8,2\n", columns={"robots": name}).rows[1].n_robots == 8
    trials = "trial," + text.replace("\n", "\n{},").removesuffix("{},").format(*range(8))
    assert len(read(tmp_path, trials, ignore=[name]).rows) == 8
    with pytest.raises(spi.IndicatorError, match="never the robot"):  # one of them is the same
        read(tmp_path, trials.replace("\n1,", "\n0,"), ignore=[name])


def test_who_delivered_is_left_out_of_an_event_log(tmp_path: Path) -> None:
    rows = read(tmp_path, "trial,robots,robot,time\n1,4,2,3.5\n1,4,0,7\n").rows
    assert [(row.performance, row.parameters) for row in rows] == [(2.0, ())]


def test_a_column_that_is_left_out_is_not_read(tmp_path: Path) -> None:
    trajectory = "x" * 200_000  # longer than the csv module takes by itself
    text = f"robots,p,seed,fault\n4,1,3,jam\n4,2,3,{trajectory}\n"
    rows = read(tmp_path, text, ignore=["seed", "fault"]).rows
    assert [(row.seed, row.fault) for row in rows] == [(None, "none")] * 2


def test_seeds_are_exact(tmp_path: Path) -> None:
    seeds = [2**53, 2**53 + 1, 10**30 + 1]
    for written, expected in (([*map(str, seeds)], seeds), (["7.0", "+8", "09"], [7, 8, 9])):
        rows = [f"{n},{seed},{n}" for n in (4, 8) for seed in written]
        trials = read(tmp_path, "\n".join(["robots,seed,p", *rows]))
        assert [row.seed for row in trials.rows] == expected * 2


def test_a_point_may_stand_before_three_decimals(tmp_path: Path) -> None:
    for text, options in (
        ("robots;p\n4;980\n4;1.200\n", {"decimal": "."}),
        ("robots;p\n4;980\n4;1.25\n4;1.200\n", {}),
        ("robots;p\n4;2\n4;1.125\n", {}),
        ("robots;p\n4;9\n4;1.000\n", {}),
        ("robots;p\n4;9\n4;0.125\n", {}),
    ):
        written = re.findall(r";([\d.]+)", text)
        assert [row.performance for row in read(tmp_path, text, **options).rows] == [
            float(cell) for cell in written
        ]
    with pytest.raises(
        spi.IndicatorError, match=r"'1\.200': .*--decimal \. where decimals have a p"
    ):
        read(tmp_path, "robots;p\n4;980,5\n4;1.200\n", decimal=",")


CELL = st.text(st.sampled_from("ab'\"=+-@ é1\t") | st.sampled_from("\n\r\v\f\x85\u2028\u2029"))
ROW = st.tuples(st.floats(0.0, 1e9), CELL)


@given(
    rows=st.lists(ROW, min_size=1, max_size=5),
    delimiter=st.sampled_from(",;\t"),
    line_end=st.sampled_from(["\n", "\r\n", "\r"]),
    quoting=st.sampled_from([csv.QUOTE_ALL, csv.QUOTE_MINIMAL, csv.QUOTE_NONNUMERIC]),
    decimal=st.sampled_from(".,"),
    start=st.sampled_from(["", "sep=", "\n"]),
    ends=st.booleans(),
    marked=st.booleans(),
)
def test_what_is_written_is_read_row_by_row(
    rows: list[tuple[float, str]], delimiter: str, line_end: str, quoting: Any, decimal: str,
    start: str, ends: bool, marked: bool, tmp_path_factory: pytest.TempPathFactory,
) -> None:  # fmt: skip
    file = io.StringIO(newline="")
    writer = csv.writer(file, delimiter=delimiter, lineterminator=line_end, quoting=quoting)
    writer.writerow(["p", "policy", "robots"])
    lines = []
    head = (
        start and f"sep={delimiter}{line_end}" if start == "sep=" else start.replace("\n", line_end)
    )
    # A cell that holds a whole row is refused, as a quote that is closed too late.
    # Python's writer leaves ends of lines without quotes if they are not those of its own lines.
    lost = delimiter + "\r\n" * (quoting == csv.QUOTE_MINIMAL)
    rows = [(p, text.translate(dict.fromkeys(map(ord, lost)))) for p, text in rows]
    # A policy that only some rows name is refused.
    rows = [(p, text if text.strip() else "b") for p, text in rows]
    for p, text in rows:
        lines.append(1 + len(re.findall(r"\r\n|\r|\n", head + file.getvalue())))
        writer.writerow([repr(p).replace(".", decimal), inert(text), "4"])
    written = head + file.getvalue()
    written = written if ends else written.removesuffix(line_end)
    path = tmp_path_factory.mktemp("trials") / "t.csv"
    path.write_bytes(codecs.BOM_UTF8 * marked + written.encode())
    trials = read_trials(path, decimal=decimal).rows
    assert [(row.performance, row.line) for row in trials] == [*zip((p for p, _ in rows), lines)]
    for row, (_, text) in zip(trials, rows):
        assert row.policy == (re.sub("[\n\v\f\r\x85\u2028\u2029]+", " ", text.strip()))


def test_a_seed_alone_tells_two_runs_of_an_event_log_apart(tmp_path: Path) -> None:
    rows = read(tmp_path, "seed,robots,time\n0,4,3\n1,4,9\n1,4,5\n2,4,\n").rows
    assert [(row.seed, row.times) for row in rows] == [(0, (3.0,)), (1, (5.0, 9.0)), (2, ())]


def test_a_label_may_stand_in_several_conditions_once_each(tmp_path: Path) -> None:
    rows = "robots,fault,faulty,trial,p\n8,none,0,1,10\n8,none,0,2,9\n8,jam,1,1,7\n"
    trials = read(tmp_path, rows).rows
    assert [(row.fault, row.performance) for row in trials] == [
        ("none", 10.0), ("none", 9.0), ("jam", 7.0),
    ]  # fmt: skip
    with pytest.raises(spi.IndicatorError, match=r"line 5, .*'1': is in line 4 too"):
        read(tmp_path, f"{rows}8,jam,1,1,6\n")


def test_what_differs_in_every_row_tells_no_conditions_apart(tmp_path: Path) -> None:
    rows = [f"{n},{temperature},9" for temperature, n in enumerate([4, 4, 4, 8, 8, 8])]
    trials = read(tmp_path, "\n".join(["robots,temperature,p", *rows]))
    assert {row.parameters for row in trials.rows} == {()}
    assert trials.notes == (
        "'temperature' differs from trial to trial: it tells no conditions apart.",
    )
    few = read(tmp_path, "\n".join(["robots,temperature,p", *rows[:3]]))
    assert len({row.parameters for row in few.rows}) == 3


def test_every_column_is_told_with_what_it_was_taken_for(tmp_path: Path) -> None:
    text = "seed,robots,fault,faulty,p,width,charge,hall,note\n"
    for row in range(24):
        text += f"{row // 4},{4 + row % 2},none,0,{row},{row // 2 % 2},5{row},3,{row % 5}\n"
    columns = read(tmp_path, text, ignore=["note"], reference={"width": 1.0}).columns
    assert {column.name: (column.use, column.n_values) for column in columns} == {
        "seed": ("seed", 6),
        "robots": ("robots", 2),
        "fault": ("fault", 1),
        "faulty": ("faulty", 1),
        "p": ("performance", 24),
        "width": ("parameter", 2),
        "charge": ("covariate", 24),
        "hall": ("the same in all", 1),
        "note": ("left out", 5),
    }
    assert columns[4].values == ("0", "1", "2", "3", "4", "5")


@pytest.mark.parametrize("word", ["", "None", "no fault", "baseline", "healthy", "0", "-", "NA"])
def test_words_for_no_fault(tmp_path: Path, word: str) -> None:
    rows = read(tmp_path, f"robots,fault,faulty,p\n8,{word},0,9\n8,jam,1,7\n").rows
    assert [row.fault for row in rows] == ["none", "jam"]


def test_a_time_to_finish_gives_a_rate(tmp_path: Path) -> None:
    text = "robots,boxes,time to finish [s],done,lasted\n5,20,925,,\n10,30,510,,\n20,30,,9,300\n"
    columns = {"work": "boxes", "performance": "done", "duration": "lasted"}
    trials = read(tmp_path, text, columns=columns)
    assert [row.performance for row in trials.rows] == [20 / 925, 30 / 510, 9 / 300]
    assert trials.notes == ("P is boxes divided by time to finish [s]: more is better.",)
    alone = read(tmp_path, "robots,makespan\n5,925\n10,510\n")
    assert [row.performance for row in alone.rows] == [1 / 925, 1 / 510]
    with pytest.raises(spi.IndicatorError, match="of a trial that did not finish, columns should"):
        read(tmp_path, "robots,makespan\n5,925\n10,\n")
    with pytest.raises(spi.IndicatorError, match="column 'work': nothing: should be a number"):
        read(tmp_path, "robots,work,makespan\n5,20,925\n10,,510\n")


@pytest.mark.parametrize("name", ["Time", "total time", "result [s]", "steps [steps]"])
def test_a_time_is_no_performance(tmp_path: Path, name: str) -> None:
    with pytest.raises(spi.IndicatorError, match="is a time by its name") as caught:
        read(tmp_path, f"robots,{name}\n5,925\n10,510\n", columns={"performance": name})
    assert f"--column time_to_finish={name!r}" in str(caught.value)
