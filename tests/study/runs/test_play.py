"""What ends a run, a study or a worker."""

from __future__ import annotations

import faulthandler
import math
import multiprocessing
import re
import sys
import threading
from types import ModuleType
from typing import Any

import pytest

from swarm_logistics_env.policies import SwarmDT
from swarm_logistics_env.policies.episode import Play, run_episode
from swarm_logistics_env.study.studies import Study

pytestmark = pytest.mark.unmeasured


class Exiting(SwarmDT):
    """Ends the process, as it thinks, at a moment of its second run."""

    identity = "exiting"

    def __init__(self, moment: str, raised: BaseException) -> None:
        super().__init__()
        self.moment, self.raised = moment, raised

    def reset(self, n_robots: int, seed: int) -> None:
        self.seed = seed
        super().reset(n_robots, seed)
        self.end_at("reset")

    def act(self, observations: Any) -> Any:
        self.end_at("act")
        return super().act(observations)

    def end_at(self, moment: str) -> None:
        if self.seed == 1 and moment == self.moment:
            raise self.raised


@pytest.mark.parametrize(
    ("moment", "raised", "processes"),
    [
        ("reset", SystemExit(0), 1),
        ("act", SystemExit("done"), 2),
        ("act", GeneratorExit(), 1),
    ],
)
def test_a_run_in_which_a_policy_exits_has_failed(
    sizes: dict[str, Any], moment: str, raised: BaseException, processes: int
) -> None:
    study = Study(**{**sizes, "policies": [Exiting(moment, raised)]})
    tally = study.run(processes=processes)
    assert (tally.played, tally.failed) == (9, 3)
    assert tally.error is not None
    assert type(raised).__name__ in tally.error
    rows = study.results()
    assert set(rows["seed"][rows["error"].notna()]) == {1}


def test_ctrl_c_ends_a_study(sizes: dict[str, Any]) -> None:
    study = Study(**{**sizes, "policies": [Exiting("act", KeyboardInterrupt())]})
    with pytest.raises(KeyboardInterrupt):
        study.run()
    assert study.finished() == (3, 9)


class Failing(SwarmDT):
    """Fails in every run."""

    identity = "failing"

    def act(self, observations: Any) -> Any:
        raise RuntimeError("a wheel came off")


@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=pytest.mark.daily)])
def test_a_study_in_which_nothing_works_is_given_up(sizes: dict[str, Any], processes: int) -> None:
    study = Study(**{**sizes, "policies": [Failing()]})
    tally = study.run(processes=processes)
    assert tally.gave_up
    # Of 9: those of the first seed and one more, or two more that were played meanwhile.
    assert tally.played == tally.failed in range(4, 7)
    assert tally.left == 9 - tally.played
    assert tally.error == "RuntimeError: a wheel came off"
    assert re.fullmatch(rf"{re.escape(__file__)}:\d+", tally.place)
    assert len(study.results()) == tally.played
    assert study.run().played == tally.played  # they are tried again, and not the others
    late = Study(**{**sizes, "policies": [Failing()]}).run(minutes=0.0)
    assert (late.played, late.failed, late.left, late.gave_up) == (1, 1, 8, False)


start_clock = faulthandler.dump_traceback_later


class Hanging(SwarmDT):
    """Waits for ever, at one seed and one swarm size: there alone time passes, and fast.

    So the other runs have a limit that the slowest machine keeps.
    """

    identity = "hanging"
    limit = math.inf
    at_the_end: dict[str, Any] = {}  # noqa: RUF012 - of the run that this worker plays

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        if multiprocessing.parent_process() is not None:
            vars(faulthandler)["dump_traceback_later"] = Hanging.note_limit

    @staticmethod
    def note_limit(limit: float, **at_the_end: Any) -> None:
        Hanging.limit = limit
        Hanging.at_the_end = at_the_end

    def reset(self, n_robots: int, seed: int) -> None:
        super().reset(n_robots, seed)
        self.seed = seed

    def act(self, observations: Any) -> Any:
        if self.seed == 1 and len(observations) == 3:
            start_clock(Hanging.limit / 10_000, **Hanging.at_the_end)
            threading.Event().wait()
        return super().act(observations)


@pytest.mark.daily
def test_a_run_that_hangs_is_ended_and_has_failed(sizes: dict[str, Any]) -> None:
    before = {process.pid for process in multiprocessing.active_children()}
    study = Study(**{**sizes, "policies": [Hanging()], "seeds": 2, "sizes": [{"values": [2, 3]}]})
    tally = study.run(processes=2, run_limit=1000.0)
    assert (tally.played, tally.failed) == (4, 1)
    assert tally.error == (
        "RunLimit: a run took longer than the limit of 1000 s (run_limit, --run-limit)"
    )
    assert tally.place.startswith(f"{__file__}:")
    rows = study.results()
    assert rows["seed"][rows["error"].notna()].tolist() == [1]
    assert {process.pid for process in multiprocessing.active_children()} == before


class Threaded(SwarmDT):
    """Decides by the number of threads in which torch computes; a worker has no torch here."""

    identity = "threaded"

    def act(self, observations: Any) -> Any:
        torch: Any = sys.modules.get("torch")
        n_threads = 1 if torch is None else torch.get_num_threads()
        return super().act(observations) * (n_threads == 1)


def test_torch_computes_in_one_thread_whoever_plays(
    sizes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    torch: Any = ModuleType("torch")
    n_threads = [4]
    torch.get_num_threads = lambda: n_threads[0]
    torch.set_num_threads = lambda count: n_threads.__setitem__(0, count)
    monkeypatch.setitem(sys.modules, "torch", torch)
    fields = {**sizes, "policies": [Threaded()], "seeds": 1}
    in_process, in_worker = Study(**fields), Study(**fields)
    assert in_process.run().failed == in_worker.run("process", processes=1).failed == 0
    digests = in_process.results()["digest"].tolist()
    assert in_worker.results()["digest"].tolist() == digests
    scenario: Any = in_process.specification.scenario
    assert run_episode(scenario, Threaded(), 0).digest in digests
    play = Play(scenario, Threaded(), 0)  # as a film and `watch` do
    start = play.world.state.robot_position.copy()
    play.step()
    assert (play.world.state.robot_position != start).any()
    assert n_threads == [4]
