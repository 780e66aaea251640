"""The page in a real browser, driven by real clicks and keys."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from swarm_logistics_env import Scenario, policies
from swarm_logistics_env.watch import Session
from swarm_logistics_env.watch.web import WatchServer

if TYPE_CHECKING:
    from verification.browser import Browser

STRIP = "document.querySelector('#strip').toDataURL()"
AT = """(({{left, top}}) => [left + place.left + place.scale * view.robots[{robot}][0],
top + place.bottom - place.scale * view.robots[{robot}][1]])
(document.querySelector('#warehouse').getBoundingClientRect())"""


@pytest.fixture
def server() -> Iterator[WatchServer]:
    session = Session(Scenario(n_robots=10), lambda: policies.load("swarm-dt"), speed=8.0)
    is_over = threading.Event()
    with WatchServer(session, "swarm-dt", 0) as server:
        threads = [
            threading.Thread(target=server.serve_forever, args=(0.01,)),
            threading.Thread(target=server.play, args=(is_over.is_set,)),
        ]
        for thread in threads:
            thread.start()
        yield server
        is_over.set()
        server.shutdown()
        for thread in threads:
            thread.join()


def test_robot_is_broken_by_a_click_and_the_strip_shows_it(
    server: WatchServer, browser: Browser
) -> None:
    session = server.session
    browser.open(server.address)
    browser.wait_for("view !== null && view.time > 1")
    browser.press(" ")
    browser.wait_for("view.paused && place !== null")
    assert not browser.value("document.querySelector('#break').offsetParent")  # none is selected
    browser.click(*browser.value(AT.format(robot=4)))
    browser.wait_for("view.selected && view.selected.robot === 4")
    assert session.selected == 4
    browser.wait_for("document.querySelector('table#row').rows.length > 20")
    before = browser.value(STRIP)
    browser.click_on("#modes button[value=FM1]")
    browser.wait_for("view.mode === 'FM1'")
    browser.click_on("#break")
    browser.wait_for("view.events.length === 1")
    assert session.run.world.state.failure_modes[4] == ("FM1",)
    browser.wait_for(f"{STRIP} !== {before!r}")
    x, y = browser.value(AT.format(robot=7))
    browser.click(x, y, button="right")
    browser.wait_for("view.robots[7][5] === '1'")
    browser.press("r")
    browser.wait_for("view.robots[7][5] === ''")
    browser.value("order({do: 'toggle', robot: 99})")
    browser.wait_for("document.querySelector('#note').textContent.includes('robot = 99')")
    browser.press("n")
    browser.wait_for("view.seed === 1 && view.events.length === 0")
    browser.press("h")
    browser.wait_for("document.querySelector('#help').open")
    assert len(browser.screenshot()) > 10_000
    # Nothing is wider than the column that holds it.
    assert browser.value("[...document.querySelectorAll('aside *')].every((one) => "
                         "one.getBoundingClientRect().right <= innerWidth)")  # fmt: skip
    # The browser's own note of the order that was refused, and nothing else.
    assert [entry for entry in browser.console if "400 (Bad Request)" not in entry] == []
