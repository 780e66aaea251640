"""Draws the pictures of the pages into docs/media: `python -m docs.pictures`."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from swarm_logistics_env import FAILURE_MODES, Fault, Scenario, policies
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.views.watch import Session
from swarm_logistics_env.views.watch.film import Film, Take
from swarm_logistics_env.views.watch.messages import recorded_page
from swarm_logistics_env.world.rendering import Renderer
from swarm_logistics_env.world.rendering.palette import film_colours
from swarm_logistics_env.world.rendering.renderer import write_film
from verification.browser import Browser

MEDIA = Path(__file__).parent / "media"
SMALL = Scenario(n_robots=16, warehouse_width=8.0, warehouse_height=6.0, n_items=30)
TINY = Scenario(
    n_robots=8, warehouse_width=5.0, warehouse_height=4.0, delivery_width=1.2, n_items=10,
    restock=True,
)  # fmt: skip
SEEDS = range(13)
REALISTIC = Scenario.preset("realistic").replace(restock=True)


def run(name: str, scenario: Scenario, seed: int, faults: Sequence[Fault] = ()) -> Play:
    """Return a policy's run at its beginning."""
    return Play(scenario, policies.load(name), seed, faults)


def median_run(name: str, scenario: Scenario, seconds: float, faults: Sequence[Fault] = ()) -> Play:
    """Return a policy's run at its beginning, by the seed of `SEEDS` with the median P by then."""
    delivered = {}
    for seed in SEEDS:
        play = run(name, scenario, seed, faults)
        while play.world.state.time < seconds:
            play.step()
        delivered[seed] = play.world.state.delivered
    ascending = sorted(SEEDS, key=delivered.__getitem__)
    return run(name, scenario, ascending[len(SEEDS) // 2], faults)


def scene(file: str, play: Play, seconds: float) -> None:
    """Write a picture of a run after some time, in the colours of films: it takes a third."""
    while play.world.state.time < seconds:
        play.step()
    renderer = Renderer(play.world.scenario, "rgb_array", 560)
    picture = renderer.frame(play.world.state, play.world.scenario)
    colours = film_colours(has_plan=play.world.scenario.floor is not None)
    palette = Image.new("P", (1, 1))
    palette.putpalette([part for colour in colours for part in colour])
    few = Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)
    few.save(MEDIA / file, optimize=True)


def browser_view(name: str) -> None:
    """Photograph the recording of a run with a headless Chromium."""
    faults = [Fault("FM4", [2, 7, 9], onset=60.0), Fault("FM4", [12, 20], onset=90.0)]
    session = Session(Scenario(), seed=1, faults=faults, speed=8.0)
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder, "run.html")
        page.write_text(recorded_page(session, 150.0), encoding="utf-8")
        browser = Browser(Path(folder, "profile"), (1280, 860))
        try:
            browser.open(page.as_uri())
            browser.wait_for("latest && playhead > 0")
            browser.value("latest.paused = true, goTo(149)")
            browser.wait_for("drawn && drawn.time >= 148")
            (MEDIA / name).write_bytes(browser.screenshot())
        finally:
            browser.close()
    Image.open(MEDIA / name).convert("RGB").save(MEDIA / name, optimize=True)


def films() -> None:
    """Film a learned swarm without and with faults, each failure mode, and each kind of policy."""
    session = Session(TINY)
    session.show_fault()  # the film and the button of the live view play the same
    takes = [
        Take("25 robots, no fault", session.beside),
        Take("two of them deliver nothing (FM4)", session.run),
    ]
    film = Film(takes, 240.0, speed=24.0, frame_rate=12.5, size=400)
    write_film(MEDIA / "fm4.gif", film.frames(), 12.5)
    # Scripts send no messages, so that a spoilt one changes nothing, and nobody has a battery here.
    is_shown = {mode: not mode.startswith(("message_", "cell_")) for mode in FAILURE_MODES}
    for mode in (mode for mode in FAILURE_MODES if is_shown[mode]):
        # Who is late begins when the fault ends, and who is away comes back; others fail for good.
        onset = 0.0 if mode == "late" else 3.0
        duration = 12.0 if mode in ("late", "away") else None
        failed = [Fault(mode, 2, onset=onset, duration=duration)]
        take = Take(f"{mode}, 2 of 8", median_run("homing", TINY, 30.0, failed))
        film = Film([take], 30.0, speed=8.0, frame_rate=8.0, size=400)
        write_film(MEDIA / f"mode-{mode}.gif", film.frames(), 8.0)
    for name in ("swarm-dt", "homing", "homing-stock", "central", "ppo-delivery", "ppo-robust"):
        take = Take(name, median_run(name, REALISTIC, 120.0))
        film = Film([take], 120.0, speed=20.0, frame_rate=8.0, size=300)
        write_film(MEDIA / f"policy-{name}.gif", film.frames(), 8.0)


if __name__ == "__main__":
    MEDIA.mkdir(exist_ok=True)
    scene("warehouse.png", run("swarm-dt", SMALL, 4), 30.0)
    failed = [Fault("FM1", 2), Fault("FM4", [0, 5])]
    scene("faults.png", run("swarm-dt", SMALL, 4, failed), 60.0)
    scene("stock.png", run("ppo-delivery", REALISTIC, 4), 300.0)
    aisles = Scenario(floor="aisles", restock=True)
    two_docks = Scenario(floor="two_docks", restock=True, request_docks="random", n_requests=3)
    scene("floor-aisles.png", run("homing", aisles, 1), 40.0)
    scene("floor-two-docks.png", run("homing", two_docks, 1), 40.0)
    films()
    browser_view("watch.png")
