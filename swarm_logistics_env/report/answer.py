"""The answer of a study in a few sentences, the same in terminal, HTML page and Markdown."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from swarm_logistics_env.spi.verdict_signs import SIGNS
from swarm_logistics_env.studies.indicator_table import Finding, findings_of
from swarm_logistics_env.studies.performance_table import groups_of
from swarm_logistics_env.studies.policy_comparison import (
    CellAgainstBaseline,
    cells_against_baseline,
)
from swarm_logistics_env.studies.results import StudyResults

from . import wording
from .verdict_matrix import VerdictMatrix, text_lines, verdict_matrix

if TYPE_CHECKING:
    import pandas as pd

DIGEST_LINES = 20  # with the line of the runs and the prompt: a screen of 24
_BUDGETS = (20, 200)  # seeds that a study may afford


@dataclass(frozen=True)
class Answer:
    """What a study found.

    Attributes:
        asked: how much was asked, and over which seeds.
        counts: a sentence a policy: how many verdicts of each kind; then P of all of them.
        surprises: what contradicts the reference, and what differs most; may be empty.
        unanswered: what is still open, and the seeds it needs.
        matrix: all verdicts.
    """

    asked: str
    counts: tuple[str, ...]
    surprises: tuple[str, ...]
    unanswered: str
    matrix: VerdictMatrix


def answer(results: StudyResults) -> Answer:
    """Return what a study found."""
    matrix = verdict_matrix(results)
    return Answer(
        _asked(results, matrix),
        tuple(_counts(results)),
        tuple(_surprises(results)),
        _unanswered(results),
        matrix,
    )


def digest(found: Answer, width: int, where: Path | None, most: int | None = DIGEST_LINES) -> str:
    """Return the answer for a terminal.

    Args:
        found: to show.
        width: of the terminal [characters]; no line is longer.
        where: the report; None: there is none.
        most: lines at most; None: as many as it takes.
    """
    head = [line for text in (found.asked, *found.counts) for line in _fold(text, width)]
    tail = _fold(found.unanswered, width) + ([f"Report: {where}"] if where else [])
    matrix = text_lines(found.matrix, width)
    rows = None if most is None else most - len(head) - len(tail)
    # The matrix first, then as many surprises as there is room for, but one at least.
    surprising: list[str] = []
    for count in range(1, len(found.surprises) + 1):
        lines = _surprising(found.surprises, count, width)
        if count == 1 or rows is None or len(matrix) + len(lines) <= rows:
            surprising = lines
    rows = None if rows is None else max(2, rows - len(surprising))
    return "\n".join([*head, *text_lines(found.matrix, width, rows), *surprising, *tail])


def _surprising(surprises: Sequence[str], count: int, width: int) -> list[str]:
    more = f"; and {len(surprises) - count} more" if len(surprises) > count else ""
    return _fold(f"Surprising: {'; '.join(surprises[:count])}{more}.", width)


def _fold(text: str, width: int) -> list[str]:
    # Paths and names are longer than a line sometimes: they are broken, never cut.
    return textwrap.wrap(text, width, subsequent_indent="  ", break_on_hyphens=False)


def _asked(results: StudyResults, matrix: VerdictMatrix) -> str:
    n, total = len(matrix.policies), sum(1 for _ in matrix.cells())
    policies = f", {n} policies" if n > 1 else ""
    seeds = wording.seeds_text(results).split(" (")[0]
    said = (
        f"{results.plan.specification.name}: {_several(total, 'question')}{policies}, {seeds}, Holm"
    )
    if results.indicators["flags"].str.contains("assumes_normal").eq(True).any():
        said += "; provisional below ten" if results.plan.paired else "; provisional"
    return f"{said}{'; exploratory' if results.exploratory else ''}."


def _counts(results: StudyResults) -> Iterator[str]:
    for policy, tests in groups_of(results.indicators, "policy"):
        claims = tests[tests["claim"].notna()]
        what, verdicts = "question", tests["conclusion"]
        if not claims.empty:
            what, verdicts = "claim", claims["claim_verdict_holm"]
        counts = Counter(verdict or "blocked" for verdict in verdicts)
        said = (f"{counts[name]} {sign.word}" for name, sign in SIGNS.items() if counts[name])
        yield f"{policy}: {', '.join(said)} of {_several(len(verdicts), what)}."
    cells = [one for here in cells_against_baseline(results).values() for one in here]
    # Where the swarm is as it should be, or else in the first condition.
    base = [one for one in cells if one.cell.kind == "fault" and not one.cell.value] or cells
    here = {one.cell.policy: one for one in reversed(base) if one.cell.cell == base[0].cell.cell}
    if here:
        each = ", ".join(_performance(here[policy]) for policy in reversed(here))
        yield f"P at {_where(base[0])}: {each}."


def _several(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _where(one: CellAgainstBaseline) -> str:
    cell = one.cell
    return cell.cell if cell.kind == "size" else f"N = {cell.n_robots}, {cell.cell}"


def _performance(one: CellAgainstBaseline) -> str:
    times = "" if one.ratio is None else f" ({one.ratio.value:.2f} times)"
    return (
        f"{one.cell.policy} {wording.fixed(one.cell.mean, wording.digits_of(one.cell.mean))}{times}"
    )


def _surprises(results: StudyResults) -> Iterator[str]:
    """Yield the claims that are refuted, the furthest first, and where policies differ most.

    What rests on too little to be more than provisional surprises nobody, and so do runs that are
    the same by construction.
    """
    tests = results.indicators
    is_solid = ~tests["flags"].str.contains("assumes_normal").eq(True) & tests["p_value"].notna()
    tests = tests[is_solid]
    contrast = _contrast(tests) if len(tests["policy"].unique()) > 1 else None
    if contrast:
        yield contrast
    refuted = tests[tests["claim_verdict_holm"] == "refuted"]
    distance = (refuted["value"] - refuted["threshold"]).abs()
    for test in findings_of(
        refuted.assign(distance=distance).sort_values("distance", ascending=False)
    ):
        yield f"{test.policy} is {_turned(test)}, {_short(test.comparison)} ({test.value:.2f})"


def _turned(test: Finding) -> str:
    """Return the opposite of a claim, e.g. "not tolerant"."""
    claim = str(test.claim)
    return claim.removeprefix("not ") if claim.startswith("not ") else f"not {claim}"


def _short(comparison: str) -> str:
    return comparison.replace(" -> ", "→").replace(" = ", "=")


def _contrast(tests: pd.DataFrame) -> str | None:
    """Return the question whose answers of two policies lie furthest apart; None: none do.

    The intervals are widened until all of them together hold the true values in 95 % (Bonferroni),
    as the furthest of many answers lie apart by chance alone.
    """
    from scipy.special import stdtrit

    found: list[tuple[float, str]] = []
    known = tests[(tests["kind"] != "policy") & tests["low"].notna()]
    if known.empty:
        return None
    df = known["n_seeds"].astype(float) - 1
    wider = stdtrit(df, 1 - 0.025 / len(known)) / stdtrit(df, 0.5 + known["confidence"] / 2)
    known = known.assign(
        low=known["value"] - wider * (known["value"] - known["low"]),
        high=known["value"] + wider * (known["high"] - known["value"]),
    )
    for (_, indicator, comparison), here in groups_of(known, "table", "indicator", "comparison"):
        here = here.sort_values("value", kind="stable")
        worst, best = here.iloc[0], here.iloc[-1]
        if worst["high"] < best["low"]:
            text = (
                f"{indicator}, {_short(comparison)} differs most: {worst['policy']} "
                f"{worst['value']:.2f}, {best['policy']} {best['value']:.2f}"
            )
            found.append((best["value"] - worst["value"], text))
    return max(found)[1] if found else None


def _unanswered(results: StudyResults) -> str:
    """Return how many questions are open, and the seeds that would decide them."""
    tests = results.indicators
    said = []
    if blocked := int(tests["conclusion"].isna().sum()):
        reason = next(iter(tests["problem"].dropna()), "")
        said.append(f"{blocked} blocked, {'the first ' if blocked > 1 else ''}because {reason}")
    left = tests[tests["conclusion"] == "inconclusive"]
    if left.empty:
        return f"Open: {'; '.join(said) or 'nothing'}."
    said.insert(0, f"Open: {len(left)} of {len(tests)}")
    published = left[left["published"].notna()]
    if not published.empty:
        needed = published["seeds_for_power_80"].dropna()
        counts = (f"{seeds} seeds decide {(needed <= seeds).sum()}" for seeds in _BUDGETS)
        said.append(f"if the paper is right, {', '.join(counts)}")
    elif left["detectable"].notna().any():
        least, most = (f"{x:.2f}" for x in (left["detectable"].min(), left["detectable"].max()))
        size = least if least == most else f"{least} to {most}"
        said.append(
            f"these seeds find an effect of {size} with 80 % power; `study power DIR --effect X` "
            "counts the seeds for a smaller one"
        )
    return f"{'; '.join(said)}."
