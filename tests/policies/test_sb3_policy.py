"""Models that stable-baselines3 saved; not run where it is not installed."""

from __future__ import annotations

import importlib
import json
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.core.errors import PolicyError, StudyError
from swarm_logistics_env.policies import Policy, PolicySpec
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.study.questions.specification import read_study_file
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.views.cli.policy_choice import policies_of
from swarm_logistics_env.views.cli.study_choice import study_of
from swarm_logistics_env.world.motion import INPUTS
from swarm_logistics_env.world.observations import N_COLUMNS
from swarm_logistics_env.wrappers import DiscreteActions, MotionFrame
from tests.wrappers.conftest import brief

pytest.importorskip("stable_baselines3")

from swarm_logistics_env.adapters import SwarmVecEnv, SwarmVecNormalize


def saved(path: Path, **fields: Any) -> Path:
    """Save an untrained model."""
    from stable_baselines3 import PPO

    env = SwarmVecEnv(n_worlds=1, **(fields or {"n_robots": 2}))
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

    actions, _ = PPO.load(model, device="cpu").predict(rows, deterministic=True)
    assert (policy.act(rows) == actions).all()
    other = tmp_path / "other.zip"
    other.write_bytes(model.read_bytes())
    policy_of_copy = policies.load(str(other), trust_code=True)
    assert policies.identity(policy_of_copy) == policies.identity(policy)


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
    study = study_of("quick", None, 1, policies_of([text], True), trust_code=True)
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
    broken = tmp_path / "broken.zip"
    broken.write_bytes(model.read_bytes()[:500])
    framed = saved(tmp_path / "framed.zip", make_env=lambda _: MotionFrame(brief(n_robots=2)))
    for path, frame, sentence in (
        (broken, False, "is no model of stable-baselines3: File is not a zip file"),
        (framed, False, "learned through MotionFrame: should be read with frame=True, or --frame"),
        (model, True, r"rows of shape .*: with frame=True, or --frame, should be 9\d inputs"),
    ):
        with pytest.raises(PolicyError, match=sentence):
            policies.load(str(path), trust_code=True, frame=frame)
    with pytest.raises(PolicyError, match="executes the code in it"):
        policies.from_sb3(model)
    data = {"policy_class": {"__module__": "sb3_contrib.common.recurrent.policies"}}
    with zipfile.ZipFile(broken, "w") as archive:
        archive.writestr("data", json.dumps(data))
    with pytest.raises(PolicyError, match=r"broken\.zip is recurrent: should have no memory"):
        policies.from_sb3(broken, trust_code=True)


def test_a_model_of_wrappers_is_read_within_them(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "wrappers_of_model.py").write_text("def wrap(env):\n    return env\n")
    monkeypatch.syspath_prepend(tmp_path)
    policy: Any = policies.load(str(model), trust_code=True, env="wrappers_of_model:wrap")
    assert policy.wrap.__name__ == "wrap"
    rows = np.random.default_rng(0).normal(size=(4, N_COLUMNS)).astype(np.float32)
    policy.reset(4, 0)
    alone = policies.from_sb3(model, trust_code=True)
    np.testing.assert_array_equal(policy.act(rows), alone.act(rows))


@pytest.mark.daily
@pytest.mark.parametrize(
    ("algorithm", "form"),
    [("PPO", MotionFrame), ("A2C", MotionFrame), ("DQN", lambda env: DiscreteActions(env)),
     ("DQN", lambda env: DiscreteActions(MotionFrame(env)))],
)  # fmt: skip
def test_a_model_plays_as_in_the_environment_that_it_learned_in(
    algorithm: str, form: Any, tmp_path: Path
) -> None:
    import stable_baselines3

    def make_env(world: int = 0) -> Any:
        return form(brief(n_robots=3))

    env = SwarmVecNormalize(SwarmVecEnv(make_env=make_env, n_worlds=1), clip_obs=2.0)
    kind = getattr(stable_baselines3, algorithm)
    learned = kind("MlpPolicy", env, policy_kwargs={"net_arch": [4]}, seed=0)
    learned.learn(300)
    learned.save(tmp_path / "model.zip")
    env.save(str(tmp_path / "rows.pkl"))
    env.training = False
    frame = env.observation_space.shape == (len(INPUTS),)
    files: dict[str, Any] = {"frame": frame, "normalize": tmp_path / "rows.pkl"}
    policy = policies.from_sb3(tmp_path / "model.zip", trust_code=True, **files)
    of_object = policies.of(learned, frame=frame, normalize=env)

    world = make_env()
    rows, plays = world.reset_arrays(5), [Play(brief().scenario.replace(n_robots=3), policy, 5)]
    plays.append(Play(brief().scenario.replace(n_robots=3), of_object, 5))
    for _ in range(15):
        actions, _ = learned.predict(env.normalize_obs(rows), deterministic=True)
        rows, *_ = world.step_arrays(actions)
        for run in plays:
            run.step()
            np.testing.assert_array_equal(
                run.world.state.robot_position, world.warehouse.state.robot_position
            )
    options = ["--frame"] * frame + ["--normalize", str(tmp_path / "rows.pkl"), "--trust-code"]
    arguments = ["run", "--policy", str(tmp_path / "model.zip"), "--set", "duration=1", *options]
    assert app.run(arguments) == 0


def test_options_for_models_are_refused_without_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert app.run(["run", "--policy", "homing", "--frame"]) == 2
    assert "--frame: is for a model of stable-baselines3, a .zip file" in capsys.readouterr().err


OWN_CODE = """\
import torch
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.dqn.policies import DQNPolicy
from stable_baselines3.sac.policies import SACPolicy
from stable_baselines3.td3.policies import TD3Policy

class Activation(torch.nn.Tanh): ...
class OfSAC(SACPolicy): ...
class OfTD3(TD3Policy): ...
class OfDQN(DQNPolicy): ...

class Features(BaseFeaturesExtractor):
    def __init__(self, space):
        super().__init__(space, 4)
        self.layers = torch.nn.Sequential(torch.nn.Linear(space.shape[0], 4), torch.nn.Dropout())

    def forward(self, rows):
        return self.layers(rows)
"""


@pytest.mark.parametrize("algorithm", ["SAC", "TD3", "DQN"])
def test_a_policy_class_of_ones_own_is_read_by_its_algorithm(
    algorithm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import stable_baselines3

    (tmp_path / "own_code.py").write_text(OWN_CODE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_code", raising=False)
    own_code = importlib.import_module("own_code")

    def make_env(world: int) -> Any:
        return DiscreteActions(brief(n_robots=2)) if algorithm == "DQN" else brief(n_robots=2)

    classes = {"features_extractor_class": own_code.Features, "activation_fn": own_code.Activation}
    learned = getattr(stable_baselines3, algorithm)(
        getattr(own_code, f"Of{algorithm}"), SwarmVecEnv(make_env=make_env, n_worlds=1),
        policy_kwargs={"net_arch": [4], **classes}, buffer_size=8, seed=0, device="cpu",
    )  # fmt: skip
    learned.save(tmp_path / "model.zip")
    rows = np.random.default_rng(0).normal(size=(4, N_COLUMNS)).astype(np.float32)
    learned.policy.set_training_mode(True)
    of_object = policies.of(learned).act(rows)
    assert learned.policy.training
    read = policies.from_sb3(tmp_path / "model.zip", trust_code=True)
    np.testing.assert_array_equal(read.act(rows), of_object)
    np.testing.assert_array_equal(policies.of(learned.predict).act(rows), of_object)
    learned.policy.double()
    with pytest.raises(
        PolicyError, match=r"numbers of type torch.float64: should have torch.float"
    ):
        policies.of(learned)

    # Without its code it would be another network, of which stable-baselines3 only warns.
    del own_code.Activation
    with pytest.raises(PolicyError, match=r"its policy_kwargs cannot be restored here \(Attribute"):
        policies.from_sb3(tmp_path / "model.zip", trust_code=True)
    (tmp_path / "own_code.py").unlink()
    monkeypatch.delitem(sys.modules, "own_code")
    importlib.invalidate_caches()
    with pytest.raises(
        PolicyError, match="needs own_code, which it was saved with: install it, or"
    ):
        policies.from_sb3(tmp_path / "model.zip", trust_code=True)


def test_actions_of_another_environment_are_refused(tmp_path: Path) -> None:
    from gymnasium.spaces import Box, Dict, Discrete
    from stable_baselines3 import PPO

    env = SwarmVecEnv(n_worlds=1, n_robots=2)
    learned = PPO("MlpPolicy", env, n_steps=8, batch_size=8, device="cpu")
    for space in (Discrete(5), Box(-1.0, 1.0, (3,))):
        learned.policy.action_space = space
        with pytest.raises(PolicyError, match=r"maps observations \(141,\) to .*: should map"):
            policies.of(learned)
    learned.policy.action_space = Dict({"drive": space})
    with pytest.raises(PolicyError, match=r"to Dict\(.*: should map a row of observations, in one"):
        policies.of(learned)


def test_statistics_that_normalize_no_rows_leave_them(model: Path, tmp_path: Path) -> None:
    """As saved with norm_obs=False, or switched off later."""
    from stable_baselines3.common.vec_env import VecNormalize

    rows = np.random.default_rng(0).normal(size=(4, N_COLUMNS)).astype(np.float32)
    plain = policies.from_sb3(model, trust_code=True).act(rows)
    made = VecNormalize(SwarmVecEnv(n_worlds=1, n_robots=2), norm_obs=False)
    switched = VecNormalize(SwarmVecEnv(n_worlds=1, n_robots=2))
    switched.obs_rms.mean += 1.0
    switched.norm_obs = False
    for number, env in enumerate((made, switched)):
        file = tmp_path / f"{number}.pkl"
        env.save(str(file))
        for normalize in (file, env):
            read = policies.from_sb3(model, trust_code=True, normalize=normalize)
            np.testing.assert_array_equal(read.act(rows), plain)
    with pytest.raises(PolicyError, match=r"cannot read .*none.pkl: No such file"):
        policies.from_sb3(model, trust_code=True, normalize=tmp_path / "none.pkl")
