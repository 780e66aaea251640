"""The callback between a training's updates: evaluate, keep the best, write checkpoints."""

from __future__ import annotations

import csv
import math
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from swarm_logistics_env.policies.card import PolicyCard
from swarm_logistics_env.policies.learned import LearnedPolicy
from swarm_logistics_env.train.checkpoint import save_checkpoint
from swarm_logistics_env.train.evaluation import Evaluated, evaluate
from swarm_logistics_env.train.learner import linears, tensors_of
from swarm_logistics_env.train.network_view import NetworkView
from swarm_logistics_env.train.progress_bar import ProgressBar
from swarm_logistics_env.train.training import Training

CHECKPOINT_EVERY = 20.0  # seconds
CURVE = "curve.csv"


@dataclass
class TrainingLog:
    """What a training keeps beside the learner.

    Attributes:
        curve: (agent-steps, seconds of training, what was measured) of each evaluation.
        best: score and tensors of the best policy so far.
        seconds: trained before this session.
        versions: that it learned with last.
    """

    curve: list[tuple[int, float, Evaluated]] = field(default_factory=list)
    best: tuple[float, dict[str, NDArray[np.float32]]] | None = None
    seconds: float = 0.0
    versions: dict[str, str] | None = None


class TrainingCallback(BaseCallback):  # type: ignore[misc]  # not in the environment of the type check
    """Evaluates between updates, keeps the best policy, writes checkpoints, shows progress."""

    def __init__(
        self, training: Training, view: NetworkView, log: TrainingLog, out: Path, bar: ProgressBar
    ) -> None:
        super().__init__()
        self._training, self._view, self._log = training, view, log
        self._out, self._progress_bar = out, bar
        self._start, self._saved_at = time.monotonic(), -math.inf
        self._before = log.seconds

    def _on_step(self) -> bool:
        self._progress_bar.reach(self.num_timesteps)
        return True

    def _on_rollout_start(self) -> None:
        is_free = self.model._n_updates >= self._training.ppo.value_warmup * self.model.n_epochs
        policy = self.model.policy
        for layer in linears(policy):
            layer.requires_grad_(is_free)
        policy.log_std.requires_grad_(is_free)
        floor = self._training.ppo.floor(self.num_timesteps / self._training.agent_steps)
        with torch.no_grad():
            policy.log_std.clamp_(min=math.log(floor))
        curve = self._log.curve
        if not curve or self.num_timesteps >= curve[-1][0] + self._training.evaluation.every:
            self._evaluate()
        if time.monotonic() - self._saved_at >= CHECKPOINT_EVERY:
            self._save()

    def end(self) -> None:
        """Evaluate and save the policy at the end of the training."""
        if self._log.curve[-1][0] < self.num_timesteps:
            self._evaluate()
        self._save()

    def _save(self) -> None:
        learner: PPO = self.model
        self._log.seconds = self._before + time.monotonic() - self._start
        save_checkpoint(self._out, learner, self._view, self._log)
        self._saved_at = time.monotonic()

    def _evaluate(self) -> None:
        training, log = self._training, self._log
        tensors = tensors_of(self.model.policy)
        card = PolicyCard(name=training.name, network=training.network)
        found = evaluate(
            LearnedPolicy(card, tensors), training.scenario, training.evaluation, training.threads
        )
        seconds = self._before + time.monotonic() - self._start
        log.curve.append((self.num_timesteps, seconds, found))
        value = _score(found, log.curve[0][2])
        if log.best is None or value > log.best[0]:
            log.best = (value, tensors)
        self.logger.record("evaluation/P", found.performance)
        for mode, robustness in found.robustness.items():
            self.logger.record(f"evaluation/R_{mode}", robustness)
            self.logger.record(f"evaluation/P_{mode}", found.under_faults[mode])
        self._progress_bar.say(str(found))
        _write_curve(self._out / CURVE, log)


def _score(found: Evaluated, first: Evaluated) -> float:
    pairs = [(found.performance, first.performance)]
    pairs += [(p, first.under_faults[mode]) for mode, p in found.under_faults.items()]
    return math.fsum(p / max(p_first, 1.0) for p, p_first in pairs) / len(pairs)


def _write_curve(path: Path, log: TrainingLog) -> None:
    modes = list(log.curve[0][2].robustness)
    part = path.with_name(f"{path.name}.part")
    with part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        names = [name for mode in modes for name in (f"P_{mode}", f"R_{mode}")]
        writer.writerow(["agent_steps", "seconds", "P", *names])
        for steps, seconds, found in log.curve:
            values = [v for m in modes for v in (found.under_faults[m], found.robustness[m])]
            writer.writerow([steps, f"{seconds:.1f}", found.performance, *values])
    part.replace(path)
