from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, policies, run_episode
from swarm_logistics_env.episode import Play
from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.rendering.renderer import load_pygame

load_pygame()

from swarm_logistics_env.watch.film import Film, Take  # noqa: E402 - wants pygame

SMALL = Scenario(n_robots=6, n_items=8, duration=12.0, warehouse_width=4, warehouse_height=4)


def take(name: str = "a", faults: tuple[Fault, ...] = (), scenario: Scenario = SMALL) -> Take:
    return Take(name, Play(scenario, policies.load("swarm-dt"), 3, faults))


def test_frames_are_as_many_and_as_large_as_announced() -> None:
    film = Film([take(), take("b")], until=10.0, speed=4.0, frame_rate=8.0, size=120)
    frames = list(film.frames())
    assert len(frames) == film.n_frames == 20 + 1 + 16
    assert len({frame.shape for frame in frames}) == 1
    assert all(side % 2 == 0 for side in frames[0].shape[:2])
    assert frames[0].dtype == np.uint8
    assert np.array_equal(frames[-1], frames[-16])
    assert all(not np.array_equal(a, b) for a, b in itertools.pairwise(frames[:21]))


def test_runs_go_on_one_clock_until_the_end() -> None:
    takes = [take(), take("b", (Fault("FM4", 2, onset=5.0),))]
    list(Film(takes, until=1e9, speed=3.0, frame_rate=7.0, size=100).frames())
    for one, faults in zip(takes, ([], [Fault("FM4", 2, onset=5.0)])):
        episode = run_episode(SMALL, policies.load("swarm-dt"), 3, faults)
        assert one.play.is_over
        assert one.play.world.state.delivery_times == episode.delivery_times.tolist()
    last = take(scenario=SMALL.replace(n_items=1, duration=200.0))
    film = Film([last], 200.0, 20.0, 2.0, 100)
    assert len(list(film.frames())) < film.n_frames
    assert last.play.world.all_delivered


def test_same_runs_give_the_same_frames_and_faults_show() -> None:
    def frames(*takes: Take) -> list[np.ndarray[Any, Any]]:
        return list(Film(takes, 3.0, 10.0, 10.0, 120).frames())

    faults = (Fault("FM1", 1, onset=2.0),)
    sound, broken = frames(take("x")), frames(take("x", faults))
    np.testing.assert_equal(frames(take("x")), sound)
    assert not np.array_equal(sound, broken)
    # Side by side each looks as it does alone.
    wide = frames(take("x"), take("x", faults))
    np.testing.assert_equal([np.hstack(pair) for pair in zip(sound, broken)], wide)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"takes": []}, "0 runs: should be 1 to 4"),
        ({"takes": [take()] * 5}, "5 runs"),
        ({"until": 0.0}, "until = 0 s"),
        ({"until": float("nan")}, "until = nan"),
        ({"speed": 0.0}, "speed = 0"),
    ],
)
def test_wrong_arguments(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(SetupError, match=words):
        Film(**{"takes": [take()], "until": 5.0, "speed": 1.0, **changed})
