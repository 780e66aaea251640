"""Two policies: by which factor P of one is larger, where the order turns, and where it is open."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure as Canvas

from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.policies_compared import compare_policies
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.trial_study import judge
from swarm_logistics_env.study.verdicts.results import StudyResults
from tests.made_up import delivered, judged

SIZES = {"values": [10, 25]}
FAULTS = {"modes": ["FM1", "FM4"], "robots": [1, 3]}


def study_of(*policies: str, **fields: Any) -> Study:
    return Study(
        policies=list(policies), seeds=12, scenario={"restock": True}, sizes=[SIZES],
        faults=[FAULTS], compares_policies=True, **fields,
    )  # fmt: skip


def play(policy: str, setting: Setting, seed: int) -> Outcome:
    """The script delivers twice as much, but half as much under FM4, and as much under FM1."""
    usual = 100 + 3 * (seed % 4)
    if policy == "homing":
        usual = {"FM4": usual // 2, "FM1": usual + (-6, 6)[seed % 2]}.get(setting.name, 2 * usual)
    return delivered(usual, digest=f"{policy} {setting} {seed}")


@pytest.mark.unmeasured
def test_the_first_line_says_the_factor_where_it_holds_turns_and_is_open() -> None:
    results = judged(study_of("homing", "swarm-dt"), play)
    words = answer(results).comparison
    assert words == (
        "P of homing is 2.00 [2.00, 2.00] times that of swarm-dt (N = 25); also more in 1 of 3 "
        "other conditions; the other way round: FM4 m = 3; open: FM1 m = 3."
    )
    assert terminal_answer(answer(results), 300).splitlines()[0] == words


def test_the_first_line_has_the_direction_of_the_rows() -> None:
    results = judged(study_of("swarm-dt", "homing"), play)
    words = answer(results).comparison
    assert words.startswith("P of swarm-dt is 0.50 [0.50, 0.50] times that of homing (N = 25); ")
    assert "; also less in 1 of 3 other conditions; the other way round: FM4 m = 3;" in words
    row = next(line for line in answer(results).lines if "N = 25" in line.question)
    # As the sentence has it.
    assert (row.question, row.value) == ("times P, N = 25", "0.50")


def test_the_first_line_says_by_how_much_other_conditions_differ_and_which_level_is_another() -> (
    None
):
    def play_ahead(policy: str, setting: Setting, seed: int) -> Outcome:
        factor = {"FM4": 3, "FM1": 4}.get(setting.name, 2) if policy == "homing" else 1
        return delivered(factor * (100 + 3 * (seed % 4)), digest=f"{policy} {setting} {seed}")

    words = answer(judged(study_of("homing", "swarm-dt"), play_ahead)).comparison
    assert words.endswith("; also more in 3 of 3 other conditions (2.00 to 4.00 times).")
    study = Study(
        policies=["homing", "swarm-dt"], seeds=60, until_clear=True, sizes=[SIZES],
        compares_policies=True, scenario={"restock": True},
    )  # fmt: skip
    results = judged(study, play)
    level = section.percent(results.level)
    assert level != "95 %"
    assert f"that of swarm-dt (N = 25, {level}); also more" in answer(results).comparison


def test_the_first_line_says_what_is_less_the_same_and_cannot_be_compared() -> None:
    faults = [{"modes": ["FM1"], "robots": [1]}]
    study = Study(
        policies=["homing", "swarm-dt"], seeds=8, sizes=[SIZES], faults=faults,
        indicators=["S", "R"], compares_policies=True,
    )  # fmt: skip

    def play_behind(policy: str, setting: Setting, seed: int) -> Outcome:
        is_alike = policy == "homing" or setting.name == "FM1"
        count = (40 if is_alike else 60) + (7 * seed + (policy == "homing") * seed**2) % 5
        return delivered(count, digest=f"{policy} {setting} {seed}")

    less = compare_policies(judged(study, play_behind))
    assert less.sentence == (
        "P of homing is 0.68 [0.66, 0.69] times that of swarm-dt (N = 25); also less in 1 of 2 "
        "other conditions; open: FM1 m = 1."
    )
    assert (less.factors, less.turns) == ({"swarm-dt": ("1.48 [1.45, 1.51]", "more")}, "")
    unchanged = compare_policies(
        judged(study, lambda _, at, s: delivered(40 + s, digest=f"{at} {s}"))
    )
    words = "Whether P of homing or of swarm-dt is larger is unaffected: 1.00 [1.00, 1.00] times ("
    assert unchanged.sentence.startswith(f"{words}N = 25)")
    assert unchanged.factors == {"swarm-dt": ("1.00 [1.00, 1.00]", "unaffected")}
    nothing = compare_policies(
        judged(study, lambda policy, *_: delivered(0 if policy == "swarm-dt" else 40))
    )
    words = "P of homing and of swarm-dt cannot be compared: it delivers nothing (N = 25)."
    assert nothing.sentence == words
    assert nothing.factors == {"swarm-dt": ("–", "undefined")}


def test_policies_share_the_row_of_a_question_in_the_figure_and_the_legend_names_them() -> None:
    results = judged(study_of("homing", "swarm-dt", indicators=["R"]), play)
    drawn = {figure.name: Canvas() for figure in document(results).figures}
    for figure in document(results).figures:
        figure.draw(drawn[figure.name])
    (axes,) = drawn["times"].axes
    conditions = [tick.get_text() for tick in axes.get_yticklabels()]
    assert axes.get_xscale() == "log"
    canvas = drawn["answer"]
    (axes,) = canvas.axes
    labels = [tick.get_text() for tick in axes.get_yticklabels()]
    of_both = [
        *("FM1 false timer, 1 of 25", "FM1 false timer, 3 of 25"),
        *("FM4 no delivery, 1 of 25", "FM4 no delivery, 3 of 25"),
    ]
    assert labels[-5:] == ["Robustness R", *of_both]
    # A heading stands among the labels.
    assert len(answer(results).lines) == len(conditions) + 2 * (len(labels) - 1)
    assert [label.get_fontweight() for label in axes.get_yticklabels()].count("bold") == 1
    (legend,) = canvas.legends
    names = ["homing", "swarm-dt"]
    assert [text.get_text() for text in legend.get_texts()] == names


def test_three_policies_stand_in_one_table_beside_the_first_and_holm_counts_all_conditions() -> (
    None
):
    fields = {"indicators": ["S", "R"]}
    results = judged(study_of("homing", "swarm-dt", "random-walk", **fields), play)
    of_three = answer(results)
    assert of_three.overview is not None
    head, *rows = of_three.overview.columns, *of_three.overview.rows
    assert head == ("[95 %]", "P, N = 25, no fault", "times the first", "")
    assert rows[0] == ("homing", "209.0 [204.5, 213.5]", "", "")
    assert rows[1][0] == "swarm-dt"
    assert rows[1][2:] == ("0.50 [0.50, 0.50]", "less")
    turns, *indicators = of_three.summary
    assert turns == (
        "The order turns in some of 6 comparisons elsewhere: swarm-dt at FM4 m = 3; random-walk at "
        "FM4 m = 3."
    )
    assert [sentence[:14] for sentence in indicators] == ["Scalability S:", "Robustness R: "]
    assert indicators[1].endswith(
        "; lowest at homing: FM4 no delivery, 1 of 25: P 209→52, R -0.71 [-0.71, -0.71], refuted."
    )
    text = terminal_answer(of_three)
    assert max(map(len, text.splitlines())) <= 80
    assert text.count("Holm's method") == 1
    families = {verdict.compared.family for verdict in results.verdicts}
    assert families >= {("swarm-dt", "change"), ("random-walk", "change")}


def test_nothing_is_compared_unless_it_is_asked_for() -> None:
    study = Study(policies=["homing", "swarm-dt"], seeds=3, sizes=[SIZES])
    results: StudyResults = judged(study, play)
    assert answer(results).comparison == ""
    first, second, *_ = terminal_answer(answer(results), 80).splitlines()
    assert first == "None of 2 questions is decided."
    assert second.startswith("study: ")
    assert "policies" not in [figure.name for figure in document(results).figures]


def test_one_figure_has_p_of_both_policies_in_every_condition() -> None:
    results = judged(study_of("homing", "swarm-dt"), play)
    figure = document(results).figures[0]
    assert figure.name == "policies"
    (panel,) = figure.panels
    assert {point.series for point in panel.points} == {"homing", "swarm-dt"}
    means = {(cell.policy, cell.arm.case.key): cell.mean for cell in results.cells}
    shown = {(point.series, point.value, point.low, point.high) for point in panel.points}
    assert shown <= {(policy, *mean) for (policy, _), mean in means.items()}
    assert len(panel.points) == 2 * 4


@pytest.mark.unmeasured
def test_the_factor_is_that_of_the_means_and_its_interval_as_a_bootstraps() -> None:
    rng = np.random.default_rng(0)
    scatter = {policy: rng.normal(0.0, 12.0, 12) for policy in ("homing", "swarm-dt")}
    means = {"homing": 130.0, "swarm-dt": 100.0}

    def noisy(policy: str, setting: Setting, seed: int) -> Outcome:
        count = round(means[policy] + scatter[policy][seed])
        return delivered(count, digest=f"{policy} {setting} {seed}")

    results = judged(study_of("homing", "swarm-dt"), noisy)
    (verdict, *_) = [v for v in results.verdicts if v.compared.indicator == "change"]
    estimate = verdict.estimate
    assert estimate is not None
    p = {policy: np.round(means[policy] + scatter[policy]) for policy in means}
    assert 1.0 + estimate.value == pytest.approx(p["homing"].mean() / p["swarm-dt"].mean())
    drawn = rng.integers(0, 12, (20_000, 12))
    ratios = p["homing"][drawn].mean(axis=1) / p["swarm-dt"][drawn].mean(axis=1)
    low, high = np.quantile(ratios, [0.025, 0.975])
    assert estimate.low is not None
    assert estimate.high is not None
    # A bootstrap of twelve is a tenth too narrow, and the test guards against hidden stalls.
    assert 0.9 < (estimate.high - estimate.low) / (high - low) < 1.5


def test_trials_of_two_controllers_are_compared_pair_by_pair(tmp_path: Path) -> None:
    rows = ["controller,robots,fault,faulty,day,delivered"]
    for day, noise in enumerate([0, 2, -1, 1, 3, -2]):
        rows += [f"ours,10,none,0,{day},{40 + noise}", f"theirs,10,none,0,{day},{20 + day % 3}"]
        rows += [f"ours,10,dead,2,{day},{21 - noise}", f"theirs,10,dead,2,{day},{20 + noise}"]
    file = tmp_path / "trials.csv"
    file.write_text("\n".join(rows))
    text = " ".join(repr(judge(file)).split())
    assert "P of ours is 1.93 [" in text
    assert "times that of theirs (no fault); open: dead m = 2." in text
