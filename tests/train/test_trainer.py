from __future__ import annotations

import errno
import itertools
import json
import pickle
import pkgutil
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import load_file

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3.common.callbacks import ConvertCallback

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.core.errors import SwarmLogisticsError, TrainingError
from swarm_logistics_env.policies.learned import LearnedPolicy, PolicyCard
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE, WarehouseTask
from swarm_logistics_env.train import training_callback
from swarm_logistics_env.train.evaluation import versions
from swarm_logistics_env.train.learner import (
    CHECKPOINT,
    make_learner,
    read_checkpoint,
    save_checkpoint,
    tensors_of,
)
from swarm_logistics_env.train.privileged import PRIVILEGED
from swarm_logistics_env.train.settings import Scores
from swarm_logistics_env.train.trainer import train
from swarm_logistics_env.train.training_worlds import NetworkView
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.world.motion import INPUTS, MotionView
from swarm_logistics_env.world.motion.classes import GROUPS
from swarm_logistics_env.world.motion.voices import N_MESSAGES


def weights(path: Path) -> dict[str, bytes]:
    return {name: tensor.tobytes() for name, tensor in load_file(path).items()}


@pytest.fixture(scope="module")
def done(small: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The policy file of the small training."""
    return train(small(), tmp_path_factory.mktemp("done"))


def test_the_learning_rate_stays_at_its_end_where_a_rollout_passes_that(
    small: Any, tmp_path: Path
) -> None:
    slow, fast = (
        weights(train(small(agent_steps=1, ppo=small().ppo.replace(learning_rate=rate)), out))
        for rate, out in ((1e-3, tmp_path / "slow"), (0.5, tmp_path / "fast"))
    )
    assert slow == fast


def test_a_training_ends_in_a_policy_that_plays(small: Any, tmp_path: Path) -> None:
    scores = Scores(seeds=2, sizes=(2, 3), modes=("FM4",), robots=(1,), n_robots=3)
    path = train(small(scores=scores), tmp_path, command="the command")
    policy: Any = policies.load(str(path))
    assert run_episode(Scenario(n_robots=4, duration=2.0), policy, seed=0).ended_at == 2.0
    card = policy.card
    assert (card.name, card.command, card.seed) == ("small", "the command", 0)
    assert card.agent_steps == 640
    assert (card.scenario["warehouse_width"], card.scenario["n_robots"]) == (5.0, 3)
    assert {"torch", "swarm-logistics-env", "simulation"} <= card.versions.keys()
    assert card.scored_with == versions()
    measured = {(score.measure, score.condition) for score in card.scores}
    assert measured >= {("P", "N = 2"), ("P", "N = 3"), ("P", "N = 3, FM4, m = 1")}
    curve = (tmp_path / "curve.csv").read_text().splitlines()
    assert curve[0] == "agent_steps,seconds,cpu_seconds,P,P_FM4,R_FM4"
    assert [line.split(",")[0] for line in curve[1:]] == ["0", "320", "640"]
    assert list((tmp_path / "tensorboard").glob("events*"))
    assert json.loads((tmp_path / "training.json").read_text())["command"] == "the command"


def test_scores_that_could_not_be_measured_are_told_and_measured_by_the_next_call(
    small: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    training = small(scores=Scores(seeds=1, sizes=(2, 3), n_robots=3))

    def broken(*_: object) -> None:
        raise RuntimeError("a wheel came off")

    with monkeypatch.context() as changed:
        changed.setattr(WarehouseTask, "play", broken)
        with pytest.raises(TrainingError, match=r"runs of the scores failed .*a wheel came off"):
            train(training, tmp_path)
    card = policies.read_card(tmp_path / "small.safetensors")
    assert (card.scores, card.scored_with) == ((), {})
    trained_with = WAREHOUSE.code()
    monkeypatch.setattr(WarehouseTask, "code", lambda _: "a later one")
    later = policies.read_card(train(training, tmp_path))
    assert later.scores
    assert later.scored_with["simulation"] == "a later one"
    assert later.versions["simulation"] == trained_with


@pytest.mark.parametrize("talks", [False, True])
@pytest.mark.parametrize("head", ["outputs", "classes"])
def test_torch_and_the_policy_file_agree(small: Any, head: str, talks: bool) -> None:
    network = {"hidden": (8,), "head": head, "talks": talks}
    scenario = small().scenario.replace(message_size=N_MESSAGES if talks else 0)
    training = small(network=network, scenario=scenario)
    n_inputs = training.network.widths[0]
    learner = make_learner(NetworkView(training), training.network, training.ppo, 0, "cpu")
    with torch.no_grad():
        for parameter in learner.policy.parameters():
            parameter.add_(0.3 * torch.randn_like(parameter))
    card = PolicyCard(name="x", network=training.network)
    outputs_of = LearnedPolicy(card, tensors_of(learner.policy)).outputs_of
    n_columns = n_inputs + len(PRIVILEGED) + (N_MESSAGES if talks else 0)
    columns = np.random.default_rng(0).normal(size=(300, n_columns)).astype(np.float32)
    # What PPO takes for the most likely action.
    likely, _ = learner.predict(columns, deterministic=True)
    outputs = outputs_of(columns[:, :n_inputs])
    if talks:
        messages = learner.policy.messages_of(torch.from_numpy(columns[:, :n_inputs]))
        np.testing.assert_allclose(outputs[:, -N_MESSAGES:].clip(0.0, 1.0), messages, atol=1e-5)
        assert 0.0 < messages.mean() < 1.0
        outputs = outputs[:, :-N_MESSAGES]
    if head == "classes":
        groups = np.split(outputs, np.cumsum(GROUPS)[:-1], axis=1)
        outputs = np.stack([group.argmax(axis=1) for group in groups], axis=1)
        assert (outputs == likely).all()
        return
    np.testing.assert_allclose(np.clip(outputs, -1.0, 1.0), likely, rtol=0, atol=1e-5)


def test_the_view_trains_what_the_policy_plays_and_goes_on_from_a_checkpoint(small: Any) -> None:
    training = small(worlds=[{"n_robots": 3}])
    view = NetworkView(training)
    view.seed(3)
    inputs = view.reset()
    frame = MotionView(training.scenario)
    frame.begin(view.frame.keys)
    rng = np.random.default_rng(0)
    for _ in range(20):
        assert (frame.read(view.frame.rows) == inputs[:, : len(INPUTS)]).all()
        outputs = rng.uniform(-1, 1, (3, 3)).astype(np.float32)
        frame.command(outputs)
        inputs, *_ = view.step(outputs)
    other = pickle.loads(pickle.dumps(view))
    for _ in range(70):  # beyond the ends of episodes
        outputs = rng.uniform(-1, 1, (3, 3)).astype(np.float32)
        for array, array_of_copy in zip(view.step(outputs)[:2], other.step(outputs)[:2]):
            assert array.tobytes() == array_of_copy.tobytes()


def test_a_checkpoint_of_worlds_with_removed_robots_goes_on_to_the_same_bits(
    small: Any, tmp_path: Path
) -> None:
    training = small(
        worlds=[{"n_robots": 16, "conditions": [{"modes": ["removed"], "robots": [8]}]}] * 3,
        scenario=small().scenario.replace(duration=60.0),
    )
    learner = make_learner(NetworkView(training), training.network, training.ppo, 0, "cpu")
    learner._last_obs = learner.env.reset()  # as a rollout does
    save_checkpoint(tmp_path, learner, None)
    saved = read_checkpoint(tmp_path)
    assert saved is not None
    rng = np.random.default_rng(0)
    for _ in range(300):
        outputs = rng.uniform((0.5, -0.5, -1), (1, 0.5, 1), (48, 3)).astype(np.float32)
        for array, saved_array in zip(
            learner.env.step(outputs)[:2], saved["view"].step(outputs)[:2]
        ):
            assert array.tobytes() == saved_array.tobytes()


@pytest.mark.unmeasured
def test_a_policy_follows_from_its_seed_whatever_callbacks_see_or_stop(
    small: Any, done: Path, tmp_path: Path
) -> None:
    sees = ConvertCallback(lambda *_: True)
    assert weights(train(small(), tmp_path / "seen", callbacks=[sees])) == weights(done)
    stops = ConvertCallback(lambda inside, _: inside["self"].num_timesteps < 320)
    path = train(small(seed=1), tmp_path / "cut", callbacks=[stops])
    assert policies.read_card(path).agent_steps == 320
    assert weights(train(small(seed=1), tmp_path / "cut")) != weights(done)
    assert policies.read_card(path).agent_steps == 640


@pytest.mark.parametrize("device", ["gpu", "cuda"])
def test_nothing_is_begun_that_cannot_be(
    small: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    device: str,
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    sentence = rf"^device = '{device}': should be left out or one of \['cpu'\] here$"
    with pytest.raises(SwarmLogisticsError, match=sentence):
        train(small(), tmp_path / "out", device=device)
    with pytest.raises(TrainingError, match=r"callbacks = .*: should be a list of callbacks"):
        train(small(), tmp_path / "out", callbacks=[print])
    assert not (tmp_path / "out").exists()


def test_what_cannot_be_gone_on_with_is_refused(small: Any, done: Path, tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match="holds a training with another seed, worlds"):
        train(small(seed=1, worlds=[{"n_robots": 5}, {"n_robots": 3}]), done.parent)
    for text, reason in (("{}", "holds a training with another agent_steps"), ("", "is not JSON")):
        (tmp_path / "training.json").write_text(text)
        with pytest.raises(TrainingError, match=reason):
            train(small(), tmp_path)
    for name, end in (("training.json", None), ("checkpoint.pt", 1000)):
        (tmp_path / name).write_bytes((done.parent / name).read_bytes()[:end])
    with pytest.raises(TrainingError, match=r"checkpoint.pt is damaged .*: train into a new dir"):
        train(small(), tmp_path)
    record = json.loads((done.parent / "training.json").read_text())
    damaged: list[dict[str, Any]] = [{"sessions": {}}, {"training": []}]
    for changed in damaged:
        (tmp_path / "training.json").write_text(json.dumps({**record, **changed}))
        with pytest.raises(TrainingError, match=r"training.json is damaged"):
            train(small(), tmp_path)


def spoil_observations(patch: pytest.MonkeyPatch) -> None:
    """Let a robot sense what is no number, after 50 decisions."""
    read, n_reads = MotionView.read, itertools.count()

    def read_nan(frame: MotionView, observations: Any) -> Any:
        inputs = read(frame, observations)
        inputs[0, 0] = np.nan if next(n_reads) > 50 else inputs[0, 0]
        return inputs

    patch.setattr(MotionView, "read", read_nan)


OWN_REWARD = """
def reward(world, before, after):
    return float("nan") if world.state.time > 5.0 else 0.0
"""


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"learning_rate": 1e30}, "(an output of the network|a loss) is nan"),
        ({"learning_rate": 1e30, "n_minibatches": 1, "epochs": 1}, "network.* is "),
        ({"rewards": {"contact": -1e30}}, "a loss is inf"),
        ({"rewards": {"contact": -1e300}}, "a reward is -inf"),
        ({"rewards": {"own_reward.py:reward": 1.0}}, "reward term '.*:reward' = nan: should be"),
        ({}, "an observation is nan"),
    ],
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of numpy and stable-baselines3
def test_a_training_whose_numbers_are_not_finite_ends_in_a_sentence_and_keeps_the_best_policy(
    small: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    fields: dict[str, Any],
    reason: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("own_reward.py").write_text(OWN_REWARD)
    monkeypatch.setattr(training_callback, "CHECKPOINT_EVERY", 0.0)
    if not fields:
        spoil_observations(monkeypatch)
    settings = {name: value for name, value in fields.items() if name != "rewards"}
    ppo = small().ppo.replace(**settings)
    rewards = fields.get("rewards", {"contact": -1.0})
    training = small(rewards=rewards, ppo=ppo)
    remedy = "mend that, and the same command goes on from the last checkpoint"
    if "own_reward" not in str(rewards):
        remedy = re.escape(f", with a smaller ppo.learning_rate than {ppo.learning_rate:g} or sm")
    end = rf"of 640 agent-steps \(.*{reason}.*\): kept is best.safetensors, with P = .*{remedy}"
    for _ in range(2):  # who tries again is told the same
        with pytest.raises(TrainingError, match=end):
            train(training, tmp_path / "out")
    assert policies.read_card(tmp_path / "out/best.safetensors").agent_steps < 640
    saved = read_checkpoint(tmp_path / "out")
    assert saved is not None
    assert all(numbers.isfinite().all() for numbers in saved["policy"].values())


def full(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize(
    ("writer", "name"),
    [
        ("torch.utils.tensorboard.SummaryWriter", "add_scalar"),
        ("torch.utils.tensorboard.SummaryWriter", "flush"),
        ("pathlib.Path", "replace"),
        ("pathlib.Path", "write_bytes"),
        ("os", "fsync"),
    ],
)
def test_a_training_on_a_full_disk_ends_in_a_sentence_and_goes_on_when_there_is_room(
    small: Any,
    done: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    writer: str,
    name: str,
) -> None:
    monkeypatch.setattr(training_callback, "CHECKPOINT_EVERY", 0.0)
    save, saved = save_checkpoint, list[bytes]()
    with monkeypatch.context() as changed:

        def save_and_fill(*arguments: Any) -> None:
            save(*arguments)
            saved.append((tmp_path / CHECKPOINT).read_bytes())
            changed.setattr(pkgutil.resolve_name(writer), name, full)

        changed.setattr(training_callback, "save_checkpoint", save_and_fill)
        with pytest.raises(TrainingError, match="No space left on device"):
            train(small(), tmp_path)
    assert saved[-1] == (tmp_path / CHECKPOINT).read_bytes()
    assert not list(tmp_path.glob(".*"))
    assert weights(train(small(), tmp_path)) == weights(done)


@pytest.mark.parametrize("package", ["torch", "tensorboard"])
def test_a_missing_library_is_told_before_anything_is_written(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    package: str,
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    for module in ("trainer", "training_callback"):
        monkeypatch.delitem(sys.modules, f"swarm_logistics_env.train.{module}")
    assert app.run(["train", "delivery", "--out", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr().err
    assert package in printed
    assert "pip install -c constraints.txt -e '.[train]'" in printed
    assert not (tmp_path / "out").exists()


def test_deviations_keep_above_their_floor(small: Any, tmp_path: Path) -> None:
    ppo = small().ppo.replace(deviations=(0.5, 0.3, 0.01), least_deviation=(0.4, 0.1))
    assert [round(ppo.floor(done), 3) for done in (0.0, 0.5, 1.0)] == [0.4, 0.2, 0.1]
    ended = load_file(train(small(ppo=ppo.replace(learning_rate=1e-9)), tmp_path))
    # The last update began three quarters on; the start of the next one would have lowered none.
    np.testing.assert_allclose(ended["deviations"], [0.5, 0.4, 0.4], rtol=1e-5)


@pytest.mark.unmeasured
def test_where_the_rate_begins_anew_adam_does_too_also_in_a_training_that_goes_on(
    small: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    training = small(ppo=small().ppo.replace(restarts=((0.5, 2e-3),)))
    n_decisions: list[int] = []  # of each row's episode, one step after the rate began anew

    def interrupt(inside: dict[str, Any], _: object) -> bool:
        if inside["self"].num_timesteps > 320:
            n_decisions.extend(inside["self"].env.frame.counts.tolist())
            raise KeyboardInterrupt
        return True

    monkeypatch.setattr(training_callback, "CHECKPOINT_EVERY", 0.0)
    with pytest.raises(KeyboardInterrupt):
        train(training, tmp_path / "cut", callbacks=[ConvertCallback(interrupt)])
    assert n_decisions == [2] * training.rows
    uncut = weights(train(training, tmp_path / "uncut"))
    assert weights(train(training, tmp_path / "cut")) == uncut
    # The clock goes on where the first session stopped.
    curve = (tmp_path / "cut/curve.csv").read_text().splitlines()[1:]
    seconds = [float(line.split(",")[1]) for line in curve]
    assert seconds == sorted(seconds)
    saved = read_checkpoint(tmp_path / "uncut")
    assert saved is not None
    steps = {state["step"].item() for state in saved["optimizer"]["state"].values()}
    assert steps == {12.0}  # 3 batches of 2 epochs in 2 parts, of the 4 batches in all


def test_torch_has_as_many_threads_after_a_training_as_before(small: Any, tmp_path: Path) -> None:
    before = torch.get_num_threads()

    def broken(*_: object) -> bool:
        assert torch.get_num_threads() == 1
        raise KeyboardInterrupt

    torch.set_num_threads(2)
    try:
        with pytest.raises(KeyboardInterrupt):
            train(small(), tmp_path, callbacks=[ConvertCallback(broken)])
        assert torch.get_num_threads() == 2
        train(small(agent_steps=1), tmp_path / "whole")
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(before)
