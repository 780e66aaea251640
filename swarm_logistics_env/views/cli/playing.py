"""`swarm-logistics run`, `watch` and `list`; films."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from typer import Argument, Option, echo

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.core.records import atomic_write
from swarm_logistics_env.policies import display_name, known_policies, load
from swarm_logistics_env.policies.episode import Play, run_episode
from swarm_logistics_env.world.scenario import ROLES, SOURCES
from swarm_logistics_env.world.warehouse import FAILURE_MODES
from swarm_logistics_env.world.warehouse.orders import OrderMeasures

from .policy_choice import (
    EnvOption,
    FrameOption,
    NormalizeOption,
    PolicyOption,
    TrustOption,
    policies_of,
)
from .world_choice import (
    USUAL_PRESET,
    BodiesOption,
    FaultOption,
    PresetOption,
    Repeated,
    ScenarioOption,
    SeedOption,
    SetOption,
    faults_of,
    scenario_of,
)


def run_command(
    policies: Annotated[
        Repeated,
        Option(
            "--policy",
            help="Name (`list policies`), path of a file, module:Class, my.py:Class or c:my.c; "
            "swarm-dt if not given. With --film it may be repeated.",
        ),
    ] = None,
    seed: SeedOption = 0,
    preset: PresetOption = None,
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    bodies: BodiesOption = None,
    faults: FaultOption = None,
    film: Annotated[
        Path | None,
        Option(
            metavar="FILE.mp4|FILE.gif",
            help="Write the episode as a film; several policies stand side by side.",
        ),
    ] = None,
    twin: Annotated[
        bool, Option("--twin", help="In the film beside the same seed without its faults.")
    ] = False,
    until: Annotated[
        float | None, Option(help="Where the film ends [s]; with the episode if not given.")
    ] = None,
    speed: Annotated[float, Option(help="How many times real time the film plays.")] = 4.0,
    trust_code: TrustOption = False,
    frame: FrameOption = False,
    normalize: NormalizeOption = None,
    env: EnvOption = None,
) -> None:
    """Play one episode and print what it delivered, or write a film."""
    players = policies_of(policies or ["swarm-dt"], trust_code, frame, normalize, env)
    scenario = scenario_of(preset, scenario_file, changes, bodies, policies=players)
    scheduled = faults_of(faults, scenario)
    if film is not None:
        variants = [(faults or [], scheduled)]
        if twin:
            if not scheduled:
                raise SetupError("--twin: shows a run without its faults: --fault should be given")
            variants.insert(0, (["no fault"], []))
        runs = []
        for player in players:
            for fault_texts, scheduled_faults in variants:
                title = ", ".join([display_name(player.name)[-24:], *fault_texts])
                runs.append((title, Play(scenario, player.load(), seed, scheduled_faults)))
        _write_film(film, runs, scenario.duration if until is None else until, speed)
        return
    if twin or until is not None or len(players) > 1:
        raise SetupError("--twin, --until, several --policy: are for a film, with --film FILE.mp4")
    policy = players[0].load()
    # This compiles the kernels, so that the time below is that of the episode alone.
    run_episode(scenario.replace(duration=scenario.control_period), policy, seed)
    start = time.perf_counter()
    episode = run_episode(scenario, policy, seed, scheduled)
    wall = time.perf_counter() - start
    times = episode.delivery_times
    of_all = "" if scenario.restock else f" of {scenario.n_items}"
    echo(
        f"P = {episode.delivered} items delivered{of_all} in {episode.ended_at:g} s "
        f"by {scenario.n_robots} robots with {display_name(players[0].name)}, seed {seed}"
    )
    if len(times):
        wait = np.diff(times, prepend=0.0).max()
        echo(f"first at {times[0]:.1f} s, last at {times[-1]:.1f} s, longest wait {wait:.1f} s")
    for line in (*_orders_in_words(episode.orders), *_batteries_in_words(episode.charge)):
        echo(line)
    if episode.failed_robots:
        echo(
            f"failed robots {', '.join(map(str, episode.failed_robots))}; working robots touched "
            f"them for {episode.anchoring_seconds:.1f} robot-seconds"
        )
    echo(f"{episode.ended_at / wall:.0f} times real time ({wall:.2f} s)")


def _orders_in_words(measures: OrderMeasures) -> Iterator[str]:
    """Yield a line on what was counted of orders, if anything was."""
    if measures.share_on_time is not None:
        yield (
            f"{measures.share_on_time:.0%} of the orders on time, "
            f"95 % at most {measures.p95_tardiness:.0f} s late"
        )
    if measures.longest_queue is not None:
        yield f"longest queue {measures.longest_queue}, {measures.turned_away} turned away"
    if measures.put_back is not None:
        yield f"{measures.put_back} requests put back"


def _batteries_in_words(charge: tuple[float, ...]) -> Iterator[str]:
    """Yield a line on what is left in the batteries, if there are any."""
    if charge:
        n_empty = charge.count(0.0)
        yield (
            f"batteries at the end: {np.mean(charge):.0%} on average, "
            f"{n_empty} of {len(charge)} empty"
        )


def watch_command(
    policy: PolicyOption = "ppo-delivery",
    against: Annotated[
        str | None, Option(help="Policy of the run beside it; left out: the same without faults.")
    ] = None,
    seed: Annotated[int, Option(min=0, help="Seed of the first episode.")] = 0,
    preset: PresetOption = None,
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    bodies: BodiesOption = None,
    faults: FaultOption = None,
    show_fault: Annotated[
        bool,
        Option("--show-fault", help="Begin with what two robots in FM4 cost, as README shows it."),
    ] = False,
    speed: Annotated[float, Option(help="How many times real time it plays.")] = 8.0,
    port: Annotated[
        int, Option(min=0, max=65535, help="Port of this machine; 0 takes any that is free.")
    ] = 8765,
    no_open: Annotated[bool, Option("--no-open", help="Open no browser.")] = False,
    save: Annotated[
        Path | None, Option(help="Play to the end and write a page that replays it; serve nothing.")
    ] = None,
    until: Annotated[
        float | None, Option(help="With --save: time at which the replay ends [s].")
    ] = None,
    trust_code: TrustOption = False,
    frame: FrameOption = False,
    normalize: NormalizeOption = None,
    env: EnvOption = None,
) -> None:
    """Watch two runs in the browser; inspect, break and repair robots."""
    import webbrowser

    from swarm_logistics_env.views.watch import Session
    from swarm_logistics_env.views.watch.messages import recorded_page

    if until is not None and (save is None or not until > 0.0):
        raise SetupError(f"--until {until:g}: should be above 0 s, together with --save")
    if save is not None and (save.is_dir() or not os.access(save.parent, os.W_OK)):
        raise SetupError(f"--save {save}: should be a file in a folder that can be written to")
    if show_fault and any((against, preset, scenario_file, changes, bodies, faults)):
        raise SetupError(
            "--show-fault: has a world, policy and fault of its own: leave out --against, "
            "--preset, --scenario, --set, --bodies and --fault"
        )
    players = policies_of(filter(None, (policy, against)), trust_code, frame, normalize, env)
    scenario = scenario_of(preset, scenario_file, changes, bodies, policies=players)
    typed = {display_name(player.name): player for player in players}
    session = Session(
        scenario,
        display_name(policy),
        None if against is None else display_name(against),
        seed,
        faults_of(faults, scenario),
        speed,
        lambda name: typed[name].load() if name in typed else load(name, trust_code=trust_code),
    )
    if show_fault:
        session.show_fault()
    if save is None:
        from swarm_logistics_env.views.watch.server import serve  # needs aiohttp

        shows = not no_open and sys.stdout.isatty() and _has_screen()
        serve(session, port, echo, show=webbrowser.open if shows else None)
        return
    page = recorded_page(session, session.scenario.duration if until is None else until)
    with atomic_write(save, SetupError) as part:
        part.write_text(page, encoding="utf-8")
    echo(f"{save}: {session.state.time:g} s, {len(page) / 1e6:.2f} MB")


def _has_screen() -> bool:
    """Return whether a browser has a window to open; one in text would take the terminal."""
    names = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform in ("darwin", "win32") or any(map(os.environ.get, names))


def _write_film(out: Path, runs: list[tuple[str, Play]], until: float, speed: float) -> None:
    """Write runs, each with the words above it, as a film, one beside the other.

    Raises:
        SetupError: the file's name or the extra for films does not do.
    """
    from rich.console import Console
    from rich.progress import Progress

    from swarm_logistics_env.world.rendering.renderer import FRAME_RATE, load_pygame, write_film

    load_pygame()
    from swarm_logistics_env.views.watch.film import Film, Take

    film = Film([Take(*run) for run in runs], until, speed, FRAME_RATE)
    has_plan = any(play.world.scenario.floor is not None for _, play in runs)
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        frames = progress.track(film.frames(), total=film.n_frames, description=out.name)
        count = write_film(out, frames, FRAME_RATE, has_plan)
    size = out.stat().st_size / 1e6
    echo(f"{out}: {count} frames, {count / FRAME_RATE:.1f} s, {size:.2f} MB")


def list_command(
    what: Annotated[
        Literal["policies", "trainings", "faults", "studies", "scenario"],
        Argument(help="What to list."),
    ],
    preset: PresetOption = None,
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    as_json: Annotated[
        bool, Option("--json", help="Of a scenario: JSON, which --scenario reads.")
    ] = False,
) -> None:
    """List policies, trainings, failure modes, studies or a scenario."""
    from swarm_logistics_env.study.questions.presets import PRESETS
    from swarm_logistics_env.study.studies import Study

    from .terminal import show_table

    if what == "scenario":
        scenario = scenario_of(preset, scenario_file, changes)
        if as_json:
            echo(scenario.to_json())
            return
        marks = (
            "fitted: chosen to bring the paper's tables closest. chosen: without a source. "
            "off: added here, left out."
        )
        sources = "; ".join(f"{name}: {address}" for name, address in SOURCES.items())
        columns = ("condition", "value", "unit, meaning; source")
        title = f"Preset {preset or USUAL_PRESET}"
        show_table(title, columns, scenario.conditions(), marks, sources)
    elif what == "policies":
        line = "Your own is package.module:Class, or the path of a file that `train` wrote."
        show_table("Policies", ("name", "kind", "about"), known_policies(), line)
    elif what == "trainings":
        from swarm_logistics_env.train.training import load_training, preset_names

        trainings = [(name, load_training(name)) for name in preset_names()]
        rows = [
            (name, f"{training.agent_steps / 1e6:g}", training.about)
            for name, training in trainings
        ]
        show_table("Trainings", ("name", "million agent-steps", "about"), rows)
    elif what == "faults":
        descriptions = [(name, mode.description) for name, mode in FAILURE_MODES.items()]
        line = (
            "As --fault takes one: MODE[:ROBOTS[:ROLE or KIND]][@ONSET[+DURATION]], e.g. "
            "FM4:2@200: two robots (one if not given) from 200 s on (0 s), in any role, for good. "
            f"Roles: {', '.join(ROLES)}. Kinds: those of robot_kinds"
        )
        show_table("Failure modes", ("mode", "what it does to a robot"), descriptions, line)
    else:
        studies = []
        for name in PRESETS:
            plan = Study.preset(name).plan()
            tables = "; ".join(dict.fromkeys(table for _, table, _ in plan.cells))
            studies.append((name, str(len(plan.seeds)), str(len(plan.runs)), tables))
        line = "swarm-logistics study plan NAME prints its conditions; study run NAME plays it."
        show_table("Studies", ("name", "seeds", "runs", "tables"), studies, line)
