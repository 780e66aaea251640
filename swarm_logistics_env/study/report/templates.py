"""The sentences of a report, each under the name of its case, with slots in braces.

`answer.py`, `answer_notes.py`, `for_a_paper.py` and `sentences.py` decide which cases apply, and
what stands in their slots.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

Slots: TypeAlias = Mapping[str, object]


def fill(templates: Mapping[str, str], slots_by_case: Mapping[str, Slots]) -> list[str]:
    """Return the templates of the cases that apply, in the order of the table, slots filled."""
    unknown = slots_by_case.keys() - templates.keys()
    if unknown:
        raise KeyError(f"no template for {sorted(unknown)}")
    return [
        template.format(**slots_by_case[case])
        for case, template in templates.items()
        if case in slots_by_case
    ]


# The first line of the answer.
SCOPE = {
    "complete": "{study}: {questions}, {policies}, {seeds}.",
    "incomplete": "{study}: {questions}, {policies}, up to {seeds}.",
}

# The line before all others where policies are compared.
POLICIES = {
    "decided": "P of {first} is {times} times that of {second} ({condition})",
    "open": "Whether P of {first} or of {second} is larger is open: {times} times ({condition})",
    "undefined": "P of {first} and of {second} cannot be compared: {problem} ({condition})",
    "same": "; so in {n_same} of {n_others} other conditions",
    "turned": "; the other way round: {conditions}",
    "undecided": "; open: {conditions}",
}

# The second line of the answer: P where the swarm is as it should be.
PERFORMANCE = {
    "nothing": "P: no run has succeeded.",
    "count": "{p}, {counted} in {duration:g} s, at {condition}: {means}.",
    "count_with_interval": "{p} [{level}], {counted} in {duration:g} s, at {condition}: {means}.",
    "no_count": "{p} at {condition}: {means}.",
    "no_count_with_interval": "{p} [{level}] at {condition}: {means}.",
}

# Mean P of one policy: the cases that apply, one after the other.
MEAN = {
    "mean": "{mean}",
    "problem": " ({problem} and do not count)",
    "all_delivered": ", all items after {time} s",
    "nothing": "0 (at most {most:.2f} at {level}, as none of {n_runs} runs delivered anything)",
    "nothing_and_problem": "0 (at most {most:.2f} at {level}, as none of {n_runs} runs delivered "
    "anything; {problem})",
}

# What a line of the answer asks, behind the symbol of its indicator.
QUESTION = {
    "sizes": "N {chain}{property}",
    "failure_modes": "{count} failure modes{start}",
    "parameters": "{count} parameters{start}",
    "fault": "{name}{start}, {values} of {n_robots}{property}",
    "policy": "with {name}{condition}{property}",
    "parameter": "{name} {before:g}→{values}{property}",
}

# What a line of the answer says.
LINE = {
    "not_played": "not played yet",
    "problem": "{words}: {problem}",
    "family_lacks_runs": "no verdict: {indicator} lacks runs",
    "words": "{words}",
    "unaffected": "{words}, exact",
    "untestable": "{words}: {reason}",
    "unbounded": "{words} by its test; P_o is too near 0 for an interval",
    "with_reason": "{words} ({reason})",
    "more_runs": "open; {n_more} more to tell {effect:g} from {threshold:g}",
}

# How to read the answer, and what limits it: the cases that apply, with "; " between them.
NOTES = {
    "indicators": "{indicators}: supported above 0 (good), refuted below",
    "intervals": "{level} intervals",
    "intervals_of_several_levels": "{level} intervals, or as said behind them",
    "adjusted": "verdicts are Holm-adjusted",
    "assumes_normal": "provisional (below ten seeds)",
    "cannot_fail": "untestable where it cannot lie below the threshold, as P cannot below 0",
    "too_few_seeds": "two seeds give no verdict",
    "few_items": "P is small: a longer duration tells more",
    "damage": "{damage}",
    "exploratory": "exploratory: other seeds or P than were declared, whose report this replaces",
    "late_margin": "equivalence is exploratory: another margin was declared",
    "collapsed": "of the trainings at worst {collapsed}",
    "capped": "{mark} P is capped: --clearing or --restock has no cap",
    "capped_measure": "{mark} P is capped: no run can have more of this measure",
    "collapsed_runs": "runs collapse {conditions}",
    "phases_untestable": "two phases untestable: {conditions}",
    "open": "open: undecided by these {runs}",
    "more_runs": "open: undecided; so many more {runs} would tell in 4 of 5 studies",
    "open_for_a_reason": "{reasons}",
    "claims_of_the_text": "of {claims} in the paper's text {counts}",
    "claims_beside_the_text": "of {claims} beside it {counts}",
    "claims_without_text": "of {claims} {counts}",
}
# Why a verdict is open although its interval lies on one side, by `Verdict.reason`.
REASONS_TO_BE_OPEN = {
    "stalls": "so few runs may hide stalled ones",
    "trainings": "so few trainings may hide collapses",
    "Holm": "decided alone, not among all questions on the indicator",
}

EXPLORATORY = "exploratory: over other seeds or P than were declared before the first run"

# The sentence that a paper can quote: the cases that apply, one after the other.
FOR_A_PAPER = {
    "performance": "{policies}{world}: {performance} over {seeds}",
    "comparison": ". {comparison}",
    "one_question": "; {lowest}; {property}: {words} ({method})",
    "several_questions": "; of {n_questions} questions {words} ({method})",
    "not_decided": "; not decided: {questions}",
    "lowest": "; the lowest is {lowest} ({word})",
    "exploratory": "; {exploratory}",
    "end": ".",
}
METHOD = "Holm's method, {error} error"
WORLD = {"task": "the task {task}", "trials": "trials of {file}{setup}"}
QUESTION_WITH_VALUE = {
    "value": "{question} = {value}",
    "interval": "{question} = {value}, {level} interval {interval}",
}

# One verdict in sentences: the cases that apply, one after the other.
VERDICT = {
    "undefined": "Undefined: {problem}.",
    "unaffected": "{indicator} = {value:.3f} exactly, over {seeds}: unaffected. Both conditions "
    "gave the same runs, so there is nothing to test.",
    "interval": "{indicator}{mark} = {value}, {level} interval {limits} over {seeds}.",
    "no_interval": "{indicator}{mark} = {value} (no interval) over {seeds}.",
    "decision": "Unadjusted: {plain}{p}; Holm-adjusted: {adjusted}{adjusted_p}.",
    "claim": 'Claim "{claim}": {words}.',
    "equivalence": "{question}? Change {change}: {words}.",
    "flags": "{flags}",
    "collapsed": "Trainings: {collapsed}.",
    "hidden_stalls": "With stalls that may be hidden p is {p:.2g}: it needs at least {n_runs} "
    "{runs}.",
    "hidden_collapses": "With collapses that may be hidden p is {p:.2g}: it needs at least "
    "{n_trainings} trainings.",
    "open_after_all_looks": "Open after {n_seeds} of at most {most} seeds.",
    "clear_at_a_look": "Clear at {n_seeds} of at most {most} seeds.",
    "exploratory": "Exploratory.",
}

# What limits a verdict, by the flag of its estimate.
FLAGS = {
    "single_seed": "One seed gives a value, but no interval and no verdict.",
    "too_few_seeds": "Two seeds give no verdict, because whole numbers agree by chance.",
    "degenerate": "The seeds show no spread, so there is no interval and no verdict.",
    "cannot_fail": "As no P is below 0, it cannot lie below the threshold, so it is not tested and "
    "has no verdict.",
    "few_pairs_differ": "Nearly all pairs of runs have equal P, so that a handful of deliveries "
    "would decide: it is not tested and has no verdict.",
    "reference_near_0": "The interval of P_o reaches 0, so that a change relative to it says "
    "nothing: it is not tested and has no verdict.",
    "capped": "P is capped on the side that the verdict leans to, so the verdict is open.",
    "hidden_stalls": "These runs are too few to exclude stalled ones that would turn the verdict, "
    "so it is open.",
    "unbounded": "Mean P_o cannot be told from 0 at so few seeds, so the interval is infinite, and "
    "the verdict comes from the test.",
    "hidden_collapses": "These trainings are too few to exclude collapses that would turn the "
    "verdict, so it is open.",
    "assumes_normal": "The verdict is provisional, because fewer than ten seeds show too little of "
    "how they scatter.",
    "few_trainings": "Fewer than five trainings give no verdict.",
}
