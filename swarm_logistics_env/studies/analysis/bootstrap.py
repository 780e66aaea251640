"""Whether the verdicts stand without a distribution: Fieller beside the studentised bootstrap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swarm_logistics_env.spi.estimate import Estimate, Verdict
from swarm_logistics_env.studies.judgement import Findings, Judgement


@dataclass(frozen=True)
class BootstrapCheck:
    """What the studentised bootstrap makes of a study's indicators.

    Attributes:
        checked: how many of them have its interval: those of ten paired seeds and more.
        differing: those whose unadjusted verdict it would change.
        width: its intervals' widths over Fieller's: least, median and greatest of the bounded
            ones; None where there are none.
    """

    checked: int
    differing: tuple[Judgement, ...]
    width: tuple[float, float, float] | None


def bootstrap_verdict(estimate: Estimate) -> Verdict | None:
    """Return what the bootstrap's interval says of "above the threshold"; None: not run."""
    if estimate.bootstrap_low is None or estimate.bootstrap_high is None:
        return None
    if estimate.bootstrap_low > estimate.threshold:
        return "supported"
    return "refuted" if estimate.bootstrap_high < estimate.threshold else "inconclusive"


def differs(estimate: Estimate) -> bool:
    """Return whether the bootstrap would change the unadjusted verdict."""
    return bootstrap_verdict(estimate) not in (None, estimate.verdict)


def bootstrap_check(findings: Findings) -> BootstrapCheck:
    """Return how the bootstrap's intervals compare with Fieller's."""
    checked = [
        (judgement, judgement.estimate)
        for judgement in findings.judgements
        if judgement.estimate is not None and bootstrap_verdict(judgement.estimate) is not None
    ]
    ratios = []
    for _, estimate in checked:
        assert estimate.low is not None
        assert estimate.high is not None
        assert estimate.bootstrap_low is not None
        assert estimate.bootstrap_high is not None
        fieller = estimate.high - estimate.low
        ratio = (estimate.bootstrap_high - estimate.bootstrap_low) / fieller if fieller else np.inf
        if np.isfinite(ratio) and np.isfinite(fieller):
            ratios.append(ratio)
    return BootstrapCheck(
        len(checked),
        tuple(judgement for judgement, estimate in checked if differs(estimate)),
        (min(ratios), float(np.median(ratios)), max(ratios)) if ratios else None,
    )
