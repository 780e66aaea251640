"""Swarm Performance Indicators as pure functions of arrays: estimates, verdicts, planning."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swarm_logistics_env.core.moved_names import moved_attribute

from .definitions import adaptability, fault_tolerance, relative_change, robustness, scalability
from .equivalence import Equivalence, equivalence
from .estimate import DecisionWord, Estimate, Options
from .hidden import Collapsed, share_stalled
from .inputs import IndicatorError
from .multiplicity import (
    FaultBudget,
    adjust,
    adjusted_p_values,
    fault_budget,
    holm,
    look_alphas,
)
from .phases import Phases, collapsed_runs, critical_size, two_phases
from .power import (
    lower_decile_of_power,
    minimum_detectable_effect,
    no_plan_because,
    seeds_against_stalls,
    seeds_for_equivalence,
    seeds_for_power,
    trainings_against_collapses,
)
from .resilience import SurvivalCurve, kaplan_meier, repair_times, resilience_index
from .summaries import (
    Interval,
    mean_interval,
    median_interval,
    pairing_correlation,
    prediction_interval,
)

__all__ = [
    "Collapsed",
    "DecisionWord",
    "Equivalence",
    "Estimate",
    "FaultBudget",
    "IndicatorError",
    "Interval",
    "Options",
    "Phases",
    "SurvivalCurve",
    "adaptability",
    "adjust",
    "adjusted_p_values",
    "collapsed_runs",
    "critical_size",
    "equivalence",
    "fault_budget",
    "fault_tolerance",
    "holm",
    "kaplan_meier",
    "look_alphas",
    "lower_decile_of_power",
    "mean_interval",
    "median_interval",
    "minimum_detectable_effect",
    "no_plan_because",
    "pairing_correlation",
    "prediction_interval",
    "relative_change",
    "repair_times",
    "resilience_index",
    "robustness",
    "scalability",
    "seeds_against_stalls",
    "seeds_for_equivalence",
    "seeds_for_power",
    "share_stalled",
    "trainings_against_collapses",
    "two_phases",
]

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        return moved_attribute(__name__, name)
