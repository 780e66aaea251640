"""What a training keeps on its way: measurements, the best policy so far, and checkpoints."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback

from swarm_logistics_env.core.errors import TrainingError
from swarm_logistics_env.core.progress_bar import ProgressBar
from swarm_logistics_env.core.records import atomic_write
from swarm_logistics_env.policies import Policy, load
from swarm_logistics_env.policies.files import write_policy
from swarm_logistics_env.policies.learned import LearnedPolicy, PolicyCard
from swarm_logistics_env.study.report.drawing import COLOURS, INK, MARKERS, WIDTH, images
from swarm_logistics_env.train.evaluation import evaluate
from swarm_logistics_env.train.learner import check_learner, pull_by, save_checkpoint, tensors_of
from swarm_logistics_env.train.settings import Teaching
from swarm_logistics_env.train.training import Training

CHECKPOINT_EVERY = 20.0  # seconds
CURVE = "curve.csv"
BEST = "best.safetensors"  # the policy as it was at the best evaluation
REFERENCES = ("swarm-dt", "homing")  # scripted policies that a training is shown beside


@dataclass
class TrainingLog:
    """What a training keeps beside the learner.

    Attributes:
        curve: of each evaluation "agent_steps", "seconds" of training (wall clock), "cpu_seconds"
            of the processor for collecting and updating alone, and what was measured.
        references: name of a scripted policy -> what it measures on the same seeds.
        seconds: trained before this session (wall clock).
        cpu_seconds: processor time of collecting and updating so far [s].
        versions: that it learned with last.
        start: the digest of the weights that it began with; empty: untrained ones.
    """

    curve: list[dict[str, float]] = field(default_factory=list)
    references: dict[str, dict[str, float]] = field(default_factory=dict)
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    versions: dict[str, str] = field(default_factory=dict)
    start: str = ""

    @property
    def best(self) -> dict[str, float]:
        """The evaluation with the highest P, the earliest of equals."""
        return max(self.curve, key=lambda row: row["P"])

    def sentence(self, means: Mapping[str, float]) -> str:
        """Return what was measured, each beside that of the scripted policies."""
        parts = []
        for name, value in means.items():
            references = [
                f"{policy} {measured[name]:.4g}"
                for policy, measured in self.references.items()
                if name in measured
            ]
            part = f"{name} = {value:.4g}"
            parts.append(f"{part} ({', '.join(references)})" if references else part)
        return ", ".join(parts)

    def write(self, directory: Path) -> None:
        """Write curve.csv, whole or not at all."""
        from pandas import DataFrame

        with atomic_write(directory / CURVE, TrainingError) as part:
            DataFrame(self.curve).to_csv(part, index=False, na_rep="nan")

    def draw(self, picture: Path, title: str, seeds: int) -> None:
        """Draw P over agent-steps as a PNG, with a line for each scripted policy."""
        steps = [row["agent_steps"] / 1e6 for row in self.curve]
        p = [row["P"] for row in self.curve]

        def curve(canvas: Any) -> None:
            axes = canvas.subplots()
            axes.plot(steps, p, MARKERS[0] + "-", color=COLOURS[0])
            for name, measured in self.references.items():
                axes.axhline(measured["P"], color=INK, linestyle="--", linewidth=0.8)
                axes.annotate(name, (steps[-1], measured["P"]), ha="right", va="bottom")
            y_label = f"P, mean over {seeds} seeds [items]"
            axes.set(title=title, xlabel="million agent-steps", ylabel=y_label, ylim=(0.0, None))

        with atomic_write(picture, TrainingError) as part:
            part.write_bytes(images(curve, 0.62 * WIDTH).png)


class TrainingCallback(BaseCallback):  # type: ignore[misc]  # not in the environment of the type check
    """Evaluates and writes checkpoints between updates."""

    def __init__(
        self, training: Training, log: TrainingLog, out: Path, progress: ProgressBar
    ) -> None:
        super().__init__()
        self._training = training
        self._log = log
        self._out = out
        self._progress = progress
        self._saved_at = -math.inf

    def _on_training_start(self) -> None:
        log = self._log
        log.references = log.references or {name: self._measure(load(name)) for name in REFERENCES}
        self._start = time.monotonic() - log.seconds
        self._cpu = time.process_time()

    def _on_step(self) -> bool:
        self._progress.reach(self.num_timesteps)
        return True

    def _on_rollout_start(self) -> None:
        check_learner(self.model)
        self._log.cpu_seconds += time.process_time() - self._cpu
        progress = self.num_timesteps / self._training.agent_steps
        if self._training.final_rewards:
            self.model.env.change_rewards(self._training.rewards_at(progress))
        if not self._training.network.says_classes:
            floor = self._training.ppo.floor(progress)
            with torch.no_grad():
                self.model.policy.log_std.clamp_(min=math.log(floor))
        self._warm_up()
        if self._training.teacher is not None:
            self._follow_teacher(self._training.teacher, progress)
        curve = self._log.curve
        due = curve[-1]["agent_steps"] + self._training.evaluation.every if curve else 0
        if self.num_timesteps >= due:
            self._evaluate()
        if time.monotonic() - self._saved_at >= CHECKPOINT_EVERY:
            self._save()
        self._cpu = time.process_time()

    def _warm_up(self) -> None:
        """Let the value network learn alone for a while, where the actor can do something."""
        training = self._training
        if training.start is None and training.teacher is None:
            return
        n_updates = self.num_timesteps // (training.rows * training.ppo.n_steps)
        for parameter in self.model.policy.actor_parameters():
            parameter.requires_grad_(n_updates >= training.ppo.warm_up)

    def _follow_teacher(self, teaching: Teaching, progress: float) -> None:
        """Let the teacher pull, or go."""
        pull = teaching.pull_at(progress)
        pull_by(self.model, pull, self._training.ppo)
        if pull == 0.0:
            self.model.env.teacher = None

    def _on_rollout_end(self) -> None:
        training = self._training
        ppo = self._training.ppo
        done = self.num_timesteps / training.agent_steps
        before = done - training.rows * ppo.n_steps / training.agent_steps
        if ppo.restarts_before(before) < ppo.restarts_before(done):
            # From here on it is as a training that begins with these weights.
            self.model.policy.optimizer.state.clear()
            self.model._last_obs = self.model.env.reset()
            self.model._last_episode_starts = np.ones(training.rows, np.bool_)

    def _on_training_end(self) -> None:
        check_learner(self.model)
        self._log.cpu_seconds += time.process_time() - self._cpu
        if self._log.curve[-1]["agent_steps"] < self.num_timesteps:
            self._evaluate()
        self._save()

    def _save(self) -> None:
        self._log.seconds = time.monotonic() - self._start
        save_checkpoint(self._out, self.model, self._log)
        self._saved_at = time.monotonic()

    def _measure(self, policy: Policy) -> dict[str, float]:
        training = self._training
        return evaluate(policy, training.evaluation_scenario, training.evaluation, training.threads)

    def _evaluate(self) -> None:
        log = self._log
        tensors = tensors_of(self.model.policy)
        card = card_of(self._training, self.num_timesteps, log)
        means = self._measure(LearnedPolicy(card, tensors))
        row = {
            "agent_steps": self.num_timesteps,
            "seconds": round(time.monotonic() - self._start, 1),
            "cpu_seconds": round(log.cpu_seconds, 1),
            **means,
        }
        log.curve.append(row)
        for name, value in means.items():
            self.logger.record(f"evaluation/{name}", value)
        self._progress.say(log.sentence(means))
        log.write(self._out)
        if log.best is log.curve[-1]:
            write_policy(self._out / BEST, card, tensors)


def card_of(
    training: Training, agent_steps: int, log: TrainingLog, command: str = ""
) -> PolicyCard:
    """Return the card of a policy as it is after so many agent-steps."""
    return PolicyCard(
        name=training.name,
        about=training.about,
        network=training.network,
        command=command,
        versions=log.versions | ({"start": log.start} if log.start else {}),
        scenario=training.evaluation_scenario.model_dump(mode="json", exclude_defaults=True),
        training=training.model_dump(mode="json", exclude_defaults=True),
        seed=training.seed,
        agent_steps=agent_steps,
    )
