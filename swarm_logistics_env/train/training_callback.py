"""The callback between a training's updates: evaluate, write checkpoints."""

from __future__ import annotations

import csv
import math
import time
from dataclasses import dataclass, field
from pathlib import Path

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from swarm_logistics_env.policies.card import PolicyCard
from swarm_logistics_env.policies.learned import LearnedPolicy
from swarm_logistics_env.progress_bar import ProgressBar
from swarm_logistics_env.train.checkpoint import save_checkpoint
from swarm_logistics_env.train.evaluation import evaluate
from swarm_logistics_env.train.learner import linears, tensors_of
from swarm_logistics_env.train.network_view import NetworkView
from swarm_logistics_env.train.training import Training

CHECKPOINT_EVERY = 20.0  # seconds
CURVE = "curve.csv"


@dataclass
class TrainingLog:
    """What a training keeps beside the learner.

    Attributes:
        curve: of each evaluation "agent_steps", "seconds" of training and what was measured.
        seconds: trained before this session.
        versions: that it learned with last.
    """

    curve: list[dict[str, float]] = field(default_factory=list)
    seconds: float = 0.0
    versions: dict[str, str] | None = None


class TrainingCallback(BaseCallback):  # type: ignore[misc]  # not in the environment of the type check
    """Evaluates between updates, writes checkpoints, shows progress."""

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
        if (
            not curve
            or self.num_timesteps >= curve[-1]["agent_steps"] + self._training.evaluation.every
        ):
            self._evaluate()
        if time.monotonic() - self._saved_at >= CHECKPOINT_EVERY:
            self._save()

    def end(self) -> None:
        """Evaluate and save the policy at the end of the training."""
        if self._log.curve[-1]["agent_steps"] < self.num_timesteps:
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
        means = evaluate(
            LearnedPolicy(card, tensors), training.scenario, training.evaluation, training.threads
        ).means()
        seconds = round(self._before + time.monotonic() - self._start, 1)
        log.curve.append({"agent_steps": self.num_timesteps, "seconds": seconds, **means})
        for name, value in means.items():
            self.logger.record(f"evaluation/{name}", value)
        self._progress_bar.say(", ".join(f"{n} = {value:.4g}" for n, value in means.items()))
        path = self._out / CURVE
        part = path.with_name(f"{CURVE}.part")
        with part.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, log.curve[0])
            writer.writeheader()
            writer.writerows(log.curve)
        part.replace(path)
