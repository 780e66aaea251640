"""`study compare` as a gate: on short studies that are really played, and on recorded trials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.cli import app
from swarm_logistics_env.studies import Study
from tests.conftest import SMALL


class Still:
    """Stands still."""

    identity = "still"

    def reset(self, n_robots: int, seed: int) -> None: ...

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.zeros((len(observations), 4))


FIELDS: dict[str, Any] = {
    **SMALL,
    "policies": [{"name": "swarm-dt", "label": "mine"}],
    "seeds": 6,
    "sizes": [{"values": [4, 6]}],
    "faults": [],
    "parameters": [],
}
PLAYED: dict[str, dict[str, Any]] = {
    "old": {},
    "same": {},
    "still": {"policies": [Still()]},
    "fresh seeds": {"first_seed": 1000},
}


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a study for each entry of `PLAYED`."""
    folder = tmp_path_factory.mktemp("gate")
    for name, fields in PLAYED.items():
        Study(out=folder / name, **{**FIELDS, **fields}).run()
    return folder


@pytest.mark.parametrize(
    ("new", "gates", "code", "words"),
    [
        (
            "same",
            ["change < 0", "possibly change < -0.1"],
            0,
            [
                "Gate passes (fails if change < 0)",
                *(
                    f"| mine: change, N = {size} (Scalability) | 0.000 | exact: the runs of both "
                    "studies are the same |"
                    for size in (4, 6)
                ),
            ],
        ),
        # Another policy in the place of the judged one is named.
        ("still", ["change < 0"], 1, ["| mine -> Still: change, N = 6 (Scalability) | -1.000"]),
        ("still", ["change > 0"], 0, ["Gate passes (fails if change > 0)"]),
        ("still", [], 0, ["Change of P"]),  # without a gate nothing fails
        ("fresh seeds", ["change < 0"], 1, ["share no seed: the old one has 0 to 5, the new one"]),
    ],
)
def test_gates_end_with_their_code_and_name_what_they_are_about(
    studies: Path,
    new: str,
    gates: list[str],
    code: int,
    words: list[str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    options = [option for gate in gates for option in ("--fail-if", gate)]
    place = [str(studies / "old"), str(studies / new)]
    assert app.run(["study", "compare", *place, *options]) == code
    printed = capsys.readouterr().out
    for part in words:
        assert part in printed


TABLE = "fault,faulty,robots,seed,delivered\n"


def imported(path: Path, faulty: tuple[int, ...], first: int = 0) -> str:
    """A study of four seeds of P_o, P_S and the P_F that are given."""
    seeds = range(first, first + 4)
    rows = [f"none,0,25,{s},{40 + s}\nremoved,1,25,{s},{38 + s}\n" for s in seeds]
    rows += [f"FM1,1,25,{seed},{p}\n" for seed, p in zip(seeds, faulty)]
    path.with_suffix(".csv").write_text(TABLE + "".join(rows))
    assert app.run(["judge", str(path.with_suffix(".csv")), "--out", str(path)]) == 0
    return str(path)


def test_recorded_trials_are_gated_and_paired_by_the_seeds_of_their_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old = imported(tmp_path / "old", (40, 41, 43, 42))
    new = imported(tmp_path / "new", (20, 22, 21, 23))
    late = imported(tmp_path / "late", (44, 41, 41, 42), first=2)
    capsys.readouterr()
    for arguments, code, words in (
        ([old, new], 0, "change, FM1, m = 1"),
        ([old, new, "--fail-if", "R < 0"], 1, "Gate fails (fails if R < 0)"),
        ([old, new, "--fail-if", "change < -0.2 at FM1"], 1, "fails"),
        ([new, old, "--fail-if", "R < 0", "--fail-if", "change < 0"], 0, "passes"),
        # Seeds 2 and 3: 44 + 41 instead of 43 + 42. By their places it would be another change.
        ([old, late, "--fail-if", "change < 0 at FM1"], 0, "robustness) | 0.000 ["),
    ):
        assert app.run(["study", "compare", *arguments]) == code
        assert words in capsys.readouterr().out
    assert app.run(["study", "compare", old, new, "--fail-if", "S < 0"]) == 2
    assert "tests nothing" in capsys.readouterr().err


def test_seeds_needed_are_told_of_a_stored_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stored = imported(tmp_path / "old", (40, 41, 43, 42))
    capsys.readouterr()
    plan = ["study", "plan", stored]
    (test,) = (t for t in Study.stored(stored).findings().verdicts if t.compared.indicator == "R")
    assert test.estimate is not None
    found = []
    for effect in (-0.1, -0.5):
        assert app.run([*plan, "--effect", str(effect)]) == 0
        printed = capsys.readouterr().out
        seeds = spi.seeds_for_power(test.estimate, effect, 0.8)
        distance = f"{spi.minimum_detectable_effect(test.estimate, 0.8):.3f}"
        assert f"R > 0, FM1, m = 1 | {effect:.3f} | {seeds} | {distance} | " in printed
        found.append(seeds or 0)
    assert found[0] > found[1]
    for effects, words in (
        ([], "| – | no effect is named |"),
        (["--effect", "0"], "at the thresh"),
    ):
        assert app.run([*plan, *effects]) == 0
        assert words in capsys.readouterr().out
    assert app.run([*plan, "--policy", "homing"]) == 2
    assert "--policy: a study that was run has its own" in capsys.readouterr().err
