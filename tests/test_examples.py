"""The examples run, in small, and give what they are about."""

from __future__ import annotations

import runpy
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import FAILURE_MODES, Scenario, Warehouse, policies
from swarm_logistics_env.policies import SwarmDT
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.views.cli import app

EXAMPLES = Path(__file__).parents[1] / "examples"
MIXED = f"{EXAMPLES / 'mixed_swarm.py'}:Mixed"


def main(name: str, **sizes: Any) -> Any:
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))["main"](**sizes)


@pytest.mark.daily
def test_evolution_ends_with_a_front_of_both_indicators(tmp_path: Path) -> None:
    pytest.importorskip("cma", reason="needs cma")
    picture = tmp_path / "front.png"
    front = main("evolve_front", prices=(2.0,), evaluations=4, seeds=2, fresh=2, out=picture)
    assert list(front) == ["start", "price of R 2"]
    assert all(len(p) == 2 and robustness.n_seeds == 2 for p, robustness in front.values())
    assert picture.stat().st_size > 10_000


def test_the_search_for_constants_ends_with_a_change() -> None:
    scenario = Scenario(n_robots=10, duration=100.0, restock=True)
    assert main("tune_swarm_dt", rounds=2, seeds=2, confirm=2, scenario=scenario).n_seeds == 2


@pytest.mark.daily
def test_what_stable_baselines3_learns_is_a_policy_and_a_file_to_judge(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("stable_baselines3", reason="needs the extra train")
    file = tmp_path / "swarm.zip"
    learned, scripted = main("ppo_swarm", total_timesteps=5_120, duration=10.0, file=file)
    printed = capsys.readouterr().out
    assert f"P on three new seeds: {learned}" in printed
    assert len(learned) == len(scripted) == 3
    _, _, command = printed.partition("Judge it: swarm-logistics ")
    assert app.run([*command.split(), "--seeds", "3", "--out", str(tmp_path / "judged")]) == 0


@pytest.mark.daily
def test_a_loop_of_ones_own_learns_on_the_frame_of_motion() -> None:
    torch = pytest.importorskip("torch", reason="needs the extra train")
    pytest.importorskip("stable_baselines3", reason="needs the extra train")
    torch.set_num_threads(1)
    learned, scripted = main("ppo_from_nothing", total_timesteps=92_160, duration=20.0, judged=2)
    assert len(learned) == len(scripted) == 2
    assert sum(scripted) > 0
    assert sum(learned) > 0  # an untrained one delivers nothing


@pytest.mark.daily
def test_each_robot_of_a_mixed_swarm_does_what_its_policy_does_upon_the_same_rows() -> None:
    scenario = Scenario(n_robots=10, n_items=20, duration=20.0)
    world = Warehouse(scenario)
    rows = world.reset(0)
    mixed, *parts = (policies.load(name) for name in (MIXED, "swarm-dt", "ppo-delivery"))
    for policy in (mixed, *parts):
        start(policy, scenario, 0)
    while not world.is_over_time:
        commands = mixed.act(rows)
        first, second = (part.act(rows) for part in parts)
        np.testing.assert_array_equal(commands, np.concatenate([first[:8], second[8:]]))
        rows = world.step(commands)
    identities = [policies.identity(policies.load(MIXED)) for _ in range(2)]
    assert identities[0] == identities[1]
    smaller = policies.load(MIXED)
    smaller.parts.pop()  # type: ignore[attr-defined]  # of this class
    assert policies.identity(smaller) != identities[0]


def test_own_policy_is_judged_beside_swarm_dt(tmp_path: Path) -> None:
    table = main("judge_my_policy", seeds=2, duration=20.0, out=tmp_path / "out")
    assert sorted(set(table["policy"])) == ["Straight", "swarm-dt"]
    assert (tmp_path / "out" / "report.html").exists()


@pytest.mark.daily
def test_own_failure_mode_is_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FAILURE_MODES, "hoarder", FAILURE_MODES["FM4"])  # gone again afterwards
    estimates = main("failure_mode", seeds=2, n_robots=10, m=3, duration=60.0)
    assert [estimate.indicator for estimate in estimates] == ["R", "FT"]


@pytest.mark.daily
@pytest.mark.skipif(not shutil.which("cc"), reason="needs a compiler of C")
def test_trials_in_the_engine_of_the_study_are_its_runs(tmp_path: Path) -> None:
    sizes: Any = {"seeds": 2, "duration": 40.0, "bodies": "chipmunk", "out": tmp_path}
    tables = [findings.cell_table for findings in main("dotbot_trials", **sizes)]
    of_study, of_trials = (dict(zip(t["cell"], t["mean"], strict=True)) for t in tables)
    assert of_trials.items() <= of_study.items()
    assert len(of_trials) == 2


@pytest.mark.daily
@pytest.mark.parametrize(("driving", "code"), [(0.0, 1), (1.0, 0)])
def test_gate_judges_the_change(
    driving: float, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Weak(SwarmDT):
        identity = "a controller that stands still, or the old one itself"

        def act(self, observations: Any) -> Any:
            return driving * super().act(observations)

    monkeypatch.setattr(policies, "load", lambda _, **changed: (Weak if changed else SwarmDT)())
    assert main("regression_gate", seeds=6, duration=60.0, out=tmp_path) == code


@pytest.mark.parametrize("study", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.name)
def test_study_file_can_be_planned(study: Path) -> None:
    assert list(Study.from_file(study).plan().runs)
