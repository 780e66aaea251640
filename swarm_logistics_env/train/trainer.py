"""A training from its specification to the policy file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.logger import configure

from swarm_logistics_env.errors import PolicyError, TrainingError
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.card import Network, PolicyCard
from swarm_logistics_env.policies.files import write_policy
from swarm_logistics_env.policies.learned import LearnedPolicy, check_tensors
from swarm_logistics_env.progress_bar import ProgressBar
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.train.checkpoint import (
    read_checkpoint,
    restore,
    save_checkpoint,
    view_of,
)
from swarm_logistics_env.train.imitation import imitate
from swarm_logistics_env.train.learner import (
    device_of,
    make_learner,
    take_tensors,
    tensors_of,
)
from swarm_logistics_env.train.network_view import NetworkView
from swarm_logistics_env.train.run_record import enter, simulation, versions
from swarm_logistics_env.train.scoring import score
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.train.training_callback import TrainingCallback, TrainingLog
from swarm_logistics_env.train.training_worlds import make_worlds


def train(
    training: Training, out: str | Path, *, command: str = "", device: str | None = None
) -> Path:
    """Train a policy, or go on with it, and return the path of its file.

    What is in `out` afterwards: the policy file NAME.safetensors; training.json, how it was made;
    curve.csv, what was measured on the way; tensorboard/; scores/, the study behind the card; and
    the checkpoint, from which the same call goes on after a crash. The result is the same, bit by
    bit, as without one (on a CPU).

    Args:
        out: directory of this training.
        command: the command line that asks for it, for the card.
        device: "cpu" or "cuda"; None: the GPU where there is one.

    Raises:
        TrainingError: the directory holds another training or cannot be used, or there is no such
            device.
        SetupError, ScenarioError, FaultError: worlds that cannot be.
    """
    out = Path(out)
    # Everything that may be refused comes first, before anything is written.
    device, begun = device_of(device), _new_view(training)
    first = None if training.start is None else _start(training.start, training.network)
    enter(out, training, command)
    # Small networks gain little from more threads and lose much if cores are shared; the sums would
    # depend on the number of threads as well.
    torch.set_num_threads(1)
    state = read_checkpoint(out)
    view, log = begun, TrainingLog()
    if state is not None:
        begun.close()
        view, log = view_of(state), state["log"]
    learner = make_learner(training, view, device, goes_on=state is not None)
    learner.set_logger(configure(str(out / "tensorboard"), ["tensorboard"]))
    if state is not None:
        restore(learner, state)
    elif training.imitation is not None:
        imitate(learner.policy, training, training.imitation)
        # Seeded anew, so that PPO does not depend on how long the imitation took.
        learner.set_random_seed(training.seed)
        save_checkpoint(out, learner, view, log)
    elif first is not None:
        take_tensors(learner.policy, first.tensors)
    if learner.num_timesteps < training.agent_steps:
        log.versions = versions()
        with ProgressBar(
            training.name, training.agent_steps, "agent-steps", done=learner.num_timesteps
        ) as bar:
            callback = TrainingCallback(training, view, log, out, bar)
            learner.learn(
                training.agent_steps - learner.num_timesteps, callback, reset_num_timesteps=False
            )
            callback.end()
    view.close()
    tensors = tensors_of(learner.policy)
    return _write(training, out, command, learner.num_timesteps, tensors, log.versions)


def _new_view(training: Training) -> NetworkView:
    return NetworkView(make_worlds(training), training.scenario, training.network.listens)


def _start(name: str, network: Network) -> LearnedPolicy:
    policy = load(name)
    if not isinstance(policy, LearnedPolicy):
        raise TrainingError(f"start = {name!r}: should be a trained policy")
    # What it hears and how it explores may differ; its tensors have to fit.
    try:
        check_tensors(network, policy.tensors)
    except PolicyError as error:
        raise TrainingError(f"start = {name!r}: {error}") from error
    return policy


def _write(
    training: Training,
    out: Path,
    command: str,
    agent_steps: int,
    tensors: Mapping[str, NDArray[np.float32]],
    learned_with: dict[str, str] | None,
) -> Path:
    path = out / f"{training.name}.safetensors"
    card = PolicyCard(
        name=training.name,
        about=training.about,
        network=training.network,
        command=command,
        versions=learned_with or versions(),
        scenario=_changed(training.scenario),
        training=training.model_dump(mode="json", exclude_defaults=True),
        seed=training.seed,
        agent_steps=agent_steps,
    )
    # The file is written before the scores are measured, which takes minutes.
    write_policy(path, card, tensors)
    scores = score(LearnedPolicy(card, tensors), training, out / "scores")
    if scores:
        write_policy(path, card.replace(scores=scores, scored_with=simulation()), tensors)
    return path


def _changed(scenario: Scenario) -> dict[str, Any]:
    changed = scenario.model_dump(mode="json", exclude_defaults=True)
    # The field is always written, because a card without it is from before there was one.
    return {"heading_drift": scenario.heading_drift, **changed}
