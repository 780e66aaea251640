"""Results of three studies, frozen as data: P, delivery times, intervals and verdicts.

`python tests/test_frozen_results.py` plays them anew. A change of what a seed produces is a new
version of the environment; a change of how the package is built may change nothing here.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks import Outcome
from swarm_logistics_env.study.verdicts.columns import VERDICT_COLUMNS, frame
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from tests.made_up import CAREFUL

FROZEN = Path(__file__).parent / "frozen"
SHIPPED = Path(__file__).parents[1] / "examples" / "shipped_policies.toml"
# As they were when their runs were frozen.
HOMING = {"name": "homing", "parameters": CAREFUL, "label": "homing"}
POLICIES = ["swarm-dt", "swarm-dt-follow", HOMING, "ppo-delivery", "ppo-robust"]
NUMBERS = ("value", "low", "high", "p_value", "p_holm", "change", "change_low", "change_high")
WORDS = (
    "policy", "indicator", "comparison", "verdict", "verdict_holm", "claim_verdict_holm",
    "equivalence", "equivalence_holm", "conclusion", "flags",
)  # fmt: skip


def shipped(**fields: Any) -> Study:
    return Study.from_file(SHIPPED, **{"policies": POLICIES, **fields})


STUDIES: dict[str, Callable[[], Study]] = {
    "paper": lambda: Study.preset("paper", seeds=3),
    "quick": lambda: Study.preset("quick"),
    "shipped_policies": lambda: shipped(seeds=3),
}


def conditions(study: Study) -> Iterator[tuple[str, str]]:
    """Yield every condition in words, and the key of its case."""
    default = Scenario().model_dump(mode="json")
    for case in study.plan().cases:
        fields = case.scenario.model_dump(mode="json")
        words = {
            "policy": case.policy.title,
            "scenario": {k: v for k, v in fields.items() if v != default[k]},
            "faults": [f.model_dump(mode="json") for f in case.faults],
            "behaviour": case.behaviour,
        }
        yield json.dumps(words), case.key


def verdicts(results: StudyResults) -> list[dict[str, Any]]:
    """Return the words and numbers of every comparison, to nine digits."""
    rows = frame(results.verdicts, VERDICT_COLUMNS).to_dict("records")
    return [
        {name: row[name] for name in WORDS}
        | {name: None if row[name] != row[name] else float(f"{row[name]:.9g}") for name in NUMBERS}
        for row in rows
    ]


def frozen(name: str) -> Any:
    return json.loads((FROZEN / f"{name}.json").read_text(encoding="utf-8"))


def played(study: Study, *, times: bool, processes: int = 1) -> dict[str, list[dict[str, Any]]]:
    """Return what the runs of each condition gave, by the condition in words."""
    study.run(processes=processes)
    outcomes = study.findings().outcomes
    runs: dict[str, list[dict[str, Any]]] = {}
    for words, case in conditions(study):
        for seed in study.plan().seeds:
            outcome = outcomes[case, seed]
            run: dict[str, Any] = {"seed": seed, "P": outcome.delivered}
            run |= {
                "all_delivered": outcome.all_delivered,
                "equal_runs": (outcome.digest or "")[:8],
            }
            if times:
                run["times"] = outcome.delivery_times.round(6).tolist()
            runs.setdefault(words, []).append(run)
    return runs


@pytest.mark.parametrize("name", STUDIES)
def test_verdicts_follow_from_the_frozen_runs(name: str) -> None:
    expected, study = frozen(name), STUDIES[name]()
    outcomes = {}
    for words, case in conditions(study):
        for run in expected["runs"][words]:
            times = run.get("times")
            outcomes[case, run["seed"]] = Outcome(
                delivery_times=np.array(times or []),
                untimed=run["P"] if times is None else None,
                all_delivered=run["all_delivered"],
                digest=run["equal_runs"],
            )
    judged = verdicts(judge(study.plan(), outcomes))
    for verdict, expected_row in zip(judged, expected["verdicts"], strict=True):
        assert {name: verdict[name] for name in WORDS} == {
            name: expected_row[name] for name in WORDS
        }
        numbers = [
            np.array([row[n] for n in NUMBERS], dtype=float) for row in (verdict, expected_row)
        ]
        assert numbers[0] == pytest.approx(numbers[1], rel=1e-7, abs=1e-12, nan_ok=True), (
            expected_row
        )


@pytest.mark.daily
def test_runs_played_anew_equal_the_frozen_ones() -> None:
    faults = [{"modes": ["FM4"], "robots": [2]}]
    few = shipped(
        policies=["swarm-dt", HOMING, "ppo-robust"], seeds=1, sizes=[{"values": [5, 25]}],
        parameters=[], faults=faults,
    )  # fmt: skip
    for name, study in {"quick": Study.preset("quick", seeds=1), "shipped_policies": few}.items():
        expected = frozen(name)["runs"]
        for words, runs in played(study, times=name == "quick").items():
            for run, frozen_run in zip(runs, expected[words]):
                assert (run["seed"], run["P"]) == (frozen_run["seed"], frozen_run["P"]), words
                assert run.get("times") == pytest.approx(frozen_run.get("times")), words


if __name__ == "__main__":
    for name, build in STUDIES.items():
        study = build()
        runs = played(study, times=name == "quick", processes=2)
        text = json.dumps({"runs": runs, "verdicts": verdicts(study.findings())}, indent=0)
        (FROZEN / f"{name}.json").write_text(text + "\n", encoding="utf-8")
