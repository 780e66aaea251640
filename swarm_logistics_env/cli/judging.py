"""`swarm-logistics judge`: trials of real robots, or a policy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from shlex import join
from typing import Annotated, NamedTuple

import typer
from typer import Argument, Exit, Option, echo

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.policies import SUFFIXES, PolicySpec
from swarm_logistics_env.policies.spec import SCRIPTED
from swarm_logistics_env.questions.presets import load_preset
from swarm_logistics_env.questions.specification import FIRST_LOOK
from swarm_logistics_env.report import benchmark
from swarm_logistics_env.report.document import document
from swarm_logistics_env.report.section import slug
from swarm_logistics_env.report.write import write_report
from swarm_logistics_env.runs.engines import Engine, Tally, engine_named
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.spi.estimate import LEAST_SEEDS
from swarm_logistics_env.spi.trials.readers.folder import TRIAL_SUFFIXES
from swarm_logistics_env.verdicts.results import StudyResults

from .judge_trials import judge_trials, numbers, pairs
from .policy_choice import EnvOption, FrameOption, NormalizeOption, TrustOption, policies_of
from .study_choice import ask_in_world, study_of, switch_to_clearing
from .study_commands import (
    ClearingOption,
    FirstSeedOption,
    FullOption,
    LimitOption,
    ProcessesOption,
    run_study,
    say_what_a_pilot_shows,
)
from .terminal import say, say_what_was_played, show, show_report
from .world_choice import (
    BodiesOption,
    PresetOption,
    Repeated,
    ScenarioOption,
    SetOption,
    changed_fields,
    options_of_world,
    scenario_of,
)

STUDY = "scorecard"
JUDGE_SEEDS = 60  # of a policy that is judged


def judge_command(
    context: typer.Context,
    policy_or_trials: Annotated[
        str,
        Argument(
            metavar="TRIALS|POLICY",
            help="File of trials, one trial or delivery a row (CSV, .xlsx, .parquet, JSON of "
            "POGEMA or marl-eval, a Monitor's CSV), or a folder of them; or a policy: name, path "
            "of a policy file, module:Class or my.py:Class.",
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
    first_seed: FirstSeedOption = None,
    until_clear: Annotated[
        bool,
        Option("--until-clear/--all-seeds", help="Stop each question where its verdict is clear."),
    ] = True,
    minutes: Annotated[
        float | None, Option(help="Play for so long; the same command goes on.")
    ] = None,
    clearing: ClearingOption = False,
    preset: PresetOption = None,
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    bodies: BodiesOption = None,
    as_benchmark: Annotated[
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
    values: Annotated[
        Repeated,
        Option(
            "--value",
            metavar="COLUMN:CELL=NEW",
            help="A cell read as another, e.g. fault:kein=none; may be repeated.",
        ),
    ] = None,
    references: Annotated[
        Repeated,
        Option(
            "--reference",
            metavar="NAME=NUMBER",
            help="Value of a parameter that A is relative to; may be repeated.",
        ),
    ] = None,
    sum_over: Annotated[
        str | None,
        Option(
            metavar="NAME", help="Column that tells a trial's robots apart: one row of their sum."
        ),
    ] = None,
    decimal: Annotated[
        str | None, Option(metavar=".|,", help="Sign before decimals; as the cells show.")
    ] = None,
    thousands: Annotated[
        str | None, Option(metavar=".|,", help="Sign between thousands; none if not given.")
    ] = None,
    check: Annotated[
        bool, Option("--check", help="Show how the trials are read, and judge nothing.")
    ] = False,
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
    frame: FrameOption = False,
    normalize: NormalizeOption = None,
    env: EnvOption = None,
) -> None:
    """Judge a policy until its verdicts are clear, or recorded trials.

    Trials are of real robots or of another simulator. Their columns are robots, fault, faulty and
    delivered (or performance); where they apply seed, policy, onset and any parameter; or time,
    with a delivery a row. Without seeds the study is unpaired.

    A policy is played in a warehouse in which delivered items come back, so that P has no cap: that
    in which a policy file was trained, or the paper's. Sizes and failures follow from it.
    """
    trials_options = {
        "--column": columns, "--ignore": ignore, "--duration": duration, "--value": values,
        "--reference": references, "--sum-over": sum_over, "--decimal": decimal,
        "--thousands": thousands, "--check": check, "--setup": setup,
    }  # fmt: skip
    policy_options = {
        "--seeds": seeds, "--first-seed": first_seed, "--minutes": minutes,
        "--clearing": clearing, "--preset": preset,
        "--scenario": scenario_file, "--set": changes, "--bodies": bodies,
        "--benchmark": as_benchmark,
        "--run-limit": run_limit, "--frame": frame, "--normalize": normalize,
        "--env": env,
    }  # fmt: skip
    if not names_policy(policy_or_trials):
        _refuse(policy_options, policy_or_trials, "a file of trials")
        judge_trials(
            policy_or_trials,
            out,
            {
                "columns": pairs("--column", columns),
                "ignore": ignore or (),
                "values": values or (),
                "reference": numbers("--reference", references),
                "sum_over": sum_over,
                "duration": duration,
                "decimal": decimal,
                "thousands": thousands,
            },
            setup=pairs("--setup", setup),
            only_check=check,
            full=full,
        )
        return
    _refuse(trials_options, policy_or_trials, "a policy")
    conditions = {
        "--seeds": seeds, "--first-seed": first_seed, "--clearing": clearing, "--preset": preset,
        "--scenario": scenario_file, "--set": changes, "--bodies": bodies,
    }  # fmt: skip
    if as_benchmark and (options := _options_in_use(conditions)):
        raise StudyError(f"{options[0]}: the benchmark has the same conditions for everybody")
    engine = engine_named("local" if processes == 1 else "process", processes, run_limit=run_limit)
    (policy,) = policies_of([policy_or_trials], trust_code, frame, normalize, env)
    world = None
    if not as_benchmark:
        usual = Scenario.model_validate(load_preset(STUDY).scenario)
        scenario = scenario_of(
            preset, scenario_file, changes, bodies, policies=[policy], usual=usual
        )
        if "restock" not in changed_fields(changes, bodies):
            scenario = scenario.replace(restock=True)
        options = options_of_world(preset, scenario_file, changes, bodies)
        world = JudgedWorld(scenario, clearing, options, first_seed)
    tally = judge_policy(
        policy,
        out,
        world=world,
        most_seeds=seeds or JUDGE_SEEDS,
        until_clear=until_clear,
        minutes=minutes,
        engine=engine,
        full=full,
        command=str(context.obj),
    )
    raise Exit(1 if tally.failed else 0)


def _refuse(options: Mapping[str, object], policy_or_trials: str, kind: str) -> None:
    """Raise a StudyError if an option is given that is not for what is judged."""
    for option in _options_in_use(options):
        raise StudyError(f"{option} is not for {kind}, and {policy_or_trials!r} is one")


def _options_in_use(options: Mapping[str, object]) -> list[str]:
    """Return the options that were typed: 0 is a value of an option, False is none."""
    return [name for name, value in options.items() if value or (value == 0 and value is not False)]


class JudgedWorld(NamedTuple):
    """Where a policy is judged.

    Attributes:
        scenario: the world, in which nothing fails yet.
        clearing: whether P is the rate at which its items are cleared.
        options: what was typed to choose the scenario, e.g. ["--preset", "realistic"].
        first_seed: the smallest seed; None: that of the study.
    """

    scenario: Scenario
    clearing: bool
    options: list[str]
    first_seed: int | None = None

    @property
    def words(self) -> list[str]:
        """What names the directory of its study."""
        words = [
            value if option == "--set" else f"{option[2:]} {value}"
            for option, value in zip(self.options[::2], self.options[1::2])
        ]
        if self.first_seed is not None:
            words.append(f"first-seed {self.first_seed}")
        return ["clearing"] * self.clearing + [slug(word)[:40] for word in words]


def judge_policy(
    policy: PolicySpec,
    out: Path | None,
    *,
    world: JudgedWorld | None,
    most_seeds: int,
    until_clear: bool,
    minutes: float | None,
    engine: Engine,
    full: bool,
    command: str,
) -> Tally:
    """Play a study of a policy, print the answer and write the report.

    Args:
        policy: as it was typed, and whether its code is trusted.
        out: directory of the study; None: results/judged/NAME or results/benchmark/NAME.
        world: where it is judged; None: in the worlds of the benchmark.
        command: the command line, which goes on where it was stopped.
    """
    for training in policy.trainings or (policy,):
        training.load()  # what is wrong with it is said before anything is written
    if world is None:
        directory = out or Path("results", "benchmark", slug(policy.title))
        study = study_of(benchmark.STUDY, directory, None, [policy], policy.trusted)
    else:
        parts = [slug(policy.title), *world.words]
        directory = out or Path("results", "judged", "-".join(parts))
        looks = until_clear and most_seeds > FIRST_LOOK
        study = study_of(
            STUDY,
            directory,
            most_seeds,
            [policy],
            policy.trusted,
            until_clear=looks,
            first_seed=world.first_seed,
        )
        ask_in_world(study, world.scenario)
        if world.clearing:
            switch_to_clearing(study)
    say(f"{study.plan()}, kept in {directory}")
    echo()
    say_what_a_pilot_shows(study)
    tally = run_study(study, engine, minutes=minutes)
    results = study.findings()
    if world is None and not (tally.left or tally.failed):
        _show_benchmark(results, directory)
    else:
        show_report(results, directory, full=full, is_finished=not tally.left)
    is_open = any(verdict.on_property.adjusted == "open" for verdict in results.verdicts)
    if tally.left and not tally.gave_up:
        reason = f"Stopped after {minutes:g} min, {tally.left} runs are left"
        say(f"{reason}; the same command goes on:", command)
    # Several trainings and untrusted code need options that the suggested command does not have.
    elif world and is_open and not (tally.left or policy.trainings or policy.trusted):
        options = [policy.name, *["--clearing"] * world.clearing, *world.options]
        options += ["--first-seed", str(study.plan().seeds[-1] + 1)]
        _suggest_more_seeds(options, directory, max(JUDGE_SEEDS, 2 * most_seeds))
    say_what_was_played(tally)
    return tally


def _suggest_more_seeds(options: Sequence[str], directory: Path, seeds: int) -> None:
    options = [*options, "--seeds", str(seeds), "--out", f"{directory}-{seeds}"]
    command = f"swarm-logistics judge {join(options)}"
    say("What is open needs more seeds, which nobody has looked at:", command)


def names_policy(policy_or_trials: str) -> bool:
    """Return whether the argument of `judge` is a policy, not a file of trials."""
    suffix = Path(policy_or_trials).suffix
    if suffix in (*SUFFIXES, ".py"):
        return True
    path = Path(policy_or_trials)
    if path.is_file() or suffix.lower() in TRIAL_SUFFIXES:
        return False
    if path.is_dir() and policy_or_trials not in SCRIPTED:
        return False
    return ":" in policy_or_trials or not suffix


def _show_benchmark(results: StudyResults, out: Path) -> None:
    """Print the table of a policy in the benchmark and its place, and write the report."""
    entries = benchmark.Entries.read()
    show(benchmark.table(results, entries.references))
    score = benchmark.score(results, entries.references)
    show(benchmark.leaderboard({**entries.scores, results.policies[0]: score}))
    echo(f"Report: {write_report(results, out, document(results))[0]}")
