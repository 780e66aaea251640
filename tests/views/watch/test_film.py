from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, policies, run_episode
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.world.rendering.renderer import Renderer, load_pygame

load_pygame()

from swarm_logistics_env.views.watch.embedded import film  # noqa: E402
from swarm_logistics_env.views.watch.film import Film, Take  # noqa: E402 - wants pygame

SMALL = Scenario(n_robots=6, n_items=8, duration=12.0, warehouse_width=4, warehouse_height=4)


def take(*faults: Fault) -> Take:
    return Take("a", Play(SMALL, policies.load("swarm-dt"), 3, faults))


def test_runs_go_on_one_clock_until_the_end() -> None:
    faults = [Fault("FM4", 2, onset=5.0)]
    takes = [take(), take(*faults)]
    film = Film(takes, until=1e9, speed=3.0, frame_rate=7.0, size=100)
    assert len(list(film.frames())) == film.n_frames == 28 + 1 + 14
    for film_take, faults_of_take in zip(takes, ([], faults)):
        episode = run_episode(SMALL, policies.load("swarm-dt"), 3, faults_of_take)
        assert film_take.play.is_over
        assert film_take.play.world.state.delivery_times == episode.delivery_times.tolist()


def test_same_runs_give_the_same_frames_and_faults_show() -> None:
    def frames(*takes: Take) -> list[np.ndarray[Any, Any]]:
        return list(Film(takes, 3.0, 10.0, 10.0, 120).frames())

    fault = Fault("FM1", 1, onset=2.0)
    sound, broken = frames(take()), frames(take(fault))
    np.testing.assert_equal(frames(take()), sound)
    assert not np.array_equal(sound, broken)
    # Below the name and P stands the picture of the state, at its place to the pixel.
    at_start = take().play.world
    picture = Renderer(SMALL, "rgb_array", 120).frame(at_start.state, SMALL)
    head = len(sound[0]) - len(picture)
    np.testing.assert_equal(sound[0][head:], picture)
    assert 20 < head < 40
    # Side by side each looks as it does alone.
    wide = frames(take(), take(fault))
    np.testing.assert_equal([np.hstack(pair) for pair in zip(sound, broken)], wide)


def test_runs_in_wide_warehouses_stand_one_above_the_other() -> None:
    wide = SMALL.replace(warehouse_width=16)
    takes = [Take("a", Play(wide, policies.load("homing"), seed, [])) for seed in (0, 1)]
    height, width, _ = next(Film(takes, 1.0, 1.0, 5.0, 300).frames()).shape
    assert width == 600
    assert height > 2 * 145
    longer = Take("b", Play(SMALL.replace(warehouse_width=9), policies.load("homing"), 0, []))
    alone = [next(Film([take], 1.0, 1.0, 5.0, 300).frames()) for take in (takes[0], longer)]
    both = next(Film([takes[0], longer], 1.0, 1.0, 5.0, 300).frames())
    assert both.shape[:2] == (sum(map(len, alone)), max(a.shape[1] for a in alone))


def test_runs_in_warehouses_of_unlike_shapes_stand_side_by_side() -> None:
    flat = SMALL.replace(warehouse_width=6, warehouse_height=3)
    takes = [Take("a", Play(scenario, policies.load("homing"), 0)) for scenario in (flat, SMALL)]
    alone = [next(Film([a], 1.0, 1.0, 5.0, 120).frames()) for a in takes]
    both = next(Film(takes, 1.0, 1.0, 5.0, 120).frames())
    height, width, _ = both.shape
    assert (height, width) == (max(map(len, alone)), sum(a.shape[1] for a in alone))
    np.testing.assert_equal(both[: len(alone[0]), : alone[0].shape[1]], alone[0])


def test_a_film_in_a_notebook_is_a_video_that_can_be_kept(tmp_path: Path) -> None:
    short = film("homing", policies.load("swarm-dt"), scenario=SMALL, seed=3, until=1.0)
    size = len(short.content) / 1e6
    assert repr(short) == f"EmbeddedFilm('homing, SwarmDT, seed 3', {size:.1f} MB)"
    html = short._repr_html_()
    assert html.startswith("<video controls ")
    assert base64.b64encode(short.content).decode() in html
    short.save(tmp_path / "film.mp4")
    assert (tmp_path / "film.mp4").read_bytes() == short.content
    longer = film("homing", "swarm-dt", scenario=SMALL, seed=3, until=8.0, faults=["dead:3"])
    assert len(longer.content) > len(short.content)
    with pytest.raises(SetupError):
        short.save(tmp_path / "nowhere" / "film.mp4")


def test_wrong_arguments() -> None:
    right: dict[str, Any] = {"takes": [take()], "until": 5.0, "speed": 1.0, "frame_rate": 9.0}
    for name, wrong, words in (
        ("takes", [], "0 runs: should be 1 to 4"),
        ("until", float("nan"), "until = nan"),
        ("speed", 0.0, "speed = 0"),
    ):
        with pytest.raises(SetupError, match=words):
            Film(**{**right, name: wrong})
