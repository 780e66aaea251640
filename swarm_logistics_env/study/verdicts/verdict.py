"""Verdict: what a study says of one comparison, and Holm's adjustment over a family of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

from more_itertools import map_reduce

from swarm_logistics_env import spi
from swarm_logistics_env.spi import Equivalence, Estimate, Interval, equivalence
from swarm_logistics_env.spi.equivalence import ALPHA
from swarm_logistics_env.spi.estimate import SEEDS_OF_HEADLINE
from swarm_logistics_env.study.questions.comparison import (
    CONFIDENCE,
    Arm,
    Comparison,
    Family,
    Setting,
)

from .cell import Cell, same_runs
from .stopped_trials import equivalence_over_ends, estimate_over_ends, samples_at_ends

POWER = 0.8
UNAFFECTED: Literal["unaffected"] = "unaffected"
UNTESTABLE: Literal["untestable"] = "untestable"
UNDEFINED: Literal["undefined"] = "undefined"
Word: TypeAlias = spi.DecisionWord | Literal["unaffected", "untestable", "undefined"]
DECIDED: tuple[Word, ...] = ("supported", "refuted", "equivalent")
_OPPOSITE: dict[Word, Word] = {"supported": "refuted", "refuted": "supported"}
# Why a comparison is played no further: nothing is to be tested, P changes within the margin, or no
# further seed is likely to decide it.
WHY_GIVEN_UP = UNTESTABLE, "margin", "hardly"
# Why there is nothing to test, by the flag of the estimate.
_WHY_UNTESTABLE = {
    "cannot_fail": "never < {threshold:g}",
    "few_pairs_differ": "equal P",
    "reference_near_0": "P_o near 0",
}
# Why a verdict is open although its interval lies on one side, by the flag that says so.
_WHY_OPEN = {
    "hidden_stalls": "stalls",
    "hidden_collapses": "trainings",
    "few_trainings": "trainings",
}


class Decision(NamedTuple):
    """What is decided on one question.

    Attributes:
        plain: the word at the question's own level: supported, refuted, equivalent or open;
            unaffected: both conditions gave the same runs, which is no evidence; untestable: the
            indicator cannot lie below the threshold, or the runs deliver too little, or all the
            same, to tell; undefined: a run that it needs failed or is missing.
        adjusted: the word after Holm's adjustment over the family; undefined, too, where another
            comparison of the family is, but for what needs no test (unaffected, untestable) and in
            a study that runs until it is clear, whose family keeps it as one that is open.
    """

    plain: Word
    adjusted: Word = UNDEFINED

    @property
    def opposite(self) -> Decision:
        """The decision on the contrary."""
        plain, adjusted = self
        return Decision(_OPPOSITE.get(plain, plain), _OPPOSITE.get(adjusted, adjusted))


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a study says of one comparison.

    Attributes:
        compared: the comparison.
        cells: P of its arms, by which it was judged.
        estimate: the indicator; None: undefined.
        problem: why it is undefined, e.g. by a failed run; None: it is not.
        equivalence: the test whether P is unchanged; None: undefined, or S, which has none.
        saturated: whether it rests on a P that is capped.
        margin: the largest change that counts as none, as a share of P_o.
        on_threshold: the decision on "the indicator lies above the threshold".
        on_equivalence: the decision on "P is unchanged"; None: S has no such question.
        p_adjusted: p of the estimate after Holm; None: nothing to test, or an undefined family
            outside of a study that runs until it is clear.
        stopped_at: number of seeds at which it was clear, in a study that runs until then; None: it
            is not, or the study is another.
        given_up: why it is played no further although it is open, in such a study: a name in
            `WHY_GIVEN_UP`; empty: it is not.
        published: the reference's value of the indicator; None: it has none.
        claimed: whether it is claimed to lie above the threshold; None: nothing is claimed.
    """

    compared: Comparison
    cells: Mapping[Arm, Cell]
    estimate: Estimate | None
    problem: str | None
    equivalence: Equivalence | None
    saturated: bool
    margin: float
    on_threshold: Decision
    on_equivalence: Decision | None
    p_adjusted: float | None = None
    stopped_at: int | None = None
    given_up: str = ""
    published: float | None = None
    claimed: bool | None = None

    @property
    def value(self) -> float | None:
        """The estimate; None: undefined."""
        return None if self.estimate is None else self.estimate.value

    @property
    def interval(self) -> Interval | None:
        """The estimate with the limits of its interval; None: undefined."""
        e = self.estimate
        return None if e is None else Interval(e.value, e.low, e.high)

    @property
    def flags(self) -> tuple[str, ...]:
        """Marks on the verdict, see `Estimate`."""
        return self.estimate.flags if self.estimate else ()

    @property
    def level(self) -> float | None:
        """The level of its interval, in (0, 1); None: it has none, or the value is exact."""
        estimate = self.estimate
        if estimate is None or estimate.low is None or estimate.identical:
            return None
        return estimate.confidence

    @property
    def lies_above(self) -> bool | None:
        """Whether its interval lies above the threshold; None: it holds it, or there is none."""
        _, low, high = self.interval or (None, None, None)
        threshold = self.compared.threshold
        if low is None or high is None or low <= threshold <= high:
            return None
        return low > threshold

    @property
    def after(self) -> Setting:
        """The setting of the changed condition."""
        return self.compared.changed.setting

    @property
    def property_name(self) -> str:
        """The property in question, e.g. "tolerant", "FT > 0.5" or "P falls"."""
        is_below = self.claimed is False
        definition = self.compared.definition
        return definition.property_name(self.compared.threshold, claimed_below=is_below)

    @property
    def question(self) -> str:
        """What it answers, e.g. "R FM4, 1 of 25"."""
        question = f"{self.compared.indicator} {self.compared.change}"
        is_usual = self.property_name == self.compared.definition.adjectives.get(0.0)
        return question if is_usual or self.after.condition else f"{question}, {self.property_name}"

    @property
    def _property_is_a_fall(self) -> bool:
        # "P falls" is asked as it is claimed; every other property is one above the threshold.
        return self.compared.definition.compares == "policy" and self.claimed is False

    @property
    def on_property(self) -> Decision:
        """The decision on the property."""
        return self.on_threshold.opposite if self._property_is_a_fall else self.on_threshold

    @property
    def claim(self) -> str | None:
        """What is claimed, e.g. "not tolerant"; None: nothing."""
        if self.claimed is None:
            return None
        is_the_property = self.claimed or self._property_is_a_fall
        return self.property_name if is_the_property else f"not {self.property_name}"

    @property
    def on_claim(self) -> Decision | None:
        """The decision on the claim; None: nothing is claimed."""
        if self.claimed is None:
            return None
        return self.on_threshold if self.claimed else self.on_threshold.opposite

    @property
    def conclusion(self) -> Word:
        """The adjusted decision on the property; equivalent if that is open and P unchanged."""
        word = self.on_property.adjusted
        is_unchanged = (
            self.on_equivalence is not None and self.on_equivalence.adjusted == "equivalent"
        )
        return "equivalent" if word == "open" and is_unchanged else word

    @property
    def reason(self) -> str:
        """Why it is untestable, or open with its interval on one side of the threshold.

        In words; or "stalls", "trainings" or "Holm", for which a report has a sentence; empty:
        there is no reason.
        """
        if self.estimate is not None and self.conclusion == UNTESTABLE:
            return why_untestable(self.estimate)
        if self.conclusion != "open" or self.lies_above is None:
            return ""
        for flag, reason in _WHY_OPEN.items():
            if flag in self.flags:
                return reason
        return "Holm" if self.on_threshold.plain in DECIDED else ""

    @property
    def in_words(self) -> str:
        """The verdict in a word or two, as every table has it, e.g. "P within 10 %".

        Below ten paired seeds a decision assumes normal differences, which "n < 10" says.
        """
        word: str = self.on_property.adjusted
        is_decided = word in DECIDED
        if self.compares_policies:
            word = {"supported": "more", "refuted": "less"}.get(word, word)
        if self.estimate is None and str(self.problem).endswith(" missing"):
            return "not played"
        if self.conclusion == "equivalent":
            return f"P within {100 * self.margin:.3g} %"
        if is_decided and "assumes_normal" in self.flags:
            return f"{word}, n < {SEEDS_OF_HEADLINE}"
        return f"{word}, {self.reason}" if self.reason else word

    @property
    def compares_policies(self) -> bool:
        """Whether it is on P of a policy and of the first one; a claimed ablation is none."""
        return self.compared.definition.compares == "policy" and self.compared.claim is None

    @property
    def at_zero(self) -> str:
        """What a report says of its value, and of a value of 0."""
        if self.compares_policies:
            return "times P: P of the policy before 'against' / P of the other"
        return self.compared.definition.at_zero

    @property
    def equivalence_name(self) -> str | None:
        """What is tested for equivalence, e.g. "P_F within 10 % of P_o"; None: nothing."""
        return self.compared.definition.unchanged(self.margin)

    @cached_property
    def seeds_needed(self) -> int | None:
        """Seeds for 80 % power at the published value, on average; None: none can be named."""
        if self.estimate is None or self.published is None:
            return None
        return spi.seeds_for_power(self.estimate, self.published, POWER)

    @property
    def detectable(self) -> float | None:
        """Distance from the threshold that these seeds find with 80 % power."""
        return spi.minimum_detectable_effect(self.estimate, POWER) if self.estimate else None


def why_untestable(estimate: Estimate) -> str:
    """Return why an estimate that is untestable is so, e.g. "P_o near 0"."""
    return _WHY_UNTESTABLE[estimate.flags[0]].format(threshold=estimate.threshold)


def level_of(verdicts: Iterable[Verdict]) -> float:
    """Return the level of most intervals of these verdicts, for a heading over all of them."""
    counts = Counter(verdict.level for verdict in verdicts if verdict.level is not None)
    return max(counts, key=counts.__getitem__, default=CONFIDENCE)


def judge_comparison(
    comparison: Comparison,
    cells: Mapping[Arm, Cell],
    *,
    paired: bool,
    margin: float,
    confidence: float = CONFIDENCE,
    alpha: float = ALPHA,
) -> Verdict:
    """Judge a comparison, without Holm's adjustment: `adjust_families` does that.

    A comparison that needs a run which failed or is missing is undefined.

    Args:
        cells: those of the comparison's arms.
        confidence: of the indicator's interval and verdict, in (0, 1).
        alpha: error of each of the two tests of equivalence, in (0, 0.5).
    """
    saturated = [arm for arm in comparison.arms if cells[arm].saturated]
    # S is not tested for equivalence.
    has_equivalence = comparison.definition.unchanged(margin) is not None
    estimate = None
    unchanged = None
    problems = [
        f"{arm.setting}: {cells[arm].problem}" for arm in comparison.arms if cells[arm].problem
    ]
    if not problems:
        original, changed = (cells[arm] for arm in (comparison.original, comparison.changed))
        # The removed robots make the third condition another one by construction.
        identical = comparison.removed is None and same_runs(original.outcomes, changed.outcomes)
        samples = list(samples_at_ends(cells, comparison.arms))
        arms = {"p_o": comparison.original, "p_new": comparison.changed}
        if comparison.removed is not None:
            arms["p_s"] = comparison.removed
        try:
            estimate = estimate_over_ends(
                [
                    comparison.estimate(
                        performance,
                        capped=saturated,
                        paired=paired,
                        identical=identical,
                        confidence=confidence,
                    )
                    for performance in samples
                ]
            )
            if has_equivalence:
                unchanged = equivalence_over_ends(
                    [
                        equivalence(
                            **{name: performance[arm] for name, arm in arms.items()},
                            margin=margin,
                            alpha=alpha,
                            paired=paired,
                            saturated=[name for name, arm in arms.items() if arm in saturated],
                            identical=identical,
                        )
                        for performance in samples
                    ]
                )
        except spi.IndicatorError as error:
            delivers_nothing = not cells[comparison.original].by_seed.any()
            estimate = None
            problems = ["it delivers nothing" if delivers_nothing else str(error)]
    on_equivalence = Decision(unchanged.verdict if unchanged else UNDEFINED)
    return Verdict(
        comparison,
        cells,
        estimate,
        "; ".join(problems) or None,
        unchanged,
        bool(saturated),
        margin,
        on_threshold=_on_threshold(estimate),
        on_equivalence=on_equivalence if has_equivalence else None,
    )


def _on_threshold(estimate: Estimate | None) -> Decision:
    """Decide whether the indicator lies above its threshold; what needs no test needs no family."""
    if estimate is None:
        return Decision(UNDEFINED)
    if estimate.identical:
        return Decision(UNAFFECTED, UNAFFECTED)
    if estimate.untestable:
        return Decision(UNTESTABLE, UNTESTABLE)
    return Decision(estimate.verdict)


def adjust_families(verdicts: Sequence[Verdict]) -> Iterator[Verdict]:
    """Yield verdicts after Holm's adjustment, family by family, in their order.

    An undefined comparison leaves its family without adjusted decisions: it would be too small.
    """
    adjusted: dict[Comparison, Verdict] = {}
    families: dict[Family, list[Verdict]] = map_reduce(
        verdicts, lambda verdict: verdict.compared.family
    )
    for family in families.values():
        estimates = [verdict.estimate for verdict in family if verdict.estimate]
        if len(estimates) == len(family):
            p_values = spi.adjusted_p_values(estimates)
            words = spi.adjust(estimates)
            family = [
                replace(verdict, p_adjusted=p, on_threshold=_adjust(verdict.on_threshold, p, word))
                for verdict, p, word in zip(family, p_values, words)
            ]
        equivalences = [verdict.equivalence for verdict in family if verdict.equivalence]
        if len(equivalences) == len(family):
            family = [
                replace(verdict, on_equivalence=Decision(test.verdict, word))
                for verdict, test, word in zip(family, equivalences, spi.adjust(equivalences))
            ]
        adjusted |= {verdict.compared: verdict for verdict in family}
    yield from (adjusted[verdict.compared] for verdict in verdicts)


def _adjust(decision: Decision, p: float | None, word: spi.DecisionWord) -> Decision:
    """Put the adjusted word into a decision; what was not tested keeps its own."""
    return decision if p is None or decision.plain == UNTESTABLE else Decision(decision.plain, word)
