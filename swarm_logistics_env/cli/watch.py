"""`swarm-logistics watch`, and films."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarm_logistics_env import policies
from swarm_logistics_env.episode import Play
from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.policies import Policy, called
from swarm_logistics_env.records import becoming
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.faults import Fault

from .application import (
    FaultOption,
    PolicyOption,
    PresetOption,
    ScenarioOption,
    SetOption,
    TrustPolicyOption,
    faults_of,
    scenario_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


FRAME_RATE = 25.0  # frames a second
FILM_SIZE = 480  # longer side of each warehouse [px]


def watch_command(
    policy: PolicyOption = "ppo-delivery",
    against: Annotated[
        str | None,
        typer.Option(help="Policy of the run beside it; left out: the same without faults."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the first episode.")] = 0,
    preset: PresetOption = "paper",
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    faults: FaultOption = None,
    speed: Annotated[float, typer.Option(help="How many times real time it plays.")] = 8.0,
    port: Annotated[
        int,
        typer.Option(min=0, max=65535, help="Port of this machine; 0 takes any that is free."),
    ] = 8765,
    host: Annotated[str, typer.Option(help="Address to listen on; 0.0.0.0: all.")] = "127.0.0.1",
    no_open: Annotated[bool, typer.Option("--no-open", help="Open no browser.")] = False,
    save: Annotated[
        Path | None,
        typer.Option(help="Play to the end and write a page that replays it; serve nothing."),
    ] = None,
    until: Annotated[
        float | None, typer.Option(help="With --save: time at which the replay ends [s].")
    ] = None,
    trust_code: TrustPolicyOption = False,
) -> None:
    """Watch two runs side by side in the browser; inspect, break and repair robots."""
    import webbrowser

    from swarm_logistics_env.watch import Session
    from swarm_logistics_env.watch.messages import recorded_page
    from swarm_logistics_env.watch.server import is_loopback, serve

    if until is not None and (save is None or not until > 0.0):
        raise SetupError(f"--until {until:g}: should be above 0 s, together with --save")
    if save is not None and (save.is_dir() or not os.access(save.parent, os.W_OK)):
        raise SetupError(f"--save {save}: should be a file in a folder that can be written to")
    scenario = scenario_of(preset, scenario_file, changes)
    given = {policies.called(name): name for name in filter(None, (policy, against))}
    session = Session(
        scenario,
        policies.called(policy),
        None if against is None else policies.called(against),
        seed,
        faults_of(faults, scenario),
        speed,
        lambda name: policies.load(given.get(name, name), trust_code=trust_code),
    )
    if save is None:
        if not is_loopback(host):
            told = "whoever learns the address can watch and steer; nothing is encrypted"
            typer.echo(f"Warning: --host {host}: {told}.", err=True)
        shows = not no_open and sys.stdout.isatty() and _has_screen()
        serve(session, port, typer.echo, host, webbrowser.open if shows else None)
        return
    page = recorded_page(session, session.scenario.duration if until is None else until)
    with becoming(save, SetupError) as part:
        part.write_text(page, encoding="utf-8")
    typer.echo(f"{save}: {session.run.world.state.time:g} s, {len(page) / 1e6:.2f} MB")


def _has_screen() -> bool:
    """Return whether a browser has a window to open; one in text would take the terminal."""
    names = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform in ("darwin", "win32") or any(map(os.environ.get, names))


def write_film_of(
    out: Path,
    scenario: Scenario,
    policies: Sequence[str],
    seed: int,
    faults: Sequence[Fault],
    until: float | None,
    speed: float,
    *,
    twin: bool,
    load: Callable[[str], Policy],
) -> None:
    """Write episodes as a film, one policy, or with and without faults, beside the other.

    Raises:
        SetupError: the file's name or the extra for films does not do, or there is no fault.
    """
    from rich.console import Console
    from rich.progress import Progress

    from swarm_logistics_env.rendering.renderer import check_film, load_pygame, write_film

    if twin and not faults:
        raise SetupError("--twin: shows the run without its faults, so --fault should be given")
    check_film(out)
    load_pygame()
    from swarm_logistics_env.watch.film import Film, Take

    takes = []
    for name in policies:
        for these in ((), faults) if twin else (faults,):
            title = _title(name, these) if faults else _short(name)
            takes.append(Take(title, Play(scenario, load(name), seed, these)))
    end = scenario.duration if until is None else until
    film = Film(takes, end, speed, FRAME_RATE, FILM_SIZE)
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        frames = progress.track(film.frames(), total=film.n_frames, description=out.name)
        count = write_film(out, frames, FRAME_RATE)
    size = out.stat().st_size / 1e6
    typer.echo(f"{out}: {count} frames, {count / FRAME_RATE:.1f} s, {size:.2f} MB")


def _short(policy: str) -> str:
    policy = called(policy)
    # A long path of a user's own policy is cut at its beginning.
    return policy if len(policy) <= 24 else f"…{policy[-23:]}"


def _title(policy: str, faults: Sequence[Fault]) -> str:
    counts = [
        f"{fault.mode} × {fault.robots if isinstance(fault.robots, int) else len(fault.robots)}"
        for fault in faults
    ]
    return f"{_short(policy)}, {', '.join(counts) or 'no fault'}"
