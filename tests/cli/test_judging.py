"""`study compare` as a gate, on short studies that are really played."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env.cli import app

STUDY = """
name = "gate"
policies = [{{ name = "swarm-dt", parameters = {{ avoidance_range = {reach} }}, label = "mine" }}]
seeds = 8
scenario = {{ n_robots = 8, warehouse_width = 4.0, warehouse_height = 4.0, duration = 150 }}

[[sizes]]
values = [6, 8]

[[ablations]]
policy = "random-walk"
"""
STILL = """
import numpy as np

class Still:
    def reset(self, n_robots, seed): ...
    def act(self, observations): return np.zeros((len(observations), 4))
"""
PLAYED = {
    "old": (0.5, []),
    "same": (0.5, []),
    # Robots that keep so far from each other hardly move in so small a warehouse.
    "worse": (1.5, []),
    "still": (0.5, ["--policy", "gate_still:Still"]),
    "more policies": (0.5, ["--policy", "gate_still:Still", "--policy", "swarm-dt"]),
    "later seeds": (0.5, ["--first-seed", "3"]),
    "fresh seeds": (0.5, ["--first-seed", "1000", "--seeds", "2"]),
}


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a study for each entry of `PLAYED`."""
    folder = tmp_path_factory.mktemp("gate")
    (folder / "gate_still.py").write_text(STILL)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        for name, (reach, arguments) in PLAYED.items():
            file = folder / "gate.toml"
            file.write_text(STUDY.format(reach=reach))
            out = ["--out", str(folder / name), "--processes", "1"]
            assert app.run(["study", "run", str(file), *arguments, *out]) == 0
    return folder


def compare(studies: Path, new: str, *gates: str) -> int:
    options = [option for gate in gates for option in ("--fail-if", gate)]
    return app.run(["study", "compare", str(studies / "old"), str(studies / new), *options])


@pytest.mark.parametrize("gate", ["change < 0", "possibly change < 0", "possibly change < -0.1"])
def test_unchanged_code_passes(
    studies: Path, gate: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert compare(studies, "same", gate) == 0
    printed = capsys.readouterr().out
    assert f"Gate '{gate}' passes" in printed
    said = "| 0.000 | exact: the runs of both studies are the same |"
    for size in (6, 8):
        assert f"| mine: change, N = {size} (Scalability) {said}" in printed
    # Whatever an ablation takes beside it is not judged.
    assert "random-walk" not in printed


def test_a_regression_fails(studies: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert compare(studies, "worse", "change < 0") == 1
    assert "mine: change, N = 8 (Scalability)" in capsys.readouterr().out
    assert compare(studies, "worse", "change < -0.3") == 1
    assert compare(studies, "worse", "change > 0") == 0


def test_another_policy_in_the_place_of_the_judged_one_fails_and_is_named(
    studies: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert compare(studies, "still", "change < 0") == 1
    printed = capsys.readouterr().out
    assert "| mine -> gate_still:Still: change, N = 8 (Scalability) | -1.000 [" in printed
    assert "random-walk" not in printed


def test_a_policy_without_a_match_fails_and_is_named(
    studies: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert compare(studies, "more policies", "change < 0") == 1
    printed = capsys.readouterr().out
    for policy in ("gate_still:Still", "swarm-dt"):
        assert (
            f"policy '{policy}' of the new study has no match: the old study judges 'mine'"
        ) in printed
    assert (
        "policy 'mine' of the old study has no match: the new study judges 'gate_still:Still', "
        "'swarm-dt'"
    ) in printed
    # Without a gate nothing fails.
    assert compare(studies, "more policies") == 0


def test_runs_are_paired_over_the_seeds_that_both_studies_have(
    studies: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert compare(studies, "later seeds", "possibly change < 0") == 0
    printed = capsys.readouterr().out
    assert "exact: the runs of both studies are the same" in printed
    shared = "Runs are paired over the shared seeds, 3 to 7."
    assert f"Only in the old study, and left out: seeds 0 to 2. {shared}" in printed
    assert f"Only in the new study, and left out: seeds 8 to 10. {shared}" in printed
    assert compare(studies, "fresh seeds", "change < 0") == 1
    assert (
        "the studies share no seed: the old one has 0 to 7, the new one 1000 to 1001"
    ) in capsys.readouterr().out
