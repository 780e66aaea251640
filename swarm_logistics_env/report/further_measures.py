"""Sections on measures that the paper does not define, and on the looks until it is clear."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from swarm_logistics_env import spi
from swarm_logistics_env.studies.fault_measures import ModeBudget, anchoring_loads, fault_budgets
from swarm_logistics_env.studies.judged_comparisons import CONFIDENCE
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.until_clear import SPENDING

from . import wording
from .result_tables import Column, Section, table_section

_BUDGET_COLUMNS: list[Column] = [
    ("policy", lambda one: one.compared.policy),
    ("failure mode", lambda one: _mode(one)),
    ("N", lambda one: str(one.compared.original.condition.size)),
    ("m tested", lambda one: ", ".join(map(str, one.tested))),
    ("robots that may fail", lambda one: _may_fail(one)),
]
_LOAD_TEXT = (
    "Time that working robots spend in contact range of failed ones; in the paired "
    "run with the same robots removed it is 0. The last column is the load per "
    "failed robot and second of failure."
)
_LOAD_COLUMNS: list[Column] = [
    ("policy", lambda one: one.compared.policy),
    ("fault", lambda one: str(one.compared.changed.setting)),
    ("robot-seconds a run [95 %]", lambda one: wording.bracketed(one.load, 1)),
    ("robots by a failed one [95 %]", lambda one: wording.bracketed(one.neighbours, 3)),
]


def budget_sections(results: StudyResults) -> Iterator[Section]:
    """Yield how many robots may fail by each mode, where R was asked."""
    budgets = list(fault_budgets(results))
    text = (
        "The largest m with R > 0 supported at every m' up to it, tested in order, with unadjusted "
        "verdicts: the sequence is fixed, so the error stays below 5 %. "
        f"Over {wording.seeds_text(results)}."
    )
    if budgets:
        yield table_section("Fault budget", budgets, _BUDGET_COLUMNS, text)


def load_sections(results: StudyResults) -> Iterator[Section]:
    """Yield how long robots stay by failed ones, where that is known."""
    loads = list(anchoring_loads(results))
    if loads:
        yield table_section("Anchoring load", loads, _LOAD_COLUMNS, _LOAD_TEXT)


def _mode(one: ModeBudget) -> str:
    setting = one.compared.changed.setting
    return setting.name + (f" from {setting.onset:g} s" if setting.onset else "")


def _may_fail(one: ModeBudget) -> str:
    if one.budget is None:
        return "blocked: runs are missing"
    robots, limit = one.budget
    if limit is None:
        return f"at least {robots}"
    if limit not in one.tested:
        return f"{robots} shown; m = {limit} was not tested"
    # Whether more are refuted or only unknown differs for whoever has to decide.
    return f"{robots}; m = {limit} {one.verdict}"


def look_sections(results: StudyResults) -> Iterator[Section]:
    """Yield the looks of a study that runs until it is clear."""
    if results.plan.specification.until_clear:
        yield _stops(results)


def _stops(results: StudyResults) -> Section:
    """Return the looks of a study that runs until it is clear, and what stopped at each."""
    stopped = Counter(results.indicators["stopped_at"].dropna())
    total = len(results.indicators)
    alphas = spi.look_alphas(results.looks, 1 - CONFIDENCE, spending=SPENDING)
    columns: list[Column] = [
        ("seeds", lambda look: str(look[0])),
        ("p below, alone", lambda look: f"{look[1]:.4f}"),
        ("level of intervals", lambda look: wording.percent(1 - look[1])),
        ("stopped here", lambda look: str(stopped[look[0]])),
    ]
    return table_section(
        "Looks, until it is clear",
        zip(results.looks, alphas),
        columns,
        "Declared before the first run. Alpha is spent over the looks in proportion to the seeds, "
        "and Holm's procedure steps down at each look, so that a comparison stops once its verdict "
        "stands; the intervals hold over all looks together with 95 %.",
        f"{stopped.total()} of {total} comparisons stopped. P and the further measures are over "
        f"the {len(results.plan.seeds)} seeds that all conditions share.",
    )
