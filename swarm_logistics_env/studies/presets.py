"""The studies that come with the package, and published values: the paper's, and how near we come.

Source: Milner, Sooriyabandara and Hauert, Swarm Performance Indicators: Metrics for Robustness,
Fault Tolerance, Scalability and Adaptability; Tables I to III and the text around them.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from swarm_logistics_env.errors import StudyError, suggest
from swarm_logistics_env.spi.estimate import Estimate

from .comparison import NO_FAULT, Comparison, Question, Setting
from .specification import Specification, read_study_file


@dataclass(frozen=True)
class Reference:
    """Performances and yes/no claims that somebody published, without a number of runs.

    Each performance is treated as one run.

    Attributes:
        source: whose they are, for the report.
        performance: P at each setting [items].
        cells: the settings that count as cells of the tables; a baseline repeated under another
            name is none.
        sentences: each sentence of the text, with the questions that it answers: whether the
            indicator is above the threshold.
        whose: what a verdict on these claims can mean, and what not.
    """

    source: str
    performance: Mapping[Setting, float]
    cells: tuple[Setting, ...]
    sentences: Mapping[str, Mapping[Question, bool]]
    whose: str

    @cached_property
    def claims(self) -> Mapping[Question, bool]:
        """Whether the text says that the indicator is above the threshold."""
        return {asked: said for one in self.sentences.values() for asked, said in one.items()}

    def estimate(self, comparison: Comparison) -> Estimate | None:
        """Return the published value of an indicator, without interval, where there is one."""
        if any(arm.setting not in self.performance for arm in comparison.arms):
            return None
        return comparison.estimate(
            {arm: np.array([self.performance[arm.setting]]) for arm in comparison.arms}
        )


def size(n: int) -> Setting:
    """Return the setting of a swarm size."""
    return Setting("size", "n_robots", n)


def fault(mode: str, m: int) -> Setting:
    """Return the setting of m robots that fail from the start."""
    return Setting("fault", mode, m)


def parameter(name: str, value: float) -> Setting:
    """Return the setting of a scenario field."""
    return Setting("parameter", name, value)


# Table I: swarm size N -> P, items delivered in 500 s.
PAPER_SIZES = {5: 9, 10: 18, 20: 29, 30: 33, 40: 45, 50: 56, 60: 65, 100: 74, 150: 69}

# Table II, N = 25: failure mode -> P for m = 1, 2, 3; "removed" is the paper's P_S.
PAPER_NO_FAULT = 39
PAPER_FAULTS = {
    "removed": (39, 35, 36),
    "FM1": (41, 38, 35),
    "FM2": (40, 41, 35),
    "FM3": (40, 41, 40),
    "FM4": (39, 15, 12),
}

# Table III, N = 25: value -> P, x_o first. The printed widths .5 to 2 m cannot be metres (25
# robots cover 1.2 m^2): the warehouse's are read in units of the stated arena's 10 m, the
# delivery area's .2 to .05 as fractions of it.
PAPER_PARAMETERS = {
    "warehouse_width": {5.0: 47, 10.0: 41, 15.0: 21, 20.0: 8},
    "delivery_width": {2.0: 41, 1.5: 37, 1.0: 26, 0.5: 16},
    "n_items": {60.0: 44, 70.0: 31},
}
# x_o of the first two is the base scenario once more, with another published P; FM3_send repeats
# the published values of FM3: no cells of their own.
NO_CELLS = {
    *(parameter("delivery_width", 2.0), parameter("n_items", 60.0)),
    *(fault("FM3_send", m) for m in (1, 2, 3)),
}

PAPER_PERFORMANCE: dict[Setting, float] = {
    **{size(n): p for n, p in PAPER_SIZES.items()},
    NO_FAULT: PAPER_NO_FAULT,
    **{fault(mode, m): p for mode, row in PAPER_FAULTS.items() for m, p in enumerate(row, start=1)},
    # "Cannot communicate with their neighbours" has two readings; this one was added after the
    # tables were seen.
    **{fault("FM3_send", m): p for m, p in enumerate(PAPER_FAULTS["FM3"], start=1)},
    **{parameter(name, x): p for name, row in PAPER_PARAMETERS.items() for x, p in row.items()},
}


def _sentences() -> dict[str, dict[Question, bool]]:
    steps = [Question("S", size(n), size(m), 0.0) for n, m in itertools.pairwise(PAPER_SIZES)]
    # The sentence on FM3 is asked of both readings of "cannot communicate".
    tolerated = {"FM1": 2, "FM2": 2, "FM3": 3, "FM3_send": 3, "FM4": 0}
    robust = {"FM1": 3, "FM2": 3, "FM3": 3, "FM3_send": 3, "FM4": 1}

    def faults(indicator: str, most: dict[str, int]) -> dict[Question, bool]:
        return {
            Question(indicator, NO_FAULT, fault(mode, m), 0.0): m <= most[mode]
            for mode in most
            for m in (1, 2, 3)
        }

    def changes(name: str, *, adaptable: bool) -> dict[Question, bool]:
        original, *changed = PAPER_PARAMETERS[name]
        before = parameter(name, original)
        return {Question("A", before, parameter(name, x), 0.0): adaptable for x in changed}

    return {
        "the swarm is scalable (S > 0) for all gaps tested from 5 to 100 robots": dict.fromkeys(
            steps[:-1], True
        ),
        "there will be a decrease in performance around 150 agents": {steps[-1]: False},
        "they will get a superscalable increase in performance if they increase to N = 40": {
            Question("S", size(30), size(40), 1.0): True
        },
        "going from 10 to 20 agents .. will therefore not be a superlinear increase": {
            Question("S", size(10), size(20), 1.0): False
        },
        "the swarm was fault tolerant (FT > 0) to FM1 and FM2 up to 2 robot failures, up to 3 "
        "failures for FM3 and not fault tolerant to any failures by FM4": faults("FT", tolerated),
        "the swarm was robust (R > 0) to 3 agent failures for FM1, FM2 and FM3, and robust to 1 "
        "agent failure for FM4": faults("R", robust),
        "the swarm is adaptable to a warehouse width from 0.5 to 2 m": changes(
            "warehouse_width", adaptable=True
        ),
        "also adaptable .. to an delivery area width from 0.2 to 0.05 m": changes(
            "delivery_width", adaptable=True
        ),
        "not adaptable to changing number of items in the warehouse from 60 items": changes(
            "n_items", adaptable=False
        ),
    }


PAPER = Reference(
    source="Milner, Sooriyabandara and Hauert, Swarm Performance Indicators, Tables I to III",
    performance=PAPER_PERFORMANCE,
    cells=tuple(setting for setting in PAPER_PERFORMANCE if setting not in NO_CELLS),
    sentences=_sentences(),
    whose=(
        "The claims are the paper's, of its own swarm. What is judged is the policy played here: "
        "swarm-dt is a re-implementation, some of whose constants were fitted to the same tables, "
        "and the paper does not give its number of runs. So a contradiction shows that the two "
        "differ, or that the paper's runs were too few; it does not show which."
    ),
)

_FOLDER = Path(__file__).parent / "preset_studies"
PRESETS = {path.stem: read_study_file(path) for path in sorted(_FOLDER.glob("*.toml"))}


def load_preset(name: str) -> Specification:
    """Return the preset study of that name.

    Raises:
        StudyError: there is none.
    """
    if name not in PRESETS:
        raise StudyError(f"no study preset {name!r}{suggest(name, PRESETS)}")
    return PRESETS[name]


def load_reference(name: str | None) -> Reference | None:
    """Return the reference of that name; None for none.

    Raises:
        StudyError: there is none of that name.
    """
    known = {"paper": PAPER}
    if name is not None and name not in known:
        raise StudyError(f"no reference {name!r}{suggest(name, known)}")
    return None if name is None else known[name]
