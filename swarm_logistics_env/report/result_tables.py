"""Sections of a report: tables, claims, published values and the set-up, as plain text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from swarm_logistics_env.report import wording
from swarm_logistics_env.report.figures import Figure
from swarm_logistics_env.report.wording import Sentence
from swarm_logistics_env.studies.agreement import Agreement, agreements
from swarm_logistics_env.studies.results import Cell, IndicatorTest, StudyResults

NOTHING = wording.NOTHING
_MOST_MISSES = 8  # more are no list that anybody reads
_FLAGS = {
    "single_seed": "one seed gives a value, no interval and no verdict",
    "identical": "unaffected by construction: both conditions gave the same runs, so the value is "
    "exact and no evidence; it stands outside Holm's family",
    "too_few_seeds": "two seeds give no verdict, as counts agree by chance",
    "degenerate": "no spread between seeds, so no interval and no verdict",
    "capped": "inconclusive, because P is capped on the side that the verdict leans to",
    "unbounded": "mean P_o is not distinguishable from 0 at so few seeds, so the interval is "
    "infinite; the verdict comes from the test",
    "assumes_normal": "below ten paired seeds, or unpaired, the verdict assumes normal differences",
    "skewed": "so skewed that at so few seeds the verdict errs more often than its level",
}


@dataclass(frozen=True)
class Section:
    """A heading with a figure, sentences, a table, lines of text, or several of them."""

    title: str
    columns: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    lines: tuple[str, ...] = ()
    sentences: tuple[Sentence, ...] = ()
    figures: tuple[Figure, ...] = ()


def tables(results: StudyResults) -> Iterator[Section]:
    """Yield the tables of a study's results, policy by policy."""
    policies = tuple(dict.fromkeys(cell.policy for cell in results.cells))
    figures = {figure.policy: figure for figure in agreements(results)}
    for policy in policies:
        for table in dict.fromkeys(cell.table for cell in results.cells if cell.policy == policy):
            yield from _tables(results, policy, table)
        yield from _claims(results, policy)
        if policy in figures:
            yield _agreement(figures[policy])


def warnings(results: StudyResults) -> tuple[str, ...]:
    """Return what a reader has to know before any verdict, one sentence each."""
    return tuple(_warnings(results))


def _tables(results: StudyResults, policy: str, table: str) -> Iterator[Section]:
    """Yield a table of P and the first indicator, then one of each further indicator."""
    cells = _grouped(
        [cell for cell in results.cells if (cell.policy, cell.table) == (policy, table)]
    )
    tests = [test for test in results.tests if (test.policy, test.table) == (policy, table)]
    published = any(cell.published is not None for cell in cells)
    performance = [_performance(cell, published=published) for cell in cells]
    columns = ["", *(["P paper", "P ours [95 %]"] if published else ["P [95 %]"])]
    columns.append("one run [95 %]")
    title = f"{policy}: {table}"
    for indicator in dict.fromkeys(test.indicator for test in tests):
        asked = [j for j in tests if j.indicator == indicator]
        more, answers = _answers(results, cells, asked, published=published)
        rows = [tuple(left + right) for left, right in zip(performance, answers)]
        judged = [row for row in rows if row[-len(more)] != NOTHING]
        yield Section(title, (*columns, *more), tuple(rows if len(columns) > 1 else judged))
        # P is printed once: the tables of further indicators start with the setting alone.
        columns, performance = columns[:1], [left[:1] for left in performance]
        title = f"{policy}: {table}, continued"


def _performance(cell: Cell, *, published: bool) -> list[str]:
    row = [str(cell.arm.setting)]
    if published:
        row.append(NOTHING if cell.published is None else f"{cell.published:g}")
    mark = wording.SATURATED if cell.saturated else ""
    return [*row, wording.items(cell.mean) + mark, wording.limits(cell.prediction)]


def _grouped(cells: list[Cell]) -> list[Cell]:
    """Put the rows of one failure mode (or other factor) together, in order of appearance."""
    names = list(dict.fromkeys(cell.arm.setting.name for cell in cells))
    return sorted(cells, key=lambda cell: names.index(cell.arm.setting.name))


def _answers(
    results: StudyResults, cells: list[Cell], asked: list[IndicatorTest], *, published: bool
) -> tuple[list[str], list[list[str]]]:
    """Return the columns of one indicator and their rows, one a cell.

    Value with interval, the paper's value, and per property (scalable, superlinear, ...) the
    verdict, with Holm's in brackets where it differs, beside what the paper claims.
    """
    indicator = asked[0].comparison.indicator
    properties = list(dict.fromkeys(test.property_name for test in asked))
    columns = [f"{indicator} [{wording.percent(results.confidence)}]"]
    columns += [f"{indicator} paper"] if published else []
    for name in properties:
        columns += [name, "paper"] if published else [name]
    rows = []
    for cell in cells:
        here = {test.property_name: test for test in asked if test.comparison.changed == cell.arm}
        row = [NOTHING] * len(columns)
        for name, test in here.items():
            row[0] = wording.ratio(test)
            place = 1 + published + properties.index(name) * (1 + published)
            row[place] = wording.verdict(test)
            if published:
                row[1] = wording.number(test.published)
                row[place + 1] = {None: NOTHING, True: "yes", False: "no"}[test.claim]
        rows.append(row)
    return columns, rows


def _claims(results: StudyResults, policy: str) -> Iterator[Section]:
    claims = [test for test in results.tests if test.policy == policy and test.claim is not None]
    if not claims:
        return
    rows, plain, adjusted = [], Counter[str](), Counter[str]()
    for test in claims:
        estimate = test.estimate
        says = test.on_claim(estimate.verdict if estimate else None)
        says_adjusted = test.on_claim(test.adjusted_verdict)
        plain[wording.counted_as(test, says)] += 1
        adjusted[wording.counted_as(test, says_adjusted)] += 1
        unaffected = wording.UNAFFECTED if test.unaffected else None
        rows.append(
            (
                f"{test.indicator}, {test.comparison.label}",
                test.claim_text or NOTHING,
                wording.number(test.published),
                wording.ratio(test),
                unaffected or says or "blocked",
                unaffected or says_adjusted or "blocked",
                wording.power(test),
            )
        )
    columns = (
        "indicator", "claim", "paper", f"ours [{wording.percent(results.confidence)}]", "claim is",
        "under Holm", "seeds for 80 % power at the paper's value",
    )  # fmt: skip
    lines = (
        f"Unadjusted: {wording.counted(plain)}.",
        f"Under Holm, family = all comparisons of one indicator: {wording.counted(adjusted)}.",
        'A "not" claim is supported where the indicator lies below its threshold beyond chance.',
        *(f"undefined: {reason}." for reason in dict.fromkeys(j.no_plan for j in claims) if reason),
    )
    yield Section(f"{policy}: claims", columns, tuple(rows), lines)


def _agreement(figure: Agreement) -> Section:
    total = len(figure.cells)
    lines = []
    if figure.misses is None or figure.met is None or figure.mean_interval_width is None:
        lines.append("Cells inside the 95 % prediction interval: one seed gives no interval.")
    else:
        lines += [
            (
                f"Cells whose published P lies inside the 95 % prediction interval of one of our "
                f"runs: {total - len(figure.misses)} of {total}; inside that of our mean: "
                f"{len(figure.met)} of {total}."
            ),
            f"Mean width of those intervals: {figure.mean_interval_width:.1f} items.",
            f"Misses: {_misses(figure.misses)}.",
        ]
    lines.append(f"Mean relative error of our mean P: {figure.mean_relative_error:.1%}.")
    if figure.mean_log_error is not None:
        lines.append(f"Mean |log error| of our mean P: {figure.mean_log_error:.3f}.")
    pairs = [f"{a.arm.setting} and {b.arm.setting}" for a, b in figure.disorder]
    lines.append(
        f"Swarm sizes up to {figure.largest_ordered} in the opposite order to the published one, "
        f"95 % intervals apart: {'; '.join(pairs) or 'none'}."
    )
    return Section(f"{figure.policy}: agreement with the published values", lines=tuple(lines))


def _misses(cells: tuple[Cell, ...]) -> str:
    told = [_miss(cell) for cell in cells[:_MOST_MISSES]]
    if len(cells) > _MOST_MISSES:
        told.append(f"and {len(cells) - _MOST_MISSES} more, in cells.csv")
    return ", ".join(told) or "none"


def _miss(cell: Cell) -> str:
    return (
        f"{cell.arm.setting} ({cell.published:g} published, {wording.items(cell.prediction)} ours)"
    )


def _warnings(results: StudyResults) -> Iterator[str]:
    if any(cell.saturated for cell in results.cells):
        yield (
            f"{wording.SATURATED} saturated: in at least one run every item was delivered, so P is "
            "capped; indicators that rest on it are marked as well. A capped reference cannot "
            "support that an indicator lies above its threshold, a capped changed condition cannot "
            "refute it."
        )
    if results.exploratory:
        since = "it is judged at a look that was not declared before its first run"
        if not results.looks:
            since = "seeds were added after the study began"
        yield f"Exploratory: {since}, so the verdicts' error level is not the nominal one."
    for cell in results.cells:
        if cell.problem:
            yield f"{cell.policy}, {cell.table}, {cell.arm.setting}: {cell.problem}."
    for test in results.tests:
        if test.estimate is None:
            comparison = test.comparison
            yield (
                f"{comparison.policy}, {comparison.indicator}, {comparison.label} is blocked: "
                f"{test.problem}."
            )
    for flag, meaning in _FLAGS.items():
        flagged = [j for j in results.tests if j.estimate and flag in j.estimate.flags]
        if flagged:
            yield f"{flag}: {meaning}: {'; '.join(_families(results, flagged))}."


def _families(results: StudyResults, some: list[IndicatorTest]) -> Iterator[str]:
    """Name comparisons, those of one policy and indicator together."""
    for family in dict.fromkeys(test.comparison.family for test in some):
        policy, indicator = family
        labels = {j.comparison.label: None for j in some if j.comparison.family == family}
        whole = {j.comparison.label for j in results.tests if j.comparison.family == family}
        all_of_them = len(labels) == len(whole) > 1
        which = f"all {len(whole)}" if all_of_them else "; ".join(labels)
        yield f"{policy}: {indicator} ({which})"
