"""Policies with parameters of their own, as a specification names them."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env import policies
from swarm_logistics_env.errors import PolicyError, StudyError, SwarmLogisticsError
from swarm_logistics_env.policies import PolicySpec, SwarmDT
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.specification import Specification

FILE = """
seeds = 1
scenario = { n_robots = 3, n_items = 4, warehouse_width = 3, warehouse_height = 3, duration = 2 }
sizes = [{ values = [2, 3] }]
policies = [
    "swarm-dt",
    { name = "swarm-dt", parameters = { taxis_gain = 0.5, diffusion = 0.7 } },
    { name = "swarm-dt", parameters = { taxis_gain = 0.25 }, label = "half-hearted" },
]
"""
LABELS = ["swarm-dt", "swarm-dt (taxis_gain = 0.5, diffusion = 0.7)", "half-hearted"]


def test_parameters_are_part_of_what_a_run_is_and_are_told(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(FILE)
    study = Study.from_file(tmp_path / "mine.toml", out=tmp_path / "out")
    plan = study.plan()
    played = {case.policy.title: case for case in plan.cases}
    assert list(played) == LABELS
    assert len({case.identity for case in played.values()}) == 3
    assert len({run.key for run in plan.runs}) == 3 * 2
    assert study.run().failed == 0
    study.report()
    assert "half-hearted" in (tmp_path / "out" / "report.md").read_text()
    # A store knows them again, and so does JSON.
    again = Study.stored(tmp_path / "out")
    assert again.specification == study.specification
    assert again.plan().cases == plan.cases
    assert Specification.from_json(study.specification.to_json()) == study.specification


class Silent(SwarmDT):
    """A policy that tells nobody its parameters."""

    def __init__(self, speed: float = 0.0) -> None:
        super().__init__()
        self.speed = speed


def test_parameters_reach_the_policy_and_count_where_it_does_not_tell_them(tmp_path: Path) -> None:
    chosen = PolicySpec(name="swarm-dt", parameters={"taxis_gain": 0.0})
    # Swarm D-T without its taxis is the random walk.
    assert policies.identity(chosen.load()) == PolicySpec.of("random-walk").identity()
    tables = [{"name": f"{__name__}:Silent", "parameters": {"speed": s}} for s in (0.1, 0.2)]
    one, other = map(PolicySpec.of, tables)
    assert one.identity() != other.identity()
    assert (one.runs_code, chosen.runs_code) == (True, False)
    # A file may not name code by way of parameters.
    table = f'{{ name = "{__name__}:Silent", parameters = {{ speed = 0.1 }} }}'
    (tmp_path / "mine.toml").write_text(FILE.replace('"swarm-dt",', f"{table},", 1))
    with pytest.raises(StudyError, match="is code, which runs when it is loaded"):
        Study.from_file(tmp_path / "mine.toml")
    assert Study.from_file(tmp_path / "mine.toml", trust_code=True).plan().cases


def test_an_object_is_a_policy_of_its_own_that_each_run_copies() -> None:
    own = SwarmDT(taxis_gain=0.0)
    spec = PolicySpec.of(own)
    assert (spec.title, spec.runs_code) == ("SwarmDT", False)
    assert spec.load() is not own
    assert spec.identity() == policies.identity(own)
    assert PolicySpec.of(spec) is spec
    with pytest.raises(PolicyError, match="should have the methods reset and act"):
        PolicySpec(name="x", made=object()).load()


@pytest.mark.parametrize(
    ("policy", "words"),
    [
        ({"nam": "swarm-dt"}, "PolicySpec has no field 'nam'; did you mean 'name'?"),
        ({"name": "swarm-dt", "parameters": {"taxis_gian": 1.0}}, "did you mean 'taxis_gain'?"),
        ({"name": "swarm-dt", "parameters": {"taxis_gain": "x"}}, "taxis_gain = 'x'"),
        ({"name": "swarm-dt", "parameters": {"trust_code": True}}, "'trust_code' is no parameter"),
        ({"name": "swarm-dt", "parameters": 3}, "PolicySpec.parameters = 3"),
        ({"name": "swarm-td", "parameters": {"taxis_gain": 1.0}}, "did you mean 'swarm-dt'?"),
        (3, "a table of name and parameters"),
    ],
)
def test_what_is_no_policy_is_refused_in_one_sentence(policy: object, words: str) -> None:
    with pytest.raises(SwarmLogisticsError) as caught:
        Study(policies=[policy], sizes=[{"values": [2, 3]}]).plan()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
