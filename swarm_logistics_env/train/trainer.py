"""A training from its specification to the policy file."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure

from swarm_logistics_env.core.errors import SwarmLogisticsError, TrainingError
from swarm_logistics_env.core.progress_bar import ProgressBar
from swarm_logistics_env.core.records import atomic_write, read_table, remove_parts
from swarm_logistics_env.policies import Policy, load
from swarm_logistics_env.policies.files import read_policy, write_policy
from swarm_logistics_env.policies.learned import LearnedPolicy, PolicyCard
from swarm_logistics_env.policies.policy import one_thread
from swarm_logistics_env.study.report.drawing import COLOURS, INK, MARKERS, WIDTH, images
from swarm_logistics_env.train.evaluation import evaluate, evaluate_score, versions
from swarm_logistics_env.train.imitation import imitate
from swarm_logistics_env.train.learner import (
    check_learner,
    device_of,
    make_learner,
    pull_by,
    read_checkpoint,
    restore,
    save_checkpoint,
    tensors_of,
)
from swarm_logistics_env.train.settings import Teaching
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.train.training_worlds import NetworkView

RECORD = "training.json"  # of how it was made
# Fields that may change when a training goes on, because they change nothing of what was done.
MAY_CHANGE = frozenset({"about", "threads", "scores", "keep"})
CHECKPOINT_EVERY = 20.0  # seconds
CURVE = "curve.csv"
PICTURE = "curve.png"
BEST = "best.safetensors"  # the policy as it was at the best evaluation
REFERENCES = ("swarm-dt", "homing")  # scripted policies that a training is shown beside


def train(
    training: Training,
    out: str | Path,
    *,
    command: str = "",
    device: str | None = None,
    callbacks: Sequence[BaseCallback] = (),
) -> Path:
    """Train a policy, or go on with it, and return the path of its file.

    What is in `out` afterwards: the policy file NAME.safetensors, as it was at the end, and
    best.safetensors, as it was when it measured the highest P, which `keep` may make the former
    as well; training.json, how it was made;
    curve.csv and curve.png, what was measured on the way (see `TrainingLog`); tensorboard/;
    scores/, the study behind the card; and the checkpoint, from which the same call goes on after a
    crash. The result is the same, bit by bit, as without one (on a CPU).

    Args:
        out: directory of this training.
        command: the command line that asks for it, for the card.
        device: "cpu" or "cuda"; None: the GPU where there is one.
        callbacks: of stable-baselines3, played beside its own; what they keep is in no checkpoint.
            One that returns False ends this call; the next one goes on.

    Raises:
        TrainingError: the directory holds another training or cannot be used, there is no such
            device, or `callbacks` are none; or a number is not finite any more, see `_explain_end`.
        SetupError, ScenarioError, FaultError: worlds that cannot be.
    """
    out = Path(out)
    # Everything that may be refused comes first, before anything is written.
    if not all(isinstance(callback, BaseCallback) for callback in callbacks):
        raise TrainingError(
            f"callbacks = {callbacks!r}: should be a list of callbacks of stable-baselines3"
        )
    device = device_of(device)
    view = NetworkView(training)
    with _explain_disk_errors(out), one_thread():
        enter_directory(out, training, command)
        return _train(training, out, command, device, view, callbacks)


def enter_directory(directory: Path, training: Training, command: str) -> None:
    """Make the directory of a training, or enter it to go on; note when and by what.

    Raises:
        TrainingError: it cannot be written, or holds another training.
    """
    path = directory / RECORD
    specification = training.model_dump(mode="json")
    sessions: list[dict[str, Any]] = []
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TrainingError(f"cannot write to {directory}: {error.strerror}") from error
    if path.exists():
        record = read_table(path, "record of a training", TrainingError)
        recorded, sessions = record.get("training", {}), record.get("sessions", [])
        if not isinstance(recorded, dict) or not isinstance(sessions, list):
            raise TrainingError(f"{path} is damaged: should be as it was written, or --out another")
        differing = sorted(
            name
            for name, value in specification.items()
            if name not in MAY_CHANGE and recorded.get(name) != value
        )
        if differing:
            raise TrainingError(
                f"{directory} holds a training with another {', '.join(differing)}: should be the "
                "same to go on, or --out another directory"
            )
    began = datetime.now(UTC).isoformat(timespec="seconds")
    sessions.append({"began": began, "versions": versions()})
    with remove_parts(directory), atomic_write(path, TrainingError) as part:
        record = {"command": command, "training": specification, "sessions": sessions}
        part.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")


def _train(
    training: Training,
    out: Path,
    command: str,
    device: str,
    view: NetworkView,
    callbacks: Sequence[BaseCallback],
) -> Path:
    """Train a policy, or go on with it, and return the path of its file; see `train`."""
    state = read_checkpoint(out)
    learner = make_learner(view, training.network, training.ppo, training.seed, device)
    learner.set_logger(configure(str(out / "tensorboard"), ["tensorboard"]))
    log = TrainingLog() if state is None else state["log"]
    if state is not None:
        restore(learner, state)
    if learner.num_timesteps < training.agent_steps:
        with _explain_end(training, out, learner, log):
            if state is None:
                imitate(training, learner, log)
            _learn(training, out, learner, log, callbacks)
    learner.env.close()
    evaluation = training.evaluation
    log.draw(out / PICTURE, f"{training.name}, N = {evaluation.n_robots}", evaluation.seeds)
    n_steps = learner.num_timesteps
    tensors = tensors_of(learner.policy)
    if training.keep == "best":
        best = read_policy(out / BEST)
        n_steps = best.card.agent_steps
        tensors = best.tensors
    card = _card(training, n_steps, log, command)
    path = out / f"{training.name}.safetensors"
    # The file is written before the scores are measured, which takes minutes.
    write_policy(path, card, tensors)
    scenario = training.scenario.replace(n_robots=training.scores.n_robots)
    scores = evaluate_score(path, scenario, training.scores, training.threads)
    if scores:
        write_policy(path, card.replace(scores=scores, scored_with=versions()), tensors)
    return path


def _learn(
    training: Training, out: Path, learner: Any, log: TrainingLog, callbacks: Sequence[BaseCallback]
) -> None:
    """Learn until the training's last agent-step."""
    log.versions = versions()
    total = training.agent_steps
    n_learned = learner.num_timesteps
    with ProgressBar(training.name, total, "agent-steps", done=n_learned) as progress:
        callback = TrainingCallback(training, log, out, progress)
        learner.learn(total - n_learned, [callback, *callbacks], reset_num_timesteps=False)


@contextmanager
def _explain_disk_errors(out: Path) -> Iterator[None]:
    """Raise a TrainingError that says how to go on where the disk is full or gone."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or error
        raise TrainingError(
            f"the training in {out} stopped ({reason}): the same command goes on from its last "
            "checkpoint"
        ) from error


@contextmanager
def _explain_end(training: Training, out: Path, learner: Any, log: TrainingLog) -> Iterator[None]:
    """Raise a TrainingError that says at which step a training ended, why, and what is kept."""
    try:
        yield
    except TrainingError:  # of the disk
        raise
    except (FloatingPointError, SwarmLogisticsError) as error:
        policy_kept = "no policy is kept, as none was measured"
        if log.curve:
            steps = log.best["agent_steps"]
            policy_kept = f"kept is {BEST}, with P = {log.best['P']:.4g} at {steps:,} agent-steps"
        remedy = "mend that, and the same command goes on from the last checkpoint"
        if isinstance(error, FloatingPointError):
            remedy = (
                "the same command would end alike, so train into another directory, with a smaller "
                f"ppo.learning_rate than {training.ppo.learning_rate:g} or smaller rewards"
            )
        raise TrainingError(
            f"the training in {out} ended at {learner.num_timesteps:,} of "
            f"{training.agent_steps:,} agent-steps ({error}): {policy_kept}; {remedy}"
        ) from error


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
    """

    curve: list[dict[str, float]] = field(default_factory=list)
    references: dict[str, dict[str, float]] = field(default_factory=dict)
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    versions: dict[str, str] = field(default_factory=dict)

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
        if self._training.teacher is not None:
            self._follow_teacher(self._training.teacher, progress)
        curve = self._log.curve
        due = curve[-1]["agent_steps"] + self._training.evaluation.every if curve else 0
        if self.num_timesteps >= due:
            self._evaluate()
        if time.monotonic() - self._saved_at >= CHECKPOINT_EVERY:
            self._save()
        self._cpu = time.process_time()

    def _follow_teacher(self, teaching: Teaching, progress: float) -> None:
        """Let the value network warm up, and the teacher pull or go."""
        ppo = self._training.ppo
        n_updates = self.num_timesteps // (self._training.rows * ppo.n_steps)
        for parameter in self.model.policy.actor_parameters():
            parameter.requires_grad_(n_updates >= teaching.warm_up)
        pull = teaching.pull_at(progress)
        pull_by(self.model, pull, ppo)
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
        card = _card(self._training, self.num_timesteps, log)
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


def _card(training: Training, agent_steps: int, log: TrainingLog, command: str = "") -> PolicyCard:
    return PolicyCard(
        name=training.name,
        about=training.about,
        network=training.network,
        command=command,
        versions=log.versions,
        scenario=training.evaluation_scenario.model_dump(mode="json", exclude_defaults=True),
        training=training.model_dump(mode="json", exclude_defaults=True),
        seed=training.seed,
        agent_steps=agent_steps,
    )
