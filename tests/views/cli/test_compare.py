"""`study compare` as a gate, on played studies and recorded trials; `study plan` of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.views.cli import app
from tests.conftest import SMALL
from tests.views.cli.conftest import Command


class Still:
    """Stands still."""

    identity = "still"

    def reset(self, n_robots: int, seed: int) -> None: ...

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.zeros((len(observations), 4))


PLAYED: dict[str, dict[str, Any]] = {
    "old": {},
    "same": {},
    "still": {"policies": [Still()]},
    "fresh": {"first_seed": 1000},
}


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a study for each entry of `PLAYED`."""
    folder = tmp_path_factory.mktemp("gate")
    shared = {"policies": [{"name": "swarm-dt", "label": "mine"}], "faults": [], "parameters": []}
    fields = {**SMALL, **shared, "seeds": 6, "sizes": [{"values": [4, 6]}]}
    for name, changed in PLAYED.items():
        Study(out=folder / name, **{**fields, **changed}).run()
    return folder


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("new", "gate", "code", "words"),
    [
        ("same", "change<0", 0, "N = 6 (Scalability) | 0.000 | exact: the runs of both"),
        # Another policy in the place of the judged one is named.
        ("still", "change<0", 1, "| mine -> Still: change, N = 6 (Scalability) | -1.000"),
        ("still", "change>0", 0, "Gate passes (fails if change>0)"),
        ("still", None, 0, "Change of P"),  # without a gate nothing fails
        ("fresh", "change<0", 1, "share no seed: the old one has 0 to 5, the new one"),
    ],
)
def test_gates_end_with_their_code_and_name_what_they_are_about(
    studies: Path, new: str, gate: str | None, code: int, words: str, command: Command
) -> None:
    option = f" --fail-if {gate}" if gate else ""
    assert words in command(f"study compare {studies}/old {studies}/{new}{option}", code=code)


def imported(command: Command, name: str, faulty: tuple[int, ...], first: int = 0) -> None:
    """Make a study of four seeds of P_o, P_S and the P_F that are given."""
    rows = ["fault,faulty,robots,seed,delivered"]
    for seed, p in enumerate(faulty, first):
        rows += [f"none,0,25,{seed},{40 + seed}", f"removed,1,25,{seed},{38 + seed}"]
        rows += [f"FM1,1,25,{seed},{p}"]
    Path(f"{name}.csv").write_text("\n".join(rows))
    command(f"judge {name}.csv --out {name}")


def test_recorded_trials_are_gated_and_paired_by_the_seeds_of_their_files(
    command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    imported(command, "old", (40, 41, 43, 42))
    imported(command, "new", (20, 22, 21, 23))
    imported(command, "late", (44, 41, 41, 42), first=2)
    for arguments, code, words in (
        ("old new", 0, "change, FM1, m = 1"),
        ("old new --fail-if R<0", 1, "Gate fails (fails if R<0)"),
        ("new old --fail-if R<0 --fail-if change<0", 0, "passes"),
        # Seeds 2 and 3: 44 + 41 instead of 43 + 42. By their places it would be another change.
        ("old late --fail-if change<0", 0, "FM1, m = 1 (Fault tolerance and robustness) | 0.000 ["),
        ("old new --fail-if S<0", 2, "tests nothing"),
    ):
        assert words in command(f"study compare {arguments}", code=code)
    columns = "|  | value [95 %] | verdict under Holm |\n| --- | --- | --- |\n"
    fault = "FM1, m = 1 (Fault tolerance and robustness)"
    robustness = f"| new: R, {fault} | -0.442 [-0.474, -0.408] | above 0: refuted |\n\n"
    change = f"| old -> new: change, {fault} | -0.482 [-0.526, -0.434] | above 0.1: refuted |\n\n"
    fails = f"## Gate fails (fails if R<0)\n\n{columns}{robustness}"
    passes = f"## Gate passes (fails if change > 0.1 at FM1)\n\n{columns}{change}"
    gates = {"R<0": fails, "change > 0.1 at FM1": passes}
    for texts in (["R<0", "change > 0.1 at FM1"], ["change > 0.1 at FM1", "R<0"]):
        line = ["study", "compare", "old", "new"]
        line += [word for text in texts for word in ("--fail-if", text)]
        assert app.run(line) == 1
        assert capsys.readouterr().out == "".join(gates[text] for text in texts)
    equal = [
        f"| old: change, {condition} (Fault tolerance and robustness) | 0.000 | "
        "untestable: equal P |"
        for condition in ("no fault", "removed, m = 1", "FM1, m = 1")
    ]
    assert command("study compare old old") == (
        "\n".join([f"## Change of P\n\n{columns}{equal[0]}", *equal[1:], "", ""])
    )


def test_seeds_needed_are_told_of_a_stored_study(command: Command) -> None:
    imported(command, "old", (40, 41, 43, 42))
    (test,) = (t for t in Study.stored("old").findings().verdicts if t.compared.indicator == "R")
    assert test.estimate is not None
    distance = f"{spi.minimum_detectable_effect(test.estimate, 0.8):.3f}"
    seeds = spi.seeds_for_power(test.estimate, -0.1, 0.8)
    row = f"R > 0, FM1, m = 1 | -0.100 | {seeds} | {distance} | "
    assert row in command("study plan old --effect -0.1")
    assert "| – | no effect is named |" in command("study plan old")
    assert "at the thresh" in command("study plan old --effect 0")
    assert "--policy: a study that" in command("study plan old --policy homing", code=2)
