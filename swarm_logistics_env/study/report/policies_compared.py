"""Two policies side by side: whose P is larger by which factor, and where the order turns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from more_itertools import map_reduce

from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.study.tasks.task import TaskScenario
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict

from . import section, templates


def between_policies(verdicts: Iterable[Verdict]) -> list[Verdict]:
    """Return the verdicts on P of a policy and of the first one; a claimed ablation is none."""
    return [
        verdict
        for verdict in verdicts
        if verdict.compared.definition.compares == "policy" and verdict.compared.claim is None
    ]


def comparison_in_words(results: StudyResults) -> str:
    """Return by which factor P of the first policy is larger than that of each other one.

    Where it is smaller, the other one stands first. Empty: the study does not compare them.
    """
    by_policy: dict[str, list[Verdict]] = map_reduce(
        between_policies(results.verdicts), lambda verdict: verdict.compared.policy
    )
    base = results.plan.specification.scenario
    return " ".join(_sentence(verdicts, base) for verdicts in by_policy.values())


def _sentence(verdicts: Sequence[Verdict], base: TaskScenario) -> str:
    sound = [verdict for verdict in verdicts if not verdict.compared.original.case.faults]
    # Trials have no base: of several conditions without a fault that with the most of them.
    as_it_is = [verdict for verdict in sound if verdict.compared.original.case.scenario == base]
    main = max(as_it_is or sound or verdicts, key=_n_seeds)
    first = main.after.name
    second = main.compared.policy
    condition = main.after.condition
    if main.interval is None:
        return templates.POLICIES["undefined"].format(
            first=first, second=second, condition=condition, problem=main.problem
        )
    is_ahead = main.interval.value >= 0.0
    if not is_ahead:
        first, second = second, first
    times = section.bracketed(_factor(main.interval, inverted=not is_ahead), 2, [1.0])
    is_decided = main.on_threshold.adjusted in ("supported", "refuted")
    text = templates.POLICIES["decided" if is_decided else "open"].format(
        first=first, second=second, times=times, condition=condition
    )
    further = [verdict for verdict in verdicts if verdict is not main]
    return text + (_elsewhere(further, is_ahead) if further else ".")


def _n_seeds(verdict: Verdict) -> int:
    return verdict.estimate.n_seeds if verdict.estimate else 0


def _factor(change: Interval, *, inverted: bool) -> Interval:
    """Return a relative change as a factor of P, or as that of the other policy."""
    value, low, high = (None if end is None else 1.0 + end for end in change)
    assert value is not None
    if not inverted:
        return Interval(value, low, high)
    low, high = (None if end is None else 1.0 / max(end, 1e-9) for end in (high, low))
    return Interval(1.0 / max(value, 1e-9), low, high)


def _elsewhere(verdicts: Sequence[Verdict], is_ahead: bool) -> str:
    """Return in how many other conditions the order is the same, and where it is not."""
    alike = "supported" if is_ahead else "refuted"
    turned = "refuted" if is_ahead else "supported"
    by_word: dict[str, list[str]] = map_reduce(
        verdicts, lambda v: v.on_threshold.adjusted, lambda v: v.after.condition
    )
    clauses = []
    if n_same := len(by_word.pop(alike, ())):
        clauses.append(templates.POLICIES["same"].format(n_same=n_same, n_others=len(verdicts)))
    if turned in by_word:
        conditions = ", ".join(by_word.pop(turned))
        clauses.append(templates.POLICIES["turned"].format(conditions=conditions))
    undecided = [condition for conditions in by_word.values() for condition in conditions]
    if undecided:
        clauses.append(templates.POLICIES["undecided"].format(conditions=", ".join(undecided)))
    return "".join(clauses) + "."
