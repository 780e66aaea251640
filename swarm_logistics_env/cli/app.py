"""`swarm-logistics run`, `list`, `attack` and `train`; the other commands are added here."""

from __future__ import annotations

import shlex
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarm_logistics_env.episode import run_episode
from swarm_logistics_env.errors import SetupError, TrainingError
from swarm_logistics_env.policies import called, known_policies, load, read_card
from swarm_logistics_env.report.section import bracketed
from swarm_logistics_env.scenario import SOURCES
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.play import engine_named
from swarm_logistics_env.studies.presets import PRESETS
from swarm_logistics_env.train.training import preset_names
from swarm_logistics_env.warehouse import FAILURE_MODES, Fault
from swarm_logistics_env.warehouse.fault_text import text_of

from .application import (
    Application,
    FaultOption,
    PresetOption,
    ScenarioOption,
    SeedOption,
    SetOption,
    TrustPolicyOption,
    faults_of,
    scenario_of,
    show_table,
)
from .judging import judge_command
from .study_commands import ProcessesOption, study
from .watch import watch_command, write_film_of

if TYPE_CHECKING:
    from swarm_logistics_env.attack import AttackResult

PolicyArgument = Annotated[
    str, typer.Argument(metavar="POLICY", help="Name, path of a file, or package.module:Class.")
]


def attack_command(
    policy: PolicyArgument,
    robots: Annotated[int, typer.Option(min=1, help="How many robots fail.")] = 2,
    modes: Annotated[
        list[str] | None,
        typer.Option("--mode", help="Mode to search; may be repeated."),
    ] = None,
    budget: Annotated[int, typer.Option(min=10, help="Runs of faults in the search.")] = 200,
    fresh: Annotated[int, typer.Option(min=3, help="Other seeds, for the estimates.")] = 30,
    seed: Annotated[int, typer.Option(help="Of the search's own choices.")] = 0,
    preset: PresetOption = "paper",
    file: ScenarioOption = None,
    changes: SetOption = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory; results/attack-POLICY if not given.")
    ] = None,
    processes: ProcessesOption = None,
) -> None:
    """Search for the fault that costs most: mode, role at the onset, time and duration.

    What it finds bounds the worst fault from one side: there may be worse ones.
    """
    from swarm_logistics_env.attack import MODES, Attack, attack

    asked = Attack(
        policy=policy,
        scenario=scenario_of(preset, file, changes),
        robots=robots,
        modes=tuple(modes) if modes else MODES,
        budget=budget,
        fresh=fresh,
        seed=seed,
    )
    engine = engine_named("local" if processes == 1 else "process", processes)
    place = out or Path("results") / f"attack-{Path(policy).stem}"
    try:
        found = attack(asked, engine, place)
    except KeyboardInterrupt:
        typer.echo(
            f"\nStopped. What is finished is kept in {place}; the same command goes on.", err=True
        )
        raise typer.Exit(130) from None
    _show_attack(found, policy, robots, fresh)


def _show_attack(result: AttackResult, policy: str, robots: int, fresh: int) -> None:
    rows = [
        (
            found.by,
            _in_words(found.fault),
            bracketed(found.robustness, 3),
            str(found.runs),
        )
        for found in result.found
    ]
    worst = min(result.found, key=lambda found: found.robustness.value)
    text = text_of(worst.fault)
    played = f" `run` and `watch` play it with --fault {shlex.quote(text)}." if text else ""
    capped = (
        "Capped: without a fault every item was delivered in a run or more, so R may be lower than "
        "shown. --set restock=true has no cap."
    )
    show_table(
        f"{policy}: worst faults found",
        ("found by", "fault", "R [95 %]", "runs"),
        rows,
        f"Worst fault of {robots} robots found: {_in_words(worst.fault)}, R = "
        f"{worst.robustness.value:.3f} on {fresh} seeds that no search has met.{played}",
        f"{result.tried} of {result.searched} faults were tried. What is found bounds "
        "the worst from one side: it proves no other fault harmless.",
        *([capped] if result.is_capped else ()),
    )


def _in_words(fault: Fault) -> str:
    who = "by the seed" if fault.role is None else fault.role.replace("_", " ")
    until = "" if fault.duration is None else f" for {fault.duration:g} s"
    return f"{fault.mode} of {fault.robots} ({who}) from {fault.onset:g} s{until}"


def train_command(
    context: typer.Context,
    preset: Annotated[
        str,
        typer.Argument(
            metavar="PRESET|FILE",
            help=f"Training preset ({', '.join(preset_names())}), or TOML file of one.",
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Directory; results/train/NAME if not given.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of everything random.")] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Agent-steps to learn from.")] = None,
    device: Annotated[
        str | None, typer.Option(help="cpu or cuda; the GPU where there is one if not given.")
    ] = None,
) -> None:
    """Train a policy; the same command goes on where it was stopped."""
    changed = {"seed": seed, "agent_steps": steps}
    fields = {name: value for name, value in changed.items() if value is not None}
    try:
        path = _train(preset, out, str(context.obj), device, fields)
    except KeyboardInterrupt:
        typer.echo("\nStopped. The same command goes on.", err=True)
        raise typer.Exit(130) from None
    typer.echo(f"Written: {path}")
    typer.echo(f"Watch it: swarm-logistics watch --policy {shlex.quote(str(path))}")
    typer.echo(f"Judge it: swarm-logistics judge {shlex.quote(str(path))}")


def _train(
    asked: str, out: Path | None, command: str, device: str | None, fields: dict[str, Any]
) -> Path:
    """Train a preset, or what a TOML file describes, and show it; return the policy file's path."""
    from swarm_logistics_env.train.training import load_training

    training = load_training(asked, **fields)
    try:
        import_module("tensorboard")  # missed before anything is written
        from swarm_logistics_env.train.trainer import train
    except ModuleNotFoundError as error:
        raise TrainingError(
            f"training needs more ({error}): pip install 'swarm-logistics-env[train]'"
        ) from error
    out = out or Path("results/train", training.name)
    log = shlex.quote(str(out / "tensorboard"))
    typer.echo(f"To follow it: tensorboard --logdir {log}")
    path = train(training, out, command=command, device=device)
    _show_training(path)
    return path


def _show_training(path: Path) -> None:
    from swarm_logistics_env.train.curve import BEST, PICTURE

    card = read_card(path)
    rows = tuple(
        (
            score.measure,
            score.condition,
            f"{score.value:.3g}",
            *("-" if limit is None else f"{limit:.3g}" for limit in (score.low, score.high)),
            str(score.seeds),
        )
        for score in card.scores
    )
    if rows:
        show_table(
            f"{card.name}: scores on seeds it was not trained on",
            ("measure", "condition", "value", "low", "high", "seeds"),
            rows,
            "low, high: limits of the 95 % interval",
        )
    typer.echo(f"Curve: {path.parent / PICTURE}")
    typer.echo(f"Best on the evaluation's seeds: {path.parent / BEST}")


def run_command(
    policies: Annotated[
        list[str] | None,
        typer.Option(
            "--policy",
            help="Name (`list policies`), path of a policy file, or package.module:Class; swarm-dt "
            "if not given. With --film it may be repeated.",
        ),
    ] = None,
    seed: SeedOption = 0,
    preset: PresetOption = "paper",
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    faults: FaultOption = None,
    film: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.mp4|FILE.gif",
            help="Write the episode as a film; several policies stand side by side.",
        ),
    ] = None,
    twin: Annotated[
        bool,
        typer.Option("--twin", help="In the film beside the same seed without its faults."),
    ] = False,
    until: Annotated[
        float | None, typer.Option(help="Where the film ends [s]; with the episode if not given.")
    ] = None,
    speed: Annotated[float, typer.Option(help="How many times real time the film plays.")] = 4.0,
    trust_code: TrustPolicyOption = False,
) -> None:
    """Play one episode and print what it delivered, or write it as a film."""
    import time

    scenario = scenario_of(preset, scenario_file, changes)
    scheduled = faults_of(faults, scenario)
    names = policies or ["swarm-dt"]
    if film is not None:
        write_film_of(
            film, scenario, names, seed, scheduled, until, speed,
            twin=twin, load=lambda name: load(name, trust_code=trust_code),
        )  # fmt: skip
        return
    if twin or until is not None or len(names) > 1:
        raise SetupError("--twin, --until, several --policy: are for a film, with --film FILE.mp4")
    player = load(names[0], trust_code=trust_code)
    # This compiles the kernels, so that the time below is that of the episode alone.
    run_episode(scenario.replace(duration=scenario.control_period), player, seed)
    start = time.perf_counter()
    episode = run_episode(scenario, player, seed, scheduled)
    wall = time.perf_counter() - start
    times = episode.delivery_times
    of = "" if scenario.restock else f" of {scenario.n_items}"
    typer.echo(
        f"P = {episode.delivered} items delivered{of} in {episode.ended_at:g} s "
        f"by {scenario.n_robots} robots with {called(names[0])}, seed {seed}"
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


class Listed(StrEnum):
    """What `list` can list."""

    policies = "policies"
    faults = "faults"
    studies = "studies"
    scenario = "scenario"


def list_command(
    what: Annotated[Listed, typer.Argument(help="What to list.")],
    preset: PresetOption = "paper",
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Of a scenario: JSON, which --scenario reads.")
    ] = False,
) -> None:
    """List policies, faults (failure modes), studies, or every condition of a scenario."""
    if what is Listed.scenario:
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
        show_table(f"Preset {preset}", columns, chosen.conditions(), marks, sources)
    elif what is Listed.policies:
        line = "Your own is package.module:Class, or the path of a file that `train` wrote."
        show_table("Policies", ("name", "kind", "about"), known_policies(), line)
    elif what is Listed.faults:
        rows = ((name, mode.description) for name, mode in FAILURE_MODES.items())
        line = "As --fault takes one: MODE:ROBOTS@ONSET, e.g. FM4:2@200"
        show_table("Failure modes", ("mode", "what it does to a robot"), rows, line)
    else:
        plans = [(name, Study.preset(name).plan()) for name in PRESETS]
        found = [
            (
                name,
                str(len(plan.seeds)),
                str(len(plan.runs)),
                "; ".join(dict.fromkeys(table for _, table, _ in plan.cells)),
            )
            for name, plan in plans
        ]
        line = "swarm-logistics study plan NAME prints its conditions; study run NAME plays it."
        show_table("Studies", ("name", "seeds", "runs", "tables"), found, line)


app = Application(
    name="swarm-logistics",
    help="A warehouse for robot swarms, and the measure of how they cope.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
# In the order of use, as the help shows them.
app.command("watch")(watch_command)
app.command("run")(run_command)
app.command("train")(train_command)
app.command("judge")(judge_command)
app.command("attack")(attack_command)
app.command("list")(list_command)
app.add_typer(study)


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
