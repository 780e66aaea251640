"""Notes on an answer: what its symbols mean, how to read its verdicts, and what limits them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.study.tasks.task_world import world_of
from swarm_logistics_env.study.verdicts.collapses import untestable
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict

from . import section, templates
from .collapse_tables import collapsed_in_words, untestable_in_words
from .templates import Slots, fill

_FEW_ITEMS = 1.0  # in a run, of which shares say little


def notes(results: StudyResults, needs_runs: bool, reasons: Collection[str]) -> str:
    """Return the notes on the answer of a study, in one line.

    Args:
        needs_runs: whether a line of it says how many more runs it takes.
        reasons: why verdicts are open, names in `REASONS_TO_BE_OPEN` that its lines say.
    """
    slots_by_case = dict(_notes_that_apply(results, needs_runs, reasons))
    line = "; ".join(fill(templates.NOTES, slots_by_case))
    return f"{line[0].upper()}{line[1:]}."


def _notes_that_apply(
    results: StudyResults, needs_runs: bool, reasons: Collection[str]
) -> Iterator[tuple[str, Slots]]:
    """Yield the notes on an answer that apply, each with its slots; `NOTES` has their order."""
    verdicts = results.verdicts
    is_paired = results.plan.paired
    indicators = {verdict.compared.indicator for verdict in verdicts} - {"change"}
    if indicators:
        headings = [d.heading for symbol, d in DEFINITIONS.items() if symbol in indicators]
        yield "indicators", {"indicators": ", ".join(headings)}
    if any(verdict.interval and verdict.interval.low is not None for verdict in verdicts):
        differ = len({verdict.level for verdict in verdicts} - {None}) > 1
        case = "intervals_of_several_levels" if differ else "intervals"
        yield case, {"level": section.percent(results.level)}
    yield "adjusted", {}
    flags = {flag for verdict in verdicts for flag in verdict.flags}
    if "assumes_normal" in flags:
        yield "few_seeds", {}
    for flag in ("cannot_fail", "too_few_seeds"):
        if flag in flags:
            yield flag, {}
    if _delivers_little(results):
        yield "few_items", {}
    if results.damage:
        yield "damage", {"damage": results.damage}
    if results.exploratory:
        yield "exploratory", {}
    if results.late_margin:
        yield "late_margin", {}
    trainings = [v.estimate.collapsed for v in verdicts if v.estimate and v.estimate.collapsed]
    if trainings:
        yield "collapsed", {"collapsed": max(trainings, key=lambda collapsed: collapsed.number)}
    if any(verdict.saturated for verdict in verdicts):
        yield "capped", {"mark": section.SATURATED}
    if results.collapses:
        words = collapsed_in_words(results.collapses, names_policies=len(results.policies) > 1)
        yield "collapsed_runs", {"conditions": words}
    if by_reason := untestable(results.cells):
        words = untestable_in_words(by_reason, names_policies=len(results.policies) > 1)
        yield "phases_untestable", {"conditions": words}
    if needs_runs:
        yield "more_runs", {"runs": "seeds" if is_paired else "trials a condition"}
    elif any(verdict.conclusion == "open" for verdict in verdicts):
        yield "open", {"runs": "seeds" if is_paired else "trials"}
    if explained := reasons_in_words(reasons):
        yield "open_for_a_reason", {"reasons": explained}
    claims_of_text = results.reference.claims if results.reference else {}
    claims = [verdict for verdict in verdicts if verdict.on_claim is not None]
    in_text = [verdict for verdict in claims if verdict.compared.question in claims_of_text]
    not_in_text = [verdict for verdict in claims if verdict not in in_text]
    if in_text:
        yield "claims_of_the_text", _claims(in_text)
    if not_in_text:
        case = "claims_beside_the_text" if claims_of_text else "claims_without_text"
        yield case, _claims(not_in_text)


def reasons_in_words(reasons: Collection[str]) -> str:
    """Return what the reasons of open verdicts mean, e.g. "(stalls): so few seeds may hide .."."""
    return "; ".join(
        f"({reason}): {words}"
        for reason, words in templates.REASONS_TO_BE_OPEN.items()
        if reason in reasons
    )


def _delivers_little(results: StudyResults) -> bool:
    """Return whether swarms that are as they should be, and count, deliver hardly anything."""
    originals = [results.cells_of(v.compared)[v.compared.original] for v in results.verdicts]
    return any(
        cell.n_seeds and world_of(cell.arm.case.task).counted and cell.mean.value < _FEW_ITEMS
        for cell in originals
    )


def _claims(verdicts: Sequence[Verdict]) -> Slots:
    words = [verdict.on_claim.adjusted for verdict in verdicts if verdict.on_claim]
    return {
        "claims": section.plural(len(verdicts), "claim"),
        "counts": section.count_words(words),
    }
