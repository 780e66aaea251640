"""`swarm-logistics judge POLICY`: a policy, played until its verdicts are clear."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import join
from typing import Annotated, NamedTuple

import typer
from typer import Argument, Exit, Option, echo

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.spi.estimate import LEAST_SEEDS
from swarm_logistics_env.study.questions.benchmark_cells import benchmark_study, entry_digest
from swarm_logistics_env.study.questions.presets import load_preset
from swarm_logistics_env.study.questions.specification import FIRST_LOOK
from swarm_logistics_env.study.report import benchmark
from swarm_logistics_env.study.report.more_seeds import more_seeds
from swarm_logistics_env.study.report.section import slug
from swarm_logistics_env.study.report.write import section_markdown, write_text
from swarm_logistics_env.study.runs.engines import engine_named
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.world.scenario import Scenario

from .output import DONE, FAILED
from .policy_choice import EnvOption, FrameOption, NormalizeOption, TrustOption, policies_of
from .study_choice import ask_in_world, study_of, switch_to_clearing
from .study_commands import (
    ClearingOption,
    FirstSeedOption,
    FullOption,
    JudgedOption,
    LimitOption,
    PerformanceOption,
    ProcessesOption,
    run_study,
    say_what_a_pilot_shows,
)
from .terminal import program, say, say_what_was_played, show, show_report
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
# The parameters of the command that the benchmark gives itself.
FIXED_BY_BENCHMARK = (
    "seeds", "first_seed", "clearing", "performance", "preset", "scenario_file", "changes", "bodies"
)  # fmt: skip

PoliciesArgument = Annotated[
    list[str],
    Argument(
        metavar="POLICIES",
        help="Name (`list policies`), path of a policy file, module:Class, my.py:Class or c:my.c. "
        "Each other one is compared with the first.",
    ),
]
MostSeedsOption = Annotated[
    int | None,
    # Fewer runs are alike by chance.
    Option(min=LEAST_SEEDS, help=f"Seeds of a policy at most; {JUDGE_SEEDS} if not given."),
]


def judge_policy_command(
    context: typer.Context,
    policies: PoliciesArgument,
    out: JudgedOption = None,
    seeds: MostSeedsOption = None,
    first_seed: FirstSeedOption = None,
    until_clear: Annotated[
        bool,
        Option("--until-clear/--all-seeds", help="Stop each question where its verdict is clear."),
    ] = True,
    minutes: Annotated[
        float | None, Option(min=0.0, help="Play for so long; the same command goes on.")
    ] = None,
    clearing: ClearingOption = False,
    performance: PerformanceOption = None,
    preset: PresetOption = None,
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    bodies: BodiesOption = None,
    as_benchmark: Annotated[
        bool,
        Option(
            "--benchmark",
            help="Play the benchmark of robustness, in worlds that are drawn from the policy's "
            "digest, so that it cannot have met them.",
        ),
    ] = False,
    processes: ProcessesOption = None,
    run_limit: LimitOption = None,
    full: FullOption = False,
    trust_code: TrustOption = False,
    frame: FrameOption = False,
    normalize: NormalizeOption = None,
    env: EnvOption = None,
) -> None:
    """Judge a policy until its verdicts are clear, or compare several.

    It is played in a warehouse in which delivered items come back, so that P has no cap: that in
    which a policy file was trained, or the paper's. Sizes and failures follow from it.
    """
    if as_benchmark:
        _refuse_conditions(context)
    engine = engine_named("local" if processes == 1 else "process", processes, run_limit=run_limit)
    specs = policies_of(policies, trust_code, frame, normalize, env)
    most_seeds = seeds or JUDGE_SEEDS
    world = None
    if not as_benchmark:
        scenario = _scenario_without_cap(preset, scenario_file, changes, bodies, specs)
        options = options_of_world(preset, scenario_file, changes, bodies)
        world = JudgedWorld(scenario, clearing, options, first_seed, performance)
    for spec in specs:
        for training in spec.trainings or (spec,):
            training.load()  # what is wrong with it is said before anything is written
    if world is None:
        study = _benchmark_of(specs, out)
    else:
        study = _study_in(world, out, specs, most_seeds, until_clear=until_clear)
    directory = study.out
    assert directory is not None
    say(f"{study.plan()}, kept in {directory}")
    echo()
    say_what_a_pilot_shows(study)
    tally = run_study(study, engine, minutes=minutes)
    results = study.findings()
    if world is None and not (tally.left or tally.failed):
        _show_benchmark(results, entry_digest(specs[0]), directory)
    else:
        show_report(results, directory, full=full)
    is_open = any(verdict.conclusion == "open" for verdict in results.verdicts)
    if tally.left and not tally.gave_up:
        reason = f"Stopped after {minutes:g} min, {tally.left} runs are left"
        say(f"{reason}; the same command goes on:", str(context.obj))
    # Several trainings and untrusted code need options that the suggested command does not have.
    elif world and is_open and not tally.left and not any(map(_needs_options, specs)):
        names = [spec.name for spec in specs]
        unseen = str(study.plan().seeds[-1] + 1)
        words = [*names, *world.options_again, "--first-seed", unseen]
        _suggest_more_seeds(words, directory, results)
    say_what_was_played(tally)
    raise Exit(FAILED if tally.failed else DONE)


def _benchmark_of(policies: Sequence[PolicySpec], out: Path | None) -> Study:
    """Return the benchmark's study of a policy, kept in a directory."""
    if len(policies) > 1:
        raise StudyError(f"--benchmark: should be of one policy, not of {len(policies)}")
    (policy,) = policies
    name = f"{slug(policy.title)}-{entry_digest(policy)[:8]}"
    return Study(out=out or Path("results", "benchmark", name), **dict(benchmark_study(policy)))


def _needs_options(policy: PolicySpec) -> bool:
    return bool(policy.trainings) or policy.trusted


def _refuse_conditions(context: typer.Context) -> None:
    """Raise a StudyError if an option was typed that the benchmark does not take."""
    for option in context.command.params:
        source = context.get_parameter_source(option.name)
        is_typed = source is not None and source.name == "COMMANDLINE"
        if option.name in FIXED_BY_BENCHMARK and is_typed:
            raise StudyError(
                f"{option.opts[0]}: the benchmark has the same conditions for everybody"
            )


def _scenario_without_cap(
    preset: str | None,
    scenario_file: Path | None,
    changes: Repeated,
    bodies: str | None,
    policies: Sequence[PolicySpec],
) -> Scenario:
    """Return the scenario that the options name, in which items come back if not said otherwise."""
    usual = Scenario.model_validate(load_preset(STUDY).scenario)
    scenario = scenario_of(preset, scenario_file, changes, bodies, policies=policies, usual=usual)
    if "restock" in changed_fields(changes, bodies):
        return scenario
    return scenario.replace(restock=True)


class JudgedWorld(NamedTuple):
    """Where a policy is judged.

    Attributes:
        scenario: the world, in which nothing fails yet.
        clearing: whether P is the rate at which its items are cleared.
        options: what was typed to choose the scenario, e.g. ["--preset", "realistic"].
        first_seed: the smallest seed; None: that of the study.
        performance: what P of a run is; None: what the task counts.
    """

    scenario: Scenario
    clearing: bool
    options: list[str]
    first_seed: int | None = None
    performance: str | None = None

    @property
    def words(self) -> list[str]:
        """What names the directory of its study."""
        words = [
            value if option == "--set" else f"{option[2:]} {value}"
            for option, value in zip(self.options[::2], self.options[1::2])
        ]
        if self.first_seed is not None:
            words.append(f"first-seed {self.first_seed}")
        if self.performance:
            words.insert(0, self.performance)
        if self.clearing:
            words.insert(0, "clearing")
        return [slug(word)[:40] for word in words]

    @property
    def options_again(self) -> list[str]:
        """The options that judge in the same world at other seeds."""
        options = ["--clearing", *self.options] if self.clearing else self.options
        return ["--performance", self.performance, *options] if self.performance else options


def _study_in(
    world: JudgedWorld,
    out: Path | None,
    policies: Sequence[PolicySpec],
    most_seeds: int,
    *,
    until_clear: bool,
) -> Study:
    """Return the study of policies in a world, kept in a directory."""
    titles = "-and-".join(slug(policy.title) for policy in policies)
    study = study_of(
        STUDY,
        out or Path("results", "judged", "-".join([titles, *world.words])),
        most_seeds,
        policies,
        policies[0].trusted,
        until_clear=until_clear and most_seeds > FIRST_LOOK,
        first_seed=world.first_seed,
        performance=world.performance,
        compares_policies=len(policies) > 1,
    )
    ask_in_world(study, world.scenario)
    if world.clearing:
        switch_to_clearing(study)
    return study


def _suggest_more_seeds(options: Sequence[str], directory: Path, results: StudyResults) -> None:
    """Say which command plays what open questions need, if that is in reach."""
    needs = more_seeds(results)
    if needs.n_seeds is None:
        return
    n_seeds = str(needs.n_seeds)
    options = [*options, "--seeds", n_seeds, "--out", f"{directory}-{n_seeds}"]
    command = f"{program()} judge {join(options)}"
    say("More seeds, which nobody has looked at:", command)


def _show_benchmark(results: StudyResults, digest: str, out: Path) -> None:
    """Print and write the table of a policy in the benchmark, and its place among the entries."""
    entry = benchmark.Entry.of(results, digest)
    entries = {**benchmark.read_entries(), results.policies[0]: entry}
    sections = benchmark.table(results, entry), benchmark.leaderboard(entries)
    for section in sections:
        show(section)
    report = out / "benchmark.md"
    write_text(report, "\n".join(map(section_markdown, sections)))
    echo(f"Report: {report}")
