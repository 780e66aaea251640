"""What all learners share: worlds, rewards, PPO's settings, the curve, the policy file and the row.

Each learner writes results/interop/NAME.csv, its curve, NAME.safetensors, a policy file for
`swarm-logistics judge`, and NAME.json, its row; NAME is "LEARNER-WORLD@SEED".
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import distributions
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, spi, swarm_logistics_v0
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.core.records import atomic_write
from swarm_logistics_env.policies.files import write_policy
from swarm_logistics_env.policies.learned import LearnedPolicy, Network, PolicyCard
from swarm_logistics_env.study.report.section import bracketed
from swarm_logistics_env.train.evaluation import performances, versions
from swarm_logistics_env.world.motion import INPUTS, OUTPUTS
from swarm_logistics_env.wrappers import MotionFrame

RESULTS = Path(__file__).parents[1] / "results" / "interop"

# As `interop/swarm_logistics/*.yaml` has them for BenchMARL: the paper's robots, items come back.
WORLDS = {
    "small": Scenario(
        n_robots=10, warehouse_width=6.0, warehouse_height=5.0, delivery_width=1.5, n_items=8,
        duration=200.0, restock=True,
    ),
    "paper": Scenario(restock=True),
}  # fmt: skip
REWARDS = {
    "own_delivery": 0.5, "delivery": 0.5, "lift_requested": 0.3, "approach": 0.1, "stocking": 0.15,
    "contact": -0.05,
}  # fmt: skip
AGENT_STEPS = {"small": 2_000_000, "paper": 4_000_000}
N_WORLDS = {"small": 12, "paper": 5}

SEEDS = range(700_000, 700_020)  # of the row: no training has them
CURVE_SEEDS = range(600_000, 600_004)
POINTS = 16  # of a curve
MODES = ("FM1", "FM2", "FM3", "FM4", "FM4_jam")  # that the recipe `robust` trains with
FAULTY = 3  # robots that fail

Tensors = Mapping[str, NDArray[np.float32]]
LIBRARIES = ("torchrl", "benchmarl")


class Settings(NamedTuple):
    """Of PPO, the same for all; one network, of which every robot is a row."""

    hidden: tuple[int, ...] = (128, 64)
    n_steps: int = 128  # of control between updates, in every world
    n_minibatches: int = 32  # parts of the batch of all robots' steps
    epochs: int = 4
    learning_rate: float = 1e-3  # at the start; it falls linearly to 0
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip: float = 0.2
    max_grad_norm: float = 0.5
    deviation: float = 0.5  # of the outputs' noise at the start; learned, the same for all states
    along: float = 0.8  # the first output of an untrained network, which therefore drives ahead


SETTINGS = Settings()


def make_env(scenario: Scenario) -> MotionFrame:
    """Return a world to learn in: rows of 95 inputs, 3 outputs within -1 and 1, shaped rewards."""
    return MotionFrame(swarm_logistics_v0.parallel_env(scenario, rewards=REWARDS))


def drive_ahead(parts: Sequence[torch.nn.Parameter]) -> None:
    """Let an untrained network, weight and bias of each layer in turn, drive ahead."""
    with torch.no_grad():
        parts[-2].mul_(0.01)
        parts[-1].zero_()
        parts[-1][0] = SETTINGS.along


def tensors_of(parts: Sequence[torch.Tensor], deviations: torch.Tensor) -> Tensors:
    """Return the tensors of a policy file, float32; of the last layer three outputs count."""
    named = {
        f"layers.{index // 2}.{'bias' if index % 2 else 'weight'}": part
        for index, part in enumerate(parts)
    }
    for name in list(named)[-2:]:
        named[name] = named[name][: len(OUTPUTS)]
    arrays = {**named, "deviations": deviations}
    return {name: part.detach().numpy().copy() for name, part in arrays.items()}


class Learning:
    """One learner in one world at one seed; `agent_steps` None: as many as the world asks for."""

    def __init__(self, learner: str, world: str, seed: int, agent_steps: int | None = None) -> None:
        self.learner, self.world, self.seed = learner, world, seed
        self.scenario, self.n_worlds = WORLDS[world], N_WORLDS[world]
        self.rows = self.n_worlds * self.scenario.n_robots
        batch = self.rows * SETTINGS.n_steps
        self.updates = max(1, (agent_steps or AGENT_STEPS[world]) // batch)
        self.agent_steps = self.updates * batch
        self.name = f"{learner}-{world}@{seed}"
        self._curve: list[dict[str, float]] = []
        self._seconds, self._since = 0.0, time.process_time()

    def left(self, agent_steps: int) -> float:
        """Return the share of the training that is left, 1 to 0: the learning rate's factor."""
        return max(0.0, 1.0 - agent_steps / self.agent_steps)

    def tell(self, agent_steps: int, tensors: Callable[[], Tensors]) -> None:
        """Add a point to the curve where one is due; the processor's time counts without it."""
        if agent_steps < len(self._curve) * self.agent_steps / POINTS:
            return
        self._seconds += time.process_time() - self._since
        p = self._played(tensors(), [()], CURVE_SEEDS)[0].mean()
        minutes = round(self._seconds / 60, 2)
        self._curve.append({"agent_steps": agent_steps, "cpu_minutes": minutes, "P": float(p)})
        RESULTS.mkdir(parents=True, exist_ok=True)
        with atomic_write(RESULTS / f"{self.name}.csv", SetupError) as part:
            pd.DataFrame(self._curve).to_csv(part, index=False, lineterminator="\r\n")
        print(f"{self.name}: {agent_steps:,} agent-steps, {minutes} CPU minutes, P {p:.1f}")
        self._since = time.process_time()

    def end(self, tensors: Tensors) -> dict[str, Any]:
        """Measure the row, write it with the policy file, print it and return it."""
        self.tell(self.agent_steps, lambda: tensors)
        write_policy(RESULTS / f"{self.name}.safetensors", self._card(), tensors)
        kinds = [(), *((Fault(mode, FAULTY),) for mode in MODES)]
        p_o, *p_f = self._played(tensors, kinds, SEEDS).tolist()
        row = {
            "learner": self.learner,
            "world": self.world,
            "seed": self.seed,
            "agent_steps": self.agent_steps,
            "cpu_minutes": self._curve[-1]["cpu_minutes"],
            "P": p_o,
            "P_F": dict(zip(MODES, p_f)),
            "settings": SETTINGS._asdict(),
            "versions": self._card().versions,
        }
        with atomic_write(RESULTS / f"{self.name}.json", SetupError) as part:
            part.write_text(json.dumps(row, indent=1) + "\n", encoding="utf-8")
        print(f"{self.name}: P {bracketed(spi.mean_interval(p_o), 1)} on {len(SEEDS)} new seeds")
        return row

    def _played(
        self, tensors: Tensors, kinds: Sequence[Sequence[Fault]], seeds: range
    ) -> NDArray[np.float64]:
        policy = LearnedPolicy(self._card(), tensors)
        return performances(policy, self.scenario, kinds, seeds)

    def _card(self) -> PolicyCard:
        libraries = {each.name: each.version for each in distributions() if each.name in LIBRARIES}
        return PolicyCard(
            name=self.name,
            about=f"{self.learner} from nothing in the {self.world} world, see interop/.",
            network=Network(inputs=INPUTS, hidden=SETTINGS.hidden, exploration=1.0),
            versions=versions() | libraries,
            scenario=self.scenario.model_dump(mode="json", exclude_defaults=True),
            seed=self.seed,
            agent_steps=self.agent_steps,
        )


def main(learn: Callable[[Learning], Tensors], learners: Sequence[str]) -> None:
    """Read the command line, learn as it asks (the first learner if none), and write the row."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--learner", choices=learners, default=learners[0])
    parser.add_argument("--world", choices=list(WORLDS), default="small")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--agent-steps", type=int)
    options = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(options.seed)
    learning = Learning(options.learner, options.world, options.seed, options.agent_steps)
    learning.end(learn(learning))
