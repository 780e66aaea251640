"""`swarm-logistics film`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarm_logistics_env.cli.app import app
from swarm_logistics_env.cli.options import (
    FaultOption,
    PresetOption,
    SetOption,
    TrustPolicyOption,
    fault_of,
    scenario_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from swarm_logistics_env.warehouse.faults import Fault
    from swarm_logistics_env.watch.film import Film


@app.command("film")
def film_command(
    out: Annotated[Path, typer.Argument(metavar="FILE.mp4|FILE.gif", help="Is replaced.")],
    policies: Annotated[
        list[str] | None,
        typer.Option(
            "--policy",
            help="Name, path of a policy file, or package.module:Class; repeated: side by side.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Decides everything random.")] = 0,
    preset: PresetOption = "paper",
    changes: SetOption = None,
    faults: FaultOption = None,
    twin: Annotated[
        bool, typer.Option("--twin", help="Beside it, the same seed without the faults.")
    ] = False,
    until: Annotated[
        float | None, typer.Option(help="End of the film [s of the run]; default: the episode's.")
    ] = None,
    speed: Annotated[float, typer.Option(help="Times real time.")] = 4.0,
    frame_rate: Annotated[float, typer.Option("--fps", help="Frames a second.")] = 25.0,
    size: Annotated[int, typer.Option(help="Longer side of each warehouse [px].")] = 480,
    trails: Annotated[bool, typer.Option("--trails", help="Robots leave their paths.")] = False,
    links: Annotated[
        bool, typer.Option("--links", help="Whom each robot follows, not the carrier alone.")
    ] = False,
    trust_code: TrustPolicyOption = False,
) -> None:
    """Write an episode as a film; several policies, or with and without faults, side by side."""
    from swarm_logistics_env import policies as known
    from swarm_logistics_env.errors import SetupError
    from swarm_logistics_env.rendering.renderer import load_pygame
    from swarm_logistics_env.rendering.video import check_film, write_film

    scenario = scenario_of(preset, changes)
    scheduled = [fault_of(text) for text in faults or []]
    if twin and not scheduled:
        raise SetupError("--twin: is the run without its faults, so --fault should be given")
    check_film(out)
    load_pygame()
    from swarm_logistics_env.watch.film import Film, Take
    from swarm_logistics_env.watch.play import Play

    takes = []
    for name in policies or ["swarm-dt"]:
        for these in ([], scheduled) if twin else (scheduled,):
            policy = known.load(name, trust_code=trust_code)
            title = _title(name, these, bool(scheduled))
            takes.append(Take(title, Play(scenario, policy, seed, these)))
    film = Film(
        takes,
        scenario.duration if until is None else until,
        speed,
        frame_rate,
        size,
        trails=trails,
        all_links=links,
    )
    count = write_film(out, _counted(film, out.name), frame_rate)
    typer.echo(
        f"{out}: {count} frames, {count / frame_rate:.1f} s, {out.stat().st_size / 1e6:.2f} MB"
    )


def _title(policy: str, faults: list[Fault], tells_faults: bool) -> str:
    # A long path of a user's own policy is cut at its beginning.
    short = policy if len(policy) <= 24 else f"…{policy[-23:]}"
    what = ", ".join(f"{fault.mode} × {_count(fault)}" for fault in faults) or "no fault"
    return f"{short}, {what}" if tells_faults else short


def _count(fault: Fault) -> int:
    return fault.robots if isinstance(fault.robots, int) else len(fault.robots)


def _counted(film: Film, label: str) -> Iterator[NDArray[np.uint8]]:
    """Return the film's frames; a bar at a terminal shows how many there were."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        yield from progress.track(film.frames(), total=film.n_frames, description=label)
