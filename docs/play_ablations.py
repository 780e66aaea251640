"""What the recipe of `ppo-robust` owes to its parts: `python docs/play_ablations.py`.

Trains the recipe at half of its agent-steps, whole and without one part at a time, three times
each (two hours of one core), plays all of them, and writes a table into docs/training.md. What is
trained and played is kept in results/ablations, and the same command goes on after an interruption.
"""

import multiprocessing
import os
import re
import shutil
from concurrent.futures import ProcessPoolExecutor
from itertools import product

import torch
from stable_baselines3.common.callbacks import BaseCallback
from tables import ROOT, rewrite, seeds_from, table

from swarm_logistics_env.motion.frame import INPUTS
from swarm_logistics_env.report import section
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.studies import Study
from swarm_logistics_env.train.trainer import train
from swarm_logistics_env.train.training import load_training
from swarm_logistics_env.verdicts.results import StudyResults

OUT = ROOT / "results" / "ablations"
AGENT_STEPS, TRAININGS = 16_000_000, 3
FAULT_INPUTS = ("failed", "stuck", "cannot_deliver", "cannot_lift", "delivering_in_vain")
MEMORY = (
    *FAULT_INPUTS, "requested_recently_held", "home_along", "home_aside", "home_certainty",
    "kept_home_along", "kept_home_aside", "kept_home_distance",
)  # fmt: skip
WITHOUT: dict[str, tuple[str, ...]] = {
    "whole": (), "without-memory": MEMORY, "without-fault-inputs": FAULT_INPUTS,
    "without-stocking": (),
}  # fmt: skip


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


def train_one(seed: int, name: str) -> None:
    """Train one variant from one seed, or go on with it, into OUT/NAME@SEED.safetensors."""
    recipe = load_training("robust")
    rewards = {"stocking": 0.0} if name == "without-stocking" else {}
    training = recipe.replace(
        name=f"{name}-{seed}",
        agent_steps=AGENT_STEPS,
        seed=seed,
        threads=1,
        rewards=recipe.rewards | rewards,
        scores=recipe.scores.replace(seeds=0),
    )
    path = train(training, OUT / training.name, callbacks=[WithoutInputs(WITHOUT[name])])
    shutil.copyfile(path, OUT / f"{name}@{seed}.safetensors")


def study() -> Study:
    """Return the study of all variants: every training over the same seeds."""
    return Study(
        name="ablations",
        policies=[f"{OUT / name}@all.safetensors" for name in WITHOUT],
        seeds=10,
        first_seed=430_000,
        scenario=Scenario(restock=True),
        faults=[
            {"modes": ["FM1", "FM2", "FM3", "FM4"], "robots": [3]},
            {"modes": ["dead"], "robots": [2], "onsets": [250.0], "title": "dies after 250 s"},
        ],
        out=OUT / "study",
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


def main() -> None:
    """Train what is missing, a training a core, then play all and write the table."""
    cores = len(os.sched_getaffinity(0))
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(cores, mp_context=context) as pool:
        list(pool.map(train_one, *zip(*product(range(TRAININGS), WITHOUT))))
    ablations = study()
    ablations.run(processes=cores)
    rewrite(ROOT / "docs" / "training.md", {"ablations": block(ablations.findings())})


if __name__ == "__main__":
    main()
