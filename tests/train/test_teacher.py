"""Trainings with a teacher: it says what it would do itself, and what follows is reproducible."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from safetensors.numpy import load_file

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3.common.callbacks import ConvertCallback
from torch.optim.optimizer import register_optimizer_step_pre_hook

from swarm_logistics_env import policies
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.policies.learned import Network
from swarm_logistics_env.policies.policy import one_thread
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.train import training_callback
from swarm_logistics_env.train.imitation import imitate, share_and_rate
from swarm_logistics_env.train.learner import make_learner, tensors_of
from swarm_logistics_env.train.settings import Teaching
from swarm_logistics_env.train.teacher import Teacher
from swarm_logistics_env.train.trainer import train
from swarm_logistics_env.train.training_callback import TrainingLog
from swarm_logistics_env.train.training_worlds import NetworkView
from swarm_logistics_env.world.motion.frame import OUTPUTS
from swarm_logistics_env.world.motion.voices import N_MESSAGES

CLASSES = Network(hidden=(8,), head="classes", role=True, exploration=0.5)


def weights(path: Path) -> dict[str, bytes]:
    return {name: tensor.tobytes() for name, tensor in load_file(path).items()}


@pytest.mark.parametrize("drive", ["holonomic", "differential"])
def test_robots_that_do_what_it_says_go_where_it_goes_itself(small: Any, drive: str) -> None:
    scenario = small().scenario.replace(drive=drive, duration=40.0)
    kinds = [{"n_robots": 6}]
    training = small(scenario=scenario, worlds=kinds, teacher={"policy": "homing-stock"})
    views = NetworkView(training), NetworkView(training)
    for view in views:
        view.seed(3)
    views[0].reset()
    rows = views[1].venv.reset()
    teacher: Any = policies.load("homing-stock")
    teacher.configure(scenario.replace(n_robots=6))
    teacher.begin(views[0].frame.keys)
    for _ in range(350):
        views[0].give_outputs(views[0].advice)
        views[0].step_wait()
        rows, *_ = views[1].venv.step(teacher.act(rows))
    states = [view.venv.worlds[0].warehouse.state for view in views]
    assert states[0].delivered == states[1].delivered > 0
    np.testing.assert_allclose(states[0].robot_position, states[1].robot_position, atol=1e-6)


TALKING = CLASSES.replace(talks=True)


@pytest.mark.daily
def test_a_training_with_a_teacher_goes_on_to_the_same_bits_and_keeps_the_best_network(
    small: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    teacher = {"policy": "homing", "decisions": 200, "pull": 0.1, "pull_until": 0.6}
    rewards = {"delivery": 1.0, "held_inside": 0.3, "contact": -0.1}
    scenario = small().scenario.replace(message_size=N_MESSAGES)
    ppo = small().ppo.replace(warm_up=1)
    training = small(
        network=TALKING, scenario=scenario, teacher=teacher, ppo=ppo, rewards=rewards, keep="best"
    )

    def interrupt(inside: dict[str, Any], _: object) -> bool:
        if inside["self"].num_timesteps > 330:
            raise KeyboardInterrupt
        return True

    uncut = weights(train(training, tmp_path / "uncut"))
    assert uncut == weights(tmp_path / "uncut/best.safetensors")
    monkeypatch.setattr(training_callback, "CHECKPOINT_EVERY", 0.0)
    with pytest.raises(KeyboardInterrupt):
        train(training, tmp_path / "cut", callbacks=[ConvertCallback(interrupt)])
    assert weights(train(training, tmp_path / "cut")) == uncut
    last = weights(train(training.replace(keep="last"), tmp_path / "cut"))
    assert last == weights(train(training.replace(keep="last"), tmp_path / "uncut"))


@pytest.mark.parametrize("network", [TALKING, Network(hidden=(8,))])
def test_the_network_comes_to_say_what_the_teacher_says_and_the_critic_warms_up_alone(
    small: Any, tmp_path: Path, network: Network
) -> None:
    teacher = {"policy": "homing", "decisions": 4000, "rate": 0.03}
    ppo = small().ppo.replace(warm_up=2)
    scenario = small().scenario.replace(message_size=N_MESSAGES if network.talks else 0)
    training = small(network=network, scenario=scenario, teacher=teacher, ppo=ppo)
    other = NetworkView(training)
    other.seed(1)
    columns = torch.from_numpy(other.reset())[:, : network.widths[0]]
    labels = torch.from_numpy(np.hstack([other.labels, other.true_messages]))
    learner = make_learner(NetworkView(training), network, training.ppo, training.seed, "cpu")
    policy = learner.policy
    n_outputs = len(OUTPUTS)

    def errors() -> NDArray[np.float64]:
        """Return the error of outputs, and that of messages, if any."""
        of_outputs = policy.error(policy.answers_of(columns), labels[:, :n_outputs]).mean().item()
        if not network.talks:
            return np.array([of_outputs])
        messages = torch.from_numpy(policy.messages_of(columns))
        of_messages = ((messages - labels[:, n_outputs:]) ** 2).mean().item()
        return np.array([of_outputs, of_messages])

    before = errors()
    with one_thread():
        imitate(training, learner, TrainingLog(), generator(training.seed, "imitation"))
    assert (errors() < 0.8 * before).all()
    imitated = {name: tensor.tobytes() for name, tensor in tensors_of(learner.policy).items()}
    shorter = training.replace(agent_steps=480)  # three updates, the last at a rate of 0
    assert weights(train(shorter, tmp_path / "warm")) == imitated
    assert weights(train(training, tmp_path / "on")) != imitated


def test_the_teachers_share_falls_evenly_and_the_rate_in_the_last_quarter() -> None:
    settings = Teaching(policy=PolicySpec.of("homing"), shares=(0.9, 0.35), rate=0.03)
    shares, rates = zip(*(share_and_rate(settings, number) for number in range(12)), strict=True)
    assert shares == pytest.approx(np.linspace(0.9, 0.35, 12))
    assert rates == pytest.approx([0.03] * 9 + [0.012] * 3)


def test_each_round_learns_as_often_as_its_epochs_say_at_its_rate(small: Any) -> None:
    # A decision of 8 rows a round; each round learns from 300 times as many, 1024 at once.
    teacher = {"policy": "homing", "decisions": 1, "rate": 0.03, "epochs": 300}
    training = small(network=CLASSES, teacher=teacher)
    learner = make_learner(NetworkView(training), CLASSES, training.ppo, training.seed, "cpu")
    rates: list[float] = []
    hook = register_optimizer_step_pre_hook(
        lambda optimizer, *_: rates.append(optimizer.param_groups[0]["lr"])
    )
    imitate(training, learner, TrainingLog(), generator(0, "imitation"))
    hook.remove()
    assert rates == pytest.approx([0.03] * 9 * 2 + [0.012] * 3 * 2)


def test_what_robots_do_while_a_network_imitates_has_noise_and_they_tell_what_it_tells(
    small: Any,
) -> None:
    teacher = {"policy": "homing", "decisions": 1, "shares": [1.0, 1.0], "noise": 0.4}
    scenario = small().scenario.replace(message_size=N_MESSAGES)
    training = small(network=TALKING, scenario=scenario, teacher=teacher)
    learner = make_learner(NetworkView(training), TALKING, training.ppo, training.seed, "cpu")
    view = learner.env
    columns: list[Any] = []
    steps: list[tuple[Any, Any, Any]] = []  # of each decision: outputs, advice and messages
    sent: list[Any] = []

    def reset() -> Any:
        columns.append(type(view).reset(view))
        return columns[-1]

    def give_outputs(outputs: Any) -> None:
        inputs = torch.from_numpy(columns[0][:, : TALKING.widths[0]])
        steps.append((outputs.copy(), view.advice.copy(), learner.policy.messages_of(inputs)))
        type(view).give_outputs(view, outputs)

    def step_wait() -> Any:
        stepped = type(view).step_wait(view)
        sent.append(np.vstack([w.warehouse.state.robot_message for w in view.venv.worlds]))
        return stepped

    view.reset, view.give_outputs, view.step_wait = reset, give_outputs, step_wait
    imitate(training, learner, TrainingLog(), generator(0, "imitation"))
    assert len(steps) == 12  # one a round
    outputs, advice, messages = steps[0]
    rng = generator(0, "imitation")
    rng.random(training.rows)
    noise = [0.4, 0.4, 0.2] * rng.standard_normal((training.rows, 3))
    np.testing.assert_allclose(outputs, advice + noise)
    np.testing.assert_allclose(sent[0], messages, atol=1e-6)
    assert messages.any()


def test_a_teacher_begins_anew_where_an_episode_ends_and_nowhere_else(
    small: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    kinds = [{"n_robots": 3, "scenario": {"duration": 2.0}}, {"n_robots": 5}]
    view = NetworkView(small(worlds=kinds, teacher={"policy": "homing"}))
    episodes: list[tuple[int, float, int]] = []

    def begin(teacher: Any, world: int, scenario: Any, keys: Any) -> None:
        episodes.append((world, scenario.duration, len(keys)))
        begin_as_usual(teacher, world, scenario, keys)

    begin_as_usual = Teacher.begin
    monkeypatch.setattr(Teacher, "begin", begin)
    view.seed(0)
    view.reset()
    assert episodes == [(0, 2.0, 3), (1, 6.0, 5)]
    for _ in range(60):
        view.step(np.zeros((8, 3), np.float32))
    assert episodes[2:] == [(0, 2.0, 3)] * 3 + [(1, 6.0, 5)]


def test_robots_do_what_the_network_says_where_the_teacher_has_no_share(small: Any) -> None:
    teacher = {"policy": "homing", "decisions": 440, "shares": [0.0, 0.0], "noise": 0.0}
    training = small(network=CLASSES, teacher=teacher)
    learner = make_learner(NetworkView(training), CLASSES, training.ppo, training.seed, "cpu")
    view = learner.env
    columns: list[Any] = [view.reset().copy()]  # before each decision
    commanded_outputs: list[Any] = []
    network_outputs: list[Any] = []

    def give_outputs(outputs: Any) -> None:
        with torch.no_grad():
            answers = learner.policy.answers_of(
                torch.from_numpy(columns[-1][:, : CLASSES.widths[0]])
            )
            network_outputs.append(learner.policy.likeliest_outputs(answers))
        commanded_outputs.append(outputs.copy())
        type(view).give_outputs(view, outputs)

    def step_wait() -> Any:
        stepped = type(view).step_wait(view)
        columns.append(stepped[0].copy())
        return stepped

    view.give_outputs, view.step_wait = give_outputs, step_wait
    imitate(training, learner, TrainingLog(), generator(0, "imitation"))
    assert len(commanded_outputs) == 12 * 5  # of 8 rows each
    # At first it begins new episodes.
    np.testing.assert_array_equal(commanded_outputs[1:], network_outputs[1:])
