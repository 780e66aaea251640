"""A training from its specification to the policy file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure

from swarm_logistics_env.core.errors import SwarmLogisticsError, TrainingError
from swarm_logistics_env.core.progress_bar import ProgressBar
from swarm_logistics_env.core.records import atomic_write, read_table, remove_parts
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.policies.files import read_policy, write_policy
from swarm_logistics_env.policies.policy import one_thread
from swarm_logistics_env.train.evaluation import evaluate_score, versions
from swarm_logistics_env.train.imitation import imitate
from swarm_logistics_env.train.learner import (
    begin_from,
    device_of,
    make_learner,
    read_checkpoint,
    restore,
    tensors_of,
)
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.train.training_callback import (
    BEST,
    TrainingCallback,
    TrainingLog,
    card_of,
)
from swarm_logistics_env.train.training_worlds import NetworkView

RECORD = "training.json"  # of how it was made
# Fields that may change when a training goes on, because they change nothing of what was done.
MAY_CHANGE = frozenset({"about", "threads", "scores", "keep"})
PICTURE = "curve.png"


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
                start = training.start_policy
                if start is not None:
                    begin_from(start, learner.policy, training.network)
                    log.start = start.parameters.weights
                imitate(training, learner, log, generator(training.seed, "imitation"))
            log.versions = versions()
            total = training.agent_steps
            done = learner.num_timesteps
            with ProgressBar(training.name, total, "agent-steps", done=done) as progress:
                callback = TrainingCallback(training, log, out, progress)
                learner.learn(total - done, [callback, *callbacks], reset_num_timesteps=False)
    learner.env.close()
    evaluation = training.evaluation
    log.draw(out / PICTURE, f"{training.name}, N = {evaluation.n_robots}", evaluation.seeds)
    n_steps = learner.num_timesteps
    tensors = tensors_of(learner.policy)
    if training.keep == "best":
        best = read_policy(out / BEST)
        n_steps = best.card.agent_steps
        tensors = best.tensors
    card = card_of(training, n_steps, log, command)
    path = out / f"{training.name}.safetensors"
    # The file is written before the scores are measured, which takes minutes.
    write_policy(path, card, tensors)
    scenario = training.scenario.replace(n_robots=training.scores.n_robots)
    scores = evaluate_score(path, scenario, training.scores, training.threads)
    if scores:
        write_policy(path, card.replace(scores=scores, scored_with=versions()), tensors)
    return path


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
