"""`swarm-logistics judge`: two commands behind one word, of which the argument says which."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument
from typer.core import TyperCommand

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import SUFFIXES
from swarm_logistics_env.policies.catalogue import SCRIPTED
from swarm_logistics_env.study.trials.readers.folder import TRIAL_SUFFIXES

from .judge_policy import judge_policy_command
from .judge_trials import judge_trials_command

POLICY = "a policy"
TRIALS = "a file of trials"


class JudgeCommand(TyperCommand):
    """Has the options of two commands, and gives what was typed to the one that judges it.

    Attributes:
        halves: the two commands, by the kind of what they judge.
    """

    def __init__(self, name: str, **settings: Any) -> None:
        super().__init__(name, **settings)
        self.halves = {POLICY: _parsed(judge_policy_command), TRIALS: _parsed(judge_trials_command)}
        options = {
            parameter.name: parameter
            for half in self.halves.values()
            for parameter in half.params
            if parameter.param_type_name == "option"
        }
        self.params += options.values()

    def make_context(
        self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any
    ) -> Any:
        """Return the context of the command for what is judged; of this one if nothing is named.

        Raises:
            StudyError: an option is typed that only the other command has.
        """
        context = self.context_class(self, info_name=info_name, parent=parent)
        typed, _, _ = self.make_parser(context).parse_args(list(args))
        argument, *options = self.params
        targets = typed[argument.name]
        if not targets:
            return super().make_context(info_name, args, parent, **extra)
        target, *further = targets
        kind = POLICY if names_policy(target) else TRIALS
        for name in further:
            if kind == TRIALS or not names_policy(name):
                raise StudyError(
                    f"{' '.join(targets)}: should be policies alone, or one file of trials"
                )
        half = self.halves[kind]
        for option in options:
            if option.name in typed and option.name not in _names(half):
                spelled = "/".join([*option.opts, *option.secondary_opts])
                raise StudyError(f"{spelled} is not for {kind}, and {target!r} is one")
        return half.make_context(info_name, args, parent, **extra)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the options that both commands have, then those of each."""
        argument, *options = self.get_params(ctx)
        sections = {"Arguments": [argument]}
        for option in options:
            kinds = [kind for kind, half in self.halves.items() if option.name in _names(half)]
            heading = f"Options for {kinds[0]}" if len(kinds) == 1 else "Options"
            sections.setdefault(heading, []).append(option)
        for heading, parameters in sections.items():
            with formatter.section(heading):
                formatter.write_dl([parameter.get_help_record(ctx) for parameter in parameters])


def _parsed(function: Callable[..., None]) -> TyperCommand:
    """Return the command of a function, whose signature is its options."""
    application = typer.Typer(add_completion=False, rich_markup_mode=None)
    application.command()(function)
    command = typer.main.get_command(application)
    assert isinstance(command, TyperCommand)
    return command


def _names(command: TyperCommand) -> set[str]:
    """Return the names of a command's parameters."""
    return {parameter.name for parameter in command.params}


# Nobody calls it: `judge --help` shows its argument and its text.
def judge_command(
    policy_or_trials: Annotated[
        list[str],
        Argument(
            metavar="TRIALS|POLICIES",
            help="File of trials, one trial or delivery a row (CSV, .xlsx, .parquet, JSON of "
            "POGEMA or marl-eval, a Monitor's CSV), or a folder of them; or a policy: name, path "
            "of a policy file, module:Class, my.py:Class or c:my.c; several policies are compared.",
        ),
    ],
) -> None:
    """Judge policies until verdicts are clear, or recorded trials.

    A file or folder of trials is read, a policy is played. `judge TRIALS --help` and `judge POLICY
    --help` show the options of one alone.
    """


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
