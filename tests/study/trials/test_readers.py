"""Files that others' programs write, by these programs or exactly as they are published."""

from __future__ import annotations

import csv
import json
import zipfile
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pandas as pd
import pytest

from swarm_logistics_env import judge, spi
from swarm_logistics_env.study.trials import Trials, read_trials
from swarm_logistics_env.study.trials.readers import workbook

FRAME = pd.DataFrame(
    {
        "robots": [4, 4, 8, 8],
        "fault": [None, "jam", None, "jam"],
        "m": [0, 1, 0, 1],
        "boxes": [10.5, 8.0, 19.25, 17.0],
    }
)
COLUMNS = {"performance": "boxes"}


def check(trials: Trials) -> None:
    assert trials.performance(fault="none").tolist() == [10.5, 19.25]
    assert trials.performance(fault="jam", n_robots=8).tolist() == [17.0]
    assert trials.performance_name == "boxes"


def test_a_data_frame_is_read_as_the_file_that_it_would_be(tmp_path: Path) -> None:
    check(read_trials(FRAME, columns=COLUMNS))
    # Names of rows are columns, too.
    check(read_trials(FRAME.set_index(["robots", "fault"]), columns=COLUMNS))
    FRAME.to_csv(tmp_path / "t.csv", index=False)
    rows = read_trials(tmp_path / "t.csv", columns=COLUMNS).rows
    in_frame = read_trials(FRAME, columns=COLUMNS).rows
    assert [row.condition[1:] for row in rows] == [row.condition[1:] for row in in_frame]
    with pytest.raises(spi.IndicatorError, match="should be the path of a file or folder, or a d"):
        read_trials([1, 2])  # type: ignore[arg-type]
    with pytest.raises(spi.IndicatorError, match="data frame, row 2, column 'boxes': nothing"):
        read_trials(FRAME.replace({"boxes": {8.0: np.nan}}), columns=COLUMNS)


def test_names_of_a_data_frame_may_have_levels_and_cells_several_lines() -> None:
    names = pd.MultiIndex.from_tuples([("robots", ""), ("P", "boxes"), (" policy", "")])
    frame = pd.DataFrame([[4, 1.0, "a\n b"], [8, 2.5, "a b"]], columns=names)
    columns = {"performance": "P boxes", "policy": " policy"}
    trials = read_trials(frame, columns=columns)
    assert [(row.n_robots, row.performance, row.policy) for row in trials.rows] == [
        (4, 1.0, "a b"), (8, 2.5, "a b"),
    ]  # fmt: skip
    assert (trials.file, len(trials.digest)) == ("data frame", 16)
    changed = frame.replace({2.5: 2.25})
    assert read_trials(changed, columns=columns).digest != trials.digest


def test_a_data_frame_is_judged_in_one_call(tmp_path: Path) -> None:
    frame = pd.concat([FRAME.assign(boxes=FRAME["boxes"] + step) for step in range(4)])
    in_memory = judge(frame, columns=COLUMNS)
    stored = judge(frame, columns=COLUMNS, out=tmp_path / "study")
    assert [verdict.value for verdict in in_memory.verdicts] == [v.value for v in stored.verdicts]
    assert {verdict.compared.indicator for verdict in stored.verdicts} == {"S", "R"}


@pytest.mark.parametrize("ending", ["xlsx", "parquet"])
def test_workbooks_and_parquet_are_read(ending: str, tmp_path: Path) -> None:
    pytest.importorskip("openpyxl")
    pytest.importorskip("pyarrow")
    path = tmp_path / f"trials.{ending}"
    if ending == "xlsx":
        with pd.ExcelWriter(path) as writer:
            FRAME.to_excel(writer, sheet_name="trials", index=False, startrow=2)
            FRAME.to_excel(writer, sheet_name="copy", index=False)
    else:
        FRAME.to_parquet(path)
    trials = read_trials(path, columns=COLUMNS)
    check(trials)
    assert trials.rows[0].line == (4 if ending == "xlsx" else 1)
    assert ("The sheet 'trials' is read, the first of 2." in trials.notes) == (ending == "xlsx")


def test_a_file_that_is_not_what_its_name_says_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    pytest.importorskip("pyarrow")
    FRAME.to_excel(tmp_path / "real.xlsx", index=False)
    FRAME.to_parquet(tmp_path / "real.parquet")
    workbook_bytes = (tmp_path / "real.xlsx").read_bytes()
    parquet_bytes = (tmp_path / "real.parquet").read_bytes()
    for name, content, words in (
        ("a.csv", workbook_bytes, r"or an archive: should end in \.xlsx, or be unpacked$"),
        ("b.csv", b"\x1f\x8b\x08", r"b\.csv is .*packed by gzip: should be unpacked$"),
        ("c.csv", parquet_bytes, r"a table in Parquet: should end in \.parquet$"),
        (
            "d.csv",
            b"\xd0\xcf\x11\xe0",
            r"of before 2007: should be saved as \.xlsx or CSV$",
        ),
        ("e.csv", b"\x89HDF", "a file of HDF5: should be saved as CSV$"),
        ("a.xlsx", b"N,P\n4,1\n", "is no workbook by its content"),
        ("a.parquet", b"N,P\n4,1\n", "is no table in Parquet by its content"),
        ("b.xlsx", workbook_bytes[:900], "is a damaged workbook"),
        ("b.parquet", parquet_bytes[:-9], "is a damaged table in Parquet"),
        ("a.json", b"N,P\n4,1\n", "is no JSON"),
        ("b.json", b"[1, 2]", "should be results as POGEMA writes them"),
        ("d.json", b"3", "should be results as POGEMA writes them"),
        ("e.json", b"{", "is no JSON: Expecting property name enclosed in double quotes"),
        ("c.json", b"[" * 50_000, "c.json is nested too deep"),
    ):
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(spi.IndicatorError, match=words):
            read_trials(path)
    openpyxl.Workbook().save(tmp_path / "empty.xlsx")
    with pytest.raises(spi.IndicatorError, match=r"empty\.xlsx is empty: should have a row of col"):
        read_trials(tmp_path / "empty.xlsx")
    with zipfile.ZipFile(tmp_path / "c.xlsx", "w") as archive:
        archive.writestr("nothing.txt", "no workbook")
    with pytest.raises(spi.IndicatorError, match=r"c\.xlsx is a damaged workbook"):
        read_trials(tmp_path / "c.xlsx")
    monkeypatch.setattr(workbook, "LARGEST", 10)
    for name in ("real.xlsx", "real.parquet"):
        with pytest.raises(spi.IndicatorError, match="unpacks to 0 MB: should be at most 0 MB"):
            read_trials(tmp_path / name, columns=COLUMNS)


def test_a_table_in_parquet_with_two_names_of_a_column_is_damaged(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    table = pyarrow.Table.from_pandas(FRAME)
    odd_table = table.rename_columns(["robots", "fault", "m", "items"])
    parquet.write_table(
        odd_table.replace_schema_metadata(table.schema.metadata), tmp_path / "t.parquet"
    )
    names = r"'m', 'items', or 'robots', 'fault', 'm', 'boxes'\)"
    with pytest.raises(spi.IndicatorError, match=rf"is a damaged table in Parquet .*{names}"):
        read_trials(tmp_path / "t.parquet")


def pogema_results() -> list[dict[str, Any]]:
    """Results in the shape of the files of pogema-benchmark."""
    return [
        {
            "metrics": {
                "avg_throughput": 0.1 * n + seed,
                "ISR": 0.5,
                "throughput_over_time": [0.1, 0.2],
            },
            "env_grid_search": {"num_agents": n, "map_name": f"maze-{seed}", "seed": 0},
            "algorithm": planner,
        }
        for planner in ("RHCR", "Follower")
        for n in (8, 16)
        for seed in (0, 1)
    ]


def test_results_of_pogema_are_read(tmp_path: Path) -> None:
    path = tmp_path / "03-warehouse.json"
    path.write_text(json.dumps(pogema_results()))
    trials = read_trials(path)
    assert trials.performance(policy="RHCR", n_robots=16).tolist() == [1.6, 2.6]
    assert trials.paired
    assert trials.notes[0].startswith("These are results of POGEMA: P is avg_throughput; --column")
    other = read_trials(path, columns={"performance": "ISR"})
    assert {row.performance for row in other.rows} == {0.5}


def test_results_of_marl_eval_are_read(tmp_path: Path) -> None:
    runs = {
        f"seed_{seed}": {
            "step_0": {"step_count": 0, "return": [0.0, 0.0]},
            "step_1": {"step_count": 9, "return": [1.0, 2.0]},
            **({"absolute_metrics": {"return": [4.0, 6.0]}} if seed else {}),
        }
        for seed in (0, 1)
    }
    path = tmp_path / "metrics.json"
    path.write_text(json.dumps({"rware": {"small": {"ippo": runs}, "large": {"ippo": runs}}}))
    with pytest.raises(spi.IndicatorError, match=r"column 'task': 'small': should be a numb"):
        read_trials(path)
    trials = read_trials(path, columns={"robots": "task"}, values=["task:small=4", "task:large=8"])
    # The absolute metric, or else the last evaluation, whose episodes are no trials of their own.
    assert trials.performance(n_robots=8).tolist() == [1.5, 5.0]
    assert not trials.paired


LAST = {"step_count": 1, "return": [1.0, 2.0]}


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        (
            {"s": {**LAST, "return": [1.0, None]}},
            "run env > task > alg > b, column 'return': '[1.0,",
        ),
        (
            {"s": {**LAST, "return": [[1.0], [2.0]]}},
            "run env > task > alg > b, column 'return': '[",
        ),
        ({"s": {**LAST, "return": ["1.0"]}}, "run env > task > alg > b, column 'return': '["),
        (
            {"s": {**LAST, "return": [float("nan")]}},
            "run env > task > alg > b, column 'return': '[",
        ),
        ({"s": {**LAST, "return": [10**400]}}, "run env > task > alg > b, column 'return': '["),
        ({"s": {**LAST, "return": []}}, "run env > task > alg > b, column 'return': '[]'"),
        ({"s": {**LAST, "return": None}}, "run env > task > alg > b, column 'return': 'null'"),
        ({"absolute_metrics": {"return": [None]}}, "run env > task > alg > b, column 'return': '["),
        ({"s": {**LAST, "step_count": None}}, "run env > task > alg > b, s: step_count is null"),
        ({"s": {**LAST, "step_count": "1"}}, 'run env > task > alg > b, s: step_count is "1"'),
        ({}, "run env > task > alg > b: holds no metric, as other runs do"),  # it has failed
        (None, "run env > task > alg > b: holds no metric, as other runs do"),
    ],
)
def test_a_result_that_is_no_number_is_refused_by_run_and_metric(
    tmp_path: Path, steps: object, words: str
) -> None:
    path = tmp_path / "metrics.json"
    path.write_text(json.dumps({"env": {"task": {"alg": {"a": {"s": LAST}, "b": steps}}}}))
    with pytest.raises(spi.IndicatorError) as caught:
        read_trials(path)
    assert str(caught.value).startswith(f"{path}, {words}")


def test_a_metric_that_is_not_read_may_be_no_number(tmp_path: Path) -> None:
    path = tmp_path / "metrics.json"
    step = {**LAST, "win_rate": [None], "loss": float("nan")}
    path.write_text(json.dumps({"env": {"task": {"alg": {"a": {"s": step}}}}}))
    assert [row.performance for row in read_trials(path).rows] == [1.5]


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("metrics", {"avg_throughput": None}, "record 2, column 'avg_throughput': 'null': should"),
        ("metrics", {"avg_throughput": "0.5"}, "record 2, column 'avg_throughput': '\"0.5\"': sho"),
        ("metrics", {}, "record 2, column 'avg_throughput': nothing: should be a number"),
        ("metrics", None, "record 2: metrics is null: should be names with values"),
        ("env_grid_search", None, "record 2: env_grid_search is null: should be names with val"),
    ],
)
def test_a_record_of_pogema_without_a_number_is_refused(
    tmp_path: Path, field: str, value: object, words: str
) -> None:
    results = pogema_results()
    results[1][field] = value
    path = tmp_path / "results.json"
    path.write_text(json.dumps(results))
    with pytest.raises(spi.IndicatorError) as caught:
        read_trials(path)
    assert str(caught.value).startswith(f"{path}, {words}")


def test_results_of_pogema_without_a_number_in_any_record_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    metrics = {"throughput_over_time": [0.1, 0.2]}
    path.write_text(json.dumps([{**pogema_results()[0], "metrics": metrics}]))
    with pytest.raises(spi.IndicatorError, match=r"json: should have a metric that is one number"):
        read_trials(path)


class Deliveries(gymnasium.Env[np.ndarray, Any]):
    """Three steps; 2 items are delivered in each."""

    observation_space = gymnasium.spaces.Box(0.0, 1.0, (1,))
    action_space: gymnasium.Space[Any] = gymnasium.spaces.Discrete(2)

    def reset(self, **options: Any) -> tuple[np.ndarray, dict[str, Any]]:
        self.steps = 0
        return np.zeros(1, np.float32), {}

    def step(self, action: int) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        self.steps += 1
        info = {"delivered": 2 * self.steps}
        return np.zeros(1, np.float32), -1.0, self.steps == 3, False, info


def monitored(path: Path, keywords: tuple[str, ...]) -> None:
    """Write two episodes by the Monitor of stable-baselines3."""
    from stable_baselines3.common.monitor import Monitor

    env = Monitor(Deliveries(), str(path), info_keywords=keywords)
    for _ in range(2):
        env.reset()
        while not env.step(0)[2]:
            pass
    env.close()


def test_a_folder_of_monitors_is_read(tmp_path: Path) -> None:
    for size in (4, 8):
        folder = tmp_path / "ppo" / f"robots={size}"
        folder.mkdir(parents=True)
        monitored(folder / "0.monitor.csv", ("delivered",))
    trials = read_trials(tmp_path)
    assert [(row.policy, row.n_robots, row.performance) for row in trials.rows] == [
        ("ppo", 4, 6.0), ("ppo", 4, 6.0), ("ppo", 8, 6.0), ("ppo", 8, 6.0),
    ]  # fmt: skip
    assert trials.notes[0] == "The folder holds 2 files: 4 rows."
    assert "P is 'delivered'" in trials.notes[1]
    with pytest.raises(spi.IndicatorError, match=r"'-3\.0': should be a number, 0 or m"):
        read_trials(tmp_path, columns={"performance": "r"})


def test_a_folder_of_unlike_files_is_refused(tmp_path: Path) -> None:
    with pytest.raises(spi.IndicatorError, match="holds no trials: should hold files of"):
        read_trials(tmp_path)
    for name, header in (("a.csv", "robots,P"), ("b.csv", "robots,boxes")):
        (tmp_path / name).write_text(f"{header}\n4,1\n8,2\n")
    with pytest.raises(spi.IndicatorError, match=r"a\.csv has no column 'boxes', as others in"):
        read_trials(tmp_path)
    (tmp_path / "b.csv").write_text("P,robots\n3,4\nfour,8\n")
    with pytest.raises(spi.IndicatorError, match=r"b\.csv, line 3, column 'P': 'four': should"):
        read_trials(tmp_path)
    (tmp_path / "b.csv").write_text("P,robots\n3,4\n4,8\n")
    trials = read_trials(tmp_path)
    assert [(row.policy, row.n_robots, row.performance) for row in trials.rows] == [
        ("a", 4, 1.0), ("a", 8, 2.0), ("b", 4, 3.0), ("b", 8, 4.0),
    ]  # fmt: skip


def test_cells_are_replaced_where_somebody_says_so(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("robots,fault,m,P\n8,kein,,NA\n8,Rad,1,3\n")
    for values in (["fault:kein=none", "P:NA=0"], ["failure:kein=none", "performance:NA=0"]):
        trials = read_trials(path, values=values)
        assert [(row.fault, row.performance) for row in trials.rows] == [("none", 0), ("Rad", 3)]
    exchanged = ["fault:kein=Rad", "fault:Rad=kein", "m:=1", "m:1=0", "P:NA=0"]
    assert [row.fault for row in read_trials(path, values=exchanged).rows] == ["Rad", "none"]
    for value, words in (
        ("kein=none", "should be COLUMN:CELL=NEW"),
        ("fault:keine=none", "has no cell 'keine' in the column 'fault'"),
        ("speed:1=2", "has no such column, but 'robots', 'fault'"),
    ):
        with pytest.raises(spi.IndicatorError, match=words):
            read_trials(path, values=[value])
    with pytest.raises(spi.IndicatorError, match="--value performance:NA=0 says so"):
        read_trials(path)


def test_rows_of_robots_are_summed_into_trials(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["trial", "robot", "robots", "P"])
        writer.writerows([[trial, robot, 3, 0.1] for trial in "ab" for robot in range(3)])
    trials = read_trials(path, sum_over="robot")
    assert [(row.line, row.performance) for row in trials.rows] == [(2, 0.3), (5, 0.3)]
    assert trials.notes[0] == "6 rows of robots are summed into 2 trials, 3 robots each on average."
    with pytest.raises(spi.IndicatorError, match="robot '0' is in line 2 too: name each row's tr"):
        read_trials(path, sum_over="robot", values=["trial:b=a"])
    with pytest.raises(spi.IndicatorError, match=r"--sum-over drone: .* has no such column"):
        read_trials(path, sum_over="drone")


def test_a_sign_between_thousands_is_told(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text('robots,P\n4,"1,204"\n8,980\n')
    with pytest.raises(spi.IndicatorError, match="or --thousands , where it stands between thous"):
        read_trials(path)
    assert [row.performance for row in read_trials(path, thousands=",").rows] == [1204, 980]
    with pytest.raises(spi.IndicatorError, match="--thousands ,: should be another sign than --d"):
        read_trials(path, thousands=",", decimal=",")
