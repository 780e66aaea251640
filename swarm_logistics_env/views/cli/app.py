"""The application: which commands there are, and errors in one sentence."""

from __future__ import annotations

import gc
import os
import shlex
import sys
import traceback
from collections.abc import Iterable, Sequence
from importlib import import_module
from typing import Annotated, Any

import typer
from typer import Exit, Option, echo

from swarm_logistics_env.core.code_files import is_users_own
from swarm_logistics_env.core.current_folder import search_current_folder
from swarm_logistics_env.core.errors import SwarmLogisticsError
from swarm_logistics_env.core.records import plain

from .output import BAD_INPUT, DONE, FAILED, PROGRAM, STOPPED, prepare_output

# In the order of use, as the help shows them. A module is imported when its command is called.
COMMANDS = {
    "watch": ("playing", "watch_command"),
    "run": ("playing", "run_command"),
    "train": ("train_command", "train_command"),
    "judge": ("judging", "judge_command"),
    "attack": ("attacking", "attack_command"),
    "record": ("recording", "record_command"),
    "export": ("exporting", "export_command"),
    "ros": ("over_ros", "ros_command"),
    "list": ("playing", "list_command"),
    "study": ("study_commands", "study_app"),
}


class Application:
    """The command line. A call ends the process with one of `output.EXIT_CODES`.

    Where code of the user's own fails, its traceback is shown.

    A command ends otherwise by raising `typer.Exit(code)`.
    """

    def __call__(self) -> None:
        """Run the command line in `sys.argv`."""
        prepare_output()
        # A notebook sets it for what is started there, and the backend may not be installed here.
        os.environ.pop("MPLBACKEND", None)
        code = self.run(sys.argv[1:])
        try:
            sys.stdout.flush()
        except OSError:  # what is left in the buffer would be tried again
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        gc.freeze()  # the process ends: nobody needs to look for garbage
        sys.exit(code)

    def run(self, arguments: list[str]) -> int:
        """Run the command with these arguments and return the exit code."""
        search_current_folder()  # a user's own policy lies in the folder that the command runs in
        typed = [*arguments, "--help"] if arguments in ([], ["study"]) else arguments
        try:
            command = command_line({*typed[:1]} & {*COMMANDS} or COMMANDS)
            # What made a file is recorded in it: the command line is the context's object.
            words = shlex.join([PROGRAM, *typed])
            code = command(typed, PROGRAM, standalone_mode=False, obj=words)
            sys.stdout.flush()
        except (KeyboardInterrupt, typer.Abort):
            return _complain(["stopped"], STOPPED)
        except SystemExit as error:  # no command of ours ends so, and 0 would say that all is well
            raise RuntimeError("a policy or a task called sys.exit()") from error
        except Exception as error:
            sentences = _sentences(error)
            if sentences:
                return _complain(sentences, BAD_INPUT)
            report = _users_part(error)
            if report is None:
                raise
            sys.stderr.write(report)
            return FAILED
        return code if isinstance(code, int) else DONE


app = Application()


def command_line(names: Iterable[str] = COMMANDS) -> Any:
    """Return the command line with these commands: click's object, which parses it."""
    application = typer.Typer(
        name=PROGRAM,
        help="A warehouse for robot swarms, and the measure of how they cope.",
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # Rich would read `[px]` in a help text as a style
    )
    application.callback()(_options)
    for name in names:
        module_name, attribute = COMMANDS[name]
        module = import_module(f"{__package__}.{module_name}")
        command = getattr(module, attribute)
        if isinstance(command, typer.Typer):
            application.add_typer(command)
        elif name == "judge":
            application.command(name, cls=module.JudgeCommand)(command)
        else:
            application.command(name)(command)
    return typer.main.get_command(application)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        echo(version("swarm-logistics-env"))
        raise Exit


def _options(
    version: Annotated[
        bool, Option("--version", help="Print the version.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Take the options that stand before a command."""


def _sentences(error: Exception) -> Sequence[str]:
    """Return what to tell the user, a line each; of a bug nothing, as its traceback should show."""
    # These are Typer's own errors of usage, whichever click they come from.
    format_message = getattr(error, "format_message", None)
    if format_message is not None:
        sentence = " ".join(str(format_message()).split())
        context = getattr(error, "ctx", None)
        if context is None:
            return [sentence]
        end = "" if sentence.endswith((".", "?")) else "."
        return [f"{sentence}{end} Help: {context.command_path} --help"]
    # The operating system refuses for reasons of its own: a disk that is full, a name too long.
    if isinstance(error, SwarmLogisticsError):
        return error.lines or [str(error)]
    return [str(error)] if isinstance(error, OSError) else []


def _users_part(error: Exception) -> str | None:
    """Return the traceback from the user's own code on; None: no code of the user's was called."""
    report = traceback.TracebackException.from_exception(error)
    is_called = False
    for number, frame in enumerate(report.stack):
        # What is above this file started the command; generated code has a name as <string>.
        is_called |= frame.filename == __file__
        if is_called and frame.filename[0] != "<" and is_users_own(frame.filename):
            report.stack = traceback.StackSummary.from_list(report.stack[number:])
            return "".join(report.format())
    return None


def _complain(sentences: Sequence[str], code: int) -> int:
    text = "\n".join(map(plain, sentences))  # they may repeat what was typed
    sys.stderr.write(f"{PROGRAM}: {text}\n")
    return code
