"""Swarm Performance Indicators as pure functions of arrays: estimates, verdicts, planning."""

from __future__ import annotations

from .efficiency import karp_flatt
from .equivalence import Equivalence, equivalence
from .estimate import Estimate, Options, Verdict
from .fault_budget import FaultBudget, fault_budget
from .indicators import adaptability, fault_tolerance, relative_change, robustness, scalability
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
from .resilience import resilience_index
from .scaling import ScalingFit, compare_scaling, fit_scaling
from .self_repair import SelfRepair, repair_times, self_repair
from .sequential import Spending, look_alphas
from .simulation import Simulation, mean_with_simulation
from .stalls import share_stalled
from .summaries import (
    Interval,
    interquartile_mean,
    mean_interval,
    pairing_correlation,
    prediction_interval,
    probability_of_improvement,
    worst_decile,
)
from .survival import SurvivalCurve, kaplan_meier
from .trials import Trial, Trials, read_trials

__all__ = [
    "Equivalence",
    "Estimate",
    "FaultBudget",
    "IndicatorError",
    "Interval",
    "Options",
    "ScalingFit",
    "SelfRepair",
    "Simulation",
    "Spending",
    "SurvivalCurve",
    "Trial",
    "Trials",
    "Verdict",
    "adaptability",
    "adjust",
    "adjusted_p_values",
    "compare_scaling",
    "equivalence",
    "fault_budget",
    "fault_tolerance",
    "fit_scaling",
    "holm",
    "interquartile_mean",
    "kaplan_meier",
    "karp_flatt",
    "look_alphas",
    "lower_decile_of_power",
    "mean_interval",
    "mean_with_simulation",
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
    "self_repair",
    "share_stalled",
    "worst_decile",
]
