"""Prints what training on robustness gave beside the two arms without it, from their cards.

for seed in 0 1 2 3 4; do
    swarm-logistics train indicator --seed $seed --out arms/indicator-$seed
    swarm-logistics train indicator-arm-same-mix --seed $seed --out arms/same-mix-$seed
    swarm-logistics train indicator-arm-deliveries --seed $seed --out arms/deliveries-$seed
done
python docs/compare_arms.py arms
"""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy import stats

from swarm_logistics_env.policies import PolicyCard, read_card

ARMS = ("deliveries", "same-mix", "indicator")
MODES = ("FM1", "FM2", "FM3", "FM4")


def measures(card: PolicyCard) -> dict[str, float]:
    """Return P without faults, R of each mode at m = 2, and the mean of these R."""
    found = {
        "P": next(s.value for s in card.scores if s.measure == "P" and "no fault" in s.condition)
    }
    for mode in MODES:
        found[mode] = next(s.value for s in card.scores if s.measure == "R" and mode in s.condition)
    return {**found, "mean R": float(np.mean([found[mode] for mode in MODES]))}


def main(folder: Path) -> None:
    """Print the table and the paired differences over the seeds that two arms share."""
    arms: dict[str, dict[int, dict[str, float]]] = defaultdict(dict)
    for file in sorted(folder.glob("*/*.safetensors")):
        arm, _, seed = file.parent.name.rpartition("-")
        card = read_card(file)
        if card.scores:
            arms[arm][int(seed)] = measures(card)
    for arm in ARMS:
        means = {
            name: np.mean([measured[name] for measured in arms[arm].values()])
            for name in ("P", *MODES, "mean R")
        }
        shown = ", ".join(f"{name} {value:.3f}" for name, value in means.items())
        print(f"{arm} ({len(arms[arm])} seeds): {shown}")
    for other in ("same-mix", "deliveries"):
        seeds = sorted(arms["indicator"].keys() & arms[other].keys())
        for name in ("mean R", "P"):
            gains = [arms["indicator"][seed][name] - arms[other][seed][name] for seed in seeds]
            low, high = stats.ttest_1samp(gains, 0.0).confidence_interval()
            print(
                f"indicator - {other}, {name}: {np.mean(gains):+.3f} [{low:.3f}, {high:.3f}], "
                f"{len(seeds)} paired training seeds"
            )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
