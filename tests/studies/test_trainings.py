"""A recipe that was trained several times: all of its networks are one policy of a study."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode, spi
from swarm_logistics_env.errors import PolicyError, StudyError
from swarm_logistics_env.policies.spec import WEIGHTS, trainings_of
from swarm_logistics_env.studies import Study

SHIPPED = [*trainings_of("ppo-robust@all")[:2], "ppo-delivery"]
SMALL = Scenario(n_robots=4, n_items=6, restock=True, duration=60.0)


@pytest.fixture
def recipe(tmp_path: Path) -> str:
    """A recipe of five trainings; the shipped networks stand for them."""
    for number in range(1, 6):
        source = WEIGHTS / f"{SHIPPED[number % 3]}.safetensors"
        shutil.copy(source, tmp_path / f"mine@{number}.safetensors")
    return str(tmp_path / "mine@all.safetensors")


def study(recipe: str, **fields: Any) -> Study:
    asked: dict[str, Any] = {"policies": [recipe], "seeds": 3, "scenario": SMALL}
    faults = [{"modes": ["FM4"], "robots": [2]}]
    return Study(**{**asked, "indicators": ["R"], "faults": faults, **fields})


def test_a_study_judges_all_trainings_together(recipe: str) -> None:
    asked = study(recipe)
    asked.run()
    (verdict,) = asked.findings().verdicts
    assert verdict.estimate is not None
    assert (verdict.estimate.n_trainings, verdict.estimate.n_seeds) == (5, 3)

    files = trainings_of(recipe)
    p_o, p_f = (
        [
            [run_episode(SMALL, policies.load(one), s, faults).delivered for s in range(3)]
            for one in files
        ]
        for faults in ([], ["FM4:2"])
    )
    same = spi.robustness(p_o, p_f, n=4, m=2)
    assert (verdict.estimate.value, verdict.estimate.low) == (same.value, same.low)
    means = [cell.mean.value for cell in asked.findings().cells]
    assert means == pytest.approx([np.mean(p_o), np.mean(p_f)], rel=1e-12)


def test_its_report_says_over_what(recipe: str, tmp_path: Path) -> None:
    sizes = [{"values": [2, 4]}]  # under so few faults nothing is delivered
    asked = study(recipe, out=tmp_path / "judged", sizes=sizes, indicators=["S"], seeds=5)
    asked.run()
    written = asked.report()
    (page,) = (path.read_text() for path in written if path.suffix == ".html")
    assert "mine, 5 trainings" in page
    assert "5 trainings x 5 paired seeds" in page


def test_trainings_count_in_order_and_go_by_their_files(recipe: str) -> None:
    folder = Path(recipe).parent
    shutil.copy(folder / "mine@1.safetensors", folder / "mine@10.safetensors")
    assert [Path(one).name for one in trainings_of(recipe)[-2:]] == [
        "mine@5.safetensors",
        "mine@10.safetensors",
    ]


@pytest.mark.parametrize("name", ["ppo-nobody@all", "nowhere/mine@all.safetensors"])
def test_fewer_than_two_trainings_are_refused(name: str) -> None:
    with pytest.raises(PolicyError, match=r"two trainings or more.* found 0"):
        policies.load(name)


def test_several_trainings_are_no_policy_to_play(recipe: str) -> None:
    with pytest.raises(PolicyError, match="is 5 trainings: should name one of"):
        policies.load(recipe)


def test_several_trainings_have_a_fixed_number_of_seeds(recipe: str) -> None:
    with pytest.raises(StudyError, match="--all-seeds"):
        study(recipe, seeds=30, until_clear=True).plan()
