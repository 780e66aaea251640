from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.core.errors import TrainingError
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.train import Training, load_training, preset_names
from swarm_logistics_env.train.settings import PPOSettings, Teaching, WorldKind


@pytest.mark.unmeasured
@pytest.mark.parametrize("name", preset_names())
def test_every_preset_can_be(name: str) -> None:
    training = load_training(name)
    assert training.name == f"ppo-{name}"
    assert Training.from_json(training.to_json()) == training
    assert training.about


def test_rates_begin_anew_and_rewards_change_until_their_share_of_the_training() -> None:
    ppo = PPOSettings(
        learning_rate=0.5, final_learning_rate=0.1, restarts=((0.5, 0.3), (0.75, 0.2))
    )
    rates = [ppo.rate(done) for done in (0.0, 0.25, 0.5, 0.625, 0.75, 1.0, 1.01)]
    assert rates == pytest.approx([0.5, 0.3, 0.3, 0.2, 0.2, 0.1, 0.1])
    ppo = PPOSettings(least_deviation=(0.4, 0.1), least_until=0.5)
    floors = [ppo.floor(done) for done in (0.0, 0.25, 0.5, 1.01)]
    assert floors == pytest.approx([0.4, 0.2, 0.1, 0.1])
    teaching = Teaching(policy=PolicySpec.of("homing"), pull=0.2, pull_until=0.8)
    pulls = [teaching.pull_at(done) for done in (0.0, 0.4, 0.8, 1.01)]
    assert pulls == pytest.approx([0.2, 0.1, 0.0, 0.0])
    rewards = {"delivery": 1.0, "contact": -0.1}
    training = Training(rewards=rewards, final_rewards={"contact": -0.5}, final_rewards_from=0.5)
    weights = [training.rewards_at(done)["contact"] for done in (0.0, 0.25, 0.5, 1.0)]
    assert weights == pytest.approx([-0.1, -0.3, -0.5, -0.5])
    assert training.rewards_at(0.25)["delivery"] == 1.0


def test_worlds_of_several_kinds_stand_side_by_side() -> None:
    kinds: Any = [{"count": 2, "n_robots": 3, "scenario": {"n_items": 8}}, {"n_robots": 5}]
    training = Training(worlds=kinds)
    met = [(world.n_robots, world.n_items) for _, world in training.each_world]
    assert (met, training.rows) == ([(3, 8), (3, 8), (5, 60)], 11)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("agent_step = 5", "Training has no field 'agent_step'; did you mean 'agent_steps'"),
        ("seed =", "is not TOML"),
        ("seed = 4294967296", "seed = 4294967296: should be less than 4294967296"),
        ("name = '../x'", r"should match pattern '\^\[A-Za-z0-9_-\]"),
        ("network.decides_every = 3", "should divide the control steps of each episode"),
        ("ppo.n_minibatches = 7", "should divide the batch of 150 robots x 128 steps"),
        ("ppo.restarts = [[0.5, 1e-3], [0.5, 1e-4]]", "should be one after another, all before"),
        ("final_rewards.contact = -1.0", "'contact' should be among the rewards, too"),
        ("rewards = { 'my.py:pay' = 1.0 }", "mine.toml: .* term 'my.py:pay' is code, which"),
        ("rewards.deliver = 1.0", "no reward term 'deliver'; did you mean 'delivery'"),
        ("scenario.n_itens = 5", "Scenario has no field 'n_itens'"),
        ("teacher.policy = 'swarm-dt'", "'swarm-dt': should be homing or homing-stock, which"),
        ("teacher.policy = 'my.py:Own'", "'my.py:Own': should be homing or homing-stock, which"),
        ("network.head = 'classes'\nppo.least_until = 0.5", "ppo.least_until: should be left out"),
        ("scenario.message_size = 2", "should be 0, as network.talks = false"),
        ("network.talks = true", "message_size = 0: should be 2, as network.talks = true"),
        ("ppo.message_weight = 0.5", "ppo.message_weight: should be left out, as network.talks"),
        ("ppo.warm_up = 5", "ppo.warm_up: should be left out, as it learns from nothing"),
        ("start = 'homing'", "start = 'homing': should be a policy that train wrote"),
        ("start = 'ppo-robost'", "start = 'ppo-robost': no policy .* did you mean 'ppo-robust'"),
        ("start = 'ppo-robust'", r"hidden = \(128, 128\): should be \(128, 64\), as ppo-robust"),
        (
            "start = 'ppo-robust'\nnetwork = { hidden = [128, 64], head = 'classes' }",
            "network.head = 'classes': should be 'outputs', as ppo-robust",
        ),
        ("evaluation = { n_robots = 2, faults = { FM1 = 3 } }", "FM1 = 3: .* most n_robots = 2"),
        ("evaluation.n_robots = 9999", "n_robots = 9999 .* do not fit"),
        ("scores.modes = ['FM9']", "no failure mode 'FM9'; did you mean"),
        ("scores = { n_robots = 2, modes = ['FM1'] }", "robots = 3: should be less than n_robots"),
        ("worlds = [{ n_robots = 900 }]", "n_robots = 900 .* do not fit"),
        ("worlds = [{ scenario.n_itens = 5 }]", "Scenario has no field 'n_itens'"),
        ("worlds = [{ scenario.n_robots = 5 }]", "the swarm size is a field of its own"),
        ("worlds = [{ n_robots = 2 }]\nconditions = [{ modes = ['FM1'] }]", "swarm, 2 robots"),
        ("conditions = [{ modes = ['FM9'] }]", "no failure mode 'FM9'; did you mean"),
        ("indicators = { weights.Q = 1.0, references = 9.0 }", "should be 'S', 'FT', 'R', 'A' or"),
        ("indicators = { weights.FT = 1.0, references = 9.0 }", 'should be "measured" where FT'),
        (
            "indicators = { weights.S = 1.0, references = 'measured' }",
            "S should have worlds that differ in n_robots alone",
        ),
        (
            (
                "conditions = [{ modes = ['FM4'], robots = [2] }]\n"
                "indicators = { weights.FT = 1.0, references = 'measured' }"
            ),
            r'FT should have conditions with modes = \["removed"\], robots = \[2\]',
        ),
        ("conditions = [{ onset = [9, 1] }]", "should be the earliest time, then the latest"),
        ("conditions = [{ scenario.n_robots = [5] }]", "swarm sizes belong in `worlds`"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(TrainingError, match=sentence):
        load_training(str(path))


def test_a_file_changes_fields_of_a_preset_one_by_one_and_has_its_own_name(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(
        "preset = 'robust'\nscenario.n_items = 30\nrewards.stocking = 0.2\nworlds = [{count = 2}]"
    )
    robust = load_training("robust")
    mine = load_training(str(path), seed=3)
    changes = {
        "name": "mine",
        "about": "",
        "seed": 3,
        "scenario": robust.scenario.replace(n_items=30),
        "rewards": {**robust.rewards, "stocking": 0.2},
        "worlds": (WorldKind(count=2),),
    }
    assert dict(mine) == {**dict(robust), **changes}


def test_unknown_presets_and_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    for preset, sentence in (
        ("'robus'", "no training preset 'robus'; did you mean 'robust'"),
        ("3", "mine.toml: preset = 3: should be a text, as 'robust'"),
    ):
        path.write_text(f"preset = {preset}")
        with pytest.raises(TrainingError, match=sentence):
            load_training(str(path))
    with pytest.raises(TrainingError, match="no training preset 'deliver'; did you mean 'delivery"):
        load_training("deliver")
    with pytest.raises(TrainingError, match="cannot read the training"):
        load_training(str(tmp_path / "none.toml"))
