"""The policies that a command line means, and what its options hand to them."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.views.cli.policy_choice import policies_of


def test_options_of_models_go_to_models_alone_and_what_wraps_worlds_to_all() -> None:
    texts = ["homing", "model.zip"]
    rows = Path("rows.pkl")
    for options, of_all, of_models in (
        ({}, {}, {}),
        ({"env": "my.py:wrap"}, {"env": "my.py:wrap"}, {}),
        ({"frame": True}, {}, {"frame": True}),
        (
            {"frame": True, "normalize": rows, "env": "my.py:wrap"},
            {"env": "my.py:wrap"},
            {"frame": True, "normalize": "rows.pkl"},
        ),
    ):
        for trusted in (False, True):
            specs = policies_of(texts, trusted, **options)
            assert [(spec.name, spec.parameters, spec.trusted) for spec in specs] == [
                ("homing", of_all, trusted),
                ("model.zip", {**of_all, **of_models}, trusted),
            ]


@pytest.mark.parametrize(
    ("options", "option"),
    [
        ({"frame": True}, "--frame"),
        ({"normalize": Path("rows.pkl")}, "--normalize"),
        ({"frame": True, "normalize": Path("rows.pkl")}, "--frame"),
    ],
)
def test_options_of_models_are_refused_where_no_policy_is_one(
    options: dict[str, object], option: str
) -> None:
    reason = rf"^{option}: is for a model of stable-baselines3, a \.zip file$"
    with pytest.raises(SetupError, match=reason):
        policies_of(["homing", "homing-stock"], False, **options)  # type: ignore[arg-type]
