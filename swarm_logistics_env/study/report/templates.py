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

# P where the swarm is as it should be.
PERFORMANCE = {
    "nothing": "P: no run has succeeded",
    "count": "{p}{level} = {mean} {counted} in {duration:g} s, {condition}",
    "no_count": "{p}{level} = {mean}, {condition}",
}

# What was found of one indicator.
SENTENCE = {
    "counts": "{indicator}: {counts}.",
    "one": "{indicator}, {question}: {value}{level}, {word}.",
    "several": "{indicator}: {counts} ({extreme} {question}: {value}{level}, {word}).",
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

# What a line of the answer asks, behind the symbol of its indicator, by what differs.
QUESTION = {
    "size": "N {before:g}→{value:g}{property}",
    "fault": "{name}{start}, {value:g} of {n_robots}{property}",
    "policy": "with {name}{property}",
    "policies": "to {name}, {condition}",
    "parameter": "{name} {before:g}→{value:g}{property}",
}

# How to read the answer, and what limits it: the cases that apply, with "; " between them.
NOTES = {
    "words": "{words}",
    "adjusted": "by Holm's method over all questions on an indicator of one policy",
    "undefined": "undefined: {problems}",
    "too_few_seeds": "two seeds give no verdict",
    "unbounded": "without limits: P_o is too near 0 for an interval",
    "few_items": "P is small: a longer duration tells more",
    "damage": "{damage}",
    "exploratory": "exploratory: other seeds or P than were declared, whose report this replaces",
    "late_margin": "equivalence is exploratory: another margin was declared",
    "collapsed": "of the trainings at worst {collapsed}",
    "capped": "{mark} P is capped: --clearing or --restock has no cap",
    "capped_measure": "{mark} P is capped: no run can have more of this measure",
    "collapsed_runs": "runs collapse {conditions}",
    "phases_untestable": "two phases untestable: {conditions}",
    "open": "{needs}",
    "claims_of_the_text": "of {claims} in the paper's text {counts}",
    "claims_beside_the_text": "of {claims} beside it {counts}",
    "claims_without_text": "of {claims} {counts}",
}
# What the words of verdicts mean: those that stand in an answer, in this order.
MEANINGS = {
    "decided": "supported: above 0 (good), refuted: below",
    "open": "open: undecided",
    "margin": "< {margin}: P changes by less than that, or P_F and P_S of FT differ by less",
    "stalls": "stalls: so few runs may hide stalled ones",
    "trainings": "trainings: so few may hide collapses",
    "Holm": "Holm: decided alone, not among all questions on the indicator",
    "provisional": "n < {n_seeds}: provisional",
    "unaffected": "unaffected: the same runs",
    "cannot_fail": "untestable, never < 0: as P cannot be",
    "few_pairs_differ": "untestable, equal P: nearly all pairs of runs have the same P",
    "reference_near_0": "untestable, P_o near 0: a change relative to it says nothing",
}
# How many more seeds open questions need: the cases that apply, one after the other.
MORE_SEEDS = {
    "within_reach": "{count} open may be decided by {n_seeds} {runs} or more",
    "beyond": "{count} open need more than {reach} {runs} ({named})",
    "none": "{count} open: no number in reach will do ({named})",
    "small": "{count} open of an effect below {effect:g}, for which more are not worth while",
}

EXPLORATORY = "exploratory: over other seeds or P than were declared before the first run"

# What a paper can quote: the cases that apply, one after the other.
FOR_A_PAPER = {
    "conditions": "{policies}{world}{how}, {seeds}",
    "comparison": ". {comparison}",
    "subjects": ". {sentences}",
    "method": ". Verdicts by Holm's method over all questions on an indicator of one policy, "
    "{error} error",
    "looks": "; looked at after {looks} seeds: of {questions} {stops}",
    "exploratory": "; {exploratory}",
    "end": ".",
}
# Why questions of a study that runs until it is clear were played no further.
STOPS = {
    "clear": "{count} stopped where clear",
    "hardly": "{count} as the rest of {most} seeds would decide them with a chance below {chance}",
    "margin": "{count} as P changes by less than {margin} of P_o",
    "untestable": "{count} as they cannot be tested",
    "most": "{count} after all {most} seeds",
}
WORLD = {"task": "the task {task}", "trials": "trials of {file}{setup}"}

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
    "clear": "Clear at {n_seeds} of at most {most} seeds.",
    "hardly": "Open after {n_seeds} of at most {most} seeds: the others would hardly decide it.",
    "margin": "Open after {n_seeds} of at most {most} seeds: P changes by less than the margin.",
    "most": "Open after {n_seeds} of at most {most} seeds.",
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
