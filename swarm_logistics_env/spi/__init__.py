"""Swarm Performance Indicators as pure functions of arrays: estimates, verdicts, planning."""

from __future__ import annotations

from .bootstrap import studentised_bootstrap
from .errors import IndicatorError
from .estimate import Estimate, Verdict
from .indicators import (
    adaptability,
    fault_tolerance,
    relative_change,
    robustness,
    scalability,
)
from .multiplicity import adjust, holm
from .power import minimum_detectable_effect, no_plan_because, seeds_for_power
from .summaries import (
    Interval,
    interquartile_mean,
    mean_interval,
    pairing_correlation,
    prediction_interval,
    probability_of_improvement,
    worst_decile,
)

__all__ = [
    "Estimate",
    "IndicatorError",
    "Interval",
    "Verdict",
    "adaptability",
    "adjust",
    "fault_tolerance",
    "holm",
    "interquartile_mean",
    "mean_interval",
    "minimum_detectable_effect",
    "no_plan_because",
    "pairing_correlation",
    "prediction_interval",
    "probability_of_improvement",
    "relative_change",
    "robustness",
    "scalability",
    "seeds_for_power",
    "studentised_bootstrap",
    "worst_decile",
]
