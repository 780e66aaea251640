"""Imitation: before PPO begins, a network learns to say what a teacher would do in its place.

Rows come from worlds in which robots do partly what the teacher says and partly what the network
says, so that it learns its way back from where it gets itself (DAgger, Ross et al. 2011).
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from swarm_logistics_env.core.progress_bar import ProgressBar
from swarm_logistics_env.train.settings import Teaching
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.train.training_worlds import check_finite
from swarm_logistics_env.world.motion.frame import OUTPUTS
from swarm_logistics_env.world.motion.voices import N_MESSAGES

ROUNDS = 12  # of collecting rows and learning from all rows so far
BATCH = 1024
LATE = 0.75  # share of the rounds after which the rate is lower
LATE_RATE = 0.4  # times the settings' rate
NOISE_SHARES = np.array([1.0, 1.0, 0.5])  # of the settings' noise, of each output


def imitate(training: Training, learner: Any, log: Any, rng: np.random.Generator) -> None:
    """Let the learner's network imitate the teacher, if there is one, always to the same bits.

    Afterwards the learner's worlds begin new episodes. There is no checkpoint before the end.

    Args:
        log: its `seconds` and `cpu_seconds` go on.
        rng: draws batches, noise, and which robots do what the teacher says.

    Raises:
        FloatingPointError: the loss, an observation or a reward is not finite.
    """
    began = time.monotonic()
    cpu = time.process_time()
    if training.teacher is not None and training.teacher.decisions > 0:
        _imitate(training, training.teacher, learner, rng)
    log.seconds += time.monotonic() - began
    log.cpu_seconds += time.process_time() - cpu


def share_and_rate(settings: Teaching, number: int) -> tuple[float, float]:
    """Return the share of robots that do what the teacher says in a round, and its learning rate.

    Args:
        number: of the round, from 0 on.
    """
    done = number / (ROUNDS - 1)
    first, last = settings.shares
    rate = settings.rate * (LATE_RATE if done > LATE else 1.0)
    return first + done * (last - first), rate


def _imitate(
    training: Training, settings: Teaching, learner: Any, rng: np.random.Generator
) -> None:
    policy = learner.policy
    n_steps = max(1, round(settings.decisions / (ROUNDS * training.rows)))
    n_new = n_steps * training.rows
    rows = np.empty((ROUNDS * n_new, training.network.widths[0]), np.float32)
    n_messages = N_MESSAGES if policy.talks else 0
    labels = np.empty((len(rows), len(OUTPUTS) + n_messages), np.float32)
    optimizer = torch.optim.Adam(policy.actor_parameters(), settings.rate)
    columns = learner.env.reset()
    with ProgressBar(f"{training.name}, imitation", len(rows), "decisions") as progress:
        for number in range(ROUNDS):
            share, rate = share_and_rate(settings, number)
            new = slice(number * n_new, (number + 1) * n_new)
            columns = _collect(learner, columns, share, settings.noise, rng, rows[new], labels[new])
            for group in optimizer.param_groups:
                group["lr"] = rate
            for _ in range(max(1, settings.epochs * n_new // BATCH)):
                batch = rng.integers(new.stop, size=BATCH)
                wanted = torch.from_numpy(labels[batch]).to(learner.device)
                loss = policy.imitation_loss(
                    torch.from_numpy(rows[batch]).to(learner.device), wanted
                )
                optimizer.zero_grad()
                loss.backward()
                optimizer.step()
            check_finite("a loss", np.array([loss.item()]))
            progress.reach(new.stop)


def _collect(
    learner: Any,
    columns: NDArray[np.float32],
    share: float,
    noise: float,
    rng: np.random.Generator,
    rows: NDArray[np.float32],
    labels: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Fill rows and labels step by step, and return what the networks read afterwards.

    Args:
        columns: what they read at first.
        share: of the robots that do what the teacher says, drawn anew at every decision.
    """
    view = learner.env
    policy = learner.policy
    n_rows = len(columns)
    for first in range(0, len(rows), n_rows):
        new = slice(first, first + n_rows)
        rows[new] = columns[:, : rows.shape[1]]
        labels[new] = np.hstack([view.labels, view.true_messages])
        outputs = view.advice.copy()
        is_own = rng.random(n_rows) >= share
        inputs = torch.from_numpy(rows[new]).to(learner.device)
        with torch.no_grad():
            if is_own.any():
                answers = policy.answers_of(inputs[is_own])
                outputs[is_own] = policy.likeliest_outputs(answers)
            if policy.talks:
                view.take_messages(policy.messages_of(inputs))
        outputs += noise * NOISE_SHARES * rng.standard_normal(outputs.shape)
        view.give_outputs(outputs)
        columns, *_ = view.step_wait()
    return columns
