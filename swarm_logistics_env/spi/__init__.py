"""Swarm Performance Indicators as pure functions of arrays: estimates, verdicts, planning."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

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
from .trials import Trial, Trials, read_trials

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
    "Trial",
    "Trials",
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
    "trainings_against_collapses",
    "two_phases",
]

# Public names that went with 0.3.0, and where to look instead.
_TWO_CHECKS = "use check_policy, or check_wrapper"
REMOVED = {
    "spi.ScalingFit": "fit a law to P over N with scipy.optimize.curve_fit",
    "spi.SelfRepair": "use spi.repair_times with spi.kaplan_meier",
    "spi.Verdict": "use spi.DecisionWord",
    "spi.Simulation": "judge the real runs alone",
    "spi.compare_scaling": "fit a law to P over N with scipy.optimize.curve_fit",
    "spi.fit_scaling": "fit a law to P over N with scipy.optimize.curve_fit",
    "spi.karp_flatt": "use spi.scalability: S = 1 where nothing is serial",
    "spi.mean_with_simulation": "use spi.mean_interval of the real runs alone",
    "spi.self_repair": "use spi.repair_times with spi.kaplan_meier",
    "testing.check_conservation": f"{_TWO_CHECKS}; verification/invariants.py counts items",
    "testing.check_determinism": _TWO_CHECKS,
    "testing.check_faults": f"{_TWO_CHECKS}; verification/invariants.py watches faults",
    "testing.check_overlap": f"{_TWO_CHECKS}; verification/invariants.py measures overlaps",
    "testing.check_spaces": "use check_wrapper",
}


def refuse(module: str, name: str) -> NoReturn:
    """Raise AttributeError, with what to use instead where the name was removed.

    No other error: `hasattr` and `getattr(module, name, None)` ask about any name.
    """
    public_name = f"{module.partition('.')[2]}.{name}"
    if public_name in REMOVED:
        raise AttributeError(f"{public_name} was removed in 0.3.0: {REMOVED[public_name]}")
    raise AttributeError(f"module {module!r} has no attribute {name!r}")


if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        refuse(__name__, name)
