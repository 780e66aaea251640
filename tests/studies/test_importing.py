from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import Study, paper
from swarm_logistics_env.studies.importing import import_results
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.studies.store import FILE_NAME, Store


def papers_tables() -> str:
    """The paper's Tables I to III, one run a row; each table has its own P_o."""
    rows = ["kind,name,value,n_robots,delivered"]
    rows += [f"size,n_robots,{n},,{p}" for n, p in paper.SIZES.items()]
    rows += [f"fault,none,0,25,{paper.NO_FAULT_PERFORMANCE}"]
    for mode, performances in paper.FAULTS.items():
        rows += [f"fault,{mode},{m},25,{p}" for m, p in enumerate(performances, start=1)]
    for name, row in paper.PARAMETERS.items():
        rows += [f"parameter,{name},{x},,{p}" for x, p in row.items()]
    return "\n".join(rows) + "\n"


def imported(tmp_path: Path, text: str) -> Study:
    (tmp_path / "table.csv").write_text(text)
    import_results(tmp_path / "table.csv", tmp_path / "out")
    return Study.stored(tmp_path / "out")


def test_the_papers_own_tables_give_its_values_unpaired_and_without_intervals(
    tmp_path: Path,
) -> None:
    study = imported(tmp_path, papers_tables())
    table = study.indicators()
    values = {
        name: [round(value, 3) for value in table.loc[table["indicator"] == name, "value"]]
        for name in ("S", "FT", "R", "A")
    }
    assert values["S"] == [1.0, 0.611, 0.276, 1.091, 0.978, 0.804, 0.208, -0.135]
    modes = [0.051, 0.077, -0.026, 0.026, 0.154, -0.026, 0.026, 0.154, 0.103, 0, -0.513, -0.615]
    assert values["FT"] == modes
    assert values["R"] == [
        *(0.091, 0.054, 0.017, 0.066, 0.131, 0.017),
        *(0.066, 0.131, 0.146, 0.04, -0.535, -0.572),
    ]
    assert values["A"] == [0.872, 0.723, 0.723, 0.61, 0.268, 0.187, -0.773]
    assert table[["low", "high", "p_value"]].isna().all(axis=None)
    assert set(table["verdict"]) == {"inconclusive"}
    study.report()
    report = (tmp_path / "out" / "report.md").read_text()
    assert "imported from table.csv. Unpaired: it names no seeds." in report
    assert "the same seeds for every condition" not in report


MANY = """kind,name,value,delivered
size,n_robots,5,9
size,n_robots,5,11
size,n_robots,5,10
size,n_robots,10,18
size,n_robots,10,22
"""


def test_unequally_many_runs_are_judged_unpaired(tmp_path: Path) -> None:
    (test,) = rows_of(imported(tmp_path, MANY).findings().indicators)
    assert test.estimate is not None
    assert not test.estimate.paired
    assert test.estimate.value == pytest.approx(1.0)
    assert test.estimate.low is not None


def test_seeds_make_it_paired_whatever_their_order(tmp_path: Path) -> None:
    rows = ["5,7,10,1", "5,3,20,1", "10,3,40,1", "10,7,21,1"]
    text = "\n".join(
        ["kind,name,value,seed,delivered,policy"]
        + [
            f"size,n_robots,{value},{seed},{p},theirs"
            for value, seed, p, _ in (row.split(",") for row in rows)
        ]
    )
    study = imported(tmp_path, text)
    (test,) = rows_of(study.findings().indicators)
    assert test.policy == "theirs"
    assert test.estimate is not None
    assert test.estimate.paired
    cells = {cell.value: cell.by_seed.tolist() for cell in rows_of(study.findings().performance)}
    assert cells == {5: [20, 10], 10: [40, 21]}
    # The file's own seeds, so that it can be compared with another file by them.
    assert list(study.plan().seeds) == [3, 7]
    assert set(study.results()["seed"]) == {3, 7}
    assert not study.findings().exploratory
    study.report()
    assert "2 paired seeds (3, 7)" in (tmp_path / "out" / "report.md").read_text()


HEAD = "kind,name,value,n_robots,delivered\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has no column 'kind'"),
        ("kind,name,value\nsize,n_robots,5\n", "has no column 'delivered'"),
        ("kind,name,value,delivered,sede\n", "has a column 'sede'; did you mean 'seed'?"),
        (HEAD, "holds no run"),
        (HEAD + "size,n_robots,5,,-3\n", "line 2: delivered = -3"),
        (HEAD + "size,n_robots,5,,9.5\n", "line 2: delivered = 9.5"),
        (HEAD + "size,n_robots,5,,nan\n", "line 2: delivered = nan"),
        (HEAD + "size,n_robots,5\n", "line 2: delivered = nothing"),
        (HEAD + "size,n_robots,5,,9,9\n", "line 2: has more values"),
        (HEAD + "size,n_robots,five,,9\n", "line 2: value = 'five'"),
        (HEAD + "sise,n_robots,5,,9\n", "kind = 'sise'; did you mean 'size'?"),
        (HEAD + "size,n_robots,5,,9\n", "stands alone"),
        (HEAD + "fault,FM1,1,25,9\n", "no row without one"),
        (HEAD + "fault,none,0,,9\n", "n_robots is missing"),
        (HEAD + "fault,none,0,25,9\nfault,FM9,1,25,9\n", "no failure mode 'FM9'"),
        (HEAD + "fault,none,0,25,9\nfault,FM1,1,20,9\n", "swarms of several sizes"),
        (HEAD + "parameter,width,1,,9\nparameter,width,2,,9\n", "no numeric scenario field"),
        ("kind,name,value,seed,delivered\nsize,n,5,0,9\nsize,n,6,,9\n", "line 3: has no seed"),
        ("kind,name,value,seed,delivered\nsize,n,5,0,9\nsize,n,6,1,9\n", "the same seeds"),
        ("kind,name,value,seed,delivered\nsize,n,5,0,9\nsize,n,5,0,9\n", "two rows of one seed"),
        ("\udcff", "not a CSV file in UTF-8"),
    ],
)
def test_bad_file_is_refused_in_one_sentence_and_leaves_nothing(
    tmp_path: Path, text: str, words: str
) -> None:
    (tmp_path / "bad.csv").write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(StudyError) as caught:
        import_results(tmp_path / "bad.csv", tmp_path / "out")
    assert words in str(caught.value)
    assert str(tmp_path / "bad.csv") in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_study_is_neither_overwritten_nor_run_into(tmp_path: Path, small: dict[str, Any]) -> None:
    imported(tmp_path, MANY)
    with pytest.raises(StudyError, match="holds a study already"):
        import_results(tmp_path / "table.csv", tmp_path / "out")
    with pytest.raises(StudyError, match="was imported: run into a new directory"):
        Study(out=tmp_path / "out", **small).run()
    with Store.existing(tmp_path / "out") as store:
        assert len(store) == 5
    assert [path.name for path in (tmp_path / "out").iterdir()] == [FILE_NAME]
    with pytest.raises(StudyError, match="code version imported"):
        Study.stored(tmp_path / "out").run()
