"""The whole report of a study: every sentence of it, and what it tells of how it was made."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.latex import latex_tables
from swarm_logistics_env.study.report.set_up import methods
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.report.write import markdown
from swarm_logistics_env.study.runs.recorded import RecordedStudy
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.trials import read_trials
from tests.made_up import paper
from tests.study.report.conftest import NARROW

FROZEN = Path(__file__).parents[2] / "frozen"


def test_a_report_is_as_recorded(tmp_path: Path) -> None:
    """Every number and sentence, but for the sheet of the set-up."""
    results = paper(seeds=12, noise=2.0, full=NARROW, unaffected=frozenset({"FM2"}))
    report = document(results)
    texts = {
        "report.md": markdown(report).partition("\n## Set-up")[0],
        "tables.tex": latex_tables(report.paper),
        "answer.txt": terminal_answer(answer(results), 80),
    }
    for name, text in texts.items():
        made = tmp_path / name
        made.write_text(f"{text.rstrip()}\n", encoding="utf-8")
        lines = (FROZEN / name).read_text(encoding="utf-8").splitlines()
        assert made.read_text(encoding="utf-8").splitlines() == lines, (
            f"if {made} is as it should be, put it into {FROZEN}"
        )


# 16 trials of four robots, half of them with a stuck one.
PAIRED = "seed,N,fault,m,P\n" + "".join(
    f"{seed},4,{fault},9\n" for fault in ("none,0", "stuck,1") for seed in range(8)
)
BLOCKS = PAIRED.replace("seed", "block").replace("\n7,", "\n6,")  # two trials in the last
ONE_EACH = re.sub(r"^(\d)", r"room \1", PAIRED.replace("seed", "block"), flags=re.MULTILINE)
FEWER = BLOCKS.rsplit("\n", 2)[0] + "\n"  # two of one condition alone
UNPAIRED = re.sub(r"^[^,]*,", "", PAIRED, flags=re.MULTILINE)


@pytest.mark.parametrize(
    ("study", "looks", "sentences"),
    [
        (
            {"seeds": 20},
            (),
            [
                "in 20 simulated runs of each of 2 conditions, paired by seed.",
                "We report robustness R,",
                "the 95 % interval that inverts the paired t-test of a logarithm. An indicator is",
                "where this test rejects at 2.5 % on that side,",
                "less than 10 % of P_o",
            ],
        ),
        (
            {"seeds": 20},
            (10, 20),
            [
                "in at least 20 simulated runs",
                "the interval that inverts",
                "after 10 and 20 seeds",
                "hold the true value with 95 %. An indicator",
                "rejects at its share of 2.5 % on that side",
            ],
        ),
        (
            {"seeds": 2, "policies": ["ppo-robust@all"]},
            (),
            ["logarithm. An interval over trainings holds for trainings like those played;"],
        ),
        (PAIRED, (), ["in 8 trials of each of 2 conditions, paired by seed.", "paired t-test"]),
        (ONE_EACH, (), ["in 8 trials of each of 2 conditions, paired by block.", "paired t-test"]),
        (BLOCKS, (), ["in 7 blocks, by the means of their trials in 2 conditions.", "paired t"]),
        (FEWER, (), ["in 7 blocks, by the means of their trials in 2 conditions.", "paired t"]),
        (UNPAIRED, (), ["in up to 8 independent trials of each of 2 conditions.", "Welch's t"]),
    ],
)
def test_a_paper_is_told_what_was_tested_and_how(
    study: dict[str, Any] | str, looks: tuple[int, ...], sentences: list[str], tmp_path: Path
) -> None:
    if isinstance(study, str):
        (tmp_path / "trials.csv").write_text(study)
        plan = RecordedStudy.of(read_trials(tmp_path / "trials.csv")).plan
    else:
        faults = [{"modes": ["FM1"], "robots": [1]}]
        plan = Study(**{**study, "faults": faults, "indicators": ["R"]}).plan()
    paragraph = methods(plan, looks)
    assert [sentence for sentence in sentences if sentence not in paragraph] == [], paragraph
    assert ("trainings" in paragraph) == ("policies" in study)
