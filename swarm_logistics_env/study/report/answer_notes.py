"""Notes on an answer and warnings: how to read the verdicts, and what limits them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.spi.estimate import SEEDS_OF_HEADLINE
from swarm_logistics_env.study.tasks.task_world import counted_in
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.collapses import Collapse
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import UNDEFINED, UNTESTABLE, Verdict

from . import section
from .more_seeds import more_seeds

_FEW_ITEMS = 1.0  # in a run, of which shares say little
_MOST_CONDITIONS = 2  # that a note of the answer names
# What the words of verdicts mean: those that stand in an answer, in this order.
_MEANINGS = {
    "decided": "supported: above 0{claims}; refuted: below 0",
    "compared": "more, less: of P than the policy behind 'against'",
    "open": "open, and no more: neither an effect is shown nor that there is none",
    "margin": "P within {margin}: P is shown to change by less than that, up or down; of FT from "
    "removed robots to faulty ones",
    "stalls": "open, stalls: too few runs to rule out rare ones that deliver nearly nothing",
    "trainings": "open, trainings: too few trainings to rule out one that collapses",
    "Holm": "open, Holm: clear as the only question, not among all on the indicator",
    "provisional": f"n < {SEEDS_OF_HEADLINE}: provisional",
    "unaffected": "unaffected: the same runs",
    "cannot_fail": "untestable, never < 0: as P cannot be",
    "few_pairs_differ": "untestable, equal P: nearly all pairs of runs have the same P",
    "reference_near_0": "untestable, P_o near 0: a change relative to it says nothing",
}


def notes(results: StudyResults, level: str) -> tuple[str, ...]:
    """Return the notes on the answer of a study, a line each.

    Args:
        level: of most intervals.
    """
    lines = [*meanings(results.verdicts)]
    if lines:
        lines.append(_method(results, level))
    rest = "; ".join(_notes_that_apply(results))
    lines.append(f"{rest[:1].upper()}{rest[1:]}" if rest else "")
    lines += [_modes(results), *_same_runs(results)]
    return tuple(f"{line}." for line in lines if line)


def _method(results: StudyResults, level: str) -> str:
    """Return how verdicts are adjusted, and why intervals are wider than usual ones."""
    method = "Verdicts are by Holm's method over all questions on an indicator of one policy"
    if level == section.P_LEVEL or not results.looks:
        return method
    n_looks = len(results.looks)
    return f"{method}; intervals are wider than of a single look, as up to {n_looks} are taken"


def _modes(results: StudyResults) -> str:
    """Return what robots do in the failure modes of the study; empty: none is described."""
    faults = [verdict.after.name for verdict in results.verdicts if verdict.after.kind == "fault"]
    modes = {mode for fault in faults for mode in fault.split("+")}
    described = results.plan.specification.played.failure_modes
    texts = [f"{mode}: {text}" for mode, text in described.items() if mode in modes]
    return f"A faulty robot: {'; '.join(texts)}" if texts else ""


def _same_runs(results: StudyResults) -> Iterator[str]:
    """Yield which failure modes gave the same runs to a policy, each pair once."""
    by_digests: dict[tuple[str, str, tuple[str, ...]], list[str]] = {}
    for cell in results.cells:
        setting = cell.arm.setting
        digests = tuple(outcome.digest or "" for outcome in cell.outcomes)
        if setting.kind == "fault" and setting.value and digests and all(digests):
            names = by_digests.setdefault((cell.policy, cell.table, digests), [])
            names += [setting.name] if setting.name not in names else []
    pairs = {(policy, *names): None for (policy, *_), names in by_digests.items() if names[1:]}
    for policy, *names in pairs:
        yield f"Rows of {section.join_names(names)} that are equal ({policy}): the same runs"


def meanings(verdicts: Sequence[Verdict]) -> list[str]:
    """Return what 0 means of these indicators, and the words that `Verdict.in_words` has."""
    words: set[str] = set()
    margin = ""
    for verdict in verdicts:
        word = verdict.on_property.adjusted
        if word in ("supported", "refuted"):
            words.add("compared" if verdict.compares_policies else "decided")
            if "assumes_normal" in verdict.flags:
                words.add("provisional")
        elif word == UNTESTABLE:
            words.add(verdict.flags[0])
        elif verdict.conclusion == "equivalent":
            words.add("margin")
            margin = f"{100 * verdict.margin:.3g} %"
        else:
            words.add(verdict.reason or word)
    of_words = (
        meaning.format(margin=margin, claims=_claims(verdicts))
        for word, meaning in _MEANINGS.items()
        if word in words
    )
    return [*dict.fromkeys(verdict.at_zero for verdict in verdicts), *of_words]


def _claims(verdicts: Sequence[Verdict]) -> str:
    """Return what it means that those that are decided are above 0; empty: there are no words."""
    symbols = {
        verdict.compared.indicator
        for verdict in verdicts
        if verdict.conclusion in ("supported", "refuted")
    }
    claims = [
        f"{definition.above} ({symbol})"
        for symbol, definition in DEFINITIONS.items()
        if symbol in symbols and definition.above
    ]
    return f", that is {', '.join(claims)}" if claims else ""


def _notes_that_apply(results: StudyResults) -> Iterator[str]:
    """Yield how to read the answer of a study, and what limits it."""
    verdicts = results.verdicts
    problems = {
        verdict.problem or "other questions on the indicator lack runs": None
        for verdict in verdicts
        if verdict.conclusion == UNDEFINED and verdict.in_words == UNDEFINED
    }
    if problems:
        yield f"undefined: {', '.join(problems)}"
    flags = {flag for verdict in verdicts for flag in verdict.flags}
    if "too_few_seeds" in flags:
        yield "two seeds give no verdict"
    if "unbounded" in flags:
        yield "without limits: P_o is too near 0 for an interval"
    if _delivers_little(results):
        yield "P is small: a longer duration tells more"
    if results.damage:
        yield results.damage
    if results.exploratory:
        yield "exploratory: other seeds or P than were declared, whose report this replaces"
    if results.late_margin:
        yield "equivalence is exploratory: another margin was declared"
    trainings = [v.estimate.collapsed for v in verdicts if v.estimate and v.estimate.collapsed]
    if trainings:
        worst = max(trainings, key=lambda collapsed: collapsed.number)
        yield f"of the trainings at worst {worst}"
    if any(verdict.saturated for verdict in verdicts):
        hint = "--clearing or --restock has no cap"
        if results.plan.specification.performance:
            hint = "no run can have more of this measure"
        yield f"{section.SATURATED} P is capped: {hint}"
    if results.collapses:
        words = collapsed_in_words(results.collapses, names_policies=len(results.policies) > 1)
        yield f"runs collapse {words}"
    if results.untestable:
        words = untestable_in_words(results.untestable, names_policies=len(results.policies) > 1)
        yield f"whether runs collapsed cannot be tested: {words}"
    if needs := more_seeds(results).words:
        yield needs
    claims_of_text = results.reference.claims if results.reference else {}
    claims = [verdict for verdict in verdicts if verdict.on_claim is not None]
    in_text = [verdict for verdict in claims if verdict.compared.question in claims_of_text]
    not_in_text = [verdict for verdict in claims if verdict not in in_text]
    beside = " beside it" if claims_of_text else ""
    for where, judged in ((" in the paper's text", in_text), (beside, not_in_text)):
        counts = section.count_words(v.on_claim.adjusted for v in judged if v.on_claim)
        if judged:
            yield f"of {section.plural(len(judged), 'claim')}{where} {counts}"


def _delivers_little(results: StudyResults) -> bool:
    """Return whether swarms that are as they should be, and count, deliver hardly anything."""
    originals = [verdict.cells[verdict.compared.original] for verdict in results.verdicts]
    return any(
        cell.n_seeds and counted_in(cell.arm.case) and cell.mean.value < _FEW_ITEMS
        for cell in originals
    )


def collapsed_in_words(
    named: Sequence[Collapse], *, names_policies: bool, most: int | None = _MOST_CONDITIONS
) -> str:
    """Return which share of the runs collapsed where, e.g. "at N = 128 in 16 % [10, 23]".

    Args:
        names_policies: whether to say of which policy.
        most: how many conditions are named, those with the largest shares; None: all.
    """
    ordered = sorted(named, key=lambda collapse: collapse.share.value, reverse=True)
    words = []
    for collapse in ordered[:most]:
        policy = f"of {collapse.cell.policy} " if names_policies else ""
        words.append(
            f"{policy}at {collapse.cell.words} in "
            f"{section.share_in_words(collapse.share)}{_breaks_in_words(collapse)}"
        )
    left = len(ordered) - len(words)
    listed = ", ".join(words)
    more = f"{section.plural(left, 'condition')} more"
    return f"{listed} and {more} (--full)" if left > 0 else listed


def untestable_in_words(by_reason: Mapping[str, Sequence[Cell]], *, names_policies: bool) -> str:
    """Return which conditions were not tested, and why, e.g. "N = 4 and 2 more (counts ..)"."""
    words = []
    for reason, cells in by_reason.items():
        first = f"of {cells[0].policy} at {cells[0].words}" if names_policies else cells[0].words
        more = f" and {section.plural(len(cells) - 1, 'condition')} more" if len(cells) > 1 else ""
        words.append(f"{first}{more} ({reason})")
    return ", ".join(words)


def _breaks_in_words(collapse: Collapse) -> str:
    """Return how many of the runs collapsed in mid-run, and when; empty where none is known to."""
    breaks = collapse.breaks
    if not len(breaks):
        return ""
    when = f"after {np.median(breaks):.0f} s (median)"
    return f" (of these {len(breaks)} of {collapse.n_collapsed} in mid-run, {when})"


def warnings(results: StudyResults) -> Iterator[str]:
    """Yield what a reader has to know before any verdict, one sentence each."""
    if results.damage:
        yield f"{results.damage}."
    if any(cell.saturated for cell in results.cells):
        reason = "every item was delivered in at least one run"
        if results.plan.specification.performance:
            reason = "no run can have more than at least one has"
        yield (
            f"{section.SATURATED} marks a P that is capped, because {reason}, and the indicators "
            "that rest on it. A verdict that a larger P could turn is open."
        )
    if results.collapses:
        words = collapsed_in_words(
            results.collapses, names_policies=len(results.policies) > 1, most=None
        )
        yield (
            f"Runs are of two phases, a good one and one that has collapsed: {words}. A mean P is "
            "of both."
        )
    if results.exploratory:
        yield (
            "The verdicts are exploratory: they are over other seeds or another P than the "
            "study declared before its first run, so they err more often than their level."
        )
    if results.late_margin:
        yield (
            "The verdicts on the margin of equivalence are exploratory: another margin was "
            "declared before the first run."
        )
    for cell in results.cells:
        if cell.problem:
            yield f"{cell.policy}, {cell.table}, {cell.arm.setting} is incomplete: {cell.problem}."
    for verdict in results.verdicts:
        if verdict.problem:
            comparison = verdict.compared
            name = f"{comparison.policy}, {comparison.indicator}, {comparison.label}"
            yield f"{name} is undefined: {verdict.problem}."
