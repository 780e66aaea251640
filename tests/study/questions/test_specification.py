"""Specifications: what a factor is called, which seeds and looks there are, and what varies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.study.questions.specification import (
    Ablation,
    Faults,
    Specification,
    looks_up_to,
    read_study_file,
    seeds_in_words,
)


@pytest.mark.parametrize(
    ("manner", "words"),
    [
        ({}, ""),
        ({"duration": 2.5}, "for 2.5 s"),
        ({"factor": 0.0}, "factor 0"),
        ({"intermittent": (2.0, 3.5)}, "2 s failed, 3.5 s not, in turn"),
        ({"kind": "scout"}, "kind scout"),
        ({"role": "carrier"}, "role carrier"),
        (
            {
                "kind": "scout", "role": "carrier", "intermittent": (2.0, 3.0), "factor": 0.5,
                "duration": 9.0,
            },
            "for 9 s, factor 0.5, 2 s failed, 3 s not, in turn, role carrier, kind scout",
        ),
    ],
)  # fmt: skip
def test_faults_say_how_long_how_far_and_whom(manner: dict[str, Any], words: str) -> None:
    faults = Faults(modes=("FM1",), **manner)
    assert str(faults) == words
    assert faults.manner == {name: x for name, x in manner.items() if name != "duration"}


@pytest.mark.parametrize(
    ("seeds", "words"),
    [
        ([4], "4"),
        (range(3), "0 to 2"),
        ([0, 1, 2, 3, 8], "0 to 3, 8"),
        ([1, 3, 5, 6], "1, 3, 5 to 6"),
    ],
)
def test_seeds_in_a_row_are_told_as_ranges(seeds: Any, words: str) -> None:
    assert seeds_in_words(seeds) == words


def test_a_study_is_looked_at_every_ten_seeds_and_at_its_end() -> None:
    for most, looks in ((3, (3,)), (10, (10,)), (11, (10, 11)), (40, (10, 20, 30, 40))):
        assert looks_up_to(most) == looks
        specification = Specification(seeds=most, first_seed=7, until_clear=True)
        assert specification.looks == looks
        assert specification.replace(until_clear=False).looks == ()
        assert specification.seed_numbers == range(7, 7 + most)


def test_trust_reaches_the_policies_of_ablations_too() -> None:
    homing: Any = {"policy": "homing"}
    policies: Any = "homing", "swarm-dt"
    specification = Specification(policies=policies, ablations=(homing,))
    assert not any(policy.trusted for policy in specification.policies)
    trusted = specification.trusting()
    (ablation,) = trusted.ablations
    assert [policy.trusted for policy in (*trusted.policies, ablation.policy)] == [True] * 3
    assert ablation == Ablation(policy=PolicySpec.of("homing").replace(trusted=True))


def test_fields_vary_in_the_base_and_in_every_factor_with_a_preset_of_its_own() -> None:
    of_preset = {"scenario": {"preset": "dots", "n_items": 5}}
    factors: dict[str, Any] = {
        "sizes": [{"values": [2, 3], **of_preset}, {"values": [4, 5], "scenario": {"n_items": 3}}],
        "faults": [{"modes": ["FM1"], **of_preset}],
        "parameters": [{"name": "delivery_width", "values": [2, 1], **of_preset}],
        "ablations": [{"policy": "homing", **of_preset}],
    }
    varied = Specification(**factors).varying({"n_items": 9, "restock": True})
    assert varied.scenario.model_dump()["n_items"] == 9
    of_another, of_base = varied.sizes
    assert of_base.scenario == {"n_items": 3}
    for factor in (of_another, *varied.faults, *varied.parameters, *varied.ablations):
        assert factor.scenario == {"preset": "dots", "n_items": 9, "restock": True}


def test_a_study_is_named_after_its_file_unless_it_names_itself(tmp_path: Path) -> None:
    path = tmp_path / "My study.toml"
    path.write_text("seeds = 2\n")
    assert read_study_file(path).name == "My-study"
    path.write_text('name = "mine"\nseeds = 2\n')
    assert read_study_file(path).name == "mine"
    path.write_text("seeds = 0\n")
    with pytest.raises(StudyError, match=r"My study\.toml: Specification\.seeds = 0: should be gr"):
        read_study_file(path)
    path.write_text('policies = ["mine:Policy"]\nablations = [{ policy = "mine:Part" }]\n')
    with pytest.raises(StudyError, match="policy 'mine:Policy' is code"):
        read_study_file(path)
    trusted = read_study_file(path, trust_code=True)
    assert trusted.policies[0].trusted
    path.write_text('ablations = [{ policy = "mine:Part" }]\n')
    with pytest.raises(StudyError, match="policy 'mine:Part' is code"):
        read_study_file(path)
