"""What a script reports: with which versions it ran, what passed, and what MPE2 fails at too."""

from __future__ import annotations

import platform
import traceback
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

RUNS_WITH = "runs with: "
PASSES = "passes: "
FAILS_ON_MPE2_TOO = "fails on MPE2 too: "


def runs_with(client: str, *distributions: str) -> None:
    """Report the versions of the client and of what it runs on; the client comes first."""
    installed = [f"{name} {version(name)}" for name in (client, *distributions)]
    installed.append(f"Python {platform.python_version()}")
    print(f"{RUNS_WITH}{', '.join(installed)}", flush=True)


def passes(what: str) -> None:
    """Report that this ran and that all checks held."""
    print(f"{PASSES}{what}", flush=True)


def fails_on_mpe2_too(what: str, proof: str) -> None:
    """Report what fails, after a check that it fails on MPE2 in the same way."""
    print(f"{FAILS_ON_MPE2_TOO}{what}: {proof}", flush=True)


def same_line(ours: Callable[[], Any], theirs: Callable[[], Any]) -> str:
    """Check that both calls raise at the same line of the library, and return it in words."""
    line, error = raised(ours)
    other_line, other = raised(theirs)
    assert line == other_line, (line, error, other_line, other)
    return f"{line} raises {error}; MPE2: {other}"


def raised(call: Callable[[], Any]) -> tuple[str, str]:
    """Return the line that raises, as "package/module.py:12 `code`", and the error.

    Raises:
        AssertionError: nothing was raised, so the report has to be changed.
    """
    try:
        call()
    except Exception as error:  # noqa: BLE001  # whatever the library raises is the result
        last = traceback.extract_tb(error.__traceback__)[-1]
        parts = Path(last.filename).parts
        first = parts.index("site-packages") + 1 if "site-packages" in parts else -2
        place = "/".join(parts[first:])
        return f"{place}:{last.lineno} `{last.line}`", f"{type(error).__name__}: {error}"
    raise AssertionError(f"{call} passes: the report says that it fails")
