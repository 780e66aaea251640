"""`swarm-logistics judge`: trials of real robots, or a policy; `attack`, its worst fault."""

from __future__ import annotations

import json
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from typer import Argument, Exit, Option, echo

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.policies import SUFFIXES, PolicySpec
from swarm_logistics_env.questions.plan import Origin
from swarm_logistics_env.questions.specification import FIRST_LOOK
from swarm_logistics_env.report import benchmark
from swarm_logistics_env.report.document import document
from swarm_logistics_env.report.section import bracketed, fixed, percent, slug
from swarm_logistics_env.report.write import write_report
from swarm_logistics_env.runs.engines import engine_named
from swarm_logistics_env.runs.notes import StoredStudy
from swarm_logistics_env.runs.recorded import import_results, origin_of
from swarm_logistics_env.runs.store import FILE_NAME
from swarm_logistics_env.spi import read_trials
from swarm_logistics_env.spi.estimate import LEAST_SEEDS
from swarm_logistics_env.studies import Study
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.warehouse.faults import text_of

from .app import PresetOption, Repeated, ScenarioOption, SetOption, TrustOption, scenario_of
from .study_commands import (
    ClearingOption,
    FullOption,
    LimitOption,
    ProcessesOption,
    run_study,
    study_of,
    tell_what_a_pilot_shows,
    until_cleared,
)
from .terminal import say, say_what_was_played, show, show_report, show_table

if TYPE_CHECKING:
    from swarm_logistics_env.attack import AttackResult

STUDY = "scorecard"
JUDGE_SEEDS = 60  # of a policy that is judged


def judge_command(
    context: typer.Context,
    asked: Annotated[
        str,
        Argument(
            metavar="TRIALS.csv|POLICY",
            help="CSV file, one trial or delivery a row; or a policy: name, path of a policy file, "
            "module:Class or my.py:Class.",
        ),
    ],
    out: Annotated[
        Path | None,
        Option(help="Directory of the study and its report; results/judged/NAME if not given."),
    ] = None,
    seeds: Annotated[
        int | None,
        # Fewer runs are alike by chance.
        Option(min=LEAST_SEEDS, help=f"Seeds of a policy at most; {JUDGE_SEEDS} if not given."),
    ] = None,
    until_clear: Annotated[
        bool,
        Option("--until-clear/--all-seeds", help="Stop each question where its verdict is clear."),
    ] = True,
    minutes: Annotated[
        float | None, Option(help="Play for so long; the same command goes on.")
    ] = None,
    clearing: ClearingOption = False,
    plays_benchmark: Annotated[
        bool,
        Option(
            "--benchmark",
            help="Play the benchmark of robustness, in which some failures are new to all.",
        ),
    ] = False,
    columns: Annotated[
        Repeated,
        Option(
            "--column",
            metavar="WHAT=NAME",
            help="What a column of another name is, e.g. performance=boxes; may be repeated.",
        ),
    ] = None,
    ignore: Annotated[
        Repeated, Option(metavar="NAME", help="Column to leave out; may be repeated.")
    ] = None,
    duration: Annotated[
        float | None, Option(help="Length of every trial in seconds, where no column says it.")
    ] = None,
    decimal: Annotated[
        str | None, Option(metavar=".|,", help="Sign before decimals; . if not given.")
    ] = None,
    setup: Annotated[
        Repeated,
        Option(
            metavar="NAME=VALUE",
            help="A condition for the report to state; may be repeated.",
        ),
    ] = None,
    processes: ProcessesOption = None,
    run_limit: LimitOption = None,
    full: FullOption = False,
    trust_code: TrustOption = False,
) -> None:
    """Judge a policy until its verdicts are clear, or recorded trials.

    Trials are of real robots or of another simulator. Their columns are robots, fault, faulty and
    delivered (or performance); where they apply seed, policy, onset and any parameter; or time,
    with a delivery a row. Without seeds the study is unpaired.

    A policy is played in a warehouse in which delivered items come back, so that P has no cap.
    """
    of_trials = {
        "--column": columns, "--ignore": ignore, "--duration": duration, "--decimal": decimal,
        "--setup": setup,
    }  # fmt: skip
    of_policy = {
        "--seeds": seeds,
        "--minutes": minutes,
        "--clearing": clearing,
        "--benchmark": plays_benchmark,
        "--run-limit": run_limit,
    }
    is_policy = names_policy(asked)
    for option, given in (of_trials if is_policy else of_policy).items():
        if given:
            kind = "a policy" if is_policy else "a file of trials"
            raise StudyError(f"{option} is not for {kind}, and {asked!r} is one")
    if plays_benchmark and (seeds or clearing):
        option = "--seeds" if seeds else "--clearing"
        raise StudyError(f"{option}: the benchmark has the same conditions for everybody")
    if is_policy:
        policy = PolicySpec.of(asked).replace(trusted=trust_code)
        for one in policy.trainings or (policy,):
            one.load()  # what is wrong with it is said before anything is written
        name = "local" if processes == 1 else "process"
        engine = engine_named(name, processes, run_limit=run_limit)
        if plays_benchmark:
            place = out or Path("results", "benchmark", slug(policy.title))
            study = study_of(benchmark.STUDY, place, None, [asked], trust_code)
        else:
            place = out or Path("results", "judged", slug(policy.title) + "-clearing" * clearing)
            most = seeds or JUDGE_SEEDS
            looks = until_clear and most > FIRST_LOOK
            study = study_of(STUDY, place, most, [asked], trust_code, until_clear=looks)
        if clearing:
            until_cleared(study)
        say(f"{study.plan()}, kept in {place}")
        echo()
        tell_what_a_pilot_shows(study)
        tally = run_study(study, engine, minutes=minutes)
        results = study.findings()
        if plays_benchmark and not (tally.left or tally.failed):
            _show_benchmark(results, place)
        else:
            show_report(results, place, full=full, is_finished=not tally.left)
        if tally.left and not tally.gave_up:
            why = f"Stopped after {minutes:g} min, {tally.left} runs are left"
            say(f"{why}; the same command goes on:", str(context.obj))
        # Several trainings and untrusted code need options that this command does not repeat.
        elif not (tally.left or plays_benchmark or policy.trainings or trust_code) and any(
            v.on_property.adjusted == "open" for v in results.verdicts
        ):
            more = max(JUDGE_SEEDS, 2 * most)
            say(
                "What is open needs more seeds, from the start:",
                f"swarm-logistics judge {quote(asked)}{' --clearing' * clearing} --seeds {more} "
                f"--out {quote(f'{place}-{more}')}",
            )
        say_what_was_played(tally)
        raise Exit(1 if tally.failed else 0)

    stated = _pairs("--setup", setup)
    trials = read_trials(
        asked,
        columns=_pairs("--column", columns),
        ignore=ignore or (),
        duration=duration,
        decimal=decimal,
    )
    origin = origin_of(trials, stated)
    usual = Path("results", "judged", Path(asked).stem)
    directory = out or _free(usual, origin)
    if not _holds(directory, origin):
        import_results(trials, directory, stated)
    if directory not in (out, usual):
        echo(f"{usual} holds an earlier judgement, so this one is in {directory}")
    echo("\n".join([f"{len(trials.rows)} runs in {asked}", *origin.notes, ""]))
    show_report(Study.stored(directory).findings(), directory, full=full)


def _holds(directory: Path, origin: Origin) -> bool:
    """Return whether a directory holds the study of these trials already."""
    try:
        return StoredStudy.existing(directory).imported == origin
    except StudyError:  # none, or none that reads
        return False


def _free(directory: Path, origin: Origin) -> Path:
    """Return a directory that holds no other study: that one, or one with a number."""
    number, free = 1, directory
    while (free / FILE_NAME).exists() and not _holds(free, origin):
        number += 1
        free = directory.with_name(f"{directory.name}-{number}")
    return free


def _pairs(option: str, texts: Repeated) -> dict[str, str]:
    pairs = {}
    for text in texts or []:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise StudyError(f"{option} {text}: should be NAME=VALUE")
        pairs[name] = value
    return pairs


def names_policy(asked: str) -> bool:
    """Return whether the argument of `judge` is a policy, not a file of trials."""
    suffix = Path(asked).suffix
    if suffix in (*SUFFIXES, ".py"):
        return True
    if Path(asked).is_file() or suffix.lower() in (".csv", ".tsv", ".txt"):
        return False
    return ":" in asked or not suffix


# Scores of the shipped policies in the benchmark; `docs/play_tables.py` writes it.
ENTRIES = Path(__file__).parents[1] / "report" / "benchmark_entries.json"


def _show_benchmark(results: StudyResults, out: Path) -> None:
    """Print the table of a policy in the benchmark and its place, and write the report."""
    show(benchmark.table(results))
    entries = {name: np.array(one) for name, one in json.loads(ENTRIES.read_text()).items()}
    entries[results.policies[0]] = benchmark.score(results)
    show(benchmark.leaderboard(entries))
    echo(f"Report: {write_report(results, out, document(results))[0]}")


def attack_command(
    policy: Annotated[
        str,
        Argument(metavar="POLICY", help="Name, .safetensors file, module:Class or my.py:Class."),
    ],
    robots: Annotated[int, Option(min=1, help="How many robots fail.")] = 2,
    modes: Annotated[Repeated, Option("--mode", help="Mode to search; may be repeated.")] = None,
    budget: Annotated[int, Option(min=10, help="Runs of faults in the search.")] = 200,
    fresh: Annotated[int, Option(min=3, help="Other seeds, for the estimates.")] = 30,
    seed: Annotated[int, Option(help="Of the search's own choices.")] = 0,
    preset: PresetOption = "paper",
    file: ScenarioOption = None,
    changes: SetOption = None,
    out: Annotated[
        Path | None, Option(help="Directory; results/attack-POLICY if not given.")
    ] = None,
    processes: ProcessesOption = None,
) -> None:
    """Search for the fault that costs most.

    It tries modes, roles at the onset, times and durations. What it finds bounds the worst fault
    from one side: there may be worse ones.
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
        echo(f"\nStopped. What is finished is kept in {place}; the same command goes on.", err=True)
        raise Exit(130) from None
    _show_attack(found, policy, robots, fresh)


def _show_attack(result: AttackResult, policy: str, robots: int, fresh: int) -> None:
    rows = [
        (found.by, str(text_of(found.fault)), bracketed(found.robustness, 3), str(found.runs))
        for found in result.found
    ]
    worst = min(result.found, key=lambda found: found.robustness.value)
    capped = (
        "Capped: without a fault every item was delivered in a run or more, so R may be lower than "
        "shown. --set restock=true has no cap."
    )
    show_table(
        f"{policy}: worst faults found",
        ("found by", "--fault", f"R [{percent(worst.robustness.confidence)}]", "runs"),
        rows,
        f"Worst fault of {robots} robots found: {text_of(worst.fault)}, R = "
        f"{fixed(worst.robustness.value, 3, [0.0])} on {fresh} seeds that the search has not met. "
        "`run` and `watch` play it with --fault.",
        f"{result.tried} of {result.searched} faults were tried. What is found bounds "
        "the worst from one side: it proves no other fault harmless.",
        *([capped] if result.is_capped else ()),
    )
