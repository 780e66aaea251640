"""The data and the script of the HTML page: what a click shows is what the study found."""

from __future__ import annotations

import html
import json
import re
import shlex
import shutil
import subprocess
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from swarm_logistics_env.cli import app
from swarm_logistics_env.episode import Play
from swarm_logistics_env.policies import PolicySpec, SwarmDT
from swarm_logistics_env.report.answer import answer
from swarm_logistics_env.report.page import axis, watch_command
from swarm_logistics_env.studies import Study
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.watch import Session, messages
from swarm_logistics_env.watch.messages import recorded_page
from tests.conftest import SMALL
from verification.browser import Browser

HOSTILE = "</script><script>alert(1)</script>"


class Made(NamedTuple):
    """A study that was played and reported: its page's file, results, text and data."""

    file: Path
    found: StudyResults
    page: str
    data: Any


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """A study of two policies, one of a hostile name."""
    out = tmp_path_factory.mktemp("page")
    area = {"warehouse_width": 4.0, "warehouse_height": 3.0}
    Study(
        out=out,
        policies=["swarm-dt", {"name": "random-walk", "label": HOSTILE}],
        seeds=3,
        scenario={**area, "n_robots": 4, "n_items": 8, "duration": 30.0},
        faults=[{"modes": ["FM4"], "robots": [1, 2]}],
    ).run()
    assert app.run(["study", "report", str(out)]) == 0
    page = (out / "report.html").read_text()
    (text,) = re.findall(r' id="data">(.*?)</script>', page, re.DOTALL)
    return Made(out / "report.html", Study.stored(out).findings(), page, json.loads(text))


def test_text_of_a_study_cannot_end_the_script(made: Made) -> None:
    assert HOSTILE not in made.page
    assert made.page.count("</script>") == 2
    assert made.data["policies"] == ["swarm-dt", HOSTILE]


def test_every_seed_stands_behind_its_interval(made: Made) -> None:
    data = made.data
    view = data["views"][0]
    means = {(cell.policy, cell.words): cell.mean for cell in made.found.cells}
    for point in view["points"]:
        condition = data["conditions"][point["condition"]]
        words = condition["name"].removeprefix(f"{point['policy']}, ")
        limits = [point["value"], point["low"], point["high"]]
        assert limits == pytest.approx(means[point["policy"], words], abs=1e-3)
        assert point["value"] == pytest.approx(np.mean(condition["p"]), abs=1e-3)
    for condition in data["conditions"]:
        assert [len(gaps) for gaps in condition["curves"]] == condition["p"]
    (robustness,) = (view for view in data["views"] if view["name"].startswith("R: "))
    assert len(robustness["points"]) == 4
    for point in robustness["points"]:
        asked = data["questions"][point["question"]]
        before, after = (np.mean(data["conditions"][c]["p"]) for _, _, c in asked["arms"])
        m = int(asked["head"].split("m = ")[1].split(",")[0])
        assert point["value"] == pytest.approx((after - before) / before + m / 4, abs=1e-3)


def test_intervals_of_the_answer_are_drawn_to_the_ends_of_their_axis(made: Made) -> None:
    first, last = axis(answer(made.found))
    shape = r'<g class="(\w+)" data-question="(\d+)"><path d="M(\S+),\S+H(\S+)"/>.*?d="M([^,]+),'
    drawn = {int(number): (word, *ends) for word, number, *ends in re.findall(shape, made.page)}
    known = {n: test for n, test in enumerate(made.found.verdicts) if test.interval}
    assert drawn.keys() == known.keys()
    for number, test in known.items():
        word, *places = drawn[number]
        value, low, high = test.interval or (0.0, None, None)
        assert word == test.conclusion
        ends = max(first, low or value), min(last, high or value), value
        assert [float(x) for x in places] == pytest.approx(ends)
        assert first < value < last


def test_command_of_a_run_plays_the_stored_one(
    made: Made, capsys: pytest.CaptureFixture[str]
) -> None:
    arms = {(policy, str(arm.setting)): arm for policy, _, arm in made.found.plan.cells}
    faulty = arms["swarm-dt", "FM4, m = 2"]
    command = str(watch_command(faulty))
    assert command in {condition["command"] for condition in made.data["conditions"]}
    # `run` takes what `watch` takes, and ends.
    assert app.run(["run", *shlex.split(command)[2:], "--seed", "1"]) == 0
    delivered = made.found.outcomes[faulty.case.key, 1].delivered
    assert f"P = {delivered} items" in capsys.readouterr().out


# All manners of a fault that a text can say.
MANNERS: list[dict[str, Any]] = [
    {"modes": ["FM1"]},
    {"modes": ["FM1+FM4"], "robots": [2]},
    {"modes": ["FM2"], "onsets": [2.5], "duration": 4.0},
    {"modes": ["FM4"], "onsets": [4.0], "role": "searching"},
    {"modes": ["FM3+FM4"], "robots": [2], "onsets": [4.0], "duration": 5.0, "role": "carrier"},
    {"modes": ["motor_wear"], "onsets": [0.1]},
]


@pytest.mark.parametrize("manner", MANNERS)
def test_command_of_a_run_plays_it_in_run_and_watch_whatever_its_faults(
    manner: dict[str, Any],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    shown: list[Session] = []

    def keep_session(session: Session, until: float) -> str:
        shown.append(session)
        return recorded_page(session, until)

    faults = {"robots": [1], **manner}
    study = Study(
        scenario=SMALL["scenario"], policies=["homing"], seeds=2, faults=[faults], indicators=["R"]
    )
    monkeypatch.setattr(messages, "recorded_page", keep_session)
    assert study.run().failed == 0
    found = study.findings()
    for _, _, arm in found.plan.cells:
        outcome = found.outcomes[arm.case.key, 1]
        words = [*shlex.split(str(watch_command(arm)))[1:], "--seed", "1"]
        assert app.run(["run", *words[1:]]) == 0
        assert f"P = {outcome.delivered} items" in capsys.readouterr().out
        assert app.run([*words, "--save", "page.html"]) == 0
        world = shown[-1].run.world
        assert world.state.delivery_times == outcome.delivery_times.tolist()
        assert world.struck_robots == outcome.failed_robots
        assert round(world.state.anchoring_seconds, 9) == outcome.anchoring_seconds
        play = Play(arm.case.scenario, arm.case.policy.load(), 1, arm.case.faults)  # type: ignore[arg-type]
        while not play.is_over:
            play.step()
        assert (world.state.robot_position == play.world.state.robot_position).all()


def test_no_command_is_shown_for_a_run_that_none_plays_and_lists_stay_one_word() -> None:
    scenario = {"speed_mix": [1.0, 0.5], "restock": True}
    mid_run = {"modes": ["FM4"], "robots": [1], "onsets": [100.0], "duration": 50.0}
    breaks = {"modes": ["FM1"], "robots": [1], "intermittent": [5.0, 5.0]}
    plan = Study(scenario=scenario, faults=[mid_run, breaks]).plan()
    commands = {arm.setting.name: watch_command(arm) for _, _, arm in plan.cells}
    assert shlex.split(str(commands["FM4"]))[4:] == [
        *("--set", "restock=true", "--set", "speed_mix=[1.0,0.5]", "--fault", "FM4:1@100+50")
    ]
    assert commands["FM1"] is None
    arm = plan.cells[0][2]
    model = replace(arm, case=replace(arm.case, policy=PolicySpec(name="model.zip")))
    assert "--policy model.zip --trust-code" in str(watch_command(model))
    given = {"name": "swarm-dt", "parameters": {"taxis_gain": 0.5}}
    own = Study(policies=[SwarmDT(), given], sizes=[{"values": [2, 3]}]).plan()
    assert {watch_command(arm) for _, _, arm in own.cells} == {None}


@pytest.mark.skipif(shutil.which("node") is None, reason="runs a line of the page's script")
def test_the_pages_script_escapes_what_it_draws() -> None:
    script = resources.files("swarm_logistics_env.report").joinpath("page.js").read_text()
    (line,) = re.findall(r"^const escaped = .*$", script, re.MULTILINE)
    hostile = """</text><img src=x onerror="alert(1)">&amp;"""
    program = f"{line}\nprocess.stdout.write(escaped({json.dumps(hostile)}))"
    done = subprocess.run(["node", "-e", program], capture_output=True, text=True, check=True)
    assert not set(done.stdout) & set('<>"')
    assert html.unescape(done.stdout) == hostile


@pytest.mark.parametrize("size", [(1440, 900), (390, 844)])
def test_answer_and_comparison_stand_on_the_first_screen_and_a_click_shows_the_question(
    size: tuple[int, int], made: Made, tmp_path: Path
) -> None:
    try:
        browser = Browser(tmp_path, size)
    except FileNotFoundError as missing:
        pytest.skip(str(missing))
    try:
        browser.open(made.file.resolve().as_uri())
        browser.wait_for("document.querySelectorAll('#comparison svg').length")
        assert browser.value("document.documentElement.scrollWidth") <= size[0]
        bottom = "document.querySelector('#comparison').getBoundingClientRect().bottom"
        assert browser.value(bottom) <= size[1]
        asked = len(made.data["questions"]) - 1
        row = f'.answer tr[data-question="{asked}"]'
        place = f"document.querySelector('{row}').getBoundingClientRect()"
        browser.click(browser.value(f"{place}.x") + 4, browser.value(f"{place}.y") + 4)
        shown = browser.wait_for("document.querySelector('.answer tr.chosen').dataset.question")
        assert int(shown) == asked
        head = browser.value("document.querySelector('#question h2').textContent")
        assert head == made.data["questions"][asked]["head"]
        lines = browser.value("document.querySelectorAll('#slopes polyline.thin').length")
        assert lines == len(made.data["seeds"])
        assert browser.console == []
    finally:
        browser.close()
