"""Swarm Performance Indicators as pure functions of arrays: estimates, verdicts, planning."""

from .definitions import adaptability, fault_tolerance, relative_change, robustness, scalability
from .equivalence import Equivalence, equivalence
from .estimate import Estimate, Options, Verdict
from .inputs import IndicatorError
from .multiplicity import (
    FaultBudget,
    Spending,
    adjust,
    adjusted_p_values,
    fault_budget,
    holm,
    look_alphas,
)
from .power import (
    lower_decile_of_power,
    minimum_detectable_effect,
    no_plan_because,
    seeds_against_stalls,
    seeds_for_equivalence,
    seeds_for_power,
)
from .resilience import SurvivalCurve, kaplan_meier, repair_times, resilience_index
from .summaries import (
    Interval,
    interquartile_mean,
    mean_interval,
    median_interval,
    pairing_correlation,
    prediction_interval,
    probability_of_improvement,
    share_stalled,
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
