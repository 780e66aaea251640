"""The data and the script of the HTML page: what a click shows is what the study found."""

from __future__ import annotations

import base64
import html
import json
import re
import shlex
import shutil
import subprocess
import zlib
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.cli import app
from swarm_logistics_env.report import page_data as page_data_module
from swarm_logistics_env.report.page_data import page_data, watch_command
from swarm_logistics_env.report.verdict_matrix import verdict_matrix
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.results import StudyResults
from verification.browser import Browser

SCENARIO = {
    "n_robots": 4, "n_items": 8, "warehouse_width": 4.0, "warehouse_height": 3.0, "duration": 30.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of two policies, played and reported."""
    out = tmp_path_factory.mktemp("page")
    Study(
        out=out,
        policies=["swarm-dt", "random-walk"],
        seeds=3,
        scenario=SCENARIO,
        faults=[{"modes": ["FM4"], "robots": [1, 2]}],
    ).run()
    assert app.run(["study", "report", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def found(directory: Path) -> StudyResults:
    return Study.stored(directory).findings()


@pytest.fixture(scope="module")
def data(directory: Path) -> Any:
    page = (directory / "report.html").read_text()
    (text,) = re.findall(
        r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL
    )
    return json.loads(text)


def test_every_seed_stands_behind_its_interval(data: Any, found: StudyResults) -> None:
    view = data["views"][0]
    assert {point["policy"] for point in view["points"]} == {"swarm-dt", "random-walk"}
    cells = found.performance
    for point in view["points"]:
        seeds = data["conditions"][point["condition"]]["p"]
        assert len(seeds) == 3
        assert point["value"] == pytest.approx(np.mean(seeds), abs=1e-3)
        rows = cells[(cells["policy"] == point["policy"]) & (cells["mean"] == np.mean(seeds))]
        assert len(rows) >= 1
    (robustness,) = (view for view in data["views"] if view["name"].startswith("R: "))
    for point in robustness["points"]:
        asked = data["questions"][point["question"]]
        before, after = (np.array(data["conditions"][c]["p"]) for _, _, c in asked["arms"])
        m = int(asked["head"].split("m = ")[1].split()[0])
        alone = (after - before) / before + m / 4
        np.testing.assert_allclose(point["seeds"], alone, atol=1e-3)


def test_curves_end_at_p(data: Any) -> None:
    for condition in data["conditions"]:
        for p, gaps in zip(condition["p"], condition["curves"]):
            assert len(gaps) == p
            assert 0 <= sum(gaps) <= 30


def test_command_of_a_run_plays_the_stored_one(
    data: Any, found: StudyResults, capsys: pytest.CaptureFixture[str]
) -> None:
    arms = {arm.condition.key: arm for _, _, arm in found.plan.cells}
    (faulty,) = (
        arm
        for arm in arms.values()
        if str(arm.setting) == "FM4, m = 2" and arm.condition.policy.label == "swarm-dt"
    )
    command = watch_command(faulty)
    assert command is not None
    assert command in {condition["command"] for condition in data["conditions"]}
    program, watch, *options = shlex.split(command)
    assert (program, watch) == ("swarm-logistics", "watch")
    # `run` takes what `watch` takes, and ends.
    assert app.run(["run", *options, "--seed", "1"]) == 0
    key = faulty.condition.run(found.plan.code, 1).key
    assert f"P = {found.outcomes[key].delivered} items" in capsys.readouterr().out


def test_no_command_is_shown_for_a_run_that_none_plays_and_lists_stay_one_word() -> None:
    scenario = {"speed_mix": [1.0, 0.5], "restock": True}
    mid_run = {"modes": ["FM4"], "robots": [1], "onsets": [100.0]}
    breaks = {"modes": ["FM1"], "robots": [1], "intermittent": [5.0, 5.0]}
    faults = [mid_run, {**mid_run, "duration": 50.0}, breaks]
    plan = Study(scenario=scenario, faults=faults).plan()
    commands = {str(arm.condition.faults): watch_command(arm) for _, _, arm in plan.cells}
    (lasting,) = (c for faults, c in commands.items() if "duration=50" in faults)
    assert lasting is not None
    assert lasting.endswith("--fault FM4:1@100+50")
    (for_good,) = (
        c for faults, c in commands.items() if "FM4" in faults and c not in (None, lasting)
    )
    assert shlex.split(for_good)[4:] == [
        *("--set", "restock=true", "--set", "speed_mix=[1.0,0.5]", "--fault", "FM4:1@100")
    ]
    assert [c for faults, c in commands.items() if "intermittent=(" in faults] == [None]
    assert {watch_command(null) for null in plan.nulls.values()} == {None}


def test_replays_are_the_stored_runs_beside_their_twins(data: Any, found: StudyResults) -> None:
    assert 1 <= len(data["replays"]) <= 3
    for replay in data["replays"]:
        run, twin = replay["runs"]
        place = data["seeds"].index(replay["seed"])
        for one, condition in zip((run, twin), replay["conditions"]):
            assert len(one["times"]) == data["conditions"][condition]["p"][place]
        assert twin["name"] == "no fault"
        assert positions(run, "failed").any()
        assert not positions(twin, "failed").any()
        robots = positions(twin, "robots") / twin["scale"]
        assert robots.shape == (2 * 4, twin["frames"])
        assert (robots > 0).all()
        assert (robots[0::2] < SCENARIO["warehouse_width"]).all()


def positions(run: Any, name: str) -> Any:
    """What the page's script makes of a packed series: (series, frames)."""
    values = np.frombuffer(zlib.decompress(base64.b64decode(run[name])), dtype="<i2")
    return values.reshape(run["count"][name], run["frames"]).cumsum(axis=1)


def test_runs_of_another_version_of_the_code_are_not_replayed(
    found: StudyResults, monkeypatch: pytest.MonkeyPatch
) -> None:
    task = type(found.plan.conditions[0].task)
    monkeypatch.setattr(task, "code", lambda self: "another")
    assert page_data(found, verdict_matrix(found))["replays"] == []


def test_a_replay_is_of_the_very_run_that_was_judged(found: StudyResults) -> None:
    other = {key: replace(one, digest="0" * 32) for key, one in found.outcomes.items()}
    changed = replace(found, outcomes=other)
    assert page_data(changed, verdict_matrix(changed))["replays"] == []


def test_a_report_runs_no_code_that_a_store_names(
    found: StudyResults, monkeypatch: pytest.MonkeyPatch
) -> None:
    played: list[object] = []
    monkeypatch.setattr(page_data_module, "runs_code", lambda source: True)
    monkeypatch.setattr(page_data_module, "record_run", lambda *given: played.append(given))
    assert page_data(found, verdict_matrix(found))["replays"] == []
    assert played == []


@pytest.mark.skipif(shutil.which("node") is None, reason="runs a line of the page's script")
def test_the_pages_script_escapes_what_it_draws() -> None:
    script = resources.files("swarm_logistics_env.report").joinpath("page.js").read_text()
    (line,) = re.findall(r"^const escaped = .*$", script, re.MULTILINE)
    hostile = """</text><img src=x onerror="alert(1)">&amp;"""
    program = f"{line}\nprocess.stdout.write(escaped({json.dumps(hostile)}))"
    done = subprocess.run(["node", "-e", program], capture_output=True, text=True, check=True)
    assert not set(done.stdout) & set('<>"')
    assert html.unescape(done.stdout) == hostile


def test_text_of_a_study_cannot_end_the_script(tmp_path: Path) -> None:
    hostile = "</script><script>alert(1)</script>"
    study = Study(
        out=tmp_path,
        seeds=2,
        scenario={**SCENARIO, "duration": 2.0},
        policies=[{"name": "swarm-dt", "label": hostile}],
        sizes=[{"values": [2, 3]}],
    )
    study.run()
    study.report()
    page = (tmp_path / "report.html").read_text()
    assert hostile not in page
    assert page.count("</script>") == 2


@pytest.mark.parametrize("size", [(1440, 900), (390, 844)])
def test_answer_and_comparison_stand_on_the_first_screen_and_a_click_shows_the_question(
    size: tuple[int, int], directory: Path, data: Any, tmp_path: Path
) -> None:
    try:
        browser = Browser(tmp_path, size)
    except FileNotFoundError as missing:
        pytest.skip(str(missing))
    try:
        browser.open((directory / "report.html").resolve().as_uri())
        browser.wait_for("document.querySelectorAll('#comparison svg').length")
        assert browser.value("document.documentElement.scrollWidth") <= size[0]
        bottom = "document.querySelector('#comparison').getBoundingClientRect().bottom"
        assert browser.value(bottom) <= size[1]
        asked = len(data["questions"]) - 1
        place = (
            f"document.querySelector('.sign[data-question=\"{asked}\"]').getBoundingClientRect()"
        )
        browser.click(browser.value(f"{place}.x") + 4, browser.value(f"{place}.y") + 4)
        shown = browser.wait_for("document.querySelector('.sign.chosen').dataset.question")
        assert int(shown) == asked
        head = browser.value("document.querySelector('#question h2').textContent")
        assert head == data["questions"][asked]["head"]
        lines = browser.value("document.querySelectorAll('#slopes polyline.thin').length")
        assert lines == len(data["seeds"])
        browser.wait_for("document.querySelector('#clock').textContent")  # a replay is unpacked
        assert browser.console == []
    finally:
        browser.close()
