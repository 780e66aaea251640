"""Models that stable-baselines3 saved; not run where it is not installed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.cli import app
from swarm_logistics_env.cli.study_choice import study_of
from swarm_logistics_env.errors import PolicyError, StudyError
from swarm_logistics_env.observations import N_COLUMNS
from swarm_logistics_env.policies import Policy, PolicySpec
from swarm_logistics_env.questions.specification import read_study_file

pytest.importorskip("stable_baselines3")


def saved(path: Path, **fields: Any) -> Path:
    """Save an untrained model."""
    from stable_baselines3 import PPO

    from swarm_logistics_env.adapters import SwarmVecEnv

    env = SwarmVecEnv(n_worlds=1, n_robots=2, **fields)
    small = {"net_arch": [4]}
    PPO("MlpPolicy", env, policy_kwargs=small, n_steps=8, batch_size=8, device="cpu").save(path)
    return path


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return saved(tmp_path_factory.mktemp("model") / "model.zip")


def test_a_trusted_model_plays_and_is_known_by_its_content(model: Path, tmp_path: Path) -> None:
    policy: Any = policies.load(str(model), trust_code=True)
    assert run_episode(Scenario(n_robots=3, duration=1.0), policy, seed=0).ended_at == 1.0
    rows = np.random.default_rng(0).normal(size=(4, N_COLUMNS)).astype(np.float32)
    from stable_baselines3 import PPO

    told, _ = PPO.load(model, device="cpu").predict(rows, deterministic=True)
    assert (policy.act(rows) == told).all()
    other = tmp_path / "other.zip"
    other.write_bytes(model.read_bytes())
    same = policies.load(str(other), trust_code=True)
    assert policies.identity(same) == policies.identity(policy)


def test_the_command_line_asks_too(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["run", "--policy", str(model), "--set", "duration=1"]
    assert app.run(arguments) == 2
    assert "executes the code in it" in capsys.readouterr().err
    assert app.run([*arguments, "--trust-code"]) == 0


def test_a_study_reads_it_where_somebody_trusts_it_and_no_file_says_so(
    model: Path, tmp_path: Path
) -> None:
    text = str(model)
    with pytest.raises(PolicyError, match="executes the code in it"):
        PolicySpec.of(text).load()
    with pytest.raises(PolicyError, match="executes the code in it"):
        PolicySpec.of(text).load({"of another task": object})
    assert isinstance(PolicySpec.of(text).replace(trusted=True).load(), Policy)
    study = study_of("quick", None, 1, [text], trust_code=True)
    assert study.plan().cases[0].policy.trusted
    with pytest.raises(ValueError, match="'trusted' is no field of a table"):
        PolicySpec.of({"name": text, "trusted": True})
    file = tmp_path / "study.toml"
    file.write_text(f'policies = ["{model}"]\nsizes = [{{ values = [2, 3] }}]\n')
    with pytest.raises(StudyError, match="is code, which runs when it is loaded"):
        read_study_file(file)
    (policy,) = read_study_file(file, trust_code=True).policies
    assert isinstance(policy.load(), Policy)
    file.write_text("task = 5\n")
    with pytest.raises(StudyError, match="task"):
        read_study_file(file)


def test_what_is_no_model_or_one_of_other_spaces_is_refused(model: Path, tmp_path: Path) -> None:
    broken, other = tmp_path / "broken.zip", saved(tmp_path / "other.zip", message_size=2)
    broken.write_bytes(model.read_bytes()[:500])
    for path, sentence in (
        (broken, "is no PPO model of stable-baselines3"),
        (other, r"to commands \(6,\): should map \(141,\) to \(4,\)"),
    ):
        with pytest.raises(PolicyError, match=sentence):
            policies.load(str(path), trust_code=True)
