"""Public names that went with 0.3.0, and where to look instead."""

from __future__ import annotations

from typing import NoReturn

_TWO_CHECKS = "use check_policy, or check_wrapper"
REMOVED = {
    "spi.ScalingFit": "fit a law to P over N with scipy.optimize.curve_fit",
    "spi.SelfRepair": "use spi.repair_times with spi.kaplan_meier",
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
    """Raise ImportError with what to use instead of a removed name, else AttributeError."""
    place = f"{module.partition('.')[2]}.{name}"
    if place in REMOVED:
        raise ImportError(f"{place} was removed in 0.3.0: {REMOVED[place]}")
    raise AttributeError(f"module {module!r} has no attribute {name!r}")
