"""The studies that come with the package."""

from __future__ import annotations

from swarm_logistics_env.errors import StudyError, suggest
from swarm_logistics_env.studies import paper
from swarm_logistics_env.studies.specification import (
    Ablation,
    Faults,
    Parameter,
    Sizes,
    Specification,
)

# Every indicator once, in under a minute on two cores at 4 seeds.
QUICK = Specification(
    name="quick",
    seeds=4,
    scenario={"duration": 300.0},
    sizes=(Sizes(values=(10, 25)),),
    faults=(
        Faults(modes=("FM4",), robots=(2,)),
        Faults(
            title="Faults in mid-run",
            modes=("FM4",),
            robots=(2,),
            onsets=(100.0,),
            scenario={"restock": True},
        ),
    ),
    parameters=(Parameter(name="delivery_width", values=(2.0, 1.0)),),
    ablations=(Ablation(policy="random-walk"),),
)

# Restock: with a finite store the rate falls towards the end, faults or not.
RESILIENCE = Specification(
    name="resilience",
    scenario={"duration": 2000.0, "restock": True},
    faults=(Faults(title="Faults in mid-run", modes=("FM1", "FM4", "dead"), onsets=(666.7,)),),
)

# What `judge module:Class` asks of every policy: the same conditions and seeds, so that its answers
# stand beside those of the shipped policies. Restock: nobody is capped. Seeds: nothing was fitted,
# trained or chosen on them.
SCORECARD = Specification(
    name="scorecard",
    seeds=10,
    first_seed=30_000,
    scenario={"restock": True},
    sizes=(Sizes(values=(10, 25, 50)),),
    faults=(Faults(modes=("FM1", "FM2", "FM3", "FM4"), robots=(1, 2, 3)),),
    parameters=(Parameter(name="delivery_width", values=(2.0, 1.0)),),
)


def presets() -> dict[str, Specification]:
    """Return the studies that come with the package, by name."""
    # Asked for anew each time, as a module attribute: a test may shorten it.
    return {study.name: study for study in (paper.SPECIFICATION, QUICK, RESILIENCE, SCORECARD)}


def load_preset(name: str) -> Specification:
    """Return the preset study of that name.

    Raises:
        StudyError: there is none.
    """
    known = presets()
    if name not in known:
        raise StudyError(f"no study preset {name!r}{suggest(name, known)}")
    return known[name]
