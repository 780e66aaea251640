"""The answer as a terminal shows it: folded sentences, and rows in columns."""

from __future__ import annotations

from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.tasks.outcome import Outcome
from tests.conftest import Check
from tests.made_up import P_BY_SEED, delivered, judged


def play(policy: str, setting: Setting, seed: int) -> Outcome:
    """Play a run: FM1 costs an item more at each next seed, FM4 none."""
    count = 4 * P_BY_SEED[policy][seed] - seed * (setting.name == "FM1")
    return delivered(count, digest=f"{policy} {setting} {seed}")


def test_sentences_are_folded_and_rows_stand_in_columns(check_recorded: Check) -> None:
    lines = []
    for n_policies, width, shortens in ((1, 40, False), (2, 40, True), (3, 56, True)):
        study = Study(
            policies=[*P_BY_SEED][:n_policies], seeds=4, indicators=["R"],
            faults=[{"modes": ["FM1", "FM4"], "robots": [1]}], compares_policies=n_policies > 2,
        )  # fmt: skip
        text = terminal_answer(answer(judged(study, play)), width, shortens=shortens)
        lines += [f"#### {n_policies} policies, {width} letters", *text.splitlines()]
    check_recorded("terminal.txt", lines)
