from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from swarm_logistics_env import FAILURE_MODES, Fault, Scenario, policies, run_episode
from swarm_logistics_env.core.errors import (
    FaultError,
    ScenarioError,
    SetupError,
    SwarmLogisticsError,
)
from swarm_logistics_env.views.watch import Session
from swarm_logistics_env.views.watch.messages import frame_message
from swarm_logistics_env.world import observations
from swarm_logistics_env.world.warehouse.state import NOBODY, STORED

SMALL = Scenario(n_robots=8, n_items=10, duration=20.0, warehouse_width=5, warehouse_height=5)


def test_run_and_twin_are_the_episodes_that_run_episode_plays() -> None:
    scenario, faults = SMALL.replace(duration=60.0), [Fault("FM4", 3, onset=5.0)]
    session = Session(scenario, seed=2, faults=faults)
    session.play(1e6)
    assert session.is_over
    run, twin = (play.world.state.delivery_times for play in (session.run, session.beside))
    for times, faults_of_run in ((run, faults), (twin, [])):
        episode = run_episode(scenario, policies.load("swarm-dt"), 2, faults_of_run)
        assert times == episode.delivery_times.tolist()
    assert run != twin


def test_time_passes_at_the_speed_that_the_budget_allows_unless_it_is_paused() -> None:
    session = Session(SMALL, speed=4.0)
    for _ in range(10):
        session.play(0.1)
    assert session.run.world.state.step == 40
    before = session.run.world.state.step
    session.set_speed(0.25)
    session.play(0.1)
    assert session.run.world.state.step == before
    session.set_speed(64.0)
    for elapsed in (1.0, 0.0, 0.0):
        session.play(elapsed, budget=0.0)
    # What the budget does not allow is not caught up with.
    assert session.run.world.state.step == before + 2
    session.pause()
    before = session.run.world.state.step
    session.play(5.0)
    assert session.run.world.state.step == before
    session.pause()
    session.step()
    assert session.run.world.state.step == session.beside.world.state.step == before + 1
    assert session.paused


@pytest.mark.unmeasured
@pytest.mark.parametrize("mode", sorted(FAILURE_MODES.keys() - {"cell_fades"}))
def test_robot_breaks_and_is_repaired(mode: str) -> None:
    session = Session(SMALL)
    session.play(2.0)
    session.choose_mode(mode)
    session.toggle_robot(3)
    state, shown = session.run.world.state, frame_message(session)
    assert state.failure_modes[3] == (mode,)
    assert not session.beside.world.state.failed.any()
    assert [(event.time, event.robot, event.mode) for event in session.events] == [
        (state.time, 3, mode)
    ]
    assert shown["robots1"][3][2] == ""
    if not FAILURE_MODES[mode].present:
        assert session.selected is None
        assert shown["robots0"][3] is None
        assert shown["poses0"][9:12] == [None] * 3
        with pytest.raises(SetupError, match="robot = 3"):
            session.toggle_robot(3)
        return
    assert shown["robots0"][3][2] == FAILURE_MODES[mode].mark
    pose = [*state.robot_position[3], state.robot_heading[3]]
    assert shown["poses0"][9:12] == np.rint(1000 * np.array(pose)).tolist()
    session.play(1.0)
    session.toggle_robot(3)
    assert not session.run.world.state.failed.any()
    assert session.run.world.state.max_speed[3] == SMALL.max_speed
    assert session.events[-1].mode is None


def test_repair_leaves_the_other_robots_of_a_fault_broken() -> None:
    session = Session(SMALL, faults=[Fault("dead", 3), Fault("FM1", 2, onset=15.0)])
    first, *still_failed = np.flatnonzero(session.run.world.state.failed).tolist()
    session.select(first)
    session.repair_robot()
    assert np.flatnonzero(session.run.world.state.failed).tolist() == still_failed
    session.play(16.0)
    modes = [name for names in session.run.world.state.failure_modes for name in names]
    assert modes.count("FM1") == 2  # a fault that is yet to come comes


def test_a_fault_by_role_chooses_at_its_onset_and_each_of_its_robots_is_repaired() -> None:
    faults = ["FM4:2:searching@5", "FM1:1:carrier@3+4"]
    session = Session(SMALL, against="homing", seed=1, faults=faults)
    session.select(0)
    session.choose_mode("FM2")
    session.break_robot()  # before any has chosen
    assert [event.mode for event in session.events] == ["FM2"]
    while session.state.time < 6.0:
        session.advance()
    failed = [event.robot for event in session.events if event.mode == "FM4"]
    first, second = (robot for robot in failed if robot is not None)
    assert {(event.time, event.mode) for event in session.events[1:]} == {(5, "FM4"), (3, "FM1")}
    assert "FM4" in session.state.failure_modes[first]
    chosen = [modes.count("FM4") for modes in session.beside.world.state.failure_modes]
    session.select(first)
    session.repair_robot()
    assert session.state.failure_modes[first] == ()
    assert "FM4" in session.state.failure_modes[second]
    # Beside it the same role was another robot's.
    left = [modes.count("FM4") for modes in session.beside.world.state.failure_modes]
    assert left == [0 if robot == first else count for robot, count in enumerate(chosen)]
    session.restart()
    assert session.events == []


def test_breaking_twice_in_a_mode_is_once() -> None:
    session = Session(SMALL)
    session.select(1)
    for mode, modes, note in (
        ("FM4", ("FM4",), "robot 1 fails in mode FM4"),
        ("FM4", ("FM4",), "robot 1 already fails in mode FM4"),
        ("FM1", ("FM4", "FM1"), "robot 1 fails in mode FM1"),
    ):
        session.choose_mode(mode)
        session.break_robot()
        assert session.run.world.state.failure_modes[1] == modes
        assert session.note == note
    for note in ("robot 1 is repaired", "robot 1 is sound"):
        session.repair_robot()
        assert session.run.world.state.failure_modes[1] == ()
        assert session.note == note


def test_swarm_size_next_seed_and_again_begin_anew_and_the_delivery_area_does_not() -> None:
    session = Session(SMALL, seed=3, faults=[Fault("FM2", 5)])
    start = session.run.world.state.robot_position.copy()
    session.play(2.0)
    session.toggle_robot(7)
    for n_robots, complaint in ((0, "n_robots = 0"), (4, "Fault.robots = 5: should be at most")):
        with pytest.raises(SwarmLogisticsError, match=complaint):
            session.resize(n_robots)
    assert (session.scenario.n_robots, session.selected) == (8, 7)
    session.resize(6)
    assert (session.run.world.state.n_robots, session.selected) == (6, None)
    assert session.note == "swarm size 6: a swarm cannot grow in a run, so it began again"
    session.resize(8)
    assert np.array_equal(session.run.world.state.robot_position, start)
    session.next_seed()
    assert session.note == "seed 4"
    assert not np.array_equal(session.run.world.state.robot_position, start)
    session.play(1.0)
    session.restart()
    assert (session.note, session.episode) == ("seed 4 again", 5)
    session.set_delivery_width(3.0)  # at once
    for play in (session.run, session.beside):
        assert (play.world.state.time, play.world.state.n_robots) == (0.0, 8)
        assert play.world.scenario.delivery_width == 3.0
    assert (session.seed, len(session.events)) == (4, 6)
    assert session.events[-1].words == session.note == "delivery area 3 m wide"


def test_what_cannot_be_is_refused() -> None:
    session = Session(SMALL)
    acts: list[tuple[type[Exception], str, Callable[[], object]]] = [
        (SetupError, "speed = 3: should be one of 0.25, 0.5", lambda: session.set_speed(3.0)),
        (FaultError, "at most n_robots = 8", lambda: Session(SMALL, faults=[Fault("FM1", 9)])),
        (ScenarioError, "leaves no storage", lambda: session.set_delivery_width(5.0)),
        (FaultError, "did you mean 'FM4'", lambda: session.choose_mode("FM44")),
        (SetupError, "robot = -1", lambda: session.select(-1)),
        (SetupError, "robot = 8", lambda: session.select(8)),
        (SetupError, "none is selected", session.break_robot),
        (SetupError, "did you mean 'homing'", lambda: session.compare("homin")),
    ]
    for error, words, act in acts:
        with pytest.raises(error, match=words):
            act()
    session.play(1e6)
    with pytest.raises(SetupError, match="the run is over"):
        session.toggle_robot(1)


def test_policies_are_compared_with_the_same_faults() -> None:
    session = Session(SMALL, against="homing", seed=3, faults=[Fault("FM1", (5,))])
    assert session.beside.world.state.failure_modes[5] == ("FM1",)
    assert session.choices[:2] == (session.policy, session.against) == ("swarm-dt", "homing")
    session.toggle_robot(2)
    assert session.beside.world.state.failure_modes[2] == ("FM4",)
    session.compare("homing")
    assert (session.policy, session.against) == ("homing", None)
    assert session.run.world.state.time == 0.0


def test_what_the_selected_robot_senses_is_shown() -> None:
    scenario = SMALL.replace(message_size=2, ranger_range=1.2346, view_range=0.8766)
    session = Session(scenario)
    session.play(3.0)
    for robot in range(8):
        session.select(robot)
        shown = frame_message(session)["selected"]
        parts = observations.unflatten(session.run.world.observe()[robot], scenario)
        assert (shown["reach"], shown["view"]) == (1.235, 0.877)
        assert list(shown["row"]) == list(parts)
        for name, values in shown["row"].items():
            assert values == pytest.approx(parts[name].tolist(), abs=0.0051)
        beams = [parts[f"range_{what}"] for what in ("robots", "walls", "items")]
        nearest = np.min(beams, axis=0).tolist()
        assert shown["beams"] == pytest.approx(nearest, abs=0.00051)


def test_the_kinds_of_robots_are_shown_where_there_are_any() -> None:
    assert frame_message(Session(SMALL))["kinds0"] == []
    session = Session(SMALL.replace(robot_kinds="lifter:3, scout:1 robot_radius=0.1"))
    session.select(2)
    shown = frame_message(session)
    assert shown["fixed"]["kinds"] == ["lifter", "scout"]
    assert shown["fixed"]["radii"] == (0.125, 0.1)
    assert shown["kinds0"] == session.scenario.kind_numbers(8).tolist()
    assert shown["selected"]["kind"] == ["lifter", "scout"][shown["kinds0"][2]]


@pytest.mark.daily
def test_what_a_fault_costs_shows_within_ten_seconds() -> None:
    session = Session(SMALL, "random-walk", against="homing")
    session.pause()
    session.show_fault()
    assert (session.policy, session.against, session.paused) == ("ppo-delivery", None, False)
    assert session.run.world.state.failed.sum() == 2
    session.play(10.0)
    assert session.beside.world.state.failed.sum() == 0
    assert 2 * session.state.delivered < session.beside.world.state.delivered


BROKEN = """
import json
import sys

import numpy as np

class Sound:
    steps = 0
    def reset(self, n_robots, seed): ...
    def act(self, observations):
        self.steps += 1
        if self.steps > 5:
            self.fail()
        return np.zeros((len(observations), 4))
    def fail(self): ...
class Raising(Sound):
    def fail(self): raise ValueError("boom in my controller")
class InALibrary(Sound):
    def fail(self): json.loads("nonsense")
class Leaving(Sound):
    def fail(self): sys.exit("enough")
class Escaping(Sound):
    def fail(self): raise RuntimeError("\\x1b[31m" + "long" * 10_000)
class Short(Sound):
    def act(self, observations): return np.zeros((len(observations), 3))
class NotBegun(Sound):
    def reset(self, n_robots, seed): {}["gain"]
class NotMade(Sound):
    def __init__(self): raise SystemExit
"""


@pytest.fixture
def broken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Session]:
    """Makes a session in which a sound policy may be compared with one that is broken."""
    (tmp_path / "broken_policy.py").write_text(BROKEN)
    monkeypatch.syspath_prepend(tmp_path)
    return lambda name: Session(SMALL, "homing", f"broken_policy:{name}")


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("Raising", "ValueError: boom in my controller, broken_policy.py line 17"),
        ("InALibrary", "JSONDecodeError: Expecting value: "),
        ("InALibrary", ", broken_policy.py line 19"),
        ("Leaving", "SystemExit: enough, broken_policy.py line 21"),
        ("Escaping", r"RuntimeError: \x1b[31mlong"),
        ("Escaping", "lo, broken_policy.py line 23"),
        ("Short", "Short at 0 s: commands of shape (8, 3): should be (8, 4)"),
    ],
)
def test_a_policy_that_fails_stops_its_episode_alone_and_says_where(
    name: str, reason: str, broken: Callable[[str], Session]
) -> None:
    session = broken(name)
    session.play(5.0)
    assert reason in session.failure
    assert len(session.failure) < 600
    assert frame_message(session)["failure"] == session.failure
    time = session.state.time
    session.play(5.0)
    session.step()
    assert session.state.time == time
    assert not session.is_over
    session.select(1)
    session.break_robot()  # nothing else is lost
    session.restart()
    assert (session.failure, session.state.time) == ("", 0.0)
    session.pause()
    session.play(5.0)
    assert reason in session.failure
    session.compare("homing")
    session.play(5.0)
    assert session.failure == ""
    assert session.state.time == pytest.approx(5.0, abs=0.2)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("NotBegun", "KeyError: 'gain', broken_policy.py line 27"),
        ("NotMade", "SystemExit, broken_policy.py line 29"),
    ],
)
def test_a_policy_that_cannot_begin_leaves_the_session_as_it_is(
    name: str, reason: str, broken: Callable[[str], Session]
) -> None:
    session = broken("Sound")
    session.choices = (*session.choices, f"broken_policy:{name}")
    session.play(1.0)
    run, twin = session.run, session.beside
    with pytest.raises(SetupError, match=re.escape(reason)):
        session.compare("homing", f"broken_policy:{name}")
    assert (session.run, session.beside) == (run, twin)
    session.play(1.0)
    assert session.failure == ""


def test_every_request_is_told_with_its_carrier() -> None:
    session = Session(SMALL.replace(n_requests=3, restock=True), policy="homing", seed=1)
    n_carriers = 0
    while not session.is_over:
        session.advance()
        state, shown = session.state, frame_message(session)
        requested = sorted(set(state.open_requests.tolist()))  # one may be asked for twice
        places = np.rint(1000 * state.item_position[requested]).astype(int).tolist()
        carriers = state.item_carrier[requested].tolist()
        assert shown["requested0"] == [[*at, robot] for at, robot in zip(places, carriers)]
        stored = set(np.flatnonzero(state.item_status == STORED).tolist()) - set(requested)
        assert len(shown["items0"]) == len(stored)
        activities = [robot_fields[0] for robot_fields in shown["robots0"]]
        delivering = [robot for robot, does in enumerate(activities) if does == "delivering"]
        assert delivering == sorted({*carriers} - {NOBODY})
        n_carriers = max(n_carriers, len(delivering))
    assert n_carriers > 1
