"""The data and the script of the HTML page: what a click shows is what the study found."""

from __future__ import annotations

import html
import json
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import pytest

from swarm_logistics_env.policies import PolicySpec, SwarmDT
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.page import _titles, marked_up
from swarm_logistics_env.study.report.page import html as html_page
from swarm_logistics_env.study.report.points import Panel, Point
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.views.watch import Session, messages
from swarm_logistics_env.views.watch.messages import recorded_page
from tests.conftest import SMALL, figures_drawn
from tests.made_up import delivered, judged
from verification.browser import Browser

pytestmark = pytest.mark.unmeasured

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
    with figures_drawn("svg"):
        assert app.run(["study", "report", str(out)]) == 0
    page = (out / "report.html").read_text()
    (text,) = re.findall(r' id="data">(.*?)</script>', page, re.DOTALL)
    return Made(out / "report.html", Study.stored(out).findings(), page, json.loads(text))


def test_text_of_a_study_cannot_end_the_script(made: Made) -> None:
    assert HOSTILE not in made.page
    assert made.page.count("</script>") == 2
    names = {condition["name"] for condition in made.data["conditions"]}
    assert any(name.startswith(f"{HOSTILE}, ") for name in names)


def test_policies_stand_in_the_title_and_no_line_ends_within_an_option(made: Made) -> None:
    title = f"swarm-dt and {html.escape(HOSTILE, quote=False)}: study &#39;study&#39;"
    assert f"<title>{title}</title>" in made.page
    assert f"<h1>{title}</h1>" in made.page
    shown = marked_up("a < b: --clearing has no cap")
    assert shown == 'a &lt; b: <span class="option">--clearing</span> has no cap'
    shown = marked_up("1 supported, 2 open")
    assert shown == (
        '<span class="word supported">1 supported</span>, <span class="word open">2 open</span>'
    )


def drawings(page: str) -> dict[str, ElementTree.Element]:
    """The drawings to choose from, by name."""
    views = re.findall(r'role="img" aria-label="([^"]*)">(<svg.*?</svg>)', page)
    return {html.unescape(name): ElementTree.fromstring(svg) for name, svg in views}


def places(marks: Iterable[ElementTree.Element], axis: str) -> list[float]:
    """Where markers are drawn, along an axis of the drawing."""
    return [float(use.attrib[axis]) for mark in marks for use in mark.iter("use")]


class Scale:
    """The value of a place on an axis, of which two places are known."""

    def __init__(self, places: Iterable[float], values: Iterable[float]) -> None:
        pairs = sorted(zip(values, places, strict=True))
        (low, start), (high, end) = pairs[0], pairs[-1]
        self.factor = (end - start) / (high - low)
        self.start = start - low * self.factor

    def values(self, positions: Iterable[float]) -> list[float]:
        return [(position - self.start) / self.factor for position in positions]


def test_a_mark_says_its_value_and_what_was_published() -> None:
    point = Point("homing", 0, "FM1 2", 0.12345, 0.0004, 0.3, 0.25, link="question-7")
    small = point._replace(value=0.0123, low=None, published=None, link="condition-1")
    large = point._replace(value=41.26, low=38.0, high=44.5, link="condition-2")
    nothing = point._replace(value=None, published=12.0, link="question-8")
    panels = [
        Panel("", "", (point, nothing), (0.0,), ""),
        Panel("", "", (small, large._replace(published=None)), (), ""),
    ]
    assert _titles(panels) == {
        "question-7": "homing, FM1 2: 0.123 [0.0004, 0.300]",
        "published-question-7": "published: 0.25",
        "published-question-8": "published: 12",
        "condition-1": "homing, FM1 2: 0.0123",
        "condition-2": "homing, FM1 2: 41.3 [38.0, 44.5]",
    }


def test_of_many_deliveries_a_page_draws_some_seeds_alone() -> None:
    study = Study(seeds=2, faults=[{"modes": ["FM4"], "robots": [1]}], indicators=["R"])
    results = judged(study, lambda *_: delivered(38_000))
    report = document(results)
    page = html_page(report, {figure.name: "<svg/>" for figure in report.figures}, "")
    (text,) = re.findall(r' id="data">(.*?)</script>', page, re.DOTALL)
    for condition in json.loads(text)["conditions"]:
        assert len(condition["p"]) == 2
        assert [len(gaps) for gaps in condition["curves"]] == [38_000]


def test_every_seed_stands_behind_its_interval(made: Made) -> None:
    conditions = made.data["conditions"]
    means = {f"{cell.policy}, {cell.words}": cell.mean.value for cell in made.found.cells}
    for condition in conditions:
        assert np.mean(condition["p"]) == pytest.approx(means[condition["name"]], abs=1e-3)
        assert [len(gaps) for gaps in condition["curves"]] == condition["p"]
    view = next(svg for name, svg in drawings(made.page).items() if name.startswith("P: "))
    marks: dict[int, list[ElementTree.Element]] = {}
    for group in view.iterfind(".//g[@data-condition]"):
        marks.setdefault(int(group.attrib["data-condition"]), []).append(group)
    assert len(marks) > 4
    dots = {number: places([groups[0]], "y") for number, groups in marks.items()}
    flat = [(y, p) for c, ys in dots.items() for y, p in zip(ys, conditions[c]["p"], strict=True)]
    scale = Scale(*zip(*flat))
    assert scale.values(y for y, _ in flat) == pytest.approx([p for _, p in flat], abs=0.02)
    for number, groups in marks.items():
        seeds = [use.attrib["data-seed"] for use in groups[0].iter("use")]
        assert seeds == [str(seed) for seed in range(3)]
        (mean,) = scale.values(places(groups[-1:], "y"))
        assert mean == pytest.approx(np.mean(conditions[number]["p"]), abs=0.02)


def test_a_mark_of_an_indicator_shows_its_question(made: Made) -> None:
    data = made.data
    (view,) = (svg for name, svg in drawings(made.page).items() if "R: " in name)
    drawn = {int(g.attrib["data-question"]): g for g in view.iterfind(".//g[@data-question]")}
    heights, values = [], []
    for number, group in drawn.items():
        question = data["questions"][number]
        if ", robust?" not in question["head"]:
            continue
        before, after = (np.mean(data["conditions"][c]["p"]) for _, _, c in question["arms"])
        m = int(question["head"].split("m = ")[1].split(",")[0])
        heights += places([group], "y")
        values.append((after - before) / before + m / 4)
    assert len(values) == 4
    assert Scale(heights, values).values(heights) == pytest.approx(values, abs=0.02)


def test_the_answer_is_drawn_in_the_colours_of_its_verdicts_on_an_axis_with_numbers(
    made: Made,
) -> None:
    axis, rows = None, {}
    for row in re.findall(r'<t[dh] class="forest">(.*?)</t[dh]>', made.page):
        svg = ElementTree.fromstring(row)
        if axis is None and svg.findall("text"):
            axis = svg
        for mark in svg.iterfind("g"):
            rows[int(mark.attrib["data-question"])] = mark
    assert axis is not None
    numbers = axis.findall("text")

    def percent(element: ElementTree.Element, name: str) -> float:
        return float(element.attrib[name].removesuffix("%"))

    scale = Scale(
        (percent(number, "x") for number in numbers),
        (float(str(number.text).replace("\N{MINUS SIGN}", "-")) for number in numbers),
    )
    verdicts = {n: test for n, test in enumerate(made.found.verdicts) if test.interval}
    assert rows.keys() == verdicts.keys()
    for number, test in verdicts.items():
        assert rows[number].attrib["class"] == test.conclusion
        (value,) = [use for use in rows[number].findall("use") if use.attrib["href"] == "#mark-o"]
        assert test.interval is not None
        assert scale.values([percent(value, "x")]) == pytest.approx([test.interval.value], abs=0.02)
        if test.interval.low is not None and test.interval.high is not None:
            line = rows[number].findall("line")[0]
            for name, end in (("x1", test.interval.low), ("x2", test.interval.high)):
                inside = 0.0 < percent(line, name) < 100.0
                assert not inside or scale.values([percent(line, name)]) == pytest.approx(
                    [end], abs=0.02
                )


def test_command_of_a_run_plays_the_stored_one(
    made: Made, capsys: pytest.CaptureFixture[str]
) -> None:
    arms = {(policy, str(arm.setting)): arm for policy, _, arm in made.found.plan.cells}
    faulty = arms["swarm-dt", "FM4, m = 2"]
    command = str(WAREHOUSE.watch_command(faulty.case))
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


@pytest.mark.daily
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
    results = study.findings()
    for _, _, arm in results.plan.cells:
        outcome = results.outcomes[arm.case.key, 1]
        words = [*shlex.split(str(WAREHOUSE.watch_command(arm.case)))[1:], "--seed", "1"]
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
    commands = {arm.setting.name: WAREHOUSE.watch_command(arm.case) for _, _, arm in plan.cells}
    assert shlex.split(str(commands["FM4"]))[4:] == [
        *("--set", "restock=true", "--set", "speed_mix=[1.0,0.5]", "--fault", "FM4:1@100+50")
    ]
    assert commands["FM1"] is None
    arm = plan.cells[0][2]
    model = replace(arm, case=replace(arm.case, policy=PolicySpec(name="model.zip")))
    assert "--policy model.zip --trust-code" in str(WAREHOUSE.watch_command(model.case))
    policy = {"name": "swarm-dt", "parameters": {"taxis_gain": 0.5}}
    own_plan = Study(policies=[SwarmDT(), policy], sizes=[{"values": [2, 3]}]).plan()
    assert {WAREHOUSE.watch_command(arm.case) for _, _, arm in own_plan.cells} == {None}


@pytest.mark.skipif(shutil.which("node") is None, reason="runs a line of the page's script")
def test_the_pages_script_escapes_what_it_draws() -> None:
    script = resources.files("swarm_logistics_env.study.report").joinpath("page.js").read_text()
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
        switch = "document.querySelector('.questions input')"
        # On a phone what is decided stands first.
        is_phone = size[0] < 600
        assert browser.value(f"{switch}.checked") is is_phone
        if is_phone:
            browser.value(f"{switch}.click()")
        question = len(made.data["questions"]) - 1
        row = f'.answer tr[data-question="{question}"]'
        browser.value(f"document.querySelector('{row}').scrollIntoView()")
        rectangle = f"document.querySelector('{row}').getBoundingClientRect()"
        browser.click(browser.value(f"{rectangle}.x") + 4, browser.value(f"{rectangle}.y") + 4)
        shown = browser.wait_for("document.querySelector('.answer tr.chosen').dataset.question")
        assert int(shown) == question
        head = browser.value("document.querySelector('#question h2').textContent")
        assert head == made.data["questions"][question]["head"]
        lines = browser.value("document.querySelectorAll('#slopes polyline.thin').length")
        assert lines == len(made.data["seeds"])
        # The switch leaves what is decided, or cannot be.
        browser.value(f"{switch}.click()")
        rows = "[...document.querySelectorAll('.answer tr[data-question]')]"
        shown = (
            f"{rows}.filter((row) => row.offsetParent).map((row) => row.dataset.question).join()"
        )
        decided = [n for n, v in enumerate(made.found.verdicts) if v.conclusion != "open"]
        assert sorted(filter(None, browser.value(shown).split(","))) == sorted(map(str, decided))
        assert len(decided) < len(made.found.verdicts)
        assert browser.console == []
    finally:
        browser.close()
