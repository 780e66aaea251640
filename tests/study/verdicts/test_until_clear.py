"""Studies that run until they are clear: when comparisons stop, what is played, and errors."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from swarm_logistics_env import spi
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study.questions.specification import looks_up_to
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.sentences import sentence
from swarm_logistics_env.study.runs.engines import Shard
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Run
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.until_clear import latest_look, predictive_power
from swarm_logistics_env.study.verdicts.verdict import Verdict
from swarm_logistics_env.views.cli.terminal import AnswerSoFar
from tests.made_up import decided, delivered

MEANS = {"FM2": 38.5, "FM3": 34.0, "FM4": 15.0}  # of 40 items; R is 0.0025, -0.11 and -0.585


def mode_of(run: Run) -> str:
    return "".join(fault.mode for fault in run.case.faults)


def made_up(run: Run) -> Outcome:
    """An outcome that depends on the run alone: Poisson counts around the mean of its fault."""
    rng = np.random.default_rng([run.seed, *map(ord, mode_of(run))])
    return delivered(rng.poisson(MEANS.get(mode_of(run), 40.0)), digest=run.key)


@dataclass
class Engine:
    """Gives made-up outcomes, as they are or as `changed` makes them, and notes the runs."""

    changed: Callable[[Run, Outcome], Outcome] = lambda _, outcome: outcome
    most: int | None = None
    played: list[Run] = field(default_factory=list)

    def __call__(self, runs: Iterable[Run]) -> Generator[tuple[Run, Outcome], None, None]:
        for run in islice(runs, self.most):
            self.played.append(run)
            yield run, self.changed(run, made_up(run))


def until_clear(most: int, out: Path | None = None) -> Study:
    faults = [{"modes": [*MEANS], "robots": [1]}]
    return Study(out=out, seeds=most, until_clear=True, faults=faults, indicators=["R"])


def test_what_cannot_fail_is_played_to_the_first_look_alone() -> None:
    drift = {"name": "heading_drift", "values": [0.02, 0.04, 0.03]}
    study, engine = Study(seeds=60, until_clear=True, parameters=[drift]), Engine()
    study.run(engine)
    doubled, half = study.findings().verdicts
    assert (doubled.on_threshold.plain, doubled.on_threshold.adjusted, doubled.conclusion) == (
        "untestable",
    ) * 3
    assert (doubled.p_adjusted, doubled.stopped_at) == (None, 10)
    assert (half.conclusion, half.p_adjusted is None) == ("supported", False)
    study_answer = answer(study.findings())
    assert study_answer.lines[0].verdict.in_words == "untestable, never < 0"
    assert "untestable, never < 0: as P cannot be." in study_answer.notes
    text = sentence(study.findings(), doubled).text
    assert "it cannot lie below the threshold, so it is not tested" in text
    assert "djusted" not in text


def test_p_stands_before_the_rest_of_the_first_look_and_the_same_engine_plays_all(
    capsys: pytest.CaptureFixture[str],
) -> None:
    study, engine, stages = until_clear(30), Engine(), list[StudyResults]()
    calls = []

    def counted(runs: Iterable[Run]) -> Generator[tuple[Run, Outcome], None, None]:
        calls.append(len(engine.played))
        yield from engine(runs)

    study.run(counted, after_look=stages.append)
    assert calls == [0]
    assert {mode_of(run) for run in engine.played[:10]} == {""}
    played = [len(results.outcomes) for results in stages]
    assert played[:2] == [10, 40]
    assert played[-1] == len(engine.played)
    so_far = AnswerSoFar()
    for results in stages:
        so_far.show(results)
    printed = re.sub(r"After \d+ s", "After T s", capsys.readouterr().err)
    first_line, rest, first_look, *_ = printed.split("\n")
    mean = stages[0].cells[0].mean.value
    assert first_line.startswith(f"After T s: swarm-dt: P [95 %] = {mean:.1f} [")
    assert re.match(r"The first look comes in \d+:\d\d, the whole takes at most \d", rest)
    assert first_look == "After T s, a first look:"
    assert printed.splitlines()[-1].startswith("After T s, 30 seeds: 1 of 3 questions are clear, ")


def test_an_engine_that_takes_all_runs_at_once_is_called_again_for_the_next_look(
    finished: tuple[Study, Engine],
) -> None:
    def eager(runs: Iterable[Run]) -> Generator[tuple[Run, Outcome], None, None]:
        yield from Engine()(list(runs))

    study = until_clear(60)
    tally = study.run(eager)
    assert (tally.played, tally.left) == (len(finished[1].played), 0)
    assert told(study) == told(finished[0])


def verdicts_of(study: Study) -> dict[str, Verdict]:
    return {test.after.name: test for test in study.findings().verdicts}


def told(study: Study) -> dict[str, tuple[Any, ...]]:
    return {
        mode: (
            test.stopped_at,
            test.estimate and test.estimate.n_seeds,
            test.on_threshold.adjusted,
            test.interval,
        )
        for mode, test in verdicts_of(study).items()
    }


@pytest.fixture(scope="module")
def finished() -> tuple[Study, Engine]:
    """A study of at most 60 seeds, and the engine that played it."""
    study, engine = until_clear(60), Engine()
    assert study.run(engine).played == len(engine.played)
    return study, engine


def test_clear_comparisons_stop_early_and_their_conditions_get_no_more_seeds(
    finished: tuple[Study, Engine],
) -> None:
    study, engine = finished
    results_by_mode = told(study)
    assert results_by_mode["FM4"][:3] == (10, 10, "refuted")
    assert 10 < results_by_mode["FM3"][1] < 60
    stopped_at, n_seeds, verdict, _ = results_by_mode["FM2"]
    # It is no longer played once the seeds to come would hardly decide it.
    assert (stopped_at, verdict) == (None, "open")
    assert 10 < n_seeds < 60
    modes = [mode_of(run) for run in engine.played]
    seeds = {mode: modes.count(mode) for mode in MEANS}
    assert seeds == {mode: results_by_mode[mode][1] for mode in MEANS}
    assert len(engine.played) == sum(seeds.values()) + max(seeds.values())
    cells, most = study.findings().cells, max(seeds.values())
    assert {cell.n_seeds for cell in cells} == {*seeds.values()}  # the sound swarm has the most
    assert study.findings().seeds_text == f"10 to {most} paired seeds (0 to {most - 1})"
    # Each is judged by its own seeds and its repeated interval.
    looks = looks_up_to(60)
    for test in study.findings().verdicts:
        estimate = test.estimate
        assert estimate is not None
        alpha = spi.look_alphas(looks)[looks.index(estimate.n_seeds)]
        assert estimate.confidence == pytest.approx(1 - alpha)
        p_o, p_f = (
            [made_up(Run(arm.case, "", seed)).delivered for seed in range(estimate.n_seeds)]
            for arm in test.compared.arms
        )
        alone = spi.robustness(p_o, p_f, n=25, m=1, confidence=estimate.confidence)
        assert test.interval == (alone.value, alone.low, alone.high)
        assert estimate.p_value == alone.p_value


@pytest.mark.unmeasured
def test_a_change_within_the_margin_is_played_no_further() -> None:
    def hardly_changed(run: Run, _: Outcome) -> Outcome:
        rng = np.random.default_rng([run.seed, *map(ord, mode_of(run))])
        return delivered(rng.poisson(148 if run.case.faults else 150))

    study = until_clear(200)
    study.run(Engine(hardly_changed))
    for verdict in verdicts_of(study).values():
        assert verdict.estimate is not None
        assert verdict.on_equivalence is not None
        assert (verdict.stopped_at, verdict.on_threshold.adjusted) == (None, "open")
        assert verdict.on_equivalence.adjusted == "equivalent"
        assert verdict.estimate.n_seeds <= 100  # for the sign it would go on to 200


def test_stopped_before_the_first_look_it_has_a_value_of_every_question_and_no_verdict() -> None:
    study = until_clear(60)
    assert latest_look(study.plan(), {}).n_most == len(study.plan().runs)
    for most, n_seeds in ((13, {1}), (22, {8, 9})):  # one seed has no p
        study.run(Engine(most=most))
        verdicts = verdicts_of(study)
        assert {test.estimate and test.estimate.n_seeds for test in verdicts.values()} <= n_seeds
        assert {test.conclusion for test in verdicts.values()} == {"undefined"}


def test_an_open_scalability_has_no_margin_to_stop_within() -> None:
    study = Study(seeds=30, until_clear=True, sizes=[{"values": [20, 40]}], indicators=["S"])
    counts = np.random.default_rng(0).poisson(40, (41, 30))  # by N and the seed
    study.run(Engine(lambda run, _: delivered(counts[run.case.scenario.n_robots, run.seed])))
    (verdict,) = study.findings().verdicts
    assert (verdict.on_threshold.adjusted, verdict.given_up) == ("open", "hardly")


@pytest.mark.daily
def test_at_each_look_holm_steps_down_through_what_is_open() -> None:
    looks, softened = looks_up_to(30), 0
    for number in range(4):

        def poisson(run: Run, _: Outcome, number: int = number) -> Outcome:
            rng = np.random.default_rng([number, run.seed, *map(ord, mode_of(run))])
            return delivered(rng.poisson(33 if run.case.faults else 40))

        study = until_clear(30)
        study.run(Engine(poisson))
        tests = [
            (e.n_seeds, e.p_value or 0.0, t.on_threshold.adjusted)
            for t in verdicts_of(study).values()
            if (e := t.estimate)
        ]
        n_open = len(tests)
        for n_seeds, p, verdict in sorted(tests, key=lambda test: test[:2]):
            look = looks.index(n_seeds)
            alone, level = (spi.look_alphas(looks, alpha)[look] for alpha in (0.05, 0.05 / n_open))
            is_clear = verdict != "open"
            assert is_clear == (p < level)
            softened += level <= p < alone
            n_open -= is_clear
    assert softened


def test_interrupted_at_any_moment_it_goes_on_to_the_same_result(
    finished: tuple[Study, Engine], tmp_path: Path
) -> None:
    study, engine = finished
    interrupted, played = until_clear(60, tmp_path), 0
    for most in (25, 7, 5, 1):
        tally = interrupted.run(Engine(most=most))
        assert (tally.kept, tally.played) == (played, most)
        played += most
        assert interrupted.finished() == (played, 10 * 4)  # the runs of its next look
    until_clear(60, tmp_path).run(Engine())
    stored = Study.stored(tmp_path)
    assert stored.finished() == (len(engine.played),) * 2
    assert told(stored) == told(study)
    assert not stored.findings().exploratory


def test_later_outcomes_of_a_shared_condition_change_no_verdict(
    finished: tuple[Study, Engine],
) -> None:
    capped = until_clear(60)
    capped.run(
        Engine(
            lambda run, outcome: replace(outcome, all_delivered=not mode_of(run) and run.seed >= 20)
        )
    )
    # A capped P_F would block "refuted" only; a capped P_o blocks "supported", and marks the rest.
    assert told(capped)["FM4"] == told(finished[0])["FM4"]
    assert not verdicts_of(capped)["FM4"].saturated


def test_a_failed_run_blocks_its_comparison_and_no_other() -> None:
    def fails_once(run: Run, outcome: Outcome) -> Outcome:
        return (
            Outcome(error="ValueError: no") if (mode_of(run), run.seed) == ("FM3", 7) else outcome
        )

    study = until_clear(30)
    assert study.run(Engine(fails_once)).failed == 1
    tests = verdicts_of(study)
    assert "1 of 10 runs failed" in str(tests["FM3"].problem)
    assert tests["FM4"].stopped_at == 10
    study.run(Engine())  # what failed is tried again
    assert not any(test.problem for test in verdicts_of(study).values())


def test_another_most_is_exploratory_and_shards_are_refused(tmp_path: Path) -> None:
    until_clear(30, tmp_path).run(Engine())
    longer = until_clear(40, tmp_path)
    assert longer.is_exploratory()
    with pytest.raises(StudyError, match="shard"):
        longer.run(Engine(), shard=Shard(1, 2))


def noise(seed: int) -> Numbers:
    """Return errors of 60 seeds, of variance 1, which cancel out at every look."""
    drawn = np.random.default_rng(seed).uniform(-math.sqrt(3.0), math.sqrt(3.0), 60)
    return np.concatenate([part - part.mean() for part in np.split(drawn, [10, 20, 30, 40, 50])])


P_O = 100.0 + noise(0)
Sampled = Callable[[float], Numbers]  # P_F over seeds, by how much it scatters


def with_p(p_value: Callable[[Numbers], float | None], sampled: Sampled, wanted: float) -> Numbers:
    """Return the sample whose p, which rises with its scatter, is the one wanted."""
    low, high = 1.0, 57.0
    for _ in range(10):
        middle = (low + high) / 2
        low, high = (middle, high) if (p_value(sampled(middle)) or 0.0) < wanted else (low, middle)
    assert p_value(sampled(low)) == pytest.approx(wanted, rel=0.05)
    return sampled(low)


def family(most: int, p_f: dict[str, Numbers]) -> tuple[dict[str, Verdict], Engine]:
    """Judge R of a robot of 100 for each mode until it is clear, with P_F at each seed."""

    def outcome_of(run: Run, _: Outcome) -> Outcome:
        p = float(p_f.get(mode_of(run), P_O)[run.seed])
        # Runs of one P at one seed are the same runs.
        return Outcome(untimed=p, digest=f"{run.seed} {p}")

    fields: dict[str, Any] = {"scenario": {"n_robots": 100}, "indicators": ["R"]}
    fields["faults"], engine = [{"modes": [*p_f], "robots": [1]}], Engine(outcome_of)
    study = Study(seeds=most, until_clear=True, **fields)
    study.run(engine)
    return verdicts_of(study), engine


def test_every_step_of_holm_at_a_look_has_a_level_of_its_own() -> None:
    def p_of_r(p_f: Numbers) -> float | None:
        return spi.robustness(P_O[:10], p_f, n=100, m=1).p_value

    def sampled(seed: int) -> Sampled:
        return lambda scatter: P_O[:10] + 25.0 + scatter * noise(seed)[:10]

    # Below 0.05, 0.05 / 2 and 0.05 / 3; in the plan the largest comes first.
    wanted = {"FM2": 0.042, "FM3": 0.021, "FM4": 0.012}
    verdicts, _ = family(
        10, {mode: with_p(p_of_r, sampled(n), p) for n, (mode, p) in enumerate(wanted.items(), 1)}
    )
    assert {
        mode: (test.on_threshold.adjusted, test.stopped_at) for mode, test in verdicts.items()
    } == dict.fromkeys(wanted, ("supported", 10))


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("shares", "equivalent"),
    [((0.85, 0.85, 0.85), {"FM2", "FM3", "FM4"}), ((0.85, 1.2, 0.85), {"FM4"})],
)
def test_equivalences_step_down_too_each_at_the_level_of_its_own_look(
    shares: tuple[float, ...], equivalent: set[str]
) -> None:
    levels = [spi.look_alphas(looks_up_to(60), 0.1 / n_open)[-1] / 2 for n_open in (1, 2, 3)]

    def p_of_equivalence(p_f: Numbers) -> float | None:
        return spi.equivalence(P_O, p_f).p_value

    def sampled(seed: int) -> Sampled:
        return lambda scatter: 0.99 * P_O + scatter * noise(seed)  # R = 0, so it stays open

    modes = ("FM2", "FM3", "FM4")  # the one with the largest p comes first
    p_f = {
        mode: with_p(p_of_equivalence, sampled(n), share * level)
        for n, (mode, share, level) in enumerate(zip(modes, shares, levels), 1)
    }
    verdicts, _ = family(60, p_f)
    assert {test.stopped_at for test in verdicts.values()} == {None}
    alphas = [test.equivalence.alpha for test in verdicts.values() if test.equivalence]
    assert alphas == pytest.approx([levels[0]] * 3)
    assert {
        m for m, test in verdicts.items() if decided(test.on_equivalence).adjusted == "equivalent"
    } == equivalent


def test_predictive_power_is_the_share_of_studies_that_the_last_look_decides() -> None:
    rng, n_seeds, most, alpha = np.random.default_rng(0), 20, 60, 0.01
    p = 0.05
    # A flat prior: the mean is that of the seeds so far, with their error.
    first = norm.isf(p) * math.sqrt(n_seeds)
    mean = rng.normal(first / n_seeds, 1.0 / math.sqrt(n_seeds), 200_000)
    rest = rng.normal(mean * (most - n_seeds), math.sqrt(most - n_seeds))
    decided = (first + rest) / math.sqrt(most) > norm.isf(alpha)
    assert predictive_power(p, n_seeds, most, alpha) == pytest.approx(decided.mean(), abs=0.005)
    assert predictive_power(p, most, most, alpha) == 0.0


def test_a_comparison_of_the_same_runs_stops_at_the_first_look() -> None:
    verdicts, engine = family(60, {"FM2": P_O})
    assert (verdicts["FM2"].on_threshold.adjusted, verdicts["FM2"].stopped_at) == ("unaffected", 10)
    assert len(engine.played) == 20


def test_all_seeds_after_looks_were_declared_are_exploratory(tmp_path: Path) -> None:
    until_clear(30, tmp_path).run(Engine())
    assert not until_clear(30, tmp_path).findings().exploratory
    fields: dict[str, Any] = {"faults": [{"modes": [*MEANS], "robots": [1]}], "indicators": ["R"]}
    assert Study(out=tmp_path, seeds=30, **fields).is_exploratory()
