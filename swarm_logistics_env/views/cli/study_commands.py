"""`swarm-logistics study ...`."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import typer
from typer import Argument, Exit, Option, echo

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.core.records import plain
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.report.drawing import PAGE_STYLE, SERIF, FigureStyle
from swarm_logistics_env.study.report.section import NOTHING, bracketed, percent, slug
from swarm_logistics_env.study.runs.engines import Engine, Shard, Tally, engine_named
from swarm_logistics_env.study.runs.notes import merge
from swarm_logistics_env.study.runs.store import Runs, export
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.task import Run
from swarm_logistics_env.study.tasks.task_world import is_capped
from swarm_logistics_env.study.verdicts.gate import SUBJECTS, Gate, GateAnswer, answers, match
from swarm_logistics_env.study.verdicts.until_clear import MOST_SEEDS_UNTIL_CLEAR
from swarm_logistics_env.study.verdicts.verdict import why_untestable

from .output import DONE, FAILED, STOPPED
from .policy_choice import EnvOption, FrameOption, NormalizeOption, TrustOption, policies_of
from .study_choice import change_scenario, changes_in_words, study_of, switch_to_clearing
from .terminal import (
    AnswerSoFar,
    program,
    say,
    say_what_was_played,
    show_power,
    show_report,
    show_table,
)
from .world_choice import BodiesOption, Repeated, SetOption, changed_fields

StudyArgument = Annotated[
    str,
    Argument(
        metavar="FILE|PRESET",
        # Literal, as to import the presets would slow every command.
        help="TOML file of a study, or a preset: day, orders, paper-fit, paper, quick, resilience, "
        "scorecard.",
    ),
]
DirectoryArgument = Annotated[Path, Argument(help="Directory of a study.")]
SeedsOption = Annotated[
    int | None, Option(min=1, help="Number of seeds of every condition; the study's if not given.")
]
SeedsOrMostOption = Annotated[
    int | None,
    Option(
        "--seeds",
        "--most",
        min=1,
        help="Number of seeds of every condition; with --until-clear the most (200).",
    ),
]
FirstSeedOption = Annotated[
    int | None, Option(min=0, help="Smallest seed, the others follow it; the study's if not given.")
]
PolicyOption = Annotated[
    Repeated, Option("--policy", help="Policy to judge (`list policies`); may be repeated.")
]
ProcessesOption = Annotated[
    int | None, Option(min=1, help="Worker processes; all cores if not given.")
]
LimitOption = Annotated[
    float | None,
    Option(
        metavar="SECONDS",
        help="Time after which a run has failed; an hour if not given. It needs --processes 2 "
        "or more.",
    ),
]
JudgedOption = Annotated[
    Path | None,
    Option(
        "--out", help="Directory of the study and its report; results/judged/NAME if not given."
    ),
]
FullOption = Annotated[bool, Option("--full", help="Print every table, not the answer alone.")]
ClearingOption = Annotated[
    bool,
    Option(
        "--clearing", help="P is the rate until all items are delivered, so that it has no cap."
    ),
]
PerformanceOption = Annotated[
    str | None,
    Option(
        help="Measure that is P, e.g. on_time; where less is better with the value that counts as "
        "P = 0, e.g. p95_tardiness:60 or longest_standstill:120."
    ),
]

study_app = typer.Typer(name="study", help="Judge a swarm by its indicators.")


@study_app.command("run")
def run_command(
    study_name: StudyArgument,
    out: Annotated[
        Path | None, Option(help="Directory of its store and report; results/NAME if not given.")
    ] = None,
    policies: PolicyOption = None,
    seeds: SeedsOrMostOption = None,
    until_clear: Annotated[
        bool,
        Option(
            "--until-clear",
            help="Look at 10, 20, .. seeds, and play on only what is not decided yet.",
        ),
    ] = False,
    first_seed: FirstSeedOption = None,
    restock: Annotated[
        bool, Option("--restock", help="Delivered items come back, so that P has no cap.")
    ] = False,
    clearing: ClearingOption = False,
    performance: PerformanceOption = None,
    changes: SetOption = None,
    bodies: BodiesOption = None,
    processes: ProcessesOption = None,
    engine: Annotated[
        str | None, Option(help="local (this process), process, or ray; process if not given.")
    ] = None,
    address: Annotated[
        str | None, Option(help="Of a Ray cluster, e.g. auto; one is started here if not given.")
    ] = None,
    shard: Annotated[
        str | None, Option(metavar="I/N", help="Play part I of N alone, kept in OUT/shard-I-of-N.")
    ] = None,
    run_limit: LimitOption = None,
    full: FullOption = False,
    trust_code: TrustOption = False,
    frame: FrameOption = False,
    normalize: NormalizeOption = None,
    env: EnvOption = None,
) -> None:
    """Play what is missing, print the answer, write the report."""
    part = Shard.parse(shard) if shard else None
    if until_clear and seeds is None:
        seeds = MOST_SEEDS_UNTIL_CLEAR
    fields = changed_fields(changes, bodies)
    policy_specs = policies_of(policies or (), trust_code, frame, normalize, env)
    study = study_of(
        study_name, out, seeds, policy_specs, trust_code,
        first_seed=first_seed, until_clear=until_clear or None, performance=performance,
    )  # fmt: skip
    if clearing:
        switch_to_clearing(study)
    if restock:
        study.specification = study.specification.varying({"restock": True})
    change_scenario(study, fields)
    options = {"clearing": clearing, "restock": restock, slug(performance or ""): performance}
    words = [*(name for name, is_typed in options.items() if is_typed), *changes_in_words(fields)]
    out = out or _default_directory(study, words, has_own_policies=bool(policies))
    study.out = out / part.directory if part else out
    player = engine_named(engine or _engine_for(processes, address), processes, address, run_limit)
    say(str(study.plan()))
    echo()
    if study.is_exploratory():
        say(
            "This study declared other seeds or another P before its first run: every verdict is "
            "exploratory. For verdicts that stand, run a new study on fresh seeds: --first-seed "
            "and --out.\n"
        )
    if policies:
        say_what_a_pilot_shows(study)
    tally = run_study(study, player, part)
    if part is None:
        show_report(study.findings(), study.out, full=full)
    else:
        say(
            f"When all {part.count} shards are done:",
            f"{program()} study merge {out}/shard-*-of-{part.count} --out {out}",
        )
    # The last line: where it is looked for after a report of many pages.
    say_what_was_played(tally)
    raise Exit(FAILED if tally.failed else DONE)


def _engine_for(processes: int | None, address: str | None) -> str:
    """Return the engine that a command line means which names none."""
    if address:
        return "ray"
    return "local" if processes == 1 else "process"


def _default_directory(study: Study, words: Sequence[str], *, has_own_policies: bool) -> Path:
    """Return results/NAME; what the options change in a preset gets a directory of its own."""
    parts = [study.specification.name, *words]
    if has_own_policies:
        titles = "-".join(policy.title for policy in study.specification.policies)
        parts.append(slug(titles)[:40])
    return Path("results", "-".join(parts))


def say_what_a_pilot_shows(study: Study) -> None:
    """Say which policies deliver everything or nothing in the base scenario at the first seed."""
    plan = study.plan()
    sound_cases = [case for case in plan.cases if not case.faults]
    base_cases = [case for case in sound_cases if case.scenario == plan.specification.scenario]
    case_by_title = {case.policy.title: case for case in reversed(base_cases or sound_cases)}
    if not any(getattr(case.scenario, "n_items", None) for case in case_by_title.values()):
        return
    for title, case in case_by_title.items():
        outcomes = [Run(training, plan.code, plan.seeds[0]).play() for training in case.trainings]
        has_cap = any(is_capped(case, outcome) for outcome in outcomes)
        if has_cap and case.performance:
            say(f"{title} has the largest P possible in a first run: most verdicts will be open.")
        elif has_cap:
            say(
                f"{title} delivers every item before the end, so that P is capped and most "
                "verdicts will be open. Nothing is capped where items come back, or where P is the "
                "rate until all are delivered: add --restock or --clearing"
            )
        elif errors := [outcome.error for outcome in outcomes if outcome.error]:
            reason = plain(errors[0].strip().splitlines()[-1])
            if "of shape" in reason:  # every run will fail so
                raise StudyError(f"{title} fails in a first run: {reason.partition(': ')[2]}")
            say(f"{title} fails in a first run: {reason}. Ctrl-C stops; finished runs are kept.")
        elif not any(outcome.delivered for outcome in outcomes):
            say(f"{title} delivers nothing in a first run. Ctrl-C stops; finished runs are kept.")


@study_app.command("plan")
def plan_command(
    study_name: Annotated[
        str,
        Argument(metavar="FILE|PRESET|DIR", help="A study; or the directory of one that was run."),
    ],
    policies: PolicyOption = None,
    seeds: SeedsOption = None,
    first_seed: FirstSeedOption = None,
    effect: Annotated[
        float | None,
        Option(help="Of a study that was run: assumed indicator; the paper's if not given."),
    ] = None,
    trust_code: TrustOption = False,
) -> None:
    """Print the conditions and count the runs. Of a study that was run: the seeds it needs."""
    if Path(study_name).is_dir():
        if policies:
            raise StudyError("--policy: a study that was run has its own policies")
        results = Study.stored(study_name, trust_code=trust_code).findings()
        show_power(study_name, results, effect)
        return
    policy_specs = policies_of(policies or (), trust_code)
    plan = study_of(study_name, None, seeds, policy_specs, trust_code, first_seed=first_seed).plan()
    uses: dict[str, list[str]] = {}
    for _, table, arm in plan.cells:
        for case in arm.case.trainings:  # as the plan counts them
            uses.setdefault(case.key, []).append(f"{table} ({arm.setting})")
    rows = (
        (case.policy.title, str(case.scenario.n_robots), "; ".join(uses[case.key]))
        for case in plan.cases
    )
    show_table("Conditions", ("policy", "N", "stands in"), rows)
    echo(plan)


@study_app.command("report")
def report_command(
    directory: DirectoryArgument,
    full: FullOption = False,
    figure_width: Annotated[
        float,
        Option(metavar="INCH", min=2, max=20, help="Of the files of figures; 3.5: of a column."),
    ] = PAGE_STYLE.width,
    font: Annotated[Literal["sans", "serif"], Option(help="Of these files.")] = "sans",
    trust_code: TrustOption = False,
) -> None:
    """Print the answer and write the report again. Nothing is played."""
    stored = Study.stored(directory, trust_code=trust_code)
    say(str(stored.plan()))
    echo()
    style = FigureStyle(figure_width, SERIF if font == "serif" else PAGE_STYLE.fonts)
    show_report(stored.findings(), directory, full=full, style=style)


@study_app.command("compare")
def compare_command(
    old: Annotated[Path, Argument(metavar="OLD", help="Directory of the study to compare with.")],
    new: Annotated[Path, Argument(metavar="NEW", help="Directory of the study that is judged.")],
    fail_if: Annotated[
        Repeated,
        Option(
            metavar="GATE",
            help=f"[possibly] {SUBJECTS} <|> NUMBER [at TEXT]; may be "
            "repeated. change is "
            "(P_new - P_old) / P_old; the others are NEW's. Plain: fails where it is so beyond "
            "chance; possibly: where that is not ruled out.",
        ),
    ] = None,
    trust_code: TrustOption = False,
) -> None:
    """Compare two studies by condition; end with 1 if a gate fails."""
    gates = [Gate.parse(text) for text in fail_if or []]
    before, after = (
        Study.stored(directory, trust_code=trust_code).findings() for directory in (old, new)
    )
    left_out = match(before, after).notes
    failed = False
    # Without a gate the change is shown, and nothing fails.
    for gate in gates or [Gate.parse("change < 0")]:
        gate_answers = answers(gate, before, after)
        fails = bool(gates) and any(answer.fails for answer in gate_answers)
        failed |= fails
        result = "fails" if fails else "passes"
        title = f"Gate {result} (fails if {gate.text})" if gates else "Change of P"
        _show_answers(title, gate_answers, left_out if gate.subject == "change" else ())
    raise Exit(FAILED if failed else DONE)


def _show_answers(
    title: str, gate_answers: tuple[GateAnswer, ...], left_out: tuple[str, ...]
) -> None:
    rows = []
    levels = {CONFIDENCE}
    for answer in gate_answers:
        estimate = answer.estimate
        value = NOTHING
        verdict = answer.problem or ""
        if answer.exact is not None:
            value = f"{answer.exact:.3f}"
            verdict = "exact: the runs of both studies are the same"
        if estimate is not None:
            value = bracketed(estimate, 3)
            levels = {estimate.confidence}
            verdict = f"above {estimate.threshold:g}: {answer.verdict}"
            if estimate.untestable:
                verdict = f"untestable: {why_untestable(estimate)}"
        rows.append((answer.name, value, verdict))
    columns = ("", f"value [{percent(*levels)}]", "verdict under Holm")
    show_table(title, columns, rows, *left_out)


@study_app.command("merge")
def merge_command(
    directories: Annotated[list[Path], Argument(help="Directories of shards of a study.")],
    out: Annotated[Path, Option(help="Directory of the merged study.")],
) -> None:
    """Make one store of those that shards or machines have filled."""
    echo(f"{merge(directories, out)} runs in {out}")
    for directory in directories:
        with Runs.existing(directory) as runs:
            if damage := runs.damage():
                echo(plain(damage), err=True)
    echo(f"Its report: swarm-logistics study report {shlex.quote(str(out))}")


@study_app.command("export")
def export_command(
    directory: DirectoryArgument, to: Annotated[Path, Option(help="File to write, .csv.")]
) -> None:
    """Write every stored run as one row, sorted by key. Wall times are left out.

    Ends with 1 if a run is damaged: it is left out, and told.
    """
    with Runs.existing(directory) as runs:
        count, digest = export(runs, to)
        damage = runs.damage()
    echo(f"{count} runs in {to}, SHA-256 {digest}")
    if damage:
        echo(plain(damage), err=True)
        raise Exit(FAILED)


def run_study(
    study: Study, engine: Engine, shard: Shard | None = None, minutes: float | None = None
) -> Tally:
    """Run a study and show the answer so far; Ctrl-C ends the command, and it says how to go on."""
    after_look = None
    if study.specification.until_clear:
        after_look = AnswerSoFar(study.finished()[0]).show
    try:
        return study.run(engine, shard=shard, minutes=minutes, after_look=after_look)
    except KeyboardInterrupt:
        n_finished, n_runs = study.finished(shard)
        missing = f"the other {n_runs - n_finished}"
        if study.specification.until_clear:
            missing += ", and with what later looks need"
        echo(
            f"\nStopped. {n_finished} of {n_runs} runs are finished and kept in {study.out}; the "
            f"same command goes on with {missing}.",
            err=True,
        )
        raise Exit(STOPPED) from None
