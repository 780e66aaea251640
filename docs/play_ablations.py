"""What the recipes owe to their parts: `python docs/play_ablations.py`.

Two ablations, three trainings of each variant (three hours and a half of one core):

* `parts`: the recipe of `ppo-robust` at half of its agent-steps, whole and without one part.
* `half-reward`: the recipe of `ppo-indicator`, but a delivery always pays the team half. It tells
  what that recipe owes to R from what it owes to a smaller pay.

Plays all of them and writes two tables into docs/training.md. What is trained and played stays in
results/ablations, and the same command goes on after an interruption. `--only half-reward` does
one of the two.
"""

import multiprocessing
import os
import re
import shutil
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from typing import Any, NamedTuple

import torch
import typer
from stable_baselines3.common.callbacks import BaseCallback
from tables import ROOT, rewrite, seeds_from, table

from swarm_logistics_env.motion import INPUTS
from swarm_logistics_env.report import section
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.studies import Study
from swarm_logistics_env.train.trainer import train
from swarm_logistics_env.train.training import load_training
from swarm_logistics_env.verdicts.results import StudyResults

OUT = ROOT / "results" / "ablations"
TRAININGS = 3
FAULT_INPUTS = ("failed", "stuck", "cannot_deliver", "cannot_lift", "delivering_in_vain")
MEMORY = (
    *FAULT_INPUTS, "requested_recently_held", "home_along", "home_aside", "home_certainty",
    "kept_home_along", "kept_home_aside", "kept_home_distance",
)  # fmt: skip


class Variant(NamedTuple):
    """A recipe with one part changed."""

    recipe: str = "robust"
    agent_steps: int = 16_000_000  # half of the recipe's
    inputs_without: tuple[str, ...] = ()
    changes: Mapping[str, Any] = {}  # of the training's fields
    rewards: Mapping[str, float] = {}  # of the task reward's weights


PARTS = {
    "whole": Variant(),
    "without-memory": Variant(inputs_without=MEMORY),
    "without-fault-inputs": Variant(inputs_without=FAULT_INPUTS),
    "without-stocking": Variant(rewards={"stocking": 0.0}),
}
# ppo-indicator pays the team .25 for a delivery of a sound swarm, .5 with a failed robot.
HALF_REWARD = {
    "half-reward": Variant(
        "indicator", 32_000_000, changes={"indicators": None}, rewards={"delivery": 0.25}
    )
}
VARIANTS = {**PARTS, **HALF_REWARD}
CONDITIONS = [
    {"modes": ["FM1", "FM2", "FM3", "FM4", "FM4_jam"], "robots": [3]},
    {"modes": ["dead"], "robots": [2], "onsets": [250.0], "title": "dies after 250 s"},
]


class WithoutInputs(BaseCallback):  # type: ignore[misc]  # not in the environment of the type check
    """Keeps the weights of some inputs at zero, in the network that decides and in the critic."""

    def __init__(self, names: tuple[str, ...]) -> None:
        super().__init__()
        self._columns = [INPUTS.index(name) for name in names]

    def _on_training_start(self) -> None:
        networks = self.model.policy.mlp_extractor
        for first in (networks.policy_net[0], networks.value_net[0]):
            mask = torch.ones_like(first.weight)
            mask[:, self._columns] = 0.0
            with torch.no_grad():
                first.weight.mul_(mask)
            # With a gradient of zero, Adam leaves a weight where it is.
            first.weight.register_hook(mask.mul)

    def _on_step(self) -> bool:
        return True


def train_variant(seed: int, name: str) -> None:
    """Train a variant from a seed, or go on with it, into OUT/NAME@SEED.safetensors."""
    variant = VARIANTS[name]
    recipe = load_training(variant.recipe)
    training = recipe.replace(
        name=f"{name}-{seed}",
        agent_steps=variant.agent_steps,
        seed=seed,
        threads=1,
        rewards=recipe.rewards | dict(variant.rewards),
        scores=recipe.scores.replace(seeds=0),
        **variant.changes,
    )
    callbacks = [WithoutInputs(variant.inputs_without)]
    path = train(training, OUT / training.name, callbacks=callbacks)
    shutil.copyfile(path, OUT / f"{name}@{seed}.safetensors")


def study(ablation: str) -> Study:
    """Return the study of an ablation's variants: every training over the same seeds."""
    trained = [f"{OUT / name}@all.safetensors" for name in ABLATIONS[ablation]]
    shipped = ["ppo-indicator@all"] if ablation == "half-reward" else []
    return Study(
        name=ablation,
        policies=[*shipped, *trained],
        seeds=10,
        first_seed=430_000,
        scenario=Scenario(restock=True),
        faults=CONDITIONS,
        out=OUT / f"study-{ablation}",
    )


def block(results: StudyResults) -> str:
    """Return a row for each variant: P without a fault and in every condition."""
    # Runs with robots removed, and those with further behaviour seeds, are FT's alone.
    settings = dict.fromkeys(cell.arm.setting for cell in results.cells)
    shown = [s for s in settings if not re.match("removed|.*behaviour seeds", str(s))]
    cells = {(cell.policy, cell.arm.setting): cell for cell in results.cells}
    rows = [
        (policy, *(section.mean_p(cells[policy, setting]) for setting in shown))
        for policy in results.policies
    ]
    return table(("", *shown), rows, f"{seeds_from(results)}, of each training.")


ABLATIONS = {"parts": PARTS, "half-reward": HALF_REWARD}


def main(only: str | None = None) -> None:
    """Train what is missing, a training a core, then play all and write the tables."""
    cores = len(os.sched_getaffinity(0))
    context = multiprocessing.get_context("spawn")
    for ablation, variants in ABLATIONS.items():
        if only in (None, ablation):
            with ProcessPoolExecutor(cores, mp_context=context) as pool:
                list(pool.map(train_variant, *zip(*product(range(TRAININGS), variants))))
            variants_study = study(ablation)
            variants_study.run(processes=cores)
            blocks = {f"ablation {ablation}": block(variants_study.findings())}
            rewrite(ROOT / "docs" / "training.md", blocks)


if __name__ == "__main__":
    typer.run(main)
