"""What is said of files that programs write, in full, and of those that are none."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.study.trials import read_trials

POGEMA: dict[str, Any] = {
    "metrics": {"CSR": 0.5, "steps": [1, 2]},
    "env_grid_search": {"num_agents": 8, "seed": 0},
    "algorithm": "RHCR",
}
SECOND = "; --column performance=NAME takes another metric."


@pytest.mark.parametrize(
    ("metrics", "performance", "note"),
    [
        ({"CSR": 0.5, "by_step": [1.0], "by_agent": {"a": 1}}, 0.5, "P is CSR."),
        ({"speed": 3, "CSR": 0.5, "ISR": 0.25}, 0.25, f"P is ISR{SECOND}"),
        ({"speed": 3, "way": 4}, 3.0, f"P is speed{SECOND}"),
    ],
)
def test_p_of_results_of_pogema_is_the_first_metric_that_it_is_known_by(
    metrics: dict[str, Any], performance: float, note: str, tmp_path: Path
) -> None:
    path = tmp_path / "t.json"
    entries = [{**POGEMA, "metrics": metrics}, {**POGEMA, "algorithm": "A", "metrics": metrics}]
    path.write_text(json.dumps(entries))
    trials = read_trials(path)
    assert trials.notes == (f"These are results of POGEMA: {note}",)
    assert [(row.policy, row.n_robots, row.seed, row.line) for row in trials.rows] == [
        ("RHCR", 8, 0, 1), ("A", 8, 0, 2),
    ]  # fmt: skip
    assert {row.performance for row in trials.rows} == {performance}
    assert {row.parameters for row in trials.rows} == {()}  # other metrics are no conditions


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (True, "'true'"),
        (float("nan"), "'NaN'"),
        ("x" * 38, f"'\"{'x' * 38}\"'"),
        ("x" * 39, f"'\"{'x' * 39}...'"),
        ({"a": 1}, ""),
    ],
)
def test_a_metric_that_is_no_number_is_shown_as_it_is_written(
    value: object, shown: str, tmp_path: Path
) -> None:
    path = tmp_path / "t.json"
    path.write_text(json.dumps([POGEMA, {**POGEMA, "metrics": {"CSR": value}}]))
    with pytest.raises(spi.IndicatorError) as refused:
        read_trials(path)
    location = f"{path}, record 2, column 'CSR': "
    words = f"{shown or 'nothing'}: should be a number, 0 or more"
    assert str(refused.value).startswith(location + words)


def marl_eval(**steps: Any) -> str:
    return json.dumps({"rware": {"small": {"ippo": {"seed_0": steps}, "mappo": {"seed_0": steps}}}})


@pytest.mark.parametrize(
    ("steps", "performance"),
    [
        ({"b": {"step_count": 9, "return": [3, 4]}, "a": {"step_count": 8, "return": [1]}}, 3.5),
        ({"b": {"step_count": 9, "elapsed_time": 7, "return": 2, "win": 1}, "note": "x"}, 2.0),
        ({"b": {"step_count": 9, "win": 0.5, "reward": 6}}, 6.0),
        ({"b": {"step_count": 9, "win": 0.5}}, 0.5),
        ({"b": {"step_count": 9, "return": 2}, "absolute_metrics": {"return": [5, 7]}}, 6.0),
        ({"b": {"step_count": 9, "return": 2}, "absolute_metrics": {}}, 2.0),
        ({"b": {"return": 4}, "c": {"step_count": 1, "return": 2}}, 2.0),
    ],
)
def test_p_of_marl_eval_is_the_mean_of_the_last_evaluation(
    steps: dict[str, Any], performance: float, tmp_path: Path
) -> None:
    path = tmp_path / "t.json"
    path.write_text(marl_eval(**steps))
    trials = read_trials(path)
    assert [(row.policy, row.performance) for row in trials.rows] == [
        ("ippo", performance), ("mappo", performance),
    ]  # fmt: skip
    assert trials.notes[0].startswith("These are results in the format of marl-eval: P is ")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", " is no JSON: Expecting property name enclosed in double quotes"),
        ("[]", ": should be results as POGEMA writes them (a list of metrics, env_grid_"),
        (json.dumps([POGEMA, {}]), ": should be results as POGEMA writes them"),
        (json.dumps({"a": {"b": {"c": {"d": {"e": {"return": 1}}}}}}), ": should be results as"),
        ("3", ": should be results as POGEMA writes them"),
    ],
)
def test_json_of_another_kind_is_refused(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "t.json"
    path.write_text(text)
    with pytest.raises(spi.IndicatorError) as refused:
        read_trials(path)
    assert str(refused.value).startswith(f"{path}{words}")


@pytest.mark.parametrize(
    ("first", "columns", "performance", "of"),
    [
        ('#{"t_start": 1.0, "env_id": "Lane-v0"}', "", "r", " of Lane-v0"),
        ('#{"t_start": 1.0}', ",boxes", "r", ""),
        ('#{"t_start": 1.0, "env_id": null}', ",width,delivered", "delivered", ""),
    ],
)
def test_episodes_of_a_monitor_are_told_with_their_environment(
    first: str, columns: str, performance: str, of: str, tmp_path: Path
) -> None:
    path = tmp_path / "t.csv"
    rows = [f"{n}.5,{n},{n}{f',{n}' * columns.count(',')}" for n in (1, 2)]
    path.write_text("\n".join([first, f"r,l,t{columns}", *rows]))
    trials = read_trials(path, columns={"robots": "4"})
    assert trials.notes[0] == (
        f"These are episodes that a Monitor wrote{of}: P is {performance!r}; --column "
        "performance=NAME takes another."
    )
    expected = [1.0, 2.0] if performance == "delivered" else [1.5, 2.5]
    assert [(row.performance, row.line) for row in trials.rows] == [*zip(expected, (3, 4))]
    assert {name for row in trials.rows for name, _ in row.parameters} <= {"boxes", "width"}


@pytest.mark.parametrize("first", ["#{", "# in May", "#{}\n#"])
def test_what_only_looks_like_a_monitor_is_a_table_of_text(first: str, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"{first}\nrobots,P\n4,1\n8,2\n")
    trials = read_trials(path)
    assert trials.notes == ()
    assert [row.performance for row in trials.rows] == [1.0, 2.0]


def test_names_of_a_data_frame_may_have_levels_and_cells_several_lines() -> None:
    names = pd.MultiIndex.from_tuples([("robots", ""), ("P", "boxes"), (" policy", "")])
    frame = pd.DataFrame([[4, 1.0, "a\n b"], [8, 2.5, "a b"]], columns=names)
    trials = read_trials(frame, columns={"performance": "P boxes", "policy": " policy"})
    assert [(row.n_robots, row.performance, row.policy) for row in trials.rows] == [
        (4, 1.0, "a b"), (8, 2.5, "a b"),
    ]  # fmt: skip
    assert (trials.file, len(trials.digest)) == ("data frame", 16)
    changed = frame.replace({2.5: 2.25})
    columns = {"performance": "P boxes", "policy": " policy"}
    assert read_trials(changed, columns=columns).digest != trials.digest


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"PK\x03\x04", "a workbook or an archive: should end in .xlsx, or be unpacked"),
        (b"PAR1", "a table in Parquet: should end in .parquet"),
        (b"\x1f\x8b", "packed by gzip: should be unpacked"),
        (b"\xd0\xcf\x11\xe0", "a workbook of before 2007: should be saved as .xlsx or CSV"),
        (b"\x89HDF", "a file of HDF5: should be saved as CSV"),
    ],
)
def test_a_file_of_another_kind_is_named(content: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(content + b"robots,P\n4,1\n")
    with pytest.raises(spi.IndicatorError) as refused:
        read_trials(path)
    assert str(refused.value).startswith(f"{path} is ")
    assert str(refused.value).endswith(words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("robots,P\n4,1,2\n", "2: has 3 values, more values than the 2 columns: if decimals"),
        ("\n# a\nrobots;P\n\n4;1;2\n", "5: has 3 values, more values than the 2 columns"),
        ("robots,P\r\n4,1\r\n4,\u200b1\r\n", "3: holds '\\u200b': should be plain text, wit"),
    ],
)
def test_a_line_that_cannot_be_is_counted_from_the_first(
    text: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(text.encode())
    with pytest.raises(spi.IndicatorError) as refused:
        read_trials(path)
    assert str(refused.value).startswith(f"{path}, line {words}")
    assert ("put ; between" in str(refused.value)) == ("if decimals" in words)


def test_surplus_cells_that_are_empty_and_rows_that_are_short_do_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("fault,P,m\nnone,1,0,,\nnone,2\n,,\njam,3,1,\n")
    trials = read_trials(path, columns={"robots": "8"})  # a column more
    assert [(row.n_robots, row.fault, row.performance, row.line) for row in trials.rows] == [
        (8, "none", 1.0, 2), (8, "none", 2.0, 3), (8, "jam", 3.0, 5),
    ]  # fmt: skip
