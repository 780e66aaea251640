"""Numbers of the statistics as recorded, so that none changes unnoticed; see `RECORD`."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import spi

RECORD = Path(__file__).parents[1] / "frozen" / "estimates.json"


def counts(mean: float, *shape: int, scatter: float = 0.2, phase: float = 0.0) -> NDArray[Any]:
    """Return deliveries of runs around a mean: numbers that no generator draws."""
    waves = np.sin(1.7 * np.arange(np.prod(shape)) ** 1.3 + phase)
    return np.asarray(np.rint(mean * (1.0 + scatter * waves)).reshape(shape))


# P of 12 seeds, of 4, and of 6 trainings over 8 seeds; with runs that stall, that deliver next to
# nothing, and that collapse; and times of deliveries [s].
MANY, LESS, REMOVED = counts(40, 12), counts(33, 12, phase=1.0), counts(30, 12, phase=2.0)
FEW, FEW_LESS = counts(40, 4), counts(36, 4, phase=1.0)
TRAINED, TRAINED_LESS = counts(40, 6, 8), counts(30, 6, 8, phase=1.0)
COLLAPSED = TRAINED_LESS * np.array([1.0, 1.0, 0.2, 1.0, 1.0, 1.0])[:, None]
STALLED = np.where(np.arange(12) % 5 == 2, 2.0, MANY)
LITTLE = counts(1.5, 12, scatter=1.0)
TIMES = [np.cumsum(counts(5, 60 + seed, scatter=0.9, phase=seed)) for seed in range(5)]
SLOWER = [np.append(times[times < 100.0], 100.0 + 2.0 * times) for times in TIMES]

SMALL = spi.robustness(MANY, LESS, n=25, m=3)
SLIGHTLY_LESS = spi.relative_change(MANY, MANY - 1.0 + 0.3 * np.cos(np.arange(12)))
FIVE = spi.relative_change(TRAINED[:5], 0.93 * TRAINED[:5] + np.cos(np.arange(40)).reshape(5, 8))
OF_TRAININGS = spi.robustness(TRAINED, TRAINED_LESS, n=25, m=3)
SAME = spi.equivalence(MANY, MANY + np.tile([1.0, -1.0], 6))

CASES: dict[str, Callable[[], Any]] = {
    "S": lambda: spi.scalability(MANY, 2 * LESS, n=10, m=10),
    "S, superlinear": lambda: spi.scalability(MANY, 3 * LESS, n=10, m=10, threshold=1.0),
    "S, other seeds": lambda: spi.scalability(MANY, 2 * LESS[:9], n=10, m=10, paired=False),
    "FT": lambda: spi.fault_tolerance(MANY, LESS, REMOVED),
    "FT, below .5 at 90 %": lambda: spi.fault_tolerance(
        MANY, LESS, REMOVED, n=25, m=3, threshold=0.5, confidence=0.9
    ),
    "R": lambda: SMALL,
    "R, few": lambda: spi.robustness(FEW, FEW_LESS, n=25, m=3),
    "R, one seed": lambda: spi.robustness([40.0], [36.0], n=25, m=3),
    "R, the same runs": lambda: spi.robustness(MANY, MANY, n=25, m=3, identical=True),
    "R, other seeds": lambda: spi.robustness(MANY, LESS[:8], n=25, m=3, paired=False),
    "R, stalled": lambda: spi.robustness(MANY, STALLED, n=25, m=3),
    "R, little": lambda: spi.robustness(LITTLE, LITTLE[::-1], n=25, m=3),
    "R, capped": lambda: spi.robustness(MANY, LESS, n=25, m=3, saturated=("p_o",)),
    "R, trainings": lambda: OF_TRAININGS,
    "R, trainings, other seeds": lambda: spi.robustness(
        TRAINED, TRAINED_LESS[:, :6], n=25, m=3, paired=False
    ),
    "R, of a script": lambda: spi.robustness(
        np.tile(counts(40, 8), (6, 1)), np.tile(counts(30, 8), (6, 1)), n=25, m=3
    ),
    "R, collapsed": lambda: spi.robustness(TRAINED, COLLAPSED, n=25, m=3),
    "changes that stalls or collapses may hide": lambda: [SLIGHTLY_LESS, FIVE],
    "A": lambda: spi.adaptability(MANY, LESS, x_o=10.0, x_new=15.0),
    "change": lambda: spi.relative_change(MANY, LESS, threshold=-0.33),
    "equivalence": lambda: SAME,
    "equivalence to P_S": lambda: spi.equivalence(MANY, LESS, REMOVED, margin=0.2, alpha=0.1),
    "equivalence, other seeds": lambda: spi.equivalence(MANY, MANY[:9] + 1, paired=False),
    "equivalence, trainings": lambda: spi.equivalence(TRAINED, TRAINED + 1),
    "mean": lambda: [spi.mean_interval(p) for p in (MANY, FEW, TRAINED, LITTLE)],
    "next run": lambda: [spi.prediction_interval(p, 0.9) for p in (MANY, FEW)],
    "median": lambda: [
        spi.median_interval(times) for times in (MANY, [3.0, 5.0, np.inf, 9.0, 7.0])
    ],
    "correlation": lambda: [spi.pairing_correlation(MANY, p) for p in (LESS, STALLED)],
    "stalled": lambda: [spi.share_stalled(p) for p in (MANY, STALLED)],
    "detectable": lambda: [spi.minimum_detectable_effect(e, 0.9) for e in (SMALL, OF_TRAININGS)],
    "seeds": lambda: [spi.seeds_for_power(SMALL, effect) for effect in (-0.3, -0.1, 0.02, 0.1)],
    "seeds for equivalence": lambda: spi.seeds_for_equivalence(SAME),
    "seeds against stalls": lambda: spi.seeds_against_stalls(SLIGHTLY_LESS),
    "trainings": lambda: spi.trainings_against_collapses(FIVE),
    "power": lambda: [spi.lower_decile_of_power(SMALL, 0.1, n) for n in (12, 40)],
    "Holm": lambda: [
        *spi.holm([0.01, 0.04, 0.03, 0.5]),
        *spi.adjusted_p_values([SMALL, SAME, OF_TRAININGS]),
    ],
    "fault budget": lambda: spi.fault_budget(
        {m: spi.robustness(MANY, MANY - m**2, n=25, m=m) for m in (1, 2, 3)}
    ),
    "resilience": lambda: spi.resilience_index(SLOWER, TIMES, onset=100.0),
    "repair": lambda: spi.repair_times(SLOWER, TIMES, onset=100.0, end=300.0, window=50.0),
    "survival": lambda: spi.kaplan_meier([3, 5, 5, 8, 9, 12], [1, 1, 0, 1, 0, 1]),
    "two phases": lambda: [spi.two_phases(p) for p in (MANY, np.append(MANY, MANY / 4))],
    "critical size": lambda: spi.critical_size([10, 20, 40, 80], [0, 2, 26, 30], [30] * 4, 0.9),
}


def plain(value: Any) -> Any:
    """Return a result as JSON has it: numbers, texts, and lists or tables of them."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [field.name for field in dataclasses.fields(value)]
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, tuple | list):
        return [plain(part) for part in value]
    if isinstance(value, dict):
        return {str(name): plain(part) for name, part in value.items()}
    return value


def differences(place: str, made: Any, recorded: Any) -> list[str]:
    """Return where two results differ by more than rounding."""
    if isinstance(made, dict) and isinstance(recorded, dict) and made.keys() == recorded.keys():
        pairs = [(f"{place}.{name}", made[name], recorded[name]) for name in made]
    elif isinstance(made, list) and isinstance(recorded, list) and len(made) == len(recorded):
        pairs = [(f"{place}[{i}]", *pair) for i, pair in enumerate(zip(made, recorded))]
    elif isinstance(made, float) and isinstance(recorded, int | float):
        is_near = made == pytest.approx(recorded, rel=1e-6, abs=1e-9, nan_ok=True)
        return [] if is_near else [f"{place} = {made}, was {recorded}"]
    else:
        return [] if made == recorded else [f"{place} = {made}, was {recorded}"]
    return [line for pair in pairs for line in differences(*pair)]


def test_numbers_are_as_recorded(tmp_path: Path) -> None:
    made = {name: plain(case()) for name, case in CASES.items()}
    path = tmp_path / RECORD.name
    path.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")
    found = differences("", made, json.loads(RECORD.read_text(encoding="utf-8")))
    assert not found, f"if {path} is as it should be, put it into {RECORD.parent}"
