"""Notes on an answer: what its symbols mean, how to read its verdicts, and what limits them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.verdicts.collapses import collapses
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.verdicts.verdict import Verdict

from . import section, templates
from .collapse_tables import collapsed_in_words
from .templates import Slots, fill


def notes(results: StudyResults, needs_runs: bool) -> str:
    """Return the notes on the answer of a study, in one line.

    Args:
        needs_runs: whether a line of it says how many more runs it takes.
    """
    slots_by_case = dict(_notes_that_apply(results, needs_runs))
    line = "; ".join(fill(templates.NOTES, slots_by_case))
    return f"{line[0].upper()}{line[1:]}."


def _notes_that_apply(results: StudyResults, needs_runs: bool) -> Iterator[tuple[str, Slots]]:
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
    if named := collapses(results.cells):
        words = collapsed_in_words(named, names_policies=len(results.policies) > 1)
        yield "collapsed_runs", {"conditions": words}
    open_verdicts = [verdict for verdict in verdicts if verdict.conclusion == "open"]
    if needs_runs:
        yield "more_runs", {"runs": "seeds" if is_paired else "trials a condition"}
    elif open_verdicts:
        yield "open", {"runs": "seeds" if is_paired else "trials"}
    reasons = list(_reasons_to_be_open(open_verdicts))
    if reasons:
        yield "open_at_an_interval_on_one_side", {"reasons": " or ".join(reasons)}
    claims_of_text = results.reference.claims if results.reference else {}
    claims = [verdict for verdict in verdicts if verdict.on_claim is not None]
    in_text = [verdict for verdict in claims if verdict.compared.question in claims_of_text]
    not_in_text = [verdict for verdict in claims if verdict not in in_text]
    if in_text:
        yield "claims_of_the_text", _claims(in_text)
    if not_in_text:
        case = "claims_beside_the_text" if claims_of_text else "claims_without_text"
        yield case, _claims(not_in_text)


def _reasons_to_be_open(verdicts: Sequence[Verdict]) -> Iterator[str]:
    """Yield why verdicts are open though their intervals lie on one side of the threshold."""
    one_sided = [verdict for verdict in verdicts if verdict.lies_above is not None]
    if any("hidden_stalls" in verdict.flags for verdict in one_sided):
        yield templates.REASONS_TO_BE_OPEN["hidden_stalls"]
    if any(verdict.on_threshold.plain in section.DECIDED for verdict in one_sided):
        yield templates.REASONS_TO_BE_OPEN["holm"]


def _claims(verdicts: Sequence[Verdict]) -> Slots:
    words = [verdict.on_claim.adjusted for verdict in verdicts if verdict.on_claim]
    return {
        "claims": section.plural(len(verdicts), "claim"),
        "counts": section.count_words(words),
    }
