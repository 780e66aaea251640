"""Tables of results, claims and agreement with published values, and the warnings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.indicator_table import Finding, findings_of
from swarm_logistics_env.studies.performance_table import Cell, cells_of, groups_of
from swarm_logistics_env.studies.policy_comparison import Agreement, agreements
from swarm_logistics_env.studies.results import StudyResults

from . import wording
from .figures import Figure
from .wording import NOTHING, Sentence

if TYPE_CHECKING:
    import pandas as pd

_MOST_MISSES = 8  # more are no list that anybody reads
_FLAGS = {
    "single_seed": "One seed gives a value, but no interval and no verdict",
    "identical": "Both conditions gave the same runs, so the value is exact, but it is no evidence "
    "and stands outside Holm's family",
    "too_few_seeds": "Two seeds give no verdict, because whole numbers agree by chance",
    "degenerate": "The seeds show no spread, so there is no interval and no verdict",
    "capped": "P is capped on the side that the verdict leans to, so the verdict is inconclusive",
    "hidden_stalls": "These seeds are too few to exclude stalled runs that would turn the verdict, "
    "so it is inconclusive",
    "unbounded": "Mean P_o cannot be told from 0 at so few seeds, so the interval is infinite, and "
    "the verdict comes from the test",
    "assumes_normal": "The verdict assumes normal differences, because the seeds are fewer than "
    "ten, or unpaired",
    "skewed": "The differences are so skewed that at so few seeds the verdict errs more often than "
    "its level says",
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


Column = tuple[str, Callable[[Any], str]]  # heading, and what stands there for a record


def table_section(
    title: str, records: Iterable[Any], columns: Sequence[Column], *lines: str
) -> Section:
    """Return a table with a row for each record, and lines of text below it."""
    rows = tuple(tuple(text(record) for _, text in columns) for record in records)
    return Section(title, tuple(heading for heading, _ in columns), rows, lines)


def tables(results: StudyResults) -> Iterator[Section]:
    """Yield the tables of a study's results, policy by policy."""
    figures = {figure.policy: figure for figure in agreements(results)}
    for policy, cells in groups_of(results.performance, "policy"):
        tests = results.indicators[results.indicators["policy"] == policy]
        for table, here in groups_of(cells, "table"):
            asked = tests[tests["table"] == table]
            yield from _tables(f"{policy}: {table}", here, asked, results.confidence)
        if tests["claim"].notna().any():
            yield _claims(f"{policy}: claims", tests[tests["claim"].notna()], results.confidence)
        if policy in figures:
            yield _agreement(figures[policy])


def _tables(
    title: str, cells: pd.DataFrame, tests: pd.DataFrame, confidence: float
) -> Iterator[Section]:
    """Yield a table of P and the first indicator, then one of each further indicator."""
    published = bool(cells["published"].notna().any())
    # Rows of one failure mode (or other factor) stand together, in order of appearance.
    rows = [cell for _, here in groups_of(cells, "factor") for cell in cells_of(here)]
    setting: Column = ("", lambda cell: cell.cell)
    columns: list[Column] = [setting]
    if published:
        columns.append(("P paper", _published))
    columns.append(("P ours [95 %]" if published else "P [95 %]", wording.mean_p))
    columns.append(("one run [95 %]", _one_run))
    for indicator, asked in groups_of(tests, "indicator"):
        answers = _answers(indicator, asked, confidence, published=published)
        yield table_section(title, rows, [*columns, *answers])
        # P is printed once: the tables of further indicators hold what was asked alone.
        changed = {comparison.changed for comparison in tests["compared"]}
        rows = [cell for cell in rows if cell.arm in changed]
        columns, title = [setting], title.removesuffix(", continued") + ", continued"


def _published(cell: Cell) -> str:
    return f"{cell.published:g}" if wording.is_known(cell.published) else NOTHING


def _one_run(cell: Cell) -> str:
    if not wording.is_known(cell.prediction_low):
        return NOTHING
    digits = wording.digits_of(cell.mean)
    low, high = (wording.fixed(x, digits) for x in (cell.prediction_low, cell.prediction_high))
    return f"[{low}, {high}]"


def _answers(
    indicator: str, tests: pd.DataFrame, confidence: float, *, published: bool
) -> Iterator[Column]:
    """Yield the columns of one indicator in a table of cells.

    Value with interval, the paper's value, and per property (scalable, superlinear, ...) the
    verdict, with Holm's in brackets where it differs, beside what the paper claims.
    """

    def column(heading: str, asked: pd.DataFrame, text: Callable[[Finding], str]) -> Column:
        by_arm = {test.compared.changed: test for test in findings_of(asked)}
        return heading, lambda cell: text(by_arm[cell.arm]) if cell.arm in by_arm else NOTHING

    yield column(f"{indicator} [{wording.percent(confidence)}]", tests, wording.ratio)
    if published:
        yield column(f"{indicator} paper", tests, lambda test: wording.number(test.published))
    for name, asked in groups_of(tests, "property"):
        yield column(name, asked, wording.verdict)
        if published:
            yield column("paper", asked, _claimed)


def _claimed(test: Finding) -> str:
    return NOTHING if test.claimed is None else "yes" if test.claimed else "no"


def _claims(title: str, claims: pd.DataFrame, confidence: float) -> Section:
    tests = list(findings_of(claims))
    plain, adjusted = (
        wording.counted(Counter(wording.counted_as(test, getattr(test, name)) for test in tests))
        for name in ("claim_verdict", "claim_verdict_holm")
    )
    columns: list[Column] = [
        ("indicator", lambda test: f"{test.indicator}, {test.comparison}"),
        ("claim", lambda test: test.claim),
        ("paper", lambda test: wording.number(test.published)),
        (f"ours [{wording.percent(confidence)}]", wording.ratio),
        ("claim is", lambda test: wording.said(test.claim_verdict)),
        ("under Holm", lambda test: wording.said(test.claim_verdict_holm)),
        ("seeds for 80 % power at the paper's value", _seeds_needed),
    ]
    return table_section(
        title,
        tests,
        columns,
        f"Unadjusted: {plain}.",
        f"Under Holm, family = all comparisons of one indicator: {adjusted}.",
        'A "not" claim is supported where the indicator lies below its threshold beyond chance.',
        *(f"undefined: {reason}." for reason in claims["no_plan"].dropna().unique()),
    )


def _seeds_needed(test: Finding) -> str:
    if test.estimate is None or not wording.is_known(test.published):
        return NOTHING
    return "undefined" if test.seeds_for_power_80 is None else f"{test.seeds_for_power_80}"


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
    pairs = [f"{a.cell} and {b.cell}" for a, b in figure.disorder]
    lines.append(
        f"Swarm sizes up to {figure.largest_ordered} in the opposite order to the published one, "
        f"95 % intervals apart: {'; '.join(pairs) or 'none'}."
    )
    return Section(f"{figure.policy}: agreement with the published values", lines=tuple(lines))


def _misses(cells: pd.DataFrame) -> str:
    told = []
    for cell in cells_of(cells[:_MOST_MISSES]):
        one_run = Interval(cell.mean, cell.prediction_low, cell.prediction_high)
        told.append(
            f"{cell.cell} ({cell.published:g} published, {wording.bracketed(one_run, 1)} ours)"
        )
    if len(cells) > _MOST_MISSES:
        told.append(f"and {len(cells) - _MOST_MISSES} more, in cells.csv")
    return ", ".join(told) or "none"


def warnings(results: StudyResults) -> Iterator[str]:
    """Yield what a reader has to know before any verdict, one sentence each."""
    if results.performance["saturated"].any():
        yield (
            f"{wording.SATURATED} marks a P that is capped, because every item was delivered in at "
            "least one run, and the indicators that rest on it. A verdict that a larger P could "
            "turn is inconclusive."
        )
    stalls = [cell for cell in cells_of(results.performance) if cell.stalled > 0.0]
    if stalls:
        told = (f"{c.policy}, {c.cell} ({c.stalled:.0%} of {c.n_seeds})" for c in stalls)
        yield (
            "Runs stalled: they have less than a quarter of the median P of their condition: "
            f"{'; '.join(dict.fromkeys(told))}."
        )
    if results.exploratory:
        yield (
            "The verdicts are exploratory: they are over other seeds than the study declared "
            "before its first run, so they err more often than their level."
        )
    if results.late_margin:
        yield (
            "The verdicts on the margin of equivalence are exploratory: another margin was "
            "declared before the first run."
        )
    for cell in cells_of(results.performance):
        if cell.problem:
            yield f"{cell.policy}, {cell.table}, {cell.cell} is incomplete: {cell.problem}."
    for test in findings_of(results.indicators):
        if test.problem:
            yield f"{test.policy}, {test.indicator}, {test.comparison} is blocked: {test.problem}."
    for flag, meaning in _FLAGS.items():
        flagged = results.indicators["flags"].str.contains(flag).eq(True)
        if flagged.any():
            yield f"{meaning}: {'; '.join(_families(results.indicators, flagged))}."


def _families(tests: pd.DataFrame, chosen: pd.Series[bool]) -> Iterator[str]:
    """Name the chosen comparisons, those of one policy and indicator together."""
    for (policy, indicator), family in groups_of(tests, "policy", "indicator"):
        labels = family["comparison"][chosen[family.index]].unique()
        whole = family["comparison"].nunique()
        which = f"all {whole}" if len(labels) == whole > 1 else "; ".join(labels)
        if len(labels):
            yield f"{policy}: {indicator} ({which})"
