from __future__ import annotations

import base64
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, policies, run_episode
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.world.rendering.renderer import Renderer, load_pygame

load_pygame()

from swarm_logistics_env.views.watch import embedded  # noqa: E402
from swarm_logistics_env.views.watch.embedded import film  # noqa: E402
from swarm_logistics_env.views.watch.film import Film, Take  # noqa: E402 - wants pygame

SMALL = Scenario(n_robots=6, n_items=8, duration=12.0, warehouse_width=4, warehouse_height=4)


def take(*faults: Fault) -> Take:
    return Take("a", Play(SMALL, policies.load("swarm-dt"), 3, faults))


def test_runs_go_on_one_clock_until_the_end() -> None:
    faults = [Fault("FM4", 2, onset=5.0)]
    takes = [take(), take(*faults)]
    film = Film(takes, until=1e9, speed=3.0, frame_rate=7.0, size=100)
    times = [[take.play.world.state.time for take in takes] for _ in film.frames()]
    assert len(times) == film.n_frames == 28 + 1 + 14
    for number, (time, time_beside) in enumerate(times):
        assert time == time_beside
        assert -1e-6 < time - min(number * 3.0 / 7.0, 12.0) < SMALL.control_period - 1e-6
    for film_take, faults_of_take in zip(takes, ([], faults)):
        episode = run_episode(SMALL, policies.load("swarm-dt"), 3, faults_of_take)
        assert film_take.play.is_over
        assert film_take.play.world.state.delivery_times == episode.delivery_times.tolist()


def test_a_film_goes_on_until_the_last_run_is_over_and_then_stays_two_seconds() -> None:
    short, served = SMALL.replace(duration=2.0), SMALL.replace(n_robots=1, n_items=1)
    runs = [Play(scenario, policies.load("homing"), 4) for scenario in (short, served)]
    film = Film([Take("a", run) for run in runs], 90.0, 0.8, 4.0, 100)
    times = [runs[1].world.state.time for _ in film.frames()]
    assert [run.is_over for run in runs] == [True, True]
    delivered_at = runs[1].world.state.time
    assert delivered_at == pytest.approx(2.3)
    assert times.count(delivered_at) == 1 + 8
    assert len(times) == 1 + math.ceil(2.3 / 0.2) + 8 < film.n_frames == 1 + 60 + 8


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
    head = Film([take()], 3.0, 10.0, 10.0, 120)._head_height
    assert 20 < head < 40
    np.testing.assert_equal(sound[0][head:], picture)
    # Side by side each looks as it does alone.
    wide = frames(take(), take(fault))
    np.testing.assert_equal([np.hstack(pair) for pair in zip(sound, broken)], wide)


def test_the_name_stands_left_above_a_picture_and_does_not_reach_the_count_right() -> None:
    names = " ", "i", "i" * 400
    films = [Film([Take(name, take().play)], 3.0, 10.0, 10.0, 660) for name in names]
    height, margin = films[0]._head_height, films[0]._text_height // 2
    heads = [next(film.frames())[:height] for film in films]
    ink = [(head != head[0, 0]).any(axis=2) for head in heads]
    count, short, long = (np.flatnonzero(places.any(axis=0)) for places in ink)
    assert 600 < count[0] < count[-1] < 660 - margin
    assert margin <= short[0] < short[short < count[0]][-1] < 60
    assert long[long < count[0]][-1] > 590
    parts = ink[1][:, : count[0]], ink[1][:, count[0] :]
    name_height, count_height = (np.ptp(part.any(axis=1).nonzero()[0]) for part in parts)
    assert name_height < count_height
    for head, places in zip(heads, ink):
        np.testing.assert_equal(head[:, count[0] :], heads[0][:, count[0] :])
        rows = np.flatnonzero(places.any(axis=1))
        assert height / 5 < rows[0] < rows[-1] < height * 4 / 5


def test_runs_in_wide_warehouses_stand_one_above_the_other() -> None:
    wide = SMALL.replace(warehouse_width=16)
    takes = [Take("a", Play(wide, policies.load("homing"), seed, [])) for seed in (0, 1)]
    height, width, _ = next(Film(takes, 1.0, 1.0, 5.0, 300).frames()).shape
    assert width == 600
    assert height > 2 * 145
    longer = Take("b", Play(SMALL.replace(warehouse_width=9), policies.load("homing"), 0, []))
    alone = [next(Film([take], 1.0, 1.0, 5.0, 300).frames()) for take in (takes[0], longer)]
    stacked = next(Film([takes[0], longer], 1.0, 1.0, 5.0, 300).frames())
    assert stacked.shape[:2] == (sum(map(len, alone)), max(a.shape[1] for a in alone))


def test_runs_in_warehouses_of_unlike_shapes_stand_side_by_side() -> None:
    flat = SMALL.replace(warehouse_width=6, warehouse_height=3)
    takes = [Take("a", Play(scenario, policies.load("homing"), 0)) for scenario in (flat, SMALL)]
    alone = [next(Film([a], 1.0, 1.0, 5.0, 120).frames()) for a in takes]
    side_by_side = next(Film(takes, 1.0, 1.0, 5.0, 120).frames())
    height, width, _ = side_by_side.shape
    assert (height, width) == (max(map(len, alone)), sum(a.shape[1] for a in alone))
    np.testing.assert_equal(side_by_side[: len(alone[0]), : alone[0].shape[1]], alone[0])


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


@pytest.mark.parametrize(
    ("fields", "until", "speed", "seed", "floor"),
    [
        ({}, 60.0, 4.0, 0, None),
        (
            {"until": 7.0, "speed": 3.0, "seed": 5, "scenario": Scenario(floor="aisles")},
            *(7.0, 3.0, 5, "aisles"),
        ),
    ],
)
def test_a_film_in_a_notebook_shows_what_its_arguments_say(
    fields: dict[str, Any],
    until: float,
    speed: float,
    seed: int,
    floor: str | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    films: list[Any] = []

    def write_film(path: Path, frames: object, frame_rate: float, *, has_plan: bool) -> None:
        assert frames == "frames"
        path.write_bytes(b"x" * 260_000)
        films.append((frame_rate, has_plan))

    def new_film(takes: list[Take], *arguments: float) -> Any:
        by_name, by_object = takes
        assert (by_name.name, by_object.name) == ("homing", "icyWithAVeryLongNameOfIt")
        for film_take in takes:
            assert film_take.play.world.scenario == fields.get("scenario", Scenario())
            assert film_take.play.world.faults == (Fault("FM1", 1),)
        films.append(arguments)
        return SimpleNamespace(frames=lambda: "frames")

    monkeypatch.setattr(embedded, "write_film", write_film)
    monkeypatch.setattr("swarm_logistics_env.views.watch.film.Film", new_film)
    long_name = type("APoicyWithAVeryLongNameOfIt", (type(policies.load("homing")),), {})
    clip = film("homing", long_name(), faults=["FM1:1"], **fields)
    assert films == [(until, speed, 25.0), (25.0, floor is not None)]
    title = f"homing, icyWithAVeryLongNameOfIt, seed {seed}"
    assert repr(clip) == f"EmbeddedFilm('{title}', 0.3 MB)"
    assert clip.content == b"x" * 260_000


def test_wrong_arguments() -> None:
    right: dict[str, Any] = {"takes": [take()], "until": 5.0, "speed": 1.0, "frame_rate": 9.0}
    for name, wrong, words in (
        ("takes", [], "0 runs: should be 1 to 4 side by side"),
        ("takes", [take()] * 5, "5 runs: should be 1 to 4 side by side"),
        ("until", float("nan"), "until = nan s: should be above 0"),
        ("until", float("inf"), "until = inf s: should be above 0"),
        ("until", 0.0, "until = 0 s: should be above 0"),
        ("speed", 0.009, "speed = 0.009: should be 0.01 to 1000 times real time"),
        ("speed", 1001.0, "speed = 1001: should be 0.01 to 1000 times real time"),
    ):
        with pytest.raises(SetupError, match=f"^{words}$"):
            Film(**{**right, name: wrong})
    for name, bound in (("takes", [take()] * 4), ("speed", 0.01), ("speed", 1000.0)):
        assert Film(**{**right, name: bound}).n_frames > 18
    usual, of_600_px = (next(Film(**fields).frames()) for fields in (right, {**right, "size": 600}))
    np.testing.assert_equal(usual, of_600_px)
