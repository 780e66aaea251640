"""The paper's claims by means: which can fail, the rule at its limits, what is played and shown."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from research import play_claims, tables
from research.fit_paper import Tried, cell_name, read_tried
from research.play_paper_fit import PAGE, published
from swarm_logistics_env.study.verdicts.reference import PAPER

PLAYED = read_tried(play_claims.FOLDER / "claims.csv")


def test_every_claim_follows_from_the_papers_own_values() -> None:
    for question in play_claims.questions():
        value = play_claims.estimate(question, published).value
        assert (value > question.threshold) == PAPER.claims[question], str(question)


def test_exactly_those_claims_cannot_fail_that_no_performances_contradict() -> None:
    draws = np.random.default_rng(0)
    never_contradicted = set()
    for question in play_claims.questions():
        settings = play_claims.settings_of(question)
        values = np.array(
            [
                play_claims.estimate(
                    question, dict(zip(settings, p, strict=True)).__getitem__
                ).value
                for p in 60.0 * draws.random((60, len(settings)))
            ]
        )
        if np.all((values > question.threshold) == PAPER.claims[question]):
            never_contradicted.add(play_claims.claim_text(question))
    cannot_fail = {
        play_claims.claim_text(q) for q in play_claims.questions() if not play_claims.can_fail(q)
    }
    assert cannot_fail == never_contradicted
    assert cannot_fail == {f"warehouse_width = 5 -> {width}: A > 0" for width in (10, 15, 20)}


@pytest.mark.parametrize(
    ("n_holding", "word"),
    [(30, "holds"), (27, "holds"), (26, "open"), (15, "open"), (4, "open"), (3, "fails")],
)
def test_a_claim_holds_or_fails_only_beyond_the_limit_of_the_share(
    n_holding: int, word: str
) -> None:
    assert play_claims.word(n_holding, 30) == word


def test_what_was_played_are_the_sets_drawn_each_at_its_seeds() -> None:
    sets = play_claims.drawn_sets(play_claims.FOLDER / "tried.csv")
    jobs = list(play_claims.jobs(sets))
    assert len({tuple(constants.values()) for constants in sets}) == play_claims.SETS
    runs = {(job.seed, cell_name(setting)) for job in jobs for setting in job.cells}
    n_cells = len(play_claims.needed_cells())
    assert len(runs) == play_claims.SETS * play_claims.SEEDS * n_cells
    constants_at = {job.seed: job.constants for job in jobs}
    assert len(constants_at) == play_claims.SETS * play_claims.SEEDS
    for row in PLAYED:
        assert row.constants == constants_at[row.seed]
        assert {(row.seed, name) for name in row.performance} <= runs


def test_a_second_call_plays_what_the_first_one_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    played = []

    def play(cells: tuple[object, ...], _: object, seed: int) -> dict[str, int]:
        played.append((seed, len(cells)))
        return {cell_name(setting): seed % 10 + 1 for setting in cells}  # type: ignore[arg-type]

    monkeypatch.setattr(play_claims, "play", play)
    sets = play_claims.drawn_sets(play_claims.FOLDER / "tried.csv")[:2]
    path = tmp_path / "claims.csv"
    ends = iter([False] * 7 + [True])
    play_claims.play_missing(path, sets, lambda: next(ends))
    assert play_claims.runs_a_cell(read_tried(path)) == (3, 4)
    play_claims.play_missing(path, sets, lambda: False)
    jobs = [(job.seed, len(job.cells)) for job in play_claims.jobs(sets)]
    assert played == jobs
    rows = read_tried(path)
    assert play_claims.runs_a_cell(rows) == (5, 5)
    claims = play_claims.judged_claims(rows)
    assert {len(claim.of_sets) for claim in claims} == {0, 2}
    assert {len(claim.of_runs) for claim in claims} == {0, 10}
    assert claims[0].of_sets == pytest.approx(0.0)  # P is the same at every size


def test_a_claim_counts_the_sets_and_the_runs_on_its_side() -> None:
    question = play_claims.questions()[0]  # N = 5 -> 10: S > 0
    sizes = {cell_name(setting): setting for setting in play_claims.settings_of(question)}
    performances = [(10, 14), (10, 8), (10, 11), (10, 10)]  # two seeds each of two sets
    rows = [
        Tried("claims", 0, seed, {"diffusion": float(seed // 2)}, dict(zip(sizes, p, strict=True)))
        for seed, p in enumerate(performances)
    ]
    claim = play_claims.judged_claims(rows)[0]
    assert claim.of_sets == pytest.approx([0.1, 0.05])
    assert claim.of_runs == pytest.approx([0.4, -0.2, 0.1, 0.0])
    assert claim.n_holding == 2
    assert list(claim.is_on_its_side(claim.of_runs)) == [True, False, True, False]


def test_the_page_shows_what_was_played() -> None:
    page = PAGE.read_text(encoding="utf-8")
    block = play_claims.block(PLAYED, play_claims.judged_claims(PLAYED))
    assert tables.with_blocks(page, {"claims": block}) == page
