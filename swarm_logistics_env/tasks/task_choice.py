"""Tasks as a specification names them: a name, an import path, or an object."""

from __future__ import annotations

import importlib
from typing import Annotated, Any

from pydantic import BeforeValidator, PlainSerializer

from swarm_logistics_env.errors import StudyError, suggest

from .task import Task

DEFAULT = "warehouse"
NAMES = {
    DEFAULT: "swarm_logistics_env.tasks.warehouse_task:WAREHOUSE",
    "recorded trials": "swarm_logistics_env.tasks.recorded_trials:RECORDED",
}


def task_of(source: object) -> Task:
    """Return the task of a name of `NAMES` or of "package.module:OBJECT"; a task as it is.

    Raises:
        StudyError: there is none.
    """
    found: Any = source
    if isinstance(source, str):
        module, colon, attribute = NAMES.get(source, source).partition(":")
        if not colon:
            raise StudyError(
                f"no task {source!r} (a name or 'package.module:OBJECT'){suggest(source, NAMES)}"
            )
        try:
            found = getattr(importlib.import_module(module), attribute)
        except (ImportError, AttributeError, ValueError) as error:
            raise StudyError(f"task {source!r} cannot be imported: {error}") from None
    if not isinstance(found, Task):
        raise StudyError(f"{source!r} is no task: should have the attributes of tasks.Task")
    return found


def refuse_untrusted(source: object, place: object, *, trust_code: bool) -> None:
    """Raise StudyError if a file, `place`, names a task whose module would run when it is loaded.

    Args:
        trust_code: whether it may.
    """
    if isinstance(source, str) and ":" in source and not trust_code:
        raise StudyError(
            f"{place}: task {source!r} is code, which runs when it is loaded: should be a task's "
            "name, or be allowed by --trust-code (trust_code=True)"
        )


def _checked(source: object) -> object:
    task_of(source)
    return source


def _written(source: object) -> str:
    return source if isinstance(source, str) else task_of(source).name


TaskSource = Annotated[Any, BeforeValidator(_checked), PlainSerializer(_written)]
