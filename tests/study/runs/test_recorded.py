from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from swarm_logistics_env import judge, spi
from swarm_logistics_env.core import progress_bar
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.study.questions.comparison import OTHER_BEHAVIOUR
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.write import markdown
from swarm_logistics_env.study.runs import recorded
from swarm_logistics_env.study.runs.recorded import RecordedStudy
from swarm_logistics_env.study.runs.store import Runs
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.trials import read_trials
from swarm_logistics_env.study.verdicts.mid_run_faults import resiliences


def imported(
    tmp_path: Path, text: str, reference: Mapping[str, float] | None = None, **stated: str
) -> Study:
    (tmp_path / "table.csv").write_text(text)
    trials = read_trials(tmp_path / "table.csv", reference=reference)
    RecordedStudy.of(trials, stated).keep(tmp_path / "out")
    return Study.stored(tmp_path / "out")


# Own names for the fault and the parameter, no seeds.
WHOLE, BROKEN, REMOVED = [11.25, 12.5, 13.1], [9.75, 10.5, 11.5], [10.2, 11.0]
NARROW, FEW = [9.5, 10.55, 10.75], [6.25, 6.5, 7.5]
LAB = "robots;fault;faulty;width;delivered"
for condition, measured in {
    "8;none;;2": WHOLE, "8;wheel;1;2": BROKEN, "8;removed;1;2": REMOVED, "8;none;;1.5": NARROW,
    "4;none;;2": FEW,
}.items():  # fmt: skip
    LAB += "".join(f"\n{condition};{p}" for p in measured)


def test_indicators_of_a_lab_file_are_those_of_spi_by_hand(tmp_path: Path) -> None:
    study = imported(tmp_path, LAB, {"width": 2.0}, arena="4 m x 4 m")
    by_hand = {
        "S": spi.scalability(FEW, WHOLE, n=4, m=4, paired=False),
        "FT": spi.fault_tolerance(WHOLE, BROKEN, REMOVED, n=8, m=1, paired=False),
        "R": spi.robustness(WHOLE, BROKEN, n=8, m=1, paired=False),
        "A": spi.adaptability(WHOLE, NARROW, x_o=2.0, x_new=1.5, paired=False),
    }
    table = study.indicators().set_index("indicator")
    assert sorted(table.index) == sorted(by_hand)
    for symbol, estimate in by_hand.items():
        for name in ("value", "low", "high", "p_value", "probability", "verdict"):
            assert table.loc[symbol, name] == getattr(estimate, name)
    assert table.loc["R", "comparison"] == "wheel, m = 1"
    assert table.loc["A", "comparison"] == "width 2 -> 1.5"
    report = markdown(document(study.findings()))
    assert "imported from table.csv. Unpaired" in report
    assert "| arena | 4 m x 4 m |" in report


EVENTS = "robots;fault;faulty;onset;duration;seed;time\n" + "\n".join(
    f"4;{condition};100;300;{seed};{time / 7 + seed}"
    for condition in ("none;0", "jam;1")
    for seed in range(3)
    for time in range(7, 1800, 300 if condition == "jam;1" else 200)
)


@pytest.mark.parametrize("text", [LAB, EVENTS], ids=["table", "event log"])
def test_trials_are_judged_as_their_store_is(tmp_path: Path, text: str) -> None:
    stored = imported(tmp_path, text, {"width": 2.0} if text == LAB else None).findings()
    judged = judge(tmp_path / "table.csv", reference={"width": 2.0} if text == LAB else None)
    assert judged.plan.specification == stored.plan.specification
    assert judged.plan.comparisons == stored.plan.comparisons
    assert judged.verdict_table.equals(stored.verdict_table)
    assert judged.cell_table.equals(stored.cell_table)
    assert repr(judged.outcomes) == repr(stored.outcomes)
    assert repr(judged) == repr(stored)
    ends = {outcome.ended_at for outcome in judged.outcomes.values()}
    assert ends == {0.0 if text == LAB else 300.0}


def test_a_study_of_trials_notes_where_they_come_from(tmp_path: Path) -> None:
    (tmp_path / "table.csv").write_text(
        "robots,map,delivered,policy\n8,b,20,Y\n4,b,9,x\n4,a,10,x\n4,a,12,x\n8,a,18,x\n4,a,3,Y\n"
    )
    trials = read_trials(tmp_path / "table.csv")
    plan = RecordedStudy.of(trials, {"arena": "4 m"}).plan
    origin = plan.origin
    assert origin is not None
    assert (origin.file, origin.digest, origin.paired, origin.seeds, origin.setup) == (
        "table.csv", trials.digest, True, (0, 1), (("arena", "4 m"),)
    )  # fmt: skip
    assert (origin.performance, origin.references, origin.blocks) == ("delivered", (), ("a", "b"))
    assert [(row.policy, row.n_robots, row.line, row.n_trials) for row in origin.trials] == [
        ("x", 4, 3, 2), ("x", 8, 6, 1), ("Y", 4, 7, 1), ("Y", 8, 2, 1),
    ]  # fmt: skip
    specification = plan.specification
    assert (specification.name, specification.seeds) == ("table", 2)
    assert [policy.title for policy in specification.policies] == ["x", "Y"]
    assert [comparison.indicator for comparison in plan.comparisons] == [
        "S",
        "S",
        "change",
        "change",
    ]


@pytest.mark.parametrize("asks_ft", [True, False])
def test_without_trials_of_removed_robots_it_is_told_that_ft_is_not_asked(
    asks_ft: bool, tmp_path: Path
) -> None:
    text = "robots,fault,faulty,p\n8,none,,9\n8,none,,8\n8,jam,1,7\n8,jam,1,6\n"
    if asks_ft:
        text += "8,removed,1,8\n8,removed,1,7\n"
    plan = imported(tmp_path, text).plan()
    indicators = {comparison.indicator for comparison in plan.comparisons}
    assert indicators == ({"R", "FT"} if asks_ft else {"R"})
    assert plan.origin is not None
    assert any(note.startswith("No FT: it needs") for note in plan.origin.notes) != asks_ft


def test_each_value_of_what_else_varies_has_a_table_of_its_own(tmp_path: Path) -> None:
    rows = ["table,policy,robots,fault,faulty,width,p"]
    for n in (8, 16):
        rows += [f"I,ours,{n},none,0,2,{n + k}" for k in (0, 1, 2)]
        rows += [f"I,ours,{n},jam,1,2,{n - k}" for k in (1, 2, 3)]
    rows += ["II,ours,8,none,0,2,8", "II,ours,8,none,0,1,6"]
    table = imported(tmp_path, "\n".join(rows), {"width": 2.0}).indicators()
    assert table[["table", "indicator"]].to_numpy().tolist() == [
        ["I: Scalability", "S"],
        ["I: Fault tolerance and robustness (N = 8, width = 2)", "R"],
        ["I: Fault tolerance and robustness (N = 16, width = 2)", "R"],
        ["II: Adaptability to width", "A"],
    ]  # without trials of removed robots for robustness alone
    last = table.iloc[-1]  # one run gives a value alone
    assert (last["value"], last["verdict"]) == (pytest.approx(-0.25 / 0.5 + 1), "open")


@pytest.mark.unmeasured
def test_an_event_log_has_the_resilience_of_the_simulators_own_rows(tmp_path: Path) -> None:
    square = {"warehouse_width": 4.0, "warehouse_height": 4.0, "n_robots": 8}
    scenario = {**square, "duration": 300.0, "restock": True}
    late = {"modes": ["FM4"], "robots": [2], "onsets": [100.0]}
    study = Study(seeds=3, scenario=scenario, faults=[late])
    study.run()
    simulated = study.findings()
    # One delivery a row; a run that delivers nothing is a row without a time.
    rows = ["policy;robots;fault;m;onset [s];seed;trial;time [s];duration"]
    for _, _, arm in simulated.plan.cells:
        at = arm.setting
        for seed in simulated.plan.seeds:
            run = f"swarm-dt;8;{at.name};{at.value:g};{at.onset:g};{seed};{at.name} {seed}"
            times = simulated.outcomes[arm.case.key, seed].delivery_times.tolist() or [""]
            rows += [f"{run};{time};300" for time in times]
    (expected,), (recorded,) = (
        resiliences(results)
        for results in (simulated, imported(tmp_path, "\n".join(rows)).findings())
    )
    assert recorded.against_removed == expected.against_removed
    assert recorded.against_whole == expected.against_whole
    curves, recorded_curves = (
        [np.array(resilience.curve) for resilience in of.single] for of in (expected, recorded)
    )
    assert len(curves) == 2
    assert np.array_equal(curves, recorded_curves)


def test_without_seeds_no_run_of_an_event_log_is_compared_with_one_other(tmp_path: Path) -> None:
    rows = ["trial,robots,fault,faulty,onset,duration,time"]
    for fault, faulty in (("none", 0), ("none again", 0), ("jam", 1), ("removed", 1)):
        rows += [
            f"{fault} {k},4,{fault},{faulty},100,300,{time + k}"
            for k in range(3)
            for time in range(10, 290, 20 + 5 * faulty)
        ]
    (resilience,) = resiliences(imported(tmp_path, "\n".join(rows)).findings())
    assert resilience.problem == (
        "the runs name no seeds, and each is compared with that of its seed"
    )
    assert not resilience.single


def test_seeds_make_it_paired_whatever_their_order(tmp_path: Path) -> None:
    rows = ["5,7,10,theirs", "5,3,20,theirs", "10,3,40,theirs", "10,7,21,theirs"]
    study = imported(tmp_path, "\n".join(["robots,seed,delivered,policy", *rows]))
    results = study.findings()
    (test,) = results.verdicts
    assert test.estimate is not None
    assert (test.compared.policy, test.estimate.paired) == ("theirs", True)
    cells = {c.arm.setting.value: c.by_seed.tolist() for c in results.cells}
    assert cells == {5: [20, 10], 10: [40, 21]}
    # The file's own seeds, so that it can be compared with another file by them.
    assert list(study.plan().seeds) == sorted({*study.results()["seed"]}) == [3, 7]
    assert not results.exploratory


def test_conditions_are_paired_over_the_blocks_that_they_share(tmp_path: Path) -> None:
    blocks = {
        5: {"hall": 10, "yard": 20, "roof": 12},
        10: {"roof": 30, "hall": 21},
        20: {"yard": 9},
    }
    rows = [f"{n},{name},{p}" for n, of_size in blocks.items() for name, p in of_size.items()]
    study = imported(tmp_path, "\n".join(["robots,map,delivered", *rows]))
    results = study.findings()
    doubled, apart = results.verdicts
    assert doubled.estimate is not None
    alone = spi.scalability([10, 12], [21, 30], n=5, m=5)
    assert (doubled.estimate.n_seeds, doubled.estimate.paired) == (2, True)
    assert (doubled.interval, doubled.estimate.p_value) == (
        (alone.value, alone.low, alone.high),
        alone.p_value,
    )
    assert apart.problem == "N = 10: 1 of 3 runs missing; N = 20: 2 of 3 runs missing"
    # P is of all runs of a condition.
    assert [cell.by_seed.tolist() for cell in results.cells] == [[10, 12, 20], [21, 30], [9]]


@pytest.mark.unmeasured
@pytest.mark.parametrize("columns", [["map"], ["map", "seed"], []], ids=["blocks", "pairs", "none"])
def test_the_order_of_rows_decides_nothing(columns: list[str]) -> None:
    draw = np.random.default_rng(0)
    rows = [
        (policy, n, fault, m, width, name_of_map, seed, p + draw.normal(0.0, 0.4))
        for policy in ("ours", "Base")
        for n, fault, m, width, p in (
            (4, "none", 0, 2, 9.0),
            (8, "none", 0, 2, 17.0),
            (8, "none", 0, 1.5, 12.0),
            (8, "jam", 1, 2, 15.0),
            (8, "JAM", 2, 2, 11.0),
            (8, "removed", 1, 2, 15.5),
            (8, "none again", 0, 2, 17.0),
        )
        for name_of_map in ("hall", "yard", "roof")
        for seed in range(2 if width == 2 else 1)
    ]
    names = ["policy", "robots", "fault", "faulty", "width", "map", "seed", "delivered"]
    frame = pd.DataFrame(rows, columns=names).drop(columns={"map", "seed"} - {*columns})
    first, *shuffled = (
        judge(frame.sample(frac=1.0, random_state=state), reference={"width": 2.0})
        for state in range(2)
    )
    assert first.plan.paired == bool(columns)
    assert first.policies == ("Base", "ours")
    assert len(first.verdicts) == 2 * (1 + 1 + 2 + 1) + 4  # and the two side by side
    for results in shuffled:
        assert results.verdict_table.equals(first.verdict_table)
        assert results.cell_table.equals(first.cell_table)
        assert [cell.words for cell in results.cells] == [cell.words for cell in first.cells]
        assert results.plan.origin
        assert first.plan.origin
        assert results.plan.origin.notes == first.plan.origin.notes


def test_the_reference_of_a_is_no_matter_of_the_first_row(tmp_path: Path) -> None:
    head, *rows = LAB.splitlines()
    trials = [row for row in rows if row.startswith("8;none;")]
    for k, ordered in enumerate((trials, trials[::-1])):
        text = "\n".join([head, *ordered, "8;none;;2;12"])
        (tmp_path / f"{k}").mkdir()
        (verdict,) = imported(tmp_path / f"{k}", text).findings().verdicts
        assert verdict.compared.label == "width 2 -> 1.5"
        assert verdict.on_property.adjusted == "open"


HEAD = "robots,fault,faulty,width,delivered\n"


ALONE = (
    "2: stands alone: should differ from some other row in the fault, the number of robots or one "
    "parameter alone"
)
UNSETTLED = (
    "{}: A is relative to one value of {!r}, and no condition without a fault has more trials than "
    "all others: say --reference {} or --reference {}, or leave it out by --ignore {}"
)
TWO_TAGS = UNSETTLED.format(2, "boxes", "boxes=10", "boxes=20", "boxes")
OF_TWO = f"{ALONE}; columns taken for parameters: 'weight', 'slope'"
NO_P_O = (
    "3: has the fault 'FM1', but no row without one (fault none) of the same robots and "
    "parameters: R and FT are relative to it; robots counts failed and removed ones, too"
)
TOGETHER = (
    "2: the number of robots and 'tags' change together, so what comes of either cannot be told: "
    "should have trials in which one of them alone differs; --ignore tags counts what comes of "
    "both as the robots'"
)
OF_WORK = "; if it counts what a run had to do, P is that by its time: --column work=boxes"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEAD + "5,,,,9\n", ALONE),
        (HEAD + "25,none,0,,9\n20,FM1,1,,9\n", NO_P_O),
        (
            HEAD + "5,,,0,9\n5,,,0,8\n5,,,2,9\n",
            "2: width = 0 is the reference, and A is relative to it: say --reference width=2",
        ),
        (
            HEAD + "5,,,2,9\n5,,,1,9\n",
            UNSETTLED.format(2, "width", "width=1", "width=2", "width"),
        ),
        (
            "robots,my width,delivered\n5,0.5,0.5\n5,0,0.2\n5,2,0.3\n",
            UNSETTLED.format(2, "my width", "'my width=0.5'", "'my width=2'", "'my width'"),
        ),
        ("robots,boxes,time to finish [s]\n5,10,90\n5,20,150\n", TWO_TAGS + OF_WORK),
        (
            "robots,boxes,time to finish [s]\n5,10,90\n5,20.5,150\n",
            UNSETTLED.format(2, "boxes", "boxes=10", "boxes=20.5", "boxes"),
        ),
        ("robots,boxes,delivered\n5,20,0.5\n5,10,2\n5,20,0.7\n5,10,3\n", TWO_TAGS),
        ("robots,tags,delivered\n4,8,9\n4,8,8\n8,16,20\n", TOGETHER),
        ("robots,weight,slope,delivered\n4,1,0,9\n4,2,3,9\n", OF_TWO),
        (
            "robots,weight,slope,delivered\n4,1,0,9\n4,1,0,8\n4,2,3,9\n",
            f"{OF_TWO}; references: weight = 1, slope = 0",
        ),
    ],
)
def test_bad_file_is_refused_in_one_sentence_and_leaves_nothing(
    tmp_path: Path, text: str, words: str
) -> None:
    with pytest.raises(StudyError) as caught:
        imported(tmp_path, text)
    assert str(caught.value) == f"table.csv, line {words}"
    assert not (tmp_path / "out").exists()


def test_study_is_neither_overwritten_nor_run_into(tmp_path: Path, small: dict[str, Any]) -> None:
    many = "robots,delivered\n5,9\n5,11\n5,10\n10,18\n10,22\n"
    imported(tmp_path, many)
    with pytest.raises(StudyError, match="holds a study already"):
        imported(tmp_path, many)
    for study, words in (
        (Study(out=tmp_path / "out", **small), "holds the study 'table' with other task: "),
        (Study.stored(tmp_path / "out"), "was imported: run into a new directory"),
    ):
        with pytest.raises(StudyError, match=words):
            study.run()
    with Runs.existing(tmp_path / "out") as runs:
        assert len(runs) == 5


def test_how_many_trials_are_written_is_told_every_so_often(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress_bar, "LINE_EVERY", 0.0)
    monkeypatch.setattr(recorded, "_PROGRESS_EVERY", 2)
    imported(tmp_path, "robots,delivered\n5,9\n5,11\n5,10\n10,18\n10,22\n")
    lines = [line.partition(",")[0] for line in capsys.readouterr().err.splitlines()]
    assert lines == ["import: 2 of 5 trials", "import: 4 of 5 trials"]


def test_p_o_is_of_trials_without_a_fault_and_repeated_ones_are_their_null(tmp_path: Path) -> None:
    measured = {"none again,0": (9, 8, 7), "none,0": (20, 22, 21), "jam,1": (19, 20, 18)}
    rows = [f"8,{fault},{p}" for fault, performances in measured.items() for p in performances]
    study = imported(tmp_path, "\n".join(["robots,fault,faulty,p", *rows]))
    (test,) = study.findings().verdicts
    assert (test.compared.indicator, test.compared.label) == ("R", "jam, m = 1")
    assert test.value == pytest.approx((19 - 21) / 21 + 1 / 8)
    assert [arm.setting for arm in study.plan().nulls.values()] == [OTHER_BEHAVIOUR]
    behaviours = dict(study.results()[["delivered", "behaviour"]].to_numpy().tolist())
    assert [behaviours[p] for p in (9.0, 22.0, 18.0)] == [1, 0, 0]


def test_recorded_contacts_stand_beside_p_and_are_missing_without_a_column(tmp_path: Path) -> None:
    rows = [
        f"4,{fault},{faulty},{seed},{30 - 5 * faulty + seed},{1.5 + seed + faulty}"
        for fault, faulty in (("none", 0), ("wheel", 1))
        for seed in range(3)
    ]
    text = "\n".join(["robots,fault,faulty,seed,delivered,contacts", *rows])
    study = imported(tmp_path, text)
    assert study.performance()["contacts"].tolist() == [2.5, 3.5]
    assert "| 2.5 [0.0, 5.0] |" in markdown(document(study.findings()))
    (tmp_path / "without").mkdir()
    without = imported(tmp_path / "without", re.sub(r",[^,\n]*$", "", text, flags=re.MULTILINE))
    assert without.performance()["contacts"].isna().all()
    assert "contacts" not in markdown(document(without.findings()))
    # Contacts as a second P: what is read is what is judged.
    columns = {"performance": "contacts"}
    trials = read_trials(tmp_path / "table.csv", columns=columns, ignore=["delivered"])
    assert [trial.performance for trial in trials.rows][:2] == [1.5, 2.5]
