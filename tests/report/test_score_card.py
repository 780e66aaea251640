"""The score card: ranks, and the recorded cards of the shipped policies."""

from __future__ import annotations

import importlib
import json
import math
from pathlib import Path

import pytest

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.report import score_card
from swarm_logistics_env.report.score_card import Line, ScoreCard, rank, recorded
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.presets import PRESETS

CARD = ScoreCard(
    "mine<b>",
    (
        Line("P", "N = 25, no fault", 50.0, 45.0, 55.0),
        Line("S, N 10 -> 25", "more robots", 0.8, 0.5, math.inf, "supported"),
        Line("S, N 25 -> 50", "more robots", 0.1, -0.1, 0.3, "inconclusive"),
        Line("R, m = 2", "FM1, the worst of 4 failure modes", -0.2, -0.3, -0.1, "refuted"),
        Line("FT, m = 2", "FM1, the worst of 4 failure modes", math.nan, verdict="blocked"),
        Line("A", "delivery_width 2 -> 1 m", 1.0, 0.9, 1.1, "supported"),
        Line("fault budget", "FM1 ends it", 1.0),
    ),
    "10 paired seeds",
)


@pytest.fixture
def beside(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four shipped policies, one of them with the card's own name."""
    p = {"low": 20.0, "near": 46.0, "high": 90.0, "mine<b>": 50.0}
    cards = {
        "policies": {
            name: {"lines": {"P": [value, value - 2, value + 2], "R, m = 2": None}}
            for name, value in p.items()
        }
    }
    monkeypatch.setattr(score_card, "recorded", lambda: cards)


@pytest.mark.usefixtures("beside")
def test_a_rank_leaves_open_what_the_intervals_leave_open() -> None:
    # "high" is surely before, "low" surely behind, "near" is not told apart.
    assert str(rank(CARD, CARD.lines[0])) == "2 of 4 (2 to 3)"
    assert str(rank(CARD, CARD.lines[3])) == "1 of 1"
    assert str(rank(CARD, CARD.lines[4])) == "–"


def test_recorded_cards_are_those_of_the_shipped_policies() -> None:
    cards = recorded()["policies"]
    assert set(cards) <= {name for name in policies.NAMES if name != "central"}
    plan = Study.preset(score_card.STUDY).plan()
    assert recorded()["seeds"] == [plan.seeds[0], plan.seeds[-1]]
    asked = {line for card in cards.values() for line in card["lines"]}
    assert asked == {line.name for line in CARD.lines}
    for name in {"swarm-dt", "homing", "ppo-delivery"} & set(cards):
        # If this fails, run `python docs/score_cards.py`.
        first = run_episode(Scenario(restock=True), policies.load(name), seed=plan.seeds[0])
        assert cards[name]["p"][0] == first.delivered
        assert cards[name]["lines"]["P"][0] == pytest.approx(
            sum(cards[name]["p"]) / len(plan.seeds)
        )


def test_they_are_recorded_by_the_command_that_they_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = Path(__file__).parents[2]
    monkeypatch.syspath_prepend(root / "docs")
    program, file = recorded()["command"].split()
    assert (program, root / file) == ("python", root / "docs" / "score_cards.py")
    script = importlib.import_module("score_cards")
    assert set(script.shipped()) >= set(recorded()["policies"])
    short = PRESETS["scorecard"].replace(seeds=2, scenario={"duration": 20.0, "restock": True})
    monkeypatch.setitem(PRESETS, "scorecard", short)
    monkeypatch.setattr(script, "OUT", tmp_path)
    monkeypatch.setattr(script, "RECORDED", tmp_path / "cards.json")
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    script.main(["homing"])
    cards = json.loads((tmp_path / "cards.json").read_text())["policies"]
    p = Study.stored(tmp_path / "homing").performance()
    unbroken = p[p["factor"] == "none"].iloc[0]
    assert cards["homing"]["p"] == list(unbroken["by_seed"])
    assert cards["homing"]["lines"]["P"] == pytest.approx(
        [unbroken["mean"], unbroken["low"], unbroken["high"]]
    )
