"""`judge TRIALS`: how trials are read, as it is shown, and where they are kept."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.views.cli import judge_trials
from swarm_logistics_env.views.cli.judge_trials import numbers, pairs
from tests.views.cli.conftest import Command


def trials_of(n_widths: int) -> str:
    """Return trials of that many widths: two of each, and of the first two more."""
    rows = ["robots,width,P,operator"]
    for width in range(1, n_widths + 1):
        operator = "a very long name of Bob" if width < 9 else ""
        rows += [f"5,{width},{20 + width + trial},{operator}" for trial in range(2)]
        if width < 3:
            rows += [f"10,{width},{9 + trial},{operator}" for trial in range(1 + width)]
    return "\n".join(rows)


@pytest.mark.parametrize(("n_widths", "left"), [(20, ""), (21, "1 row more"), (22, "2 rows more")])
def test_columns_and_the_first_twenty_conditions_are_shown(
    n_widths: int, left: str, command: Command
) -> None:
    Path("many.csv").write_text(trials_of(n_widths))
    shown = command("judge many.csv --check --ignore operator").splitlines()
    assert shown[:8] == [
        f"## many.csv: {2 * n_widths + 5} trials",
        "",
        "| column | read as | values |",
        "| --- | --- | --- |",
        "| robots | robots | 5, 10 |",
        f"| width | parameter | 1, 2, 3, 4, 5, 6, and {n_widths - 6} more |",
        f"| P | performance | 21, 22, 9, 10, 23, 11, and {n_widths - 2} more |",
        "| operator | left out | a very long , (empty) |",
    ]
    further = ["", f"And {left}."] if left else []
    assert shown[9 : 13 + 20 + len(further)] == [
        f"## {n_widths + 2} conditions",
        "",
        "| policy | fault | parameters | N | trials |",
        "| --- | --- | --- | --- | --- |",
        "| many | none | width = 1 | 5, 10 | 2 each |",
        "| many | none | width = 2 | 5, 10 | 2 to 3 |",
        *(f"| many | none | width = {width} | 5 | 2 |" for width in range(3, 21)),
        *further,
    ]


def test_faults_onsets_and_policies_are_shown_in_words(command: Command) -> None:
    rows = [
        f"{policy},8,{fault},{faulty},{onset},{p + seed}"
        for policy in ("ours", "theirs")
        for fault, faulty, onset, p in (("none", 0, 0, 20), ("jam", 2, 0, 9), ("jam", 2, 62.5, 15))
        for seed in range(2)
    ]
    Path("lab.csv").write_text("\n".join(["policy,robots,fault,faulty,onset,P", *rows]))
    shown = command("judge lab.csv --check")
    for policy in ("ours", "theirs"):
        for fault in ("none", "jam, m = 2", "jam, m = 2 from 62.5 s"):
            assert f"| {policy} | {fault} |  | 8 | 2 |\n" in shown


def test_each_other_judgement_of_a_file_is_kept_beside_the_earlier_ones(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders: list[str] = []
    monkeypatch.setattr(
        judge_trials, "show_report", lambda _, out, full: folders.append(out.as_posix())
    )
    Path("lab.csv").write_text(trials_of(2))
    for number, setup in enumerate(("", "--setup floor=wood", "--setup floor=tiles"), start=1):
        for _ in range(2):
            shown = command(f"judge lab.csv --ignore operator {setup}")
            folder = f"results/judged/lab{f'-{number}' * (number > 1)}"
            sentence = (
                f"results/judged/lab holds an earlier judgement, so this one is in {folder}\n"
            )
            assert (sentence in shown) == (number > 1)
            assert folders[-1] == folder


def test_names_and_values_of_options_are_parted_at_the_first_sign() -> None:
    assert pairs("--setup", None) == {}
    assert numbers("--reference", None) == {}
    assert pairs("--setup", [" a = b=c ", "d=1"]) == {"a": "b=c", "d": "1"}
    assert numbers("--reference", ["a=2", "b = 1e-3"]) == {"a": 2.0, "b": 0.001}
    for text in ("a", "a=", "=b", " = ", ""):
        with pytest.raises(StudyError, match=f"^--setup {text}: should be NAME=VALUE$"):
            pairs("--setup", [text])
    with pytest.raises(StudyError, match=r"^--reference a=b: should be NAME=NUMBER$"):
        numbers("--reference", ["a=b"])
