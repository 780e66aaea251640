"""`swarm-logistics judge`, `study power` and `study compare`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.definitions import DEFINITIONS

from .application import TrustPolicyOption
from .study_commands import (
    FullOption,
    PolicyOption,
    ProcessesOption,
    TrustCodeOption,
    show_report,
    study,
    study_of,
)

if TYPE_CHECKING:
    from swarm_logistics_env.studies.gate import Answer
    from swarm_logistics_env.studies.results import StudyResults


SYMBOLS = tuple(DEFINITIONS)
AtOption = Annotated[
    str, typer.Option(metavar="TEXT", help="Only comparisons whose name holds this.")
]


def judge_command(
    asked: Annotated[
        str,
        typer.Argument(
            metavar="TRIALS.csv|POLICY",
            help="CSV file, one trial or delivery a row; or a policy: name, path of a policy file, "
            "or package.module:Class.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Directory to keep the study, report and tables.tex in; of a policy "
            "results/scorecards/NAME if not given."
        ),
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option(
            "--column",
            metavar="WHAT=NAME",
            help="What a column of another name is, e.g. performance=boxes; may be repeated.",
        ),
    ] = None,
    ignore: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Column to leave out; may be repeated."),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(help="Length of every trial in seconds, where no column says it."),
    ] = None,
    decimal: Annotated[
        str | None, typer.Option(metavar=".|,", help="Sign before decimals; . if not given.")
    ] = None,
    setup: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE|FILE",
            help="A condition for the report to state, or a TOML file of some; may be repeated.",
        ),
    ] = None,
    processes: ProcessesOption = None,
    full: FullOption = False,
    trust_code: TrustPolicyOption = False,
) -> None:
    """Judge trials of real robots or of another simulator; or a policy, by a score card.

    Columns: robots, fault, faulty, delivered (or performance), and where they apply seed, policy,
    onset, and any parameter; or time, one delivery a row. Without seeds the study is unpaired.
    A policy is played in the fixed study `scorecard`, in a minute or a few.
    """
    from tempfile import TemporaryDirectory

    from swarm_logistics_env.report.document import document
    from swarm_logistics_env.report.report_files import latex_tables, write_text
    from swarm_logistics_env.studies import Study
    from swarm_logistics_env.studies.importing import import_results

    if names_policy(asked):
        of_trials = {
            "--column": columns, "--ignore": ignore, "--duration": duration,
            "--decimal": decimal, "--setup": setup,
        }  # fmt: skip
        for option, given in of_trials.items():
            if given:
                raise StudyError(f"{option} is for a file of trials, and {asked!r} is a policy")
        raise typer.Exit(1 if judge_policy(asked, out, processes, trust_code, full=full) else 0)
    with TemporaryDirectory() as elsewhere:
        directory = out or Path(elsewhere) / "study"
        count = import_results(
            Path(asked),
            directory,
            columns=dict(_pair("--column", text) for text in columns or []),
            ignore=ignore or (),
            duration=duration,
            decimal=decimal or ".",
            setup=_stated(setup or []),
        )
        typer.echo(f"{count} runs in {asked}\n")
        results = Study.stored(directory).findings()
        whole = document(results)
        show_report(results, whole, out, full=full)
    if out is not None:
        write_text(out / "tables.tex", latex_tables(whole.summary))
        typer.echo(f"Written: {out / 'tables.tex'}")


def _stated(texts: list[str]) -> dict[str, str]:
    """Return the conditions that --setup states."""
    from swarm_logistics_env.records import read_table

    stated: dict[str, str] = {}
    for text in texts:
        if "=" in text:
            stated.update([_pair("--setup", text)])
        elif Path(text).is_file():
            found = read_table(Path(text), "file of --setup", StudyError)
            stated.update((name, str(value)) for name, value in found.items())
        else:
            raise StudyError(f"--setup {text}: should be NAME=VALUE, or a TOML file of such")
    return stated


def _pair(option: str, text: str) -> tuple[str, str]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise StudyError(f"{option} {text}: should be NAME=VALUE")
    return name, value


@study.command("power")
def power_command(
    asked: Annotated[
        str,
        typer.Argument(
            metavar="DIR|FILE|PRESET",
            help="Study that was run; or one to play a pilot of, which is not kept.",
        ),
    ],
    effect: Annotated[
        float | None,
        typer.Option(help="Assumed true value of the indicator; the paper's if not given."),
    ] = None,
    power: Annotated[float, typer.Option(help="Wanted probability of a verdict.")] = 0.8,
    indicator: Annotated[
        str | None, typer.Option(help=f"Only {', '.join(SYMBOLS[:-1])} or {SYMBOLS[-1]}.")
    ] = None,
    at: AtOption = "",
    pilot_seeds: Annotated[int, typer.Option(min=2, help="Seeds of the pilot.")] = 5,
    policies: PolicyOption = None,
    processes: ProcessesOption = None,
    trust_code: TrustCodeOption = False,
) -> None:
    """Print how many seeds each verdict needs, from a pilot or a study that was run."""
    from swarm_logistics_env.report.wording import number
    from swarm_logistics_env.studies.results import demands

    from .terminal_tables import show_table

    results = _pilot(asked, pilot_seeds, policies, processes, trust_code)
    rows = []
    for demand in demands(results, effect, power):
        comparison = demand.test.compared
        name = f"{comparison.indicator} > {comparison.threshold:.3g}, {comparison.label}"
        if indicator not in (None, comparison.indicator) or at not in name:
            continue
        rows.append(
            (
                comparison.policy,
                name,
                number(demand.effect),
                demand.problem or str(demand.seeds),
                "–" if demand.least_power is None else f"{demand.least_power:.0%}",
                number(demand.detectable),
                number(demand.unchanged, 0),
            )
        )
    if not rows:
        asked_for = [] if indicator is None else [f"--indicator {indicator}"]
        asked_for += [f"--at {at!r}"] if at else []
        made = results.indicators["indicator"].unique()
        raise StudyError(
            f"{' '.join(asked_for) or asked}: the study makes no such comparison; "
            f"it asks about {', '.join(made) or 'nothing'}"
        )
    n_seeds = len(results.plan.seeds)
    columns = (
        "policy", "verdict on", "assumed effect", f"seeds for {power:.0%} power on average",
        "power in nine pilots of ten at least",
        f"distance that {n_seeds} seeds find",
        f"seeds for equivalent at {results.plan.specification.margin:.0%}",
    )  # fmt: skip
    show_table(f"Seeds needed, from {n_seeds} seeds", columns, rows)


@study.command("compare")
def compare_command(
    old: Annotated[
        Path, typer.Argument(metavar="OLD", help="Directory of the study to compare with.")
    ],
    new: Annotated[
        Path, typer.Argument(metavar="NEW", help="Directory of the study that is judged.")
    ],
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            metavar="GATE",
            help=f"[possibly] {'|'.join(SYMBOLS)} <|> NUMBER [at TEXT]; may be "
            "repeated. change is "
            "(P_new - P_old) / P_old; the others are NEW's. Plain: fails where it is so beyond "
            "chance; possibly: where that is not ruled out.",
        ),
    ] = None,
    trust_code: TrustCodeOption = False,
) -> None:
    """Compare two studies, condition by condition; end with 1 if a gate fails."""
    from swarm_logistics_env.studies import Study
    from swarm_logistics_env.studies.gate import Gate, answers, match

    gates = [Gate.parse(text) for text in fail_if or []]
    before, after = (
        Study.stored(directory, trust_code=trust_code).findings() for directory in (old, new)
    )
    left_out = match(before, after).notes
    failed = False
    # Without a gate the change is shown, and nothing fails.
    for gate in gates or [Gate.parse("change < 0")]:
        said = answers(gate, before, after)
        fails = bool(gates) and any(answer.fails for answer in said)
        failed |= fails
        result = "fails" if fails else "passes"
        title = f"Gate {gate.text!r} {result}" if gates else "Change of P"
        notes = left_out if gate.subject == "change" else ()
        _show_answers(title, said, notes, after.confidence)
    raise typer.Exit(1 if failed else 0)


def _pilot(
    asked: str,
    seeds: int,
    policies: list[str] | None,
    processes: int | None,
    trust_code: bool,
) -> StudyResults:
    import os

    from swarm_logistics_env.studies import Study

    if Path(asked).is_dir():
        if policies:
            raise StudyError("--policy is for a pilot: a study that was run has its own policies")
        return Study.stored(asked, trust_code=trust_code).findings()
    pilot = study_of(asked, None, seeds, policies, trust_code, until_clear=False)
    pilot.run(processes=processes or os.cpu_count() or 1)
    return pilot.findings()


def _show_answers(
    title: str, said: tuple[Answer, ...], left_out: tuple[str, ...], confidence: float
) -> None:
    from swarm_logistics_env.report.wording import bracketed, percent

    from .terminal_tables import show_table

    rows = []
    for answer in said:
        estimate = answer.estimate
        value, says = "–", answer.problem or ""
        if answer.exact is not None:
            value, says = f"{answer.exact:.3f}", "exact: the runs of both studies are the same"
        if estimate is not None:
            value = bracketed(estimate, 3)
            says = f"above {estimate.threshold:g}: {answer.verdict}"
        rows.append((answer.name, value, says))
    columns = ("", f"value [{percent(confidence)}]", "verdict under Holm")
    show_table(title, columns, rows, *left_out)


def names_policy(asked: str) -> bool:
    """Return whether the argument of `judge` is a policy, not a file of trials."""
    from swarm_logistics_env.policies import SUFFIXES

    suffix = Path(asked).suffix
    if suffix in (*SUFFIXES, ".py"):
        return True
    if Path(asked).is_file() or suffix.lower() in (".csv", ".tsv", ".txt"):
        return False
    return ":" in asked or not suffix


def judge_policy(
    asked: str, out: Path | None, processes: int | None, trust_code: bool, *, full: bool
) -> int:
    """Play the study `scorecard` with a policy; print its score card and write the report.

    Every run is kept at once, so that the same command goes on after an interruption.

    Args:
        asked: the policy, for `policies.load`.
        out: directory; None: results/scorecards/ and the policy's name.
        processes: number of worker processes; None: all cores.
        trust_code: whether to read a model of stable-baselines3, which executes code in it.
        full: whether to print the report of the study as well.

    Returns:
        The number of runs that failed.

    Raises:
        PolicyError, StudyError: the policy cannot be loaded, or the store cannot be used.
    """
    from swarm_logistics_env.policies import called, load
    from swarm_logistics_env.report.document import document
    from swarm_logistics_env.report.figures import slug
    from swarm_logistics_env.report.report_files import write_report
    from swarm_logistics_env.report.score_card import STUDY, card_section, score_card
    from swarm_logistics_env.studies.engines import engine_named

    from .study_commands import in_one_line, run_study, show_report, study_of
    from .terminal_tables import show

    load(asked, trust_code=trust_code)  # what is wrong with it is said before anything is written
    out = out or Path("results", "scorecards", slug(called(asked)))
    study = study_of(STUDY, out, None, [asked], trust_code)
    typer.echo(f"{study.plan()}, kept in {out}\n")
    count = processes or os.cpu_count() or 1
    tally = run_study(study, engine_named("process" if count > 1 else "local", count, None))
    results = study.findings()
    show(card_section(score_card(results)))
    if full:
        show_report(results, document(results), out, full=True)
    else:
        typer.echo(f"Written: {', '.join(map(str, write_report(results, out)))}")
    typer.echo(in_one_line(tally, f"{count} process{'es' if count > 1 else ''}"))
    return tally.failed
