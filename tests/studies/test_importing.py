from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.report.document import document
from swarm_logistics_env.report.write import markdown
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.importing import import_results
from swarm_logistics_env.studies.measures import resiliences
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.runs import Runs


def imported(tmp_path: Path, text: str) -> Study:
    (tmp_path / "table.csv").write_text(text)
    import_results(tmp_path / "table.csv", tmp_path / "out")
    return Study.stored(tmp_path / "out")


# Own names for the fault and the parameter, no seeds.
LAB = """robots;fault;faulty;delivered;width
8;;;12.5;2
8;;;11.25;2
8;;;13.1;2
8;wheel;1;10.5;2
8;wheel;1;9.75;2
8;wheel;1;11.5;2
8;removed;1;10.2;2
8;removed;1;11.0;2
8;;;9.5;1.5
8;;;10.55;1.5
8;;;10.75;1.5
4;;;6.5;2
4;;;7.5;2
4;;;6.25;2
"""
WHOLE, BROKEN, REMOVED = [12.5, 11.25, 13.1], [10.5, 9.75, 11.5], [10.2, 11.0]
NARROW, FEW = [9.5, 10.55, 10.75], [6.5, 7.5, 6.25]


def test_indicators_of_a_lab_file_are_those_of_spi_by_hand(tmp_path: Path) -> None:
    study = imported(tmp_path, LAB)
    by_hand = {
        "S": spi.scalability(FEW, WHOLE, n=4, m=4, paired=False),
        "FT": spi.fault_tolerance(WHOLE, BROKEN, REMOVED, n=8, m=1, paired=False),
        "R": spi.robustness(WHOLE, BROKEN, n=8, m=1, paired=False),
        "A": spi.adaptability(WHOLE, NARROW, x_o=2.0, x_new=1.5, paired=False),
    }
    found = study.indicators().set_index("indicator")
    assert sorted(found.index) == sorted(by_hand)
    for symbol, estimate in by_hand.items():
        for name in ("value", "low", "high", "p_value", "probability"):
            assert found.loc[symbol, name] == getattr(estimate, name)
        assert found.loc[symbol, "verdict"] == estimate.verdict
    assert found.loc["R", "comparison"] == "wheel, m = 1"
    assert found.loc["A", "comparison"] == "width 2 -> 1.5"
    (tmp_path / "lab.csv").write_text(LAB)
    import_results(tmp_path / "lab.csv", tmp_path / "stated", setup={"arena": "4 m x 4 m"})
    report = markdown(document(Study.stored(tmp_path / "stated").findings()))
    assert "imported from lab.csv. Unpaired: it names no seeds." in report
    assert "| arena | 4 m x 4 m |" in report
    assert "Welch's t-test for independent samples" in report
    assert "heading_drift" not in report
    assert "code version" not in report


def test_each_value_of_what_else_varies_has_a_table_of_its_own(tmp_path: Path) -> None:
    rows = ["table,policy,robots,fault,faulty,width,p"]
    for n in (8, 16):
        rows += [f"I,ours,{n},none,0,2,{n + k}" for k in (0, 1, 2)]
        rows += [f"I,ours,{n},jam,1,2,{n - k}" for k in (1, 2, 3)]
    rows += ["II,ours,8,none,0,2,8", "II,ours,8,none,0,1,6"]
    table = imported(tmp_path, "\n".join(rows)).indicators()
    assert table[["table", "indicator"]].to_numpy().tolist() == [
        ["I: Scalability", "S"],
        ["I: Fault tolerance and robustness (N = 8, width = 2)", "R"],
        ["I: Fault tolerance and robustness (N = 16, width = 2)", "R"],
        ["II: Adaptability to width", "A"],
    ]  # without trials of removed robots for robustness alone
    # One run gives a value alone.
    last = table.iloc[-1]
    assert last["value"] == pytest.approx(-0.25 / 0.5 + 1)
    assert last[["low", "high", "p_value"]].isna().all()
    assert last["verdict"] == "inconclusive"


SQUARE = {"warehouse_width": 4.0, "warehouse_height": 4.0}
LATE = Study(
    name="late",
    seeds=3,
    scenario={**SQUARE, "n_robots": 8, "duration": 300.0, "restock": True},
    faults=[{"modes": ["FM4"], "robots": [2], "onsets": [100.0]}],
)


def event_log(results: StudyResults, *, seeds: bool = True) -> str:
    """One delivery a row; a run that delivers nothing is a row without a time."""
    rows = ["policy;robots;fault;m;onset [s];seed;trial;time [s];duration"]
    for _, _, arm in results.plan.cells:
        setting = arm.setting
        for number, seed in enumerate(results.plan.seeds):
            outcome = results.outcomes[arm.case.key, seed]
            size = arm.case.scenario.n_robots
            named = f"swarm-dt;{size};{setting.name};{setting.value:g};{setting.onset:g}"
            shown = f"{seed if seeds else ''};{setting.name} {number}"
            times = outcome.delivery_times.tolist() or [""]
            rows += [f"{named};{shown};{time};300" for time in times]
    return "\n".join(rows)


def test_an_event_log_has_the_resilience_of_the_simulators_own_rows(tmp_path: Path) -> None:
    LATE.run()
    ours = LATE.findings()
    study = imported(tmp_path, event_log(ours))
    (own,), (theirs,) = resiliences(ours), resiliences(study.findings())
    assert theirs.against_removed == own.against_removed
    assert theirs.against_whole == own.against_whole
    assert len(own.single) == len(theirs.single) == 2
    for one, other in zip(own.single, theirs.single):
        assert np.array_equal(np.array(one.curve), np.array(other.curve))
    assert "Resilience: deliveries after the onset" in markdown(document(study.findings()))
    # Without seeds and removed robots it has the index alone; one run fewer, so that the two
    # conditions have not equally many.
    log = event_log(ours, seeds=False).splitlines()
    kept = [row for row in log if "removed" not in row and row.split(";")[6] != "FM4 2"]
    (tmp_path / "less").mkdir()
    (found,) = resiliences(imported(tmp_path / "less", "\n".join(kept)).findings())
    assert found.against_whole is not None
    assert not found.against_whole.paired
    assert (found.against_removed, found.single) == (None, ())
    assert found.problem == "no runs with the robots removed are there to compare with"


MANY = "robots,delivered\n5,9\n5,11\n5,10\n10,18\n10,22\n"


def test_seeds_make_it_paired_whatever_their_order(tmp_path: Path) -> None:
    rows = ["5,7,10,theirs", "5,3,20,theirs", "10,3,40,theirs", "10,7,21,theirs"]
    study = imported(tmp_path, "\n".join(["robots,seed,delivered,policy", *rows]))
    (test,) = study.findings().verdicts
    assert test.compared.policy == "theirs"
    assert test.estimate is not None
    assert test.estimate.paired
    cells = {c.arm.setting.value: c.by_seed.tolist() for c in study.findings().cells}
    assert cells == {5: [20, 10], 10: [40, 21]}
    # The file's own seeds, so that it can be compared with another file by them.
    assert list(study.plan().seeds) == [3, 7]
    assert set(study.results()["seed"]) == {3, 7}
    assert not study.findings().exploratory
    assert "2 paired seeds (3, 7)" in markdown(document(study.findings()))


HEAD = "robots,fault,faulty,width,delivered\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        (HEAD + "5,,,,-3\n", "line 2, column 'delivered': '-3'"),
        (HEAD + "five,,,,9\n", "line 2, column 'robots': 'five'"),
        (HEAD + "5,,,,9\n", "line 2: stands alone"),
        (HEAD + "25,FM1,1,,9\n", "no row without one (fault none)"),
        (HEAD + "25,none,0,,9\n20,FM1,1,,9\n", "line 3: has the fault 'FM1', but no row"),
        (HEAD + "5,,,0,9\n5,,,2,9\n", "line 2: width = 0 is x_o"),
        (
            "robots,weight,slope,delivered\n4,1,0,9\n4,2,3,9\n",
            "or one parameter alone; columns taken for parameters: 'weight', 'slope'",
        ),
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
    with Runs.existing(tmp_path / "out") as runs:
        assert len(runs) == 5
