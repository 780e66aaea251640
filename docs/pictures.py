"""Draws the pictures of the pages into docs/media: `python -m docs.pictures`."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from swarm_logistics_env import FAILURE_MODES, Fault, Scenario, Warehouse, policies
from swarm_logistics_env.episode import Play
from swarm_logistics_env.policies.policy import decide, start
from swarm_logistics_env.rendering import Renderer
from swarm_logistics_env.rendering.palette import film_colours
from swarm_logistics_env.watch import Session
from swarm_logistics_env.watch.film import Film, Take
from swarm_logistics_env.watch.messages import recorded_page
from verification.browser import Browser

MEDIA = Path(__file__).parent / "media"
SIZE = 560  # px
SMALL = Scenario(n_robots=16, warehouse_width=8.0, warehouse_height=6.0, n_items=30)


def scene(
    seconds: float,
    faults: tuple[Fault, ...] = (),
    scenario: Scenario = SMALL,
    name: str = "swarm-dt",
) -> NDArray[np.uint8]:
    """Return a picture of a policy's swarm after some time."""
    world = Warehouse(scenario)
    observations = world.reset(seed=4, faults=faults)
    policy = policies.load(name)
    start(policy, scenario, 4)
    renderer = Renderer(scenario, "rgb_array", SIZE)
    while world.state.time < seconds:
        observations = world.step(decide(policy, observations, world.state))
        picture = renderer.frame(world.state, scenario)
    return picture


def browser_view(name: str) -> None:
    """Keep a recording of a run, and photograph it with a headless Chromium."""
    faults = [Fault("FM4", [2, 7, 9], onset=60.0), Fault("FM4", [12, 20], onset=90.0)]
    session = Session(Scenario(), seed=1, faults=faults, speed=8.0)
    page = MEDIA / "run.html"
    page.write_text(recorded_page(session, 150.0), encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        browser = Browser(Path(folder), (1280, 860))
        try:
            browser.open(page.as_uri())
            browser.wait_for("latest && playhead > 0")
            browser.value("latest.paused = true, playhead = 149")
            browser.wait_for("drawn && drawn.time >= 148")
            (MEDIA / name).write_bytes(browser.screenshot())
        finally:
            browser.close()
    Image.open(MEDIA / name).convert("RGB").save(MEDIA / name, optimize=True)


def collapse(name: str) -> None:
    """Film one seed of a learned swarm without faults and with two robots that deliver nothing."""
    scenario, load = Scenario(restock=True), policies.load
    takes = [
        Take(title, Play(scenario, load("ppo-delivery"), 0, faults))
        for title, faults in (
            ("25 robots, no fault", ()),
            ("two of them deliver nothing (FM4)", ("FM4:2",)),
        )
    ]
    keep(Film(takes, 150.0, speed=16.0, frame_rate=12.5, size=400), name, 80)


def keep(film: Film, name: str, milliseconds: int) -> None:
    """Write a film that loops, each frame for so long."""
    first, *rest = (in_film_colours(frame) for frame in film.frames())
    timing = {"duration": milliseconds, "loop": 0}
    first.save(MEDIA / name, None, save_all=True, append_images=rest, optimize=True, **timing)


def gallery() -> None:
    """Film each failure mode in a small swarm, and each kind of policy in a large one."""
    small = Scenario(
        n_robots=8, warehouse_width=5.0, warehouse_height=4.0, delivery_width=1.2, n_items=10,
        restock=True,
    )  # fmt: skip
    for mode in FAILURE_MODES:
        faults = [Fault(mode, 2, onset=3.0)]
        take = Take(f"{mode}, 2 of 8", Play(small, policies.load("homing"), 2, faults))
        keep(Film([take], 30.0, 8.0, 8.0, size=400), f"mode-{mode}.gif", 125)
    for name in ("swarm-dt", "homing", "homing-stock", "central", "ppo-delivery", "ppo-robust"):
        take = Take(name, Play(Scenario(restock=True), policies.load(name), 0))
        keep(Film([take], 90.0, 20.0, 8.0, size=300), f"policy-{name}.gif", 125)


def save(picture: NDArray[np.uint8], name: str) -> None:
    """Write a picture: in the colours of films it takes a third, and none shifts."""
    in_film_colours(picture).save(MEDIA / name, optimize=True)


def in_film_colours(picture: NDArray[np.uint8]) -> Image.Image:
    """Return a picture in the colours that all films have."""
    palette = Image.new("P", (1, 1))
    palette.putpalette([part for colour in film_colours() for part in colour])
    return Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)


if __name__ == "__main__":
    MEDIA.mkdir(exist_ok=True)
    save(scene(30.0), "warehouse.png")
    save(scene(60.0, (Fault("FM1", 2), Fault("FM4", [0, 5]))), "faults.png")
    learned = scene(300.0, scenario=Scenario(restock=True), name="ppo-delivery")
    save(learned, "stock.png")
    collapse("fm4.gif")
    gallery()
    browser_view("watch.png")
