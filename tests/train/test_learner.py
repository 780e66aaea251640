from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

import torch

from swarm_logistics_env.core.errors import TrainingError
from swarm_logistics_env.policies.files import read_policy, write_policy
from swarm_logistics_env.policies.learned import LearnedPolicy, Network, PolicyCard, tensor_shapes
from swarm_logistics_env.train import Training
from swarm_logistics_env.train.learner import (
    begin_from,
    make_learner,
    read_checkpoint,
    save_checkpoint,
    tensors_of,
)
from swarm_logistics_env.train.privileged import PRIVILEGED
from swarm_logistics_env.train.settings import PPOSettings
from swarm_logistics_env.train.trainer import train
from swarm_logistics_env.train.training_worlds import NetworkView
from swarm_logistics_env.world.motion.classes import GROUPS, outputs_of
from swarm_logistics_env.world.motion.frame import OUTPUTS
from swarm_logistics_env.world.motion.network_inputs import INPUTS, LEAD, input_names
from swarm_logistics_env.world.motion.voices import N_MESSAGES


def test_the_actor_sees_nothing_of_it(small: Any) -> None:
    training = small()
    policy = make_learner(NetworkView(training), training.network, training.ppo, 0, "cpu").policy
    columns = torch.randn(50, len(INPUTS) + len(PRIVILEGED))
    changed = columns.clone()
    changed[:, len(INPUTS) :] += 1.0
    with torch.no_grad():
        before, after = (policy.get_distribution(rows).mode() for rows in (columns, changed))
        assert (before == after).all()
        assert (policy.predict_values(columns) != policy.predict_values(changed)).all()


def test_the_learner_learns_as_the_settings_say_and_begins_by_driving_ahead(small: Any) -> None:
    ppo = PPOSettings(
        n_steps=30, epochs=3, n_minibatches=4, gamma=0.9, gae_lambda=0.8, clip=0.3, entropy=0.01,
        value_weight=0.7, max_grad_norm=0.4, target_kl=0.05, deviations=(0.5, 0.3, 0.2),
    )  # fmt: skip
    training = small(ppo=ppo)
    learner = make_learner(NetworkView(training), training.network, training.ppo, 0, "cpu")
    assert (learner.n_steps, learner.n_epochs, learner.batch_size) == (30, 3, 8 * 30 // 4)
    assert (learner.gamma, learner.gae_lambda, learner.clip_range(1.0)) == (0.9, 0.8, 0.3)
    assert (learner.ent_coef, learner.vf_coef, learner.max_grad_norm) == (0.01, 0.7, 0.4)
    assert (learner.target_kl, learner.lr_schedule(1.0)) == (0.05, ppo.learning_rate)
    with torch.no_grad():
        first = learner.policy.get_distribution(torch.zeros(1, len(INPUTS) + len(PRIVILEGED)))
    assert first.distribution.mean.tolist() == [pytest.approx([0.8, 0.0, 0.0])]
    assert first.distribution.stddev.tolist() == [pytest.approx([0.5, 0.3, 0.2])]


def test_where_a_teacher_pulls_ppo_is_paid_for_entropy_less_the_error_beside_it(small: Any) -> None:
    training = small()
    policy = make_learner(NetworkView(training), training.network, training.ppo, 0, "cpu").policy
    columns = torch.randn(50, len(INPUTS) + len(PRIVILEGED) + len(OUTPUTS))
    actions = torch.zeros(50, len(OUTPUTS))
    with torch.no_grad():
        entropy = policy.evaluate_actions(columns, actions)[2]
        error = policy.error(
            policy.answers_of(columns[:, : len(INPUTS)]), columns[:, -len(OUTPUTS) :]
        )
        policy.pull, policy.entropy_weight = 0.2, 0.5
        pulled = policy.evaluate_actions(columns, actions)[2]
    torch.testing.assert_close(pulled, 0.5 * entropy - 0.2 * error)


@pytest.mark.parametrize("head", ["outputs", "classes"])
def test_what_a_network_tells_is_learned_from_what_is_so_and_is_told_without_noise(
    small: Any, head: Any
) -> None:
    network = Network(hidden=(8,), talks=True, head=head)
    scenario = small().scenario.replace(message_size=N_MESSAGES)
    ppo = small().ppo.replace(message_weight=0.3, entropy=0.5)
    training = small(network=network, scenario=scenario, ppo=ppo)
    view = NetworkView(training)
    learner = make_learner(view, network, training.ppo, 0, "cpu")
    policy = learner.policy
    columns = torch.from_numpy(view.reset())
    inputs = columns[:, : network.widths[0]]
    with torch.no_grad():
        actions, _, log_probability = policy(columns)
        estimates = policy.message_net(policy.mlp_extractor.policy_net(inputs))
        view.step(actions.numpy())
        judged = policy.evaluate_actions(columns, actions)
        policy.message_weight = 0.0
        bare = policy.evaluate_actions(columns, actions)
    sent = [world.warehouse.state.robot_message for world in view.venv.worlds]
    np.testing.assert_allclose(np.concatenate(sent), estimates.clamp(0.0, 1.0), atol=1e-6)
    torch.testing.assert_close(judged[1], log_probability)
    assert learner.ent_coef == 1.0
    truth = columns[:, network.widths[0] + len(PRIVILEGED) :]
    error = ((estimates - truth) ** 2).mean(dim=1)
    torch.testing.assert_close(judged[2], bare[2] - 0.3 * error)


def check_learning(
    small: Any, head: Any, expected_of: Callable[[Any, torch.Tensor, torch.Tensor], tuple[Any, ...]]
) -> None:
    """Compare what a policy learns from with what torch's distributions say.

    Args:
        expected_of: returns log-probabilities, entropies, errors and the likeliest outputs, of a
            policy, its answers and the actions.
    """
    network = Network(hidden=(8,), head=head, exploration=0.5)
    training = small(network=network)
    policy = make_learner(NetworkView(training), network, training.ppo, 0, "cpu").policy
    columns = torch.randn(50, len(INPUTS) + len(PRIVILEGED))
    with torch.no_grad():
        for parameter in policy.parameters():
            parameter.add_(0.3 * torch.randn_like(parameter))
        actions, _, log_probability = policy(columns)
        _, *judged = policy.evaluate_actions(columns, actions)
        answers = policy.answers_of(columns[:, : len(INPUTS)])
        probabilities, entropies, errors, outputs = expected_of(policy, answers, actions)
        loss = policy.imitation_loss(columns[:, : len(INPUTS)], actions)
    torch.testing.assert_close([log_probability, *judged], [probabilities] * 2 + [entropies])
    torch.testing.assert_close(policy.error(answers, actions), errors)
    torch.testing.assert_close(loss, errors.mean())
    np.testing.assert_array_equal(policy.likeliest_outputs(answers), outputs)


def test_outputs_are_learned_as_torchs_normal_distributions_say(small: Any) -> None:
    def expected(policy: Any, answers: torch.Tensor, actions: torch.Tensor) -> tuple[Any, ...]:
        normal: Any = torch.distributions.Normal(answers, policy.log_std.exp())
        errors = ((answers - actions) ** 2).mean(dim=1)
        probabilities = normal.log_prob(actions).sum(dim=1)
        return probabilities, normal.entropy().sum(dim=1), errors, answers.numpy()

    check_learning(small, "outputs", expected)


def test_classes_are_learned_as_torchs_categorical_distributions_say(small: Any) -> None:
    def expected(_: Any, answers: torch.Tensor, actions: torch.Tensor) -> tuple[Any, ...]:
        logits = answers.split(GROUPS, dim=1)
        kinds: list[Any] = [torch.distributions.Categorical(logits=group / 0.5) for group in logits]
        probabilities = sum(kind.log_prob(actions[:, n]) for n, kind in enumerate(kinds))
        entropies = sum(kind.entropy() for kind in kinds)
        errors = sum(
            torch.nn.functional.cross_entropy(group, actions[:, n], reduction="none")
            for n, group in enumerate(logits)
        )
        likeliest = np.stack([group.argmax(dim=1) for group in logits], axis=1)
        return probabilities, entropies, errors, outputs_of(likeliest)

    check_learning(small, "classes", expected)


def test_a_checkpoint_of_another_version_of_a_library_is_refused_with_the_reason(
    small: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    training = small()
    learner = make_learner(NetworkView(training), training.network, training.ppo, 0, "cpu")
    save_checkpoint(tmp_path, learner, None)

    def refuse(*_: object, **__: object) -> None:
        raise AttributeError("no class Adam\nin torch")

    monkeypatch.setattr(torch, "load", refuse)
    with pytest.raises(TrainingError, match=r"pt cannot be read \(no class Adam\): train into a"):
        read_checkpoint(tmp_path)


@pytest.mark.parametrize(("exploration", "temperature"), [(0.0, 1.0), (0.5, 0.5)])
def test_classes_are_drawn_at_the_temperature_of_the_file_or_at_1_and_drive_ahead_at_first(
    small: Any, exploration: float, temperature: float
) -> None:
    network = Network(hidden=(8,), head="classes", exploration=exploration)
    training = small(network=network)
    policy = make_learner(NetworkView(training), network, training.ppo, 0, "cpu").policy
    assert policy.temperature == temperature
    with torch.no_grad():
        first = policy.answers_of(torch.zeros(1, len(INPUTS)))
    assert first[first != 0.0].tolist() == [3.0, 3.0]  # of the direction and the speed
    assert policy.likeliest_outputs(first)[0, :2].tolist() == pytest.approx([0.75, 0.0])


def drawn_policy(network: Network, **fields: Any) -> LearnedPolicy:
    """Return a policy whose numbers are drawn."""
    rng = np.random.default_rng(0)
    tensors = {
        name: rng.normal(0.0, 0.3, shape).astype(np.float32)
        for name, shape in tensor_shapes(network).items()
    }
    return LearnedPolicy(PolicyCard(name="start", network=network, **fields), tensors)


@pytest.mark.parametrize("listens", [False, True])
@pytest.mark.parametrize("talks", [False, True])
@pytest.mark.parametrize("head", ["outputs", "classes"])
def test_a_network_that_goes_on_says_what_its_start_said_whatever_else_it_reads(
    small: Any, head: Any, talks: bool, listens: bool
) -> None:
    of_start = Network(hidden=(8,), head=head, role=True, talks=talks, listens=listens)
    network = of_start.replace(sees_items=True, talks=True, listens=True)
    start = drawn_policy(of_start)
    training = small(network=network, scenario=small().scenario.replace(message_size=N_MESSAGES))
    policy = make_learner(NetworkView(training), network, training.ppo, 0, "cpu").policy
    begin_from(start, policy, network)
    inputs = np.random.default_rng(1).normal(size=(50, network.widths[0])).astype(np.float32)
    names = input_names(**network.reads)
    inputs_of_start = inputs[:, [names.index(name) for name in input_names(**of_start.reads)]]
    if not listens:
        inputs_of_start[:, LEAD] = 0.0
    answers = start.outputs_of(inputs_of_start)
    new_policy = LearnedPolicy(PolicyCard(name="new", network=network), tensors_of(policy))
    new_answers = new_policy.outputs_of(inputs)[:, : answers.shape[1]]
    np.testing.assert_allclose(new_answers, answers, atol=1e-5)


def test_a_training_goes_on_from_a_policy_file_once_its_critic_is_warm(
    small: Any, tmp_path: Path
) -> None:
    path = train(small(), tmp_path / "start")
    start = read_policy(path)
    network = small().network.replace(sees_items=True)
    ppo = small().ppo.replace(warm_up=2)
    training = small(network=network, start=str(path), ppo=ppo, agent_steps=480)
    warm = read_policy(train(training, tmp_path / "warm"))  # the third update is at a rate of 0
    weights = warm.tensors["layers.0.weight"]
    n_read = len(INPUTS)
    np.testing.assert_array_equal(weights[:, :n_read], start.tensors["layers.0.weight"])
    assert not weights[:, n_read:].any()
    assert warm.tensors["layers.1.weight"].tolist() == start.tensors["layers.1.weight"].tolist()
    learned = read_policy(train(training.replace(agent_steps=960), tmp_path / "learned"))
    assert learned.tensors["layers.0.weight"][:, n_read:].any()
    assert warm.card.training["start"]["name"] == str(path)
    assert warm.card.versions["start"] == start.parameters.weights
    assert Training.from_json(training.to_json()) == training


def test_of_several_trainings_the_start_is_the_one_of_the_seed(small: Any) -> None:
    network = small().network.replace(hidden=(128, 64))
    seeds = [
        small(network=network, start="ppo-robust@all", seed=seed).start_policy.card.seed
        for seed in (0, 1, 6, 7)
    ]
    assert seeds == [0, 1, 6, 0]


@pytest.mark.parametrize(
    ("of_start", "reason"),
    [
        ({"role": True}, "network.role = False: should be True, as start has"),
        ({"talks": True}, "network.talks = False: should be True"),
        ({"sees_items": True}, "network.sees_items = False: should be True"),
        ({"hidden": (9,)}, r"network.hidden = \(8,\): should be \(9,\), as start has"),
    ],
)
def test_a_start_that_the_network_cannot_go_on_from_is_refused(
    small: Any, tmp_path: Path, of_start: dict[str, Any], reason: str
) -> None:
    policy = drawn_policy(Network(**{"hidden": (8,), **of_start}))
    write_policy(tmp_path / "start.safetensors", policy.card, policy.tensors)
    with pytest.raises(TrainingError, match=reason):
        small(start=str(tmp_path / "start.safetensors"))
    with pytest.raises(TrainingError, match="start = LearnedPolicy: should be a policy's name or"):
        small(start=policy)
