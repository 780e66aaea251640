"""Measures beyond the paper, from outcomes that are made up, so that the answer is known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.report import drawing
from swarm_logistics_env.report.document import document
from swarm_logistics_env.report.report_files import markdown
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparisons import NO_FAULT, OTHER_BEHAVIOUR, Setting
from swarm_logistics_env.studies.fault_measures import (
    Resilience,
    anchoring_loads,
    fault_budgets,
    rate_curves,
    resiliences,
)
from swarm_logistics_env.studies.policy_comparison import (
    cells_against_baseline,
    indicators_against_baseline,
    jackknife_interval,
)
from swarm_logistics_env.studies.results import StudyResults, judge
from swarm_logistics_env.tasks.task import Outcome

ONSET, END = 600.0, 2000.0
SEEDS = 8


def judged(study: Study, play: Callable[[str, Setting, int], Outcome]) -> StudyResults:
    plan = study.plan()
    levels = {arm.condition.key: (policy, arm.setting) for policy, _, arm in reversed(plan.cells)}
    outcomes: dict[str, Outcome] = {}
    for run in plan.runs():
        outcome = play(*levels[run.condition.key], run.seed)
        outcomes[run.key] = Outcome(
            run.key,
            outcome.delivery_times,
            outcome.ended_at,
            anchoring_seconds=outcome.anchoring_seconds,
        )
    return judge(plan, outcomes)


def after_a_fault(share: float, back: float) -> StudyResults:
    """A fault that leaves a share of the deliveries until `back` [s]; references go on as before.

    About one delivery in 2 s, in every kind of run other ones, but for those before the onset.
    """
    study = Study(
        seeds=SEEDS,
        scenario={"duration": END, "restock": True},
        faults=[{"modes": ["dead"], "robots": [3], "onsets": [ONSET]}],
    )
    kinds = {NO_FAULT: 1, OTHER_BEHAVIOUR: 2, Setting("fault", "removed", 3, ONSET): 3}

    def play(_: str, level: Setting, seed: int) -> Outcome:
        draw = np.random.default_rng([seed, kinds.get(level, 4)])
        times = np.sort(draw.uniform(0.0, END, 1000))
        if level.name == "dead":
            lost = (times > ONSET) & (times < back) & (draw.uniform(size=times.size) > share)
            times = times[~lost]
        return Outcome("", times, END, anchoring_seconds=21.0 if level.name == "dead" else 0.0)

    return judged(study, play)


def only(results: StudyResults) -> Resilience:
    (one,) = resiliences(results)
    return one


def table(results: StudyResults, title: str) -> list[tuple[str, ...]]:
    return [
        row
        for chapter in document(results).chapters
        for section in chapter.sections
        if section.title == title
        for row in section.rows
    ]


@pytest.fixture(scope="module")
def repaired() -> StudyResults:
    return after_a_fault(0.4, back=1200.0)


def test_swarm_that_comes_back_has_a_time(repaired: StudyResults) -> None:
    fault, null = only(repaired).single
    assert (fault.total, null.total) == (SEEDS, SEEDS)
    median, nothing = fault.curve.median(), null.curve.median()
    assert median is not None
    assert 500 < median < 700
    assert nothing is not None
    assert nothing < 100
    names = [figure.name for figure in document(repaired).figures()]
    assert "self-repair-swarm-dt-Fault-tolerance-and-robustness-dead-600s" in names


def test_swarm_that_never_comes_back_is_censored() -> None:
    found = after_a_fault(0.3, back=END)
    one = only(found)
    assert one.against_removed is not None
    assert one.against_removed.value == pytest.approx(0.3, abs=0.03)
    assert one.against_removed.verdict == "refuted"
    ((_, _, median, censored, *_),) = table(found, "Time to come back")
    assert (median, censored) == ("not reached", f"{SEEDS} of {SEEDS} runs")


def test_no_loss_leaves_robustness_local_in_time() -> None:
    one = only(after_a_fault(1.0, back=END))
    assert one.against_whole is not None
    assert one.against_whole.threshold == pytest.approx(1 - 3 / 25)
    assert one.against_whole.verdict == "supported"


def test_time_to_come_back_without_its_null_says_so(repaired: StudyResults) -> None:
    (null,) = repaired.plan.nulls.values()
    keys = {null.condition.run(repaired.plan.code, seed).key for seed in range(SEEDS)}
    outcomes = {key: o for key, o in repaired.outcomes.items() if key not in keys}
    found = judge(repaired.plan, outcomes)
    assert not only(found).single
    assert "the runs of the no-fault null are missing" in markdown(document(found))


def test_null_that_ran_out_of_items_is_none(repaired: StudyResults) -> None:
    (null,) = repaired.plan.nulls.values()
    key = null.condition.run(repaired.plan.code, 0).key
    emptied = replace(repaired.outcomes[key], all_delivered=True)
    outcomes = {**repaired.outcomes, key: emptied}
    one = only(judge(repaired.plan, outcomes))
    assert not one.single
    assert "the items ran out" in str(one.problem)


def test_runs_that_deliver_everything_are_no_evidence_of_resilience() -> None:
    found = after_a_fault(1.0, back=END)
    (comparison,) = (c for c in found.plan.comparisons if c.indicator == "FT")
    key = comparison.original.condition.run(found.plan.code, 0).key
    capped = {**found.outcomes, key: replace(found.outcomes[key], all_delivered=True)}
    one = only(judge(found.plan, capped))
    assert one.against_whole is not None
    assert one.against_whole.verdict == "inconclusive"
    assert "| inconclusive† |" in markdown(document(judge(found.plan, capped)))


def test_deliveries_over_time_are_rates_of_the_window(repaired: StudyResults) -> None:
    (comparison,) = (c for c in repaired.plan.comparisons if c.indicator == "FT")
    rates = rate_curves(repaired, comparison)
    assert list(rates["runs"].unique()) == ["no fault", "removed", "fault"]
    assert (rates["seconds"].min(), rates["seconds"].max()) == (100.0, END)
    # 0.5 deliveries a second, in 100 s.
    deliveries = rates.set_index(["runs", "seconds"])["deliveries"]
    assert deliveries["no fault", 900.0] == pytest.approx(50, abs=6)
    assert deliveries["fault", 900.0] == pytest.approx(20, abs=6)
    assert deliveries["fault", 1800.0] == pytest.approx(50, abs=6)
    names = [figure.name for figure in document(repaired).figures()]
    assert "deliveries-swarm-dt-Fault-tolerance-and-robustness-dead-600s" in names


def test_one_scale_holds_the_rates_of_all_policies(repaired: StudyResults) -> None:
    figures = pytest.importorskip("matplotlib.figure", reason="needs the extra study")
    (comparison,) = (c for c in repaired.plan.comparisons if c.indicator == "FT")
    few = rate_curves(repaired, comparison)
    many = few.assign(**{name: 10.0 * few[name] for name in ("deliveries", "low", "high")})
    canvas = figures.Figure()
    drawing.rates(canvas, {"few": few, "many": many}, ONSET, "deliveries")
    for axes in canvas.axes:
        bottom, top = axes.get_ylim()
        assert bottom == 0.0
        assert top >= many["high"].max()


def test_anchoring_load_per_failed_robot(repaired: StudyResults) -> None:
    (load,) = anchoring_loads(repaired)
    assert load.load.value == 21.0
    assert load.neighbours.value == pytest.approx(21.0 / (3 * (END - ONSET)))


def test_fault_budget_stops_at_what_was_not_tested(repaired: StudyResults) -> None:
    (budget,) = fault_budgets(repaired)
    assert budget.tested == (3,)
    assert budget.budget == spi.FaultBudget(0, 1)
    ((*_, answer),) = table(repaired, "Fault budget")
    assert answer == "0 shown; m = 1 was not tested"


@pytest.mark.parametrize(
    ("delivered", "answer"),
    [
        # One robot of ten may be lost, and R = 0 lies at a tenth of the deliveries.
        ([10, 11, 10, 11], "at least 2"),
        ([5, 6, 5, 6], "0; m = 1 refuted"),
        ([2, 14, 2, 14], "0; m = 1 inconclusive"),
        ([9], "0; m = 1 inconclusive"),
    ],
)
def test_fault_budget_says_whether_more_is_refuted_or_unknown(
    delivered: list[int], answer: str
) -> None:
    study = Study(
        seeds=len(delivered),
        scenario={"n_robots": 10, "duration": END},
        faults=[{"modes": ["FM4"], "robots": [1, 2]}],
    )

    def play(_: str, level: Setting, seed: int) -> Outcome:
        number = delivered[seed] if level.name == "FM4" else 10
        return Outcome("", np.arange(1.0, number + 1.0), END)

    ((*_, said),) = table(judged(study, play), "Fault budget")
    assert said == answer


def two_policies(seeds: int, factor: float) -> StudyResults:
    """Random walk delivers `factor` times what Swarm D-T does, in every run."""
    study = Study(
        policies=["swarm-dt", "random-walk"],
        seeds=seeds,
        sizes=[{"values": [5, 10, 20, 40]}],
        faults=[{"modes": ["FM1"], "robots": [1]}],
    )
    base: Mapping[object, float] = {5: 10, 10: 20, 20: 30, 40: 36}

    def play(policy: str, level: Setting, seed: int) -> Outcome:
        # In another order at 40 robots, so that not every difference is the same.
        noise = 2 * ((3 * seed + 1) % 4 if level.value == 40 else seed % 4)
        p = base.get(level.value if level.kind == "size" else None, 32.0) + noise
        return Outcome("", np.arange(p * (factor if policy == "random-walk" else 1.0)), 500.0)

    return judged(study, play)


def test_policies_are_set_against_the_first() -> None:
    found = two_policies(8, 2.0)
    entries = {
        (c.cell.policy, c.cell.cell): c for c in cells_against_baseline(found)["Scalability"]
    }
    first, second = entries["swarm-dt", "N = 10"], entries["random-walk", "N = 10"]
    assert first.difference is None
    assert first.cell.by_seed.tolist() == [20, 22, 24, 26] * 2
    assert (first.interquartile_mean, first.worst_decile) == (23.0, 20.0)
    assert second.difference == spi.mean_interval([20, 22, 24, 26] * 2)
    assert first.ratio is None
    assert second.ratio == pytest.approx((2.0, 2.0, 2.0))
    assert second.improvement is not None
    assert second.improvement.value == 1.0
    # Twice the deliveries everywhere leaves every ratio as it was.
    one, *_ = indicators_against_baseline(found)
    assert one.differences["random-walk"] == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    titles = {chapter.title for chapter in document(found).chapters}
    assert "Policies compared" in titles
    alone = judge(Study(sizes=[{"values": [5, 10]}]).plan(), {})
    assert "Policies compared" not in {chapter.title for chapter in document(alone).chapters}


def test_nothing_is_a_multiple_of_no_deliveries() -> None:
    study = Study(policies=["swarm-dt", "random-walk"], seeds=3, sizes=[{"values": [5, 10]}])

    def play(policy: str, level: Setting, seed: int) -> Outcome:
        return Outcome("", np.arange(0.0 if policy == "swarm-dt" else 2.0 + seed), 500.0)

    *_, last = cells_against_baseline(judged(study, play))["Scalability"]
    assert (last.cell.policy, last.ratio) == ("random-walk", None)
    assert last.difference is not None


def test_several_policies_over_one_seed_give_values_alone() -> None:
    text = markdown(document(two_policies(1, 2.0)))
    assert "## Policies compared" in text
    one, *_ = indicators_against_baseline(two_policies(1, 2.0))
    assert one.differences["random-walk"] == (0.0, None, None)


def test_jackknife_of_a_mean_is_its_t_interval() -> None:
    sample = np.array([3.0, 5.0, 4.0, 9.0])

    def mean(seeds: NDArray[np.intp]) -> float:
        return float(sample[seeds].mean())

    assert jackknife_interval(4, mean) == pytest.approx(spi.mean_interval(sample))


def test_differences_of_policies_are_drawn_table_by_table() -> None:
    figures = {f.name: f for f in document(two_policies(8, 2.0)).figures()}
    sizes = figures["differences-Scalability"]
    (at_10,) = sizes.data.query("of == 'P' and cell == '10'")[
        ["policy", "less", "difference", "low", "high"]
    ].to_numpy()
    assert set(sizes.data["of"]) == {"P", "S"}
    assert at_10[:2].tolist() == ["random-walk", "swarm-dt"]
    assert tuple(at_10[2:]) == pytest.approx(spi.mean_interval([20, 22, 24, 26] * 2))
    faults = figures["differences-Fault-tolerance-and-robustness"]
    assert set(faults.data["of"]) == {"P", "FT", "R"}
    assert set(faults.data["cell"]) == {"no fault", "removed 1", "FM1 1"}


def test_ablation_is_drawn_with_its_threshold() -> None:
    study = Study(seeds=4, ablations=[{"policy": "random-walk", "fall": 0.25}])
    found = judged(
        study,
        lambda _, level, seed: Outcome(
            "", np.arange(float((20 if level.name == "random-walk" else 40) + seed))
        ),
    )
    (figure,) = document(found).figures()
    assert figure.name == "change-Ablation"
    ((_, _, indicator, label, value, *_),) = figure.data.to_numpy().tolist()
    assert (indicator, label) == ("change", "random-walk, N = 25")
    assert value == pytest.approx(21.5 / 41.5 - 1)


def test_policies_that_differ_in_punctuation_have_files_of_their_own() -> None:
    chosen = [{"name": "swarm-dt", "parameters": {"taxis_gain": 0.5}, "label": "Swarm.DT"}]
    study = Study(policies=["swarm-dt", *chosen], seeds=1, sizes=[{"values": [5, 10]}])
    found = judged(study, lambda *_: Outcome("", np.arange(30.0)))
    names = [figure.name for figure in document(found).figures()]
    assert len({name.lower() for name in names}) == len(names)
    assert "P-N-swarm-dt-Scalability" in names
    assert "P-N-Swarm-DT-Scalability-2" in names
