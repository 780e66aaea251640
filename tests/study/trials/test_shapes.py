"""Thirty shapes of a file of trials, as people and programs write them.

The same sixteen trials of eight robots are in all: twelve without a fault, four with a stuck wheel.
Each is read at the first try, or with the option that the refusal names.
"""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.study.trials import read_trials

WHOLE = [12.5, 11.25, 13.0, 12.0, 12.75, 11.5, 12.25, 13.5, 11.0, 12.0, 13.25, 12.5]
BROKEN = [10.5, 9.75, 8.5, 9.0]


def rows(line: str, sound: str = "none", broken: str = "wheel", comma: str = ".") -> str:
    """Return a line for each trial: {p}, {fault}, {m}, {k} are filled."""
    trials = [(p, sound, 0) for p in WHOLE] + [(p, broken, 1) for p in BROKEN]
    return "".join(
        line.format(p=str(p).replace(".", comma), fault=fault, m=m, k=k) + "\n"
        for k, (p, fault, m) in enumerate(trials)
    )


class Shape(NamedTuple):
    """A file, and the option that its refusal names; "": it is read at once."""

    name: str
    text: str | bytes
    option: str = ""
    refusal: str = ""


SHAPES = [
    Shape("commas", "robots,fault,faulty,delivered\n" + rows("8,{fault},{m},{p}")),
    Shape("semicolons", "robots;fault;faulty;delivered\n" + rows("8;{fault};{m};{p}")),
    Shape("tabs", "robots\tfault\tfaulty\tdelivered\n" + rows("8\t{fault}\t{m}\t{p}")),
    Shape("bars", "robots|fault|faulty|delivered\n" + rows("8|{fault}|{m}|{p}")),
    Shape("Excel's first line", "sep=;\nN;mode;m;P\n" + rows("8;{fault};{m};{p}")),
    Shape("decimal commas", "N;fault;m;P\n" + rows("8;{fault};{m};{p}", comma=",")),
    Shape("quoted", '"N" , "fault","m","P"\n' + rows('"8", "{fault}" ,"{m}", "{p}" ')),
    Shape("Windows line ends", ("N,fault,m,P\n" + rows("8,{fault},{m},{p}")).replace("\n", "\r\n")),
    Shape("old Mac line ends", ("N,fault,m,P\n" + rows("8,{fault},{m},{p}")).replace("\n", "\r")),
    Shape("byte order mark", "\ufeffN,fault,m,P\n" + rows("8,{fault},{m},{p}")),
    Shape("UTF-16", ("N\tfault\tm\tP\n" + rows("8\t{fault}\t{m}\t{p}")).encode("utf-16")),
    Shape("cp1252", ("N;fault;m;P\n" + rows("8;{fault};{m};{p}", broken="Räder")).encode("cp1252")),
    Shape("another order", "Items [box],n_robots,failed,failure\n" + rows("{p},8,{m},{fault}")),
    Shape("units", "Robots [-],Fault,Faulty (robots),Score [items]\n" + rows("8,{fault},{m},{p}")),
    Shape("capitals and blanks", " N , Fault , M , P \n" + rows(" 8 , {fault} , {m} , {p} ")),
    Shape("an empty column", "N,fault,m,P,seed\n" + rows("8,{fault},{m},{p},")),
    Shape("empty lines", "\nN,fault,m,P\n\n" + rows("8,{fault},{m},{p}") + ",,,\n\n,,,\n"),
    Shape("an empty fault", "N,fault,m,P\n" + rows("8,{fault},{m},{p}", sound="")),
    Shape("NA for no fault", "N,fault,m,P\n" + rows("8,{fault},{m},{p}", sound="NA")),
    Shape("German for no fault", "N;fault;m;P\n" + rows("8;{fault};{m};{p}", sound="keiner")),
    Shape("others' names", "agents,failure_mode,n_faulty,throughput\n" + rows("8,{fault},{m},{p}")),
    Shape("a number of its own each", "id,N,fault,m,P\n" + rows("{k},8,{fault},{m},{p}")),
    Shape("a temperature", "N,fault,m,P,temperature\n" + rows("8,{fault},{m},{p},2{k}.5")),
    Shape("days", "N,fault,m,P,day\n" + rows("8,{fault},{m},{p},Monday")),
    Shape("comments first", "# in May\n# hall 3\nN,fault,m,P\n" + rows("8,{fault},{m},{p}")),
    Shape("thousands", "N;fault;m;P\n" + rows("8;{fault};{m};1'{m}{m}{m}").replace("'000", "'200")),
    Shape(
        "another name",
        "N,fault,m,boxes\n" + rows("8,{fault},{m},{p}"),
        "--column performance=boxes",
        "say which it is by --column performance=boxes",
    ),
    Shape(
        "a note",
        "N,fault,m,P,note\n" + rows("8,{fault},{m},{p},ok").replace("ok", "battery", 1),
        "--ignore note",
        "else --ignore note",
    ),
    Shape(
        "two performances",
        "N,fault,m,P,items\n" + rows("8,{fault},{m},{p},{p}"),
        "--ignore items",
        "leave one of them out by --ignore items",
    ),
    Shape(
        "a row a robot",
        "trial,robot,N,fault,m,P\n"
        + rows("{k},0,8,{fault},{m},1")
        + rows("{k},1,8,{fault},{m},{p}"),
        "--sum-over robot",
        "by --sum-over robot",
    ),
]  # fmt: skip

READING = {"--column": "columns", "--ignore": "ignore", "--sum-over": "sum_over"}


def reading(option: str) -> dict[str, Any]:
    """Return the arguments of `read_trials` that an option of the command line stands for."""
    if not option:
        return {}
    name, value = shlex.split(option)
    if name == "--column":
        return {"columns": dict([value.split("=")])}
    return {READING[name]: value if name == "--sum-over" else [value]}


def test_there_are_thirty_shapes() -> None:
    assert len(SHAPES) == len({shape.text for shape in SHAPES}) == 30


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
def test_a_shape_is_read_at_once_or_as_the_refusal_says(shape: Shape, tmp_path: Path) -> None:
    path = tmp_path / "trials.csv"
    text = shape.text
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    if shape.option:
        with pytest.raises(spi.IndicatorError) as refused:
            read_trials(path)
        assert shape.refusal in str(refused.value)
    trials = read_trials(path, **reading(shape.option))
    sound = trials.performance(fault="none")
    (fault,) = {row.fault for row in trials.rows} - {"none"}
    broken = trials.performance(fault=fault)
    expected = WHOLE, BROKEN
    if shape.name == "thousands":
        expected = [1200.0] * 12, [1111.0] * 4
    elif shape.name == "a row a robot":
        expected = [p + 1.0 for p in WHOLE], [p + 1.0 for p in BROKEN]
    assert (sound.tolist(), broken.tolist()) == (list(expected[0]), list(expected[1]))
    assert {row.n_robots for row in trials.rows} == {8}
    encoding = "The file is no UTF-8: it is read as Windows-1252 (cp1252)."
    assert (encoding in trials.notes) == (shape.name == "cp1252")


@pytest.mark.parametrize("has_trial", [False, True])
def test_who_leaves_out_the_robots_is_told_of_a_column_that_is_missing(
    has_trial: bool, tmp_path: Path
) -> None:
    path = tmp_path / "trials.csv"
    path.write_text(f"{'trial' if has_trial else 'day'},robot,N,P\n3,0,2,4\n3,1,2,5\n4,0,2,4\n")
    with pytest.raises(spi.IndicatorError, match="by --sum-over 'robot'") as refused:
        read_trials(path, ignore=["robot"])
    assert ("name each row's trial in a column 'trial'" in str(refused.value)) != has_trial
