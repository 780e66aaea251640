"""The page in a real browser, driven by real clicks, touches and keys."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env.views.watch import Session, server
from swarm_logistics_env.views.watch.messages import recorded_page
from tests.views.watch.conftest import SMALL, Served
from verification.browser import Browser

pytestmark = pytest.mark.unmeasured


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Browser]:
    try:
        opened_browser = Browser(tmp_path / "profile", (1280, 860))
    except FileNotFoundError as error:
        pytest.skip(str(error))
    yield opened_browser
    opened_browser.close()


AT = """(() => {{
const canvas = element('arena0'), box = canvas.getBoundingClientRect();
const place = placeOf(canvas, latest.scenario);
const pose = posesBetween(shown.now, shown.next, shown.share, 0)[{robot}];
return [box.left + place.left + place.scale * pose[0] / 1000,
box.top + place.bottom - place.scale * pose[1] / 1000];
}})()"""

UNNAMED_SENSES = """(() => {
const lines = [...document.querySelectorAll('#senses dd')];
const titles = lines.flatMap(({ title }) => title.split(', '));
return Object.keys(drawn.selected.row).filter((name) => !titles.includes(name));
})()"""

ENABLED = "['break', 'repair'].map((id) => !element(id).disabled)"


def test_robot_is_broken_by_click_and_by_touch(served: Served, browser: Browser) -> None:
    browser.open(served.server.address)
    browser.wait_for("latest && latest.time > 1")
    browser.press(" ")
    browser.wait_for("latest.paused && Math.abs(playhead - latest.time) < 0.01")
    browser.click(*browser.value(AT.format(robot=4)))
    browser.wait_for("latest.selected && latest.selected.robot === 4")
    assert browser.value(ENABLED) == [True, False]
    browser.wait_for("drawn.selected")
    assert browser.value(UNNAMED_SENSES) == []
    browser.click_on("#break")
    browser.wait_for("latest.robots0[4][2] === '4' && latest.robots1[4][2] === ''")
    assert browser.value(ENABLED) == [False, True]
    x, y = browser.value(AT.format(robot=2))
    browser.call("Emulation.setTouchEmulationEnabled", enabled=True)
    browser.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
    browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    browser.wait_for("latest.selected && latest.selected.robot === 2")
    browser.press("b")
    browser.wait_for("latest.robots0[2][2] === '4'")
    browser.press("n")
    browser.wait_for("latest.seed === 1 && latest.events.length === 0")
    assert browser.console == []


@pytest.fixture
def played(tmp_path: Path) -> Iterator[dict[str, str]]:
    """The addresses of the same run of 20 s: as it is played, paused at its end, and recorded."""
    session = Session(SMALL, faults=[Fault("FM4", [1], onset=5.0)], speed=1.0)
    session.pause()
    running_server = Served(session)
    recording = running_server.server.recording
    while session.state.time < 20.0 - 1e-9:
        recording.note()
        session.advance()
    file = tmp_path / "run.html"
    file.write_text(recording.page(), encoding="utf-8")
    yield {"live": running_server.server.address, "recorded": file.as_uri()}
    running_server.stop()


HANDLE = """(() => {{
const handle = element('moment'), box = handle.getBoundingClientRect();
return [box.left + 7 + (box.width - 14) * {moment} / handle.max, box.top + box.height / 2];
}})()"""


@pytest.mark.parametrize("page", ["live", "recorded"])
def test_timeline_goes_back_and_forth_and_plays_on_from_there(
    page: str, played: dict[str, str], browser: Browser
) -> None:
    browser.open(played[page])
    browser.wait_for("drawn && latest.time === 20")
    if page == "recorded":
        browser.press(" ")
    browser.wait_for("latest.paused")
    # The mouse drags the handle.
    browser.press("End")
    mouse = {"button": "left", "clickCount": 1}
    for kind, moment in (("mousePressed", 20), ("mouseMoved", 10), ("mouseReleased", 10)):
        x, y = browser.value(HANDLE.format(moment=moment))
        browser.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, buttons=1, **mouse)
    browser.wait_for("Math.abs(playhead - 10) < 1 && drawn.time <= playhead")
    assert browser.value("element('now').disabled") is False
    browser.call("Emulation.setTouchEmulationEnabled", enabled=True)
    x, y = browser.value(HANDLE.format(moment=14))
    browser.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
    browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    browser.wait_for("Math.abs(playhead - 14) < 1 && !isHeld")
    browser.press("Home")
    browser.wait_for("playhead === 0 && drawn.time === 0")
    browser.press("ArrowRight")
    assert browser.value("playhead > 0 && playhead < 5 && latest.time === 20")
    browser.press("ArrowLeft")
    assert browser.value("playhead") == 0
    # A mark leads to its event, and it is played on from there.
    browser.call("Emulation.setTouchEmulationEnabled", enabled=False)
    browser.click_on("#events button")
    browser.wait_for("playhead === 5 && drawn.robots0[1][2] === '4'")
    assert browser.value("element('note').textContent") == "5.0 s: robot 1 fails in mode FM4"
    browser.press(" ")
    browser.wait_for("playhead > 5.5")
    browser.press("End")
    browser.wait_for("!isBehind && playhead >= 19")
    assert browser.console == []


def test_a_long_run_is_kept_more_coarsely(played: dict[str, str], browser: Browser) -> None:
    browser.open(played["live"])
    browser.wait_for("drawn && latest.time === 20")
    play_long = """(() => { for (let time = 20; time < 20000; time++) take({ time });
    return [frames.length, frames[0].time, frames.at(-1).time] })()"""
    length, first, last = browser.value(play_long)
    assert length * SMALL.n_robots <= 100_000
    assert (first, last) == (0, 19999)


FAILED = """[latest.robots0, latest.robots1]
.map((robots) => robots.filter((robot) => robot[2]).length)"""


def test_button_shows_what_a_fault_costs(browser: Browser) -> None:
    session = Session(SMALL.replace(warehouse_width=10, warehouse_height=10, floor="aisles"))
    served = Served(session)
    try:
        browser.open(served.server.address)
        browser.wait_for("drawn && element('state').hidden")
        counts = "['delivered0', 'delivered1'].map((id) => element(id).textContent)"
        assert browser.value(counts) == ["0 of 8 delivered"] * 2
        assert browser.value("element('legend').textContent.includes('rack')")
        browser.click_on("#show")
        browser.wait_for("latest.episode === 2")
        assert browser.value(FAILED) == [2, 0]
        shown = [32, "ppo-delivery", None]
        assert browser.value("[latest.speed, latest.policy, latest.against]") == shown
        # Items come back, so that there is no number of all; nothing of the other floor stays.
        browser.wait_for(f"{counts}.every((text) => /^[0-9]+ delivered$/.test(text))")
        assert not browser.value("element('legend').textContent.includes('rack')")
        assert browser.console == []
    finally:
        served.stop()


SCALE = "placeOf(element('arena0'), latest.scenario).scale"
CUT_OFF = """[...document.querySelectorAll('button, #legend li, label')]
.filter((entry) => entry.scrollWidth > entry.clientWidth).map((entry) => entry.textContent)"""


def device(size: tuple[int, int]) -> dict[str, float]:
    return {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}


@pytest.mark.daily
@pytest.mark.parametrize(
    ("size", "room", "is_stacked", "least"),
    [
        ((1280, 800), (10, 10), False, 14.0),
        ((1280, 800), (40, 8), True, 7.0),
        ((390, 844), (10, 10), True, 7.0),
        ((390, 844), (4, 16), False, 7.0),
    ],
)
def test_arenas_take_the_room_that_the_window_has_and_nothing_is_cut_off(
    size: tuple[int, int], room: tuple[int, int], is_stacked: bool, least: float, browser: Browser
) -> None:
    width, height = room
    scenario = SMALL.replace(warehouse_width=width, warehouse_height=height, n_obstacles=0)
    session = Session(scenario, "homing")
    session.pause()
    session.select(1)
    served = Served(session)
    browser.call("Emulation.setDeviceMetricsOverride", **device(size))
    try:
        browser.open(served.server.address)
        browser.wait_for("drawn && element('state').hidden")
        assert browser.value("element('arenas').classList.contains('stacked')") == is_stacked
        assert browser.value(f"{SCALE} * 2 * latest.scenario.robot_radius") >= least
        assert browser.value("document.documentElement.scrollWidth") <= size[0]
        assert browser.value(CUT_OFF) == []
    finally:
        served.stop()


@pytest.mark.daily
def test_on_a_phone_a_note_covers_nothing_and_ends_and_a_page_that_is_refused_says_why(
    served: Served, browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "_NOTE_LASTS", 600.0)
    browser.call("Emulation.setDeviceMetricsOverride", **device((390, 844)))
    browser.open(served.server.address)
    browser.wait_for("latest && element('state').hidden")
    top = browser.value("element('delivered0').getBoundingClientRect().top")
    browser.value("order({ do: 'toggle', robot: 2 })")
    browser.wait_for("element('note').textContent")
    height = browser.value("element('note').getBoundingClientRect().height")
    assert browser.value("element('delivered0').getBoundingClientRect().top") == top + height
    browser.call("Page.reload")
    browser.wait_for("latest && latest.robots0[2][2] === '4' && element('state').hidden")
    assert browser.value("element('note').textContent") == ""
    assert browser.value("element('moment').getBoundingClientRect().width") > 250
    browser.value("connects = Array.from({ length: 16 }, connect)")
    browser.wait_for("element('state').textContent.includes('16 pages are open')")


def test_page_tells_that_the_server_has_gone(browser: Browser) -> None:
    served = Served()
    browser.open(served.server.address)
    browser.wait_for("latest && element('state').hidden")
    served.stop()
    browser.wait_for("element('state').textContent.includes('has gone')")


BACKGROUND = "getComputedStyle(element('state')).backgroundColor"


def test_page_warns_of_a_policy_that_failed_and_of_nothing_before(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "stumbling_policy.py").write_text(
        "class Stumbling:\n    def reset(self, n_robots, seed): ...\n"
        "    def act(self, observations): raise ValueError('<b>boom</b>')\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    served = Served(Session(SMALL, "stumbling_policy:Stumbling"))
    try:
        wait = "window.WebSocket = class {}"
        script = browser.call("Page.addScriptToEvaluateOnNewDocument", source=wait)
        browser.open(served.server.address)
        browser.wait_for("element('state').textContent.includes('Connecting')")
        calm = browser.value(BACKGROUND)
        browser.call("Page.removeScriptToEvaluateOnNewDocument", **script)
        browser.open(served.server.address)
        reason = "ValueError: <b>boom</b>, stumbling_policy.py line 3"
        browser.wait_for(f"element('state').textContent.includes({reason!r})")
        assert browser.value(BACKGROUND) != calm
        assert browser.value("element('step').disabled")
        browser.value("order({ do: 'compare', policy: 'homing', against: null })")
        browser.wait_for("element('state').hidden && latest.time > 1")
        assert browser.console == []
    finally:
        served.stop()


@pytest.mark.daily
def test_recording_plays_from_a_file(browser: Browser, tmp_path: Path) -> None:
    session = Session(SMALL, faults=[Fault("FM4", [1], onset=5.0)])
    file = tmp_path / "run.html"
    file.write_text(recorded_page(session, 20.0), encoding="utf-8")
    browser.open(file.as_uri())
    browser.wait_for("latest && playhead > 6")
    assert browser.value("latest.time") == 20.0
    browser.click_on("#legend li:nth-child(5)")
    browser.wait_for("element('note').textContent.startsWith('Timer: the time since')")
    assert browser.value("frames[frameAt(6)].robots0[1][2]") == "4"
    assert browser.console == []
