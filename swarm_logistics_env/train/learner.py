"""The learner: stable-baselines3's PPO, and the checkpoints it goes on from.

The value network reads more than a robot can sense, see `privileged`.
"""

from __future__ import annotations

import hashlib
import io
import os
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO

from swarm_logistics_env.core.errors import TrainingError
from swarm_logistics_env.core.records import atomic_write
from swarm_logistics_env.policies.learned import LearnedPolicy, Network
from swarm_logistics_env.train.actor_critic import ClassesPolicy, GaussianPolicy
from swarm_logistics_env.train.settings import PPOSettings
from swarm_logistics_env.train.training_worlds import NetworkView, check_finite
from swarm_logistics_env.world.motion.classes import N_DIRECTIONS, classes_of
from swarm_logistics_env.world.motion.network_inputs import LEAD, input_names

CHECKPOINT = "checkpoint.pt"
STATE = ("num_timesteps", "_n_updates", "_last_obs", "_last_episode_starts")  # of the learner

# The outputs of an untrained network, whatever it reads: it drives ahead, so that it meets things.
# One that trembles on the spot would learn very slowly that searching pays.
FIRST_OUTPUTS = (0.8, 0.0, 0.0)
FIRST_LOGIT = 3.0  # of its direction and speed, where a network says classes


def make_learner(
    view: NetworkView, network: Network, ppo: PPOSettings, seed: int, device: str
) -> PPO:
    """Return PPO as the settings ask for it; seeds the worlds and global generators."""
    net_arch = {"pi": list(network.hidden), "vf": list(ppo.value_hidden)}
    of_policy: dict[str, Any] = {"net_arch": net_arch, "n_inputs": network.widths[0]}
    if network.says_classes:
        of_policy["temperature"] = network.exploration or 1.0
    if network.talks:
        of_policy["message_weight"] = ppo.message_weight
    learner = PPO(
        ClassesPolicy if network.says_classes else GaussianPolicy,
        view,
        learning_rate=lambda left: ppo.rate(1.0 - left),
        n_steps=ppo.n_steps,
        batch_size=view.num_envs * ppo.n_steps // ppo.n_minibatches,
        n_epochs=ppo.epochs,
        gamma=ppo.gamma,
        gae_lambda=ppo.gae_lambda,
        clip_range=ppo.clip,
        ent_coef=ppo.entropy,
        vf_coef=ppo.value_weight,
        max_grad_norm=ppo.max_grad_norm,
        target_kl=ppo.target_kl,
        policy_kwargs=of_policy,
        seed=seed,
        device=device,
    )
    policy = learner.policy
    with torch.no_grad():
        if network.says_classes:
            direction, speed, _ = classes_of(np.array([FIRST_OUTPUTS]))[0]
            policy.action_net.bias[[direction, N_DIRECTIONS + speed]] = FIRST_LOGIT
        else:
            policy.log_std.copy_(torch.tensor(ppo.deviations).log())
            policy.action_net.bias.copy_(torch.tensor(FIRST_OUTPUTS))
    policy.tell = view.take_messages
    pull_by(learner, 0.0, ppo)
    return learner


def pull_by(learner: PPO, pull: float, ppo: PPOSettings) -> None:
    """Let the learner's losses have a teacher's error in them from now on, with that weight."""
    policy = learner.policy
    policy.pull = pull
    policy.entropy_weight = ppo.entropy
    learner.ent_coef = 1.0 if pull > 0.0 or policy.talks else ppo.entropy


def check_learner(learner: Any) -> None:
    """Raise a FloatingPointError unless the latest losses, and all that was learned, are finite."""
    logged = learner.logger.name_to_value
    losses = [logged.get(f"train/{name}", 0.0) for name in ("value_loss", "policy_gradient_loss")]
    check_finite("a loss", np.array(losses))
    policy = learner.policy
    averages = [mean for means in policy.optimizer.state.values() for mean in means.values()]
    deviations = [policy.log_std.exp()] if isinstance(policy, GaussianPolicy) else []
    for numbers in (*policy.parameters(), *deviations, *averages):
        check_finite("a number of the networks", numbers.detach().cpu().numpy())


def device_of(name: str | None) -> str:
    """Return the device to learn on: the named one, else the GPU where there is one.

    Raises:
        TrainingError: there is no such device.
    """
    devices = ["cpu", "cuda"] if torch.cuda.is_available() else ["cpu"]
    if name not in (None, *devices):
        raise TrainingError(f"device = {name!r}: should be left out or one of {devices} here")
    return name or devices[-1]


def tensors_of(policy: Any) -> dict[str, NDArray[np.float32]]:
    """Return the tensors of a policy file (`policies.learned.tensor_shapes`) from PPO's policy."""
    tensors = {}
    if isinstance(policy, GaussianPolicy):
        tensors["deviations"] = _array(policy.log_std.exp())
    for layer, parts in enumerate(_layers_of(policy)):
        tensors[f"layers.{layer}.weight"] = _array(torch.cat([part.weight for part in parts]))
        tensors[f"layers.{layer}.bias"] = _array(torch.cat([part.bias for part in parts]))
    return tensors


def begin_from(start: LearnedPolicy, policy: Any, network: Network) -> None:
    """Let PPO's policy begin as a trained one, with weights of 0 for what that does not read.

    Noise begins as the settings have it, and messages that it does not say as they are untrained.

    Args:
        start: with the hidden layers and the head of `network`.
        policy: of the learner.
        network: that the policy trains.
    """
    inputs = input_names(**network.reads)
    of_start = input_names(**start.card.network.reads)
    first_weight = start.tensors["layers.0.weight"].copy()
    if not start.card.network.listens:
        first_weight[:, LEAD] = 0.0  # it read zeros there, so that these are untrained
    for layer, parts in enumerate(_layers_of(policy)):
        weight = start.tensors[f"layers.{layer}.weight"]
        bias = start.tensors[f"layers.{layer}.bias"]
        if layer == 0:
            weight = np.zeros((len(bias), len(inputs)), np.float32)
            weight[:, [inputs.index(name) for name in of_start]] = first_weight
        first = 0
        for part in parts:
            rows = slice(first, first + part.out_features)
            first = rows.stop
            if first > len(bias):  # messages, which the start does not say
                continue
            with torch.no_grad():
                part.weight.copy_(torch.from_numpy(weight[rows]))
                part.bias.copy_(torch.from_numpy(bias[rows]))


def _layers_of(policy: Any) -> list[list[torch.nn.Linear]]:
    """Return the actor's layers, the parts of each in the order of a policy file."""
    modules = policy.mlp_extractor.policy_net
    hidden = [[module] for module in modules if isinstance(module, torch.nn.Linear)]
    last = [policy.action_net, policy.message_net] if policy.talks else [policy.action_net]
    return [*hidden, last]


def _array(tensor: torch.Tensor) -> NDArray[np.float32]:
    array: NDArray[np.float32] = tensor.detach().cpu().numpy().astype(np.float32)
    return array


def save_checkpoint(directory: Path, learner: PPO, log: Any) -> None:
    """Write a checkpoint, whole or not at all; until then the one before stays.

    To be called between updates: after learning from a batch, before collecting the next; or
    before the first.

    Args:
        log: what else the training remembers; picklable.
    """
    state = {
        "policy": learner.policy.state_dict(),
        "optimizer": learner.policy.optimizer.state_dict(),
        **{name: getattr(learner, name) for name in STATE},
        "view": learner.env,
        "torch": torch.get_rng_state(),
        "cuda": torch.cuda.get_rng_state_all(),
        # stable-baselines3 shuffles minibatches by numpy's global generator.
        "numpy": np.random.get_state(),  # noqa: NPY002 - see above
        "log": log,
    }
    content = io.BytesIO()
    torch.save(state, content)
    with atomic_write(directory / CHECKPOINT, TrainingError) as part, part.open("wb") as file:
        file.write(_head(content.getbuffer()))
        file.write(content.getbuffer())
        file.flush()
        os.fsync(file.fileno())


def _head(content: bytes | memoryview) -> bytes:
    """Return the line that stands before what torch wrote, with its digest."""
    return b"swarm-logistics checkpoint, sha256 %s\n" % hashlib.sha256(content).hexdigest().encode()


def read_checkpoint(directory: Path) -> dict[str, Any] | None:
    """Return the checkpoint in a training's directory; None: there is none.

    It is a pickle: resume trainings of your own only. One that is not as it was written is not
    unpickled.

    Raises:
        TrainingError: it cannot be read, is damaged, or is of another version.
    """
    path = directory / CHECKPOINT
    if not path.exists():
        return None
    remedy = "train into a new directory, or delete that file to begin anew in this one"
    try:
        head, end, content = path.read_bytes().partition(b"\n")
        if head + end != _head(content):
            raise TrainingError(
                f"the checkpoint {path} is damaged or of another version, as its digest tells: "
                f"{remedy}"
            )
        state: dict[str, Any] = torch.load(
            io.BytesIO(content), map_location="cpu", weights_only=False
        )
    except TrainingError:
        raise
    except Exception as error:  # whatever unpickling what another version wrote raises
        reason = str(error).partition("\n")[0]
        raise TrainingError(f"the checkpoint {path} cannot be read ({reason}): {remedy}") from error
    return state


def restore(learner: PPO, state: dict[str, Any]) -> None:
    """Bring a new learner to where that of the checkpoint stood, and its worlds as well."""
    learner.env.close()
    learner.set_env(state["view"], force_reset=False)
    learner.policy.tell = state["view"].take_messages
    learner.policy.load_state_dict(state["policy"])
    learner.policy.optimizer.load_state_dict(state["optimizer"])
    for name in STATE:
        setattr(learner, name, state[name])
    torch.set_rng_state(state["torch"])
    if torch.cuda.is_available():
        torch.cuda.set_rng_state_all(state["cuda"])
    np.random.set_state(state["numpy"])  # noqa: NPY002 - see above
