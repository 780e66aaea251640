"""Cells and verdicts: P under each condition, and what every comparison of a study says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from swarm_logistics_env import spi
from swarm_logistics_env.grouping import grouped
from swarm_logistics_env.questions.comparison import CONFIDENCE, Arm, Comparison, Setting
from swarm_logistics_env.spi import Equivalence, Estimate, Interval, equivalence
from swarm_logistics_env.spi.equivalence import ALPHA

from .cell import Cell, same_runs

POWER = 0.8
UNAFFECTED = "unaffected"
UNTESTABLE = "untestable"


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a study says of one comparison.

    Attributes:
        compared: what is compared.
        estimate: the indicator; None: blocked.
        problem: why it is blocked, e.g. by a failed run; None: it is not.
        equivalence: whether P is unchanged; None: blocked, or not asked.
        saturated: whether it rests on a P that is capped.
        margin: the largest change that counts as none, as a share of P_o.
        p_holm, verdict_holm: of the estimate under Holm; None: nothing to test, or a blocked
            family.
        equivalence_holm: verdict of the equivalence under Holm; None as `equivalence`.
        stopped_at: number of seeds at which it was clear, in a study that runs until then; None: it
            is not, or the study is another.
        published: the reference's value of the indicator; None: it has none.
        claimed: whether it is claimed to lie above the threshold; None: nothing is claimed.
    """

    compared: Comparison
    estimate: Estimate | None
    problem: str | None
    equivalence: Equivalence | None
    saturated: bool
    margin: float
    p_holm: float | None = None
    verdict_holm: spi.Verdict | None = None
    equivalence_holm: spi.Verdict | None = None
    stopped_at: int | None = None
    published: float | None = None
    claimed: bool | None = None

    @property
    def value(self) -> float | None:
        """The estimate; None: blocked."""
        return None if self.estimate is None else self.estimate.value

    @property
    def interval(self) -> Interval | None:
        """The estimate with the limits of its interval; None: blocked."""
        e = self.estimate
        return None if e is None else Interval(e.value, e.low, e.high)

    @property
    def flags(self) -> tuple[str, ...]:
        """Marks on the verdict, see `Estimate`."""
        return self.estimate.flags if self.estimate else ()

    @property
    def asked(self) -> str:
        """What is asked, e.g. "tolerant", "FT > 0.5" or "P falls"."""
        definition, below = self.compared.definition, self.claimed is False
        return definition.property_name(self.compared.threshold, claimed_below=below)

    @property
    def after(self) -> Setting:
        """The setting of the changed condition."""
        return self.compared.changed.setting

    @property
    def plain(self) -> str | None:
        """Whether it lies above the threshold.

        "unaffected": equal runs, no evidence; "untestable": it cannot lie below the threshold.
        """
        if self.estimate is None:
            return None
        if self.estimate.identical:
            return UNAFFECTED
        return UNTESTABLE if self.estimate.untestable else self.estimate.verdict

    @property
    def holm(self) -> str | None:
        """The same after Holm."""
        return self.plain if self.plain in (UNAFFECTED, UNTESTABLE) else self.verdict_holm

    @property
    def claim_verdict(self) -> str | None:
        """The verdict on the claim; None: nothing is claimed."""
        return self._on_claim(self.plain)

    @property
    def claim_verdict_holm(self) -> str | None:
        """The same after Holm."""
        return self._on_claim(self.holm)

    @property
    def answer(self) -> str | None:
        """The verdict on the property."""
        return self.claim_verdict if self._asks_for_fall else self.plain

    @property
    def answer_holm(self) -> str | None:
        """The same after Holm."""
        return self.claim_verdict_holm if self._asks_for_fall else self.holm

    def _on_claim(self, found: str | None) -> str | None:
        if self.claimed is False:
            return {"supported": "refuted", "refuted": "supported"}.get(found or "", found)
        return None if self.claimed is None else found

    @property
    def _asks_for_fall(self) -> bool:
        # "P falls" is asked as it is claimed; every other property is one above the threshold.
        return self.compared.definition.compares == "policy" and self.claimed is False

    @property
    def claim(self) -> str | None:
        """What is claimed, e.g. "not tolerant"; None: nothing."""
        if self.claimed is None:
            return None
        return self.asked if self.claimed or self._asks_for_fall else f"not {self.asked}"

    @property
    def conclusion(self) -> str | None:
        """The answer under Holm, but "equivalent" if that is inconclusive and P unchanged."""
        unchanged = self.equivalence_holm == "equivalent"
        is_open = self.answer_holm == "inconclusive"
        return "equivalent" if is_open and unchanged else self.answer_holm

    @property
    def unchanged(self) -> str | None:
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


def judge_one(
    comparison: Comparison,
    cells: Mapping[Arm, Cell],
    *,
    paired: bool,
    margin: float,
    confidence: float = CONFIDENCE,
    alpha: float = ALPHA,
) -> Verdict:
    """Return a comparison's verdict, without what Holm makes of it.

    A comparison that needs a run which failed or is missing is blocked.

    Args:
        cells: those of the comparison's arms.
        confidence: of the indicator's interval and verdict, in (0, 1).
        alpha: error of each of the two tests of equivalence, in (0, 0.5).
    """
    saturated = [arm for arm in comparison.arms if cells[arm].saturated]
    estimate, same = None, None
    problems = [
        f"{arm.setting}: {cells[arm].problem}" for arm in comparison.arms if cells[arm].problem
    ]
    if not problems:
        pair = (cells[arm].outcomes for arm in (comparison.original, comparison.changed))
        # The removed robots make the third condition another one by construction.
        identical = comparison.removed is None and same_runs(*pair)
        samples = {arm: cells[arm].by_seed for arm in comparison.arms}
        try:
            estimate = comparison.estimate(
                samples, capped=saturated, paired=paired, identical=identical, confidence=confidence
            )
            if comparison.definition.unchanged(margin) is not None:  # S has no such question
                named = dict(zip(("p_o", "p_new", "p_s"), comparison.arguments.values()))
                same = equivalence(
                    *(samples[arm] for arm in named.values()),
                    margin=margin,
                    alpha=alpha,
                    paired=paired,
                    saturated=[name for name, arm in named.items() if arm in saturated],
                    identical=identical,
                )
        except spi.IndicatorError as error:
            nothing = not samples[comparison.original].any()
            estimate, problems = None, ["it delivers nothing" if nothing else str(error)]
    return Verdict(comparison, estimate, "; ".join(problems) or None, same, bool(saturated), margin)


def under_holm(found: Sequence[Verdict]) -> Iterator[Verdict]:
    """Yield verdicts with what Holm makes of them, family by family, in their order.

    A blocked comparison leaves its family without adjusted verdicts: it would be too small.
    """
    adjusted: dict[Comparison, Verdict] = {}
    for family in grouped(found, lambda one: one.compared.family).values():
        estimates = [one.estimate for one in family if one.estimate]
        same = [one.equivalence for one in family if one.equivalence]
        none = (None,) * len(family)
        is_whole = len(estimates) == len(family)
        p_values = spi.adjusted_p_values(estimates) if is_whole else none
        verdicts = spi.adjust(estimates) if is_whole else none
        unchanged = spi.adjust(same) if len(same) == len(family) else none
        for one, p, verdict, as_before in zip(family, p_values, verdicts, unchanged):
            adjusted[one.compared] = replace(
                one,
                p_holm=p,
                # What is no evidence, or cannot fail, has no verdict.
                verdict_holm=None if p is None else verdict,
                equivalence_holm=as_before,
            )
    yield from (adjusted[one.compared] for one in found)
