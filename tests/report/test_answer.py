"""The answer: one screen that counts, shows every verdict and says what surprises and is open."""

from __future__ import annotations

from dataclasses import replace

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.report.answer import DIGEST_LINES, answer, digest
from swarm_logistics_env.report.verdict_matrix import text_lines, verdict_matrix
from swarm_logistics_env.spi.verdict_signs import SIGNS
from swarm_logistics_env.studies.comparisons import Setting
from swarm_logistics_env.studies.presets import PAPER
from swarm_logistics_env.studies.results import StudyResults
from tests.report.test_report_files import results


@pytest.fixture(scope="module")
def found() -> StudyResults:
    return results(4)


@pytest.fixture(scope="module")
def compared() -> StudyResults:
    """Two policies: the second delivers half as much, and collapses under FM1."""

    def p(policy: str, setting: Setting) -> float:
        published = float(PAPER.performance.get(setting, 10.0))
        collapses = setting.name == "FM1"
        return published if policy == "swarm-dt" else published * (0.1 if collapses else 0.5)

    return results(10, p, policies=["swarm-dt", "swarm-dt-follow"])


def test_every_question_has_the_sign_of_its_verdict(found: StudyResults) -> None:
    matrix = verdict_matrix(found)
    cells = list(matrix.cells())
    assert len(cells) == len(found.indicators)
    assert [cell.verdict for cell in cells].count("supported") == (
        found.indicators["answer_holm"].eq("supported").sum()
    )
    (faults,) = (block for block in matrix.blocks if block.axis == "m = 1 2 3")
    assert [row.label for row in faults.rows] == [
        f"{symbol} FM{mode}" for symbol in ("FT", "R") for mode in (1, 2, 3, 4)
    ]
    for row in faults.rows:
        for m, cell in zip((1, 2, 3), row.cells["swarm-dt"]):
            assert cell is not None
            assert (cell.test.factor, cell.test.after) == (row.factor, m)
            assert cell.mark == SIGNS[cell.test.conclusion or "blocked"].mark


@pytest.mark.parametrize("width", [60, 80, 120])
def test_digest_fits_the_screen_and_nothing_is_cut(
    width: int, found: StudyResults, compared: StudyResults
) -> None:
    for one in (found, compared):
        lines = digest(answer(one), width, None).splitlines()
        assert len(lines) <= DIGEST_LINES
        assert max(map(len, lines)) <= width
        assert not any("…" in line for line in lines if "N 5→" not in line)
    whole = text_lines(verdict_matrix(compared), width)
    for block in verdict_matrix(compared).blocks:
        for row in block.rows:
            for cells in row.cells.values():
                signs = "".join(cell.mark if cell else "·" for cell in cells)
                assert any(signs in line for line in whole), row.label


def test_digest_counts_claims_and_names_what_contradicts_the_paper(found: StudyResults) -> None:
    text = digest(answer(found), 80, None)
    claims = found.indicators[found.indicators["claim"].notna()]
    supported = int(claims["claim_verdict_holm"].eq("supported").sum())
    assert f"swarm-dt: {supported} supported, " in text
    assert f" of {len(claims)} claims." in text
    assert "if the paper is right, 20 seeds decide " in text
    # The robots of a fleet that FM4 spares deliver all the same: the paper says they do not.
    tough = results(10, lambda _, setting: 39.0 if setting.name == "FM4" else 20.0)
    surprises = answer(tough).surprises
    assert any("FM4, m=3" in one and "swarm-dt is tolerant, " in one for one in surprises)


def test_blocked_questions_tell_why() -> None:
    said = answer(results(1, lambda *_: 0.0)).unanswered
    assert "blocked, the first because mean of p_n = 0: nothing was delivered" in said


def test_what_is_provisional_surprises_nobody() -> None:
    def p(policy: str, setting: Setting) -> float:
        return 39.0 if setting.name == "FM4" and policy == "swarm-dt" else 20.0

    few = results(4, p, policies=["swarm-dt", "swarm-dt-follow"])
    assert "refuted" in set(few.indicators["claim_verdict_holm"])
    assert not answer(few).surprises


def test_the_furthest_of_many_answers_is_no_surprise_by_chance() -> None:
    for seeds in (15, 20, 29):  # the same policy twice
        twins = results(seeds, policies=["swarm-dt", "swarm-dt-follow"])
        assert not any("differs most" in one for one in answer(twins).surprises)


def test_policies_stand_side_by_side_with_their_greatest_contrast(compared: StudyResults) -> None:
    found = answer(compared)
    assert found.matrix.policies == ("swarm-dt", "swarm-dt-follow")
    assert any(
        "FM1" in one and "differs most" in one and "swarm-dt-follow -0." in one
        for one in found.surprises
    )
    text = digest(found, 80, None)
    assert "P at N = 25, no fault: swarm-dt 4" in text
    assert "times)" in text


def test_more_policies_than_fit_stand_below_each_other(compared: StudyResults) -> None:
    matrix = verdict_matrix(compared)
    many = tuple(f"a-policy-of-a-long-name-{number}" for number in range(12))
    rows = [
        replace(
            block,
            rows=tuple(
                replace(row, cells=dict.fromkeys(many, row.cells["swarm-dt"])) for row in block.rows
            ),
        )
        for block in matrix.blocks
    ]
    lines = text_lines(replace(matrix, policies=many, blocks=tuple(rows)), 80)
    assert max(map(len, lines)) <= 80
    assert all(f"({number}) {name}" in "\n".join(lines) for number, name in enumerate(many, 1))
    assert sum("S superlinear" in line for line in lines) > 1


def test_an_estimate_prints_as_one_cell_of_the_matrix() -> None:
    estimate = spi.robustness([40.0, 42, 41, 43], [20.0, 22, 20, 21], n=25, m=1)
    text = str(estimate)
    assert text.startswith(f"✗ R = {estimate.value:.3f} [{estimate.low:.3f}, ")
    assert "above 0: refuted (4 paired seeds, p = " in text
