from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import policies, spi
from swarm_logistics_env.cli import app
from swarm_logistics_env.errors import PolicyError, TrainingError
from swarm_logistics_env.policies import SwarmDT
from swarm_logistics_env.policies.tuned import read_tuned
from swarm_logistics_env.train.evaluation import Evaluated, evaluate
from swarm_logistics_env.train.tuning import RANGES, Trial, Tuning, tune, values_of

pytest.importorskip("optuna")

SCENARIO = {
    "warehouse_width": 4.0, "warehouse_height": 3.0, "n_robots": 3, "n_items": 5, "duration": 20.0,
}  # fmt: skip


def small(**fields: Any) -> Tuning:
    given = {"trials": 4, "seeds": 2, "modes": ("FM4",), "robots": 1, "threads": 1, "confirm": 3}
    return Tuning(**{"policy": "swarm-dt-follow", "scenario": SCENARIO, **given, **fields})


def found(trials: list[Trial]) -> list[tuple[object, ...]]:
    return [(tuple(trial.parameters.items()), trial.values) for trial in trials]


def test_a_search_starts_from_the_policys_own_and_ends_in_a_policy(tmp_path: Path) -> None:
    trials = tune(small(), tmp_path, command="the command")
    own = SwarmDT(heading_follows=True).parameters
    assert trials[0].parameters == {name: getattr(own, name) for name in RANGES}
    assert len(trials) == 4
    best = max(trials, key=lambda trial: trial.values[0])
    policy: Any = policies.load(str(tmp_path / "result.json"))
    assert policy.parameters.heading_follows
    for name, value in best.parameters.items():
        assert getattr(policy.parameters, name) == value
    measures = [score.measure for score in read_tuned(tmp_path / "result.json").scores]
    assert measures[:2] == ["P", "P"]
    front = [trial for trial in trials if trial.is_best]
    for trial in trials:
        assert trial.is_best or any(
            all(a >= b for a, b in zip(other.values, trial.values)) for other in front
        )


def test_a_search_that_was_cut_short_goes_on_as_it_would_have(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from swarm_logistics_env.train import tuning

    whole = tune(small(), tmp_path / "whole")
    real, calls = evaluate, []

    def dies(*arguments: Any) -> Evaluated:
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return real(*arguments)

    monkeypatch.setattr(tuning, "evaluate", dies)
    with pytest.raises(KeyboardInterrupt):
        tune(small(), tmp_path / "cut")
    monkeypatch.setattr(tuning, "evaluate", real)
    assert found(tune(small(), tmp_path / "cut")) == found(whole)
    with pytest.raises(TrainingError, match="holds a training with another seed"):
        tune(small(seed=1), tmp_path / "cut")
    more = tune(small(trials=5), tmp_path / "cut")
    assert found(more)[:4] == found(whole)
    assert len(more) == 5


def test_objectives_are_p_and_means_over_the_modes() -> None:
    asked = small(modes=("FM1", "FM4"), robots=2, objectives=("FT", "P", "R"))
    p_o = np.array([30.0, 50.0])
    p_f = {
        "FM1": np.array([20.0, 40.0]),
        "FM4": np.array([12.0, 8.0]),
        "removed": np.array([32.0, 40.0]),
    }
    measured = Evaluated(10, dict.fromkeys(p_f, 2), p_o, p_f)
    robustness = [spi.robustness(p_o, p_f[mode], n=10, m=2).value for mode in ("FM1", "FM4")]
    expected = ((30 + 10 - 72) / 2 / 40, 40.0, np.mean(robustness))
    assert values_of(asked, measured) == pytest.approx(expected)
    nothing = measured._replace(p_o=np.zeros(2))
    assert values_of(asked, nothing) == (-1.0, 0.0, -1.0)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"policy": "swarm-dt-folow"}, "no policy to tune; did you mean 'swarm-dt-follow'"),
        ({"policy": "central"}, "no policy to tune"),
        ({"objectives": ("Q",)}, "objectives"),
        ({"modes": ("FM9",)}, "FM9"),
        ({"trial": 3}, "no field 'trial'; did you mean 'trials'"),
    ],
)
def test_what_cannot_be_searched_is_refused(fields: dict[str, Any], sentence: str) -> None:
    with pytest.raises(TrainingError, match=sentence):
        small(**fields)


def test_a_tuned_policy_that_cannot_be_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    for record, sentence in (
        ({"policy": "swarm-td", "parameters": {}}, "no scripted policy 'swarm-td'; did you mean"),
        ({"policy": "swarm-dt", "parameters": {"taxis": 1.0}}, "no field 'taxis'"),
        ({"a": 1}, "holds no tuned policy"),
        ([], "holds no tuned policy"),
    ):
        path.write_text(json.dumps(record))
        with pytest.raises(PolicyError, match=sentence):
            policies.load(str(path))


def test_the_command_says_what_is_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, sentence in (
        ([], "should be given a preset"),
        (["delivery", "--tune", "swarm-dt"], "should be given a preset"),
        (["delivery", "--seeds", "3"], "--seeds does not go with delivery"),
        (["delivery", "--trials", "3"], "evaluation.faults: should name the modes"),
        (["--tune", "swarm-dt", "--steps", "3"], "--steps does not go with swarm-dt"),
        (["deliver"], "no training preset 'deliver'; did you mean 'delivery'"),
        (["--tune", "swarm"], "no policy to tune"),
    ):
        assert app.run(["train", *arguments]) == 2
        assert sentence in capsys.readouterr().err
