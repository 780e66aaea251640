"""`swarm-logistics run` and `scenario`; the other commands are added here."""

from __future__ import annotations

from typing import Annotated

import typer

from .application import Application
from .fault_commands import attack_command
from .judging import judge_command
from .options import (
    FaultOption,
    PolicyOption,
    PresetOption,
    ScenarioOption,
    SeedOption,
    SetOption,
    TrustPolicyOption,
    faults_of,
    scenario_of,
)
from .study_commands import study
from .train import train_command
from .watch import film_command, watch_command

app = Application(
    name="swarm-logistics",
    help="A warehouse for robot swarms, and the measure of how they cope.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(study)
app.command("train")(train_command)
app.command("film")(film_command)
app.command("watch")(watch_command)
app.command("judge")(judge_command)
app.command("attack")(attack_command)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(version("swarm-logistics-env"))
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version.", is_eager=True, callback=_print_version
        ),
    ] = False,
) -> None:
    """Take the options that stand before a command."""


@app.command("scenario")
def scenario_command(
    preset: PresetOption = "paper",
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON, which can be read back.")
    ] = False,
) -> None:
    """Print every condition of a run: value, unit, and whether the default is sourced or fitted."""
    from swarm_logistics_env.scenario import SOURCES

    from .terminal_tables import show_table

    chosen = scenario_of(preset, scenario_file, changes)
    if as_json:
        typer.echo(chosen.to_json())
        return
    marks = (
        "fitted: chosen to bring the paper's tables closest. chosen: without a source. "
        "off: added here, left out."
    )
    sources = "; ".join(f"{name}: {address}" for name, address in SOURCES.items())
    columns = ("condition", "value", "unit, meaning; source")
    show_table(f"Scenario, from the preset {preset}", columns, chosen.conditions(), marks, sources)


@app.command("policies")
def policies_command() -> None:
    """List the policies that can be called by name."""
    from swarm_logistics_env.policies import known_policies

    from .terminal_tables import show_table

    line = "A policy of your own is package.module:Class, or the path of a file that `train` wrote."
    show_table("Policies", ("name", "kind", "about"), known_policies(), line)


@app.command("run")
def run_command(
    policy: PolicyOption = "swarm-dt",
    seed: SeedOption = 0,
    preset: PresetOption = "paper",
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    faults: FaultOption = None,
    trust_code: TrustPolicyOption = False,
) -> None:
    """Play one episode and print what it delivered."""
    import time

    from swarm_logistics_env import policies
    from swarm_logistics_env.episode import run_episode

    scenario = scenario_of(preset, scenario_file, changes)
    scheduled = faults_of(faults, scenario)
    player = policies.load(policy, trust_code=trust_code)
    # This compiles the kernels, so that the time below is that of the episode alone.
    run_episode(scenario.replace(duration=scenario.control_period), player, seed)
    start = time.perf_counter()
    episode = run_episode(scenario, player, seed, scheduled)
    wall = time.perf_counter() - start
    times = episode.delivery_times
    of = "" if scenario.restock else f" of {scenario.n_items}"
    typer.echo(
        f"P = {episode.delivered} items delivered{of} in {episode.ended_at:g} s "
        f"by {scenario.n_robots} robots with {policies.called(policy)}, seed {seed}"
    )
    if len(times):
        gaps = [after - before for before, after in zip([0.0, *times], times)]
        typer.echo(
            f"first at {times[0]:.1f} s, last at {times[-1]:.1f} s, "
            f"{sum(gaps) / len(gaps):.1f} s apart on average, at most {max(gaps):.1f} s"
        )
    if episode.failed_robots:
        typer.echo(
            f"failed robots {', '.join(map(str, episode.failed_robots))}; working robots touched "
            f"them for {episode.anchoring_seconds:.1f} robot-seconds"
        )
    typer.echo(f"{episode.ended_at / wall:.0f} times real time ({wall:.2f} s)")
