"""Where commands play their runs: in this process, in several, or on a cluster."""

from __future__ import annotations

import inspect

import pytest

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.study.runs.engines import engine_named
from swarm_logistics_env.views.cli import attacking, judge_policy, study_commands
from tests.views.cli.conftest import Command


@pytest.mark.parametrize(
    ("words", "engine"),
    [
        ("judge homing", ("process", None, None, None)),
        ("judge homing --processes 1", ("local", 1, None, None)),
        ("judge homing --processes 2 --run-limit 9", ("process", 2, None, 9.0)),
        ("attack homing", ("process", None, None, None)),
        ("attack homing --processes 1", ("local", 1, None, None)),
        ("attack homing --processes 3", ("process", 3, None, None)),
        ("study run quick", ("process", None, None, None)),
        ("study run quick --processes 1", ("local", 1, None, None)),
        ("study run quick --processes 2 --run-limit 9", ("process", 2, None, 9.0)),
        ("study run quick --address auto", ("ray", None, "auto", None)),
        ("study run quick --engine local", ("local", None, None, None)),
    ],
)
def test_one_process_is_this_one_and_several_are_beside_it(
    words: str, engine: tuple[object, ...], command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: object, **keywords: object) -> None:
        call = inspect.signature(engine_named).bind(*arguments, **keywords)
        call.apply_defaults()
        raise SetupError(repr(call.args))

    for module in (attacking, judge_policy, study_commands):
        monkeypatch.setattr(module, "engine_named", refuse)
    assert command(words, code=2) == f"swarm-logistics: {engine!r}"
