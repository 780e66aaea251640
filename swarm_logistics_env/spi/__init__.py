"""Swarm Performance Indicators as pure functions of arrays: estimates, verdicts, planning."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .equivalence import Equivalence, equivalence
from .estimate import Estimate, Options, Verdict
from .indicators import (
    FaultBudget,
    adaptability,
    fault_budget,
    fault_tolerance,
    relative_change,
    robustness,
    scalability,
)
from .inputs import IndicatorError
from .multiplicity import adjust, adjusted_p_values, holm
from .power import (
    lower_decile_of_power,
    minimum_detectable_effect,
    no_plan_because,
    seeds_against_stalls,
    seeds_for_equivalence,
    seeds_for_power,
)
from .removed import refuse
from .resilience import SurvivalCurve, kaplan_meier, repair_times, resilience_index
from .sequential import Spending, look_alphas
from .stalls import share_stalled
from .summaries import (
    Interval,
    interquartile_mean,
    mean_interval,
    median_interval,
    pairing_correlation,
    prediction_interval,
    probability_of_improvement,
    worst_decile,
)
from .trials import Trial, Trials, read_trials

__all__ = [
    "Equivalence",
    "Estimate",
    "FaultBudget",
    "IndicatorError",
    "Interval",
    "Options",
    "Spending",
    "SurvivalCurve",
    "Trial",
    "Trials",
    "Verdict",
    "adaptability",
    "adjust",
    "adjusted_p_values",
    "equivalence",
    "fault_budget",
    "fault_tolerance",
    "holm",
    "interquartile_mean",
    "kaplan_meier",
    "look_alphas",
    "lower_decile_of_power",
    "mean_interval",
    "median_interval",
    "minimum_detectable_effect",
    "no_plan_because",
    "pairing_correlation",
    "prediction_interval",
    "probability_of_improvement",
    "read_trials",
    "relative_change",
    "repair_times",
    "resilience_index",
    "robustness",
    "scalability",
    "seeds_against_stalls",
    "seeds_for_equivalence",
    "seeds_for_power",
    "share_stalled",
    "worst_decile",
]

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        refuse(__name__, name)
