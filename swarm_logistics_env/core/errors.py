"""Every error the package raises of bad input: one family, all of them `ValueError`.

`spi.IndicatorError` belongs to it. A message names the field, the value that was given and what
would be right.
"""

from __future__ import annotations

import difflib
import re
import sysconfig
from collections.abc import Iterable
from pathlib import Path


class SwarmLogisticsError(ValueError):
    """Anything this package refuses; catch this to catch all of them.

    Attributes:
        lines: of a message that says several things, each of them; else empty.
    """

    lines: tuple[str, ...] = ()


class ScenarioError(SwarmLogisticsError):
    """A scenario that is mistyped, out of range, or impossible to build."""


class ArgumentError(ScenarioError, TypeError):
    """An argument that the environment does not have: also a TypeError, as Python's own is."""


class FaultError(SwarmLogisticsError):
    """A fault whose mode, robots or times cannot be."""


class CommandError(SwarmLogisticsError):
    """Commands of the wrong shape, of the wrong type, or not finite."""


class SetupError(SwarmLogisticsError):
    """An environment, a reward or a wrapper that is set up or called wrongly."""


class PolicyError(SwarmLogisticsError):
    """A policy that cannot be found, built or trusted, or whose output is wrong."""


class BodiesError(SwarmLogisticsError):
    """Bodies that cannot be loaded, that a scenario cannot have, or whose poses cannot be."""


class TrainingError(SwarmLogisticsError):
    """A training whose specification, directory or request cannot be."""


class RobotError(SwarmLogisticsError):
    """A robot's log, or an export for robots, that cannot be."""


class StudyError(SwarmLogisticsError):
    """A study whose specification, store or request cannot be."""


# What code that is not ours may raise: sys.exit() in a policy ends its run alone. Ctrl-C, which is
# a KeyboardInterrupt, ends all.
RAISED_BY_OTHERS = (Exception, SystemExit, GeneratorExit)


_FRAME = re.compile(r'File "(.+?)", line (\d+)')  # of a traceback


def users_line(traceback: str) -> tuple[str, str] | None:
    """Return the file and the line of a traceback at which a user's own code failed.

    That is the last one outside this package and the libraries; the last one of all where there
    is none; None where the traceback names no file.
    """
    frames: list[tuple[str, str]] = _FRAME.findall(traceback)
    libraries = (sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib"))
    not_by_users = (str(Path(__file__).parents[1]), "<", *libraries)
    users_frames = [frame for frame in frames if not frame[0].startswith(not_by_users)]
    if users_frames:
        return users_frames[-1]
    return frames[-1] if frames else None


def how_to_install(extra: str) -> str:
    """Return the end of an error message about a package of one of the extras that is missing."""
    package = f"'swarm-logistics-env[{extra}]'"
    if (Path(__file__).parents[2] / "constraints.txt").is_file():  # in a clone
        package = f"-c constraints.txt -e '.[{extra}]'"
    command = f"pip install {package}"
    if extra == "train":
        return f"{command}, or without 5 GB of CUDA: uv pip install --torch-backend cpu {package}"
    return command


def suggest(name: str, names: Iterable[str]) -> str:
    """Return the end of an error message about an unknown `name`.

    "; did you mean 'x'?" where one of `names` is close to it; "; did you mean 'x' or 'y'?" where
    one to eight of them contain it, whatever its case; else the list of all.
    """
    candidates = sorted(names)
    suggestions = difflib.get_close_matches(name, candidates, n=1)
    if not suggestions and name:
        suggestions = [text for text in candidates if name.casefold() in text.casefold()]
    if not 1 <= len(suggestions) <= 8:
        return f"; known: {', '.join(candidates)}"
    *first, last = map(repr, suggestions)
    choice = f"{', '.join(first)} or {last}" if first else last
    return f"; did you mean {choice}?"
