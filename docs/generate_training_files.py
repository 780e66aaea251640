"""Writes docs/training_files.md from the records: `python docs/generate_training_files.py`."""

# ruff: noqa: E501  # the lines of the page

from __future__ import annotations

from pathlib import Path

from record_tables import fields, summary

from swarm_logistics_env.policies.learned import Network
from swarm_logistics_env.train.settings import (
    Conditions,
    Evaluation,
    Indicators,
    PPOSettings,
    Scores,
    WorldKind,
)
from swarm_logistics_env.train.training import Training, load_training, preset_names

PAGE = Path(__file__).parent / "training_files.md"
TABLES = {
    "[network]": Network,
    "[[worlds]]": WorldKind,
    "[[conditions]]": Conditions,
    "[indicators]": Indicators,
    "[ppo]": PPOSettings,
    "[evaluation]": Evaluation,
    "[scores]": Scores,
}

TEXT = """\
# Training files

<!-- Written by docs/generate_training_files.py from the code; change that, not this. -->

```{{figure}} media/flow-training_files.svg
:alt: From a training file over the training to a policy file
```

A training is a TOML file. An unknown field is an error, which suggests the nearest known field. [Training](training.md) explains how
trainings work.

## The training

{training}

{tables}

## Presets

`swarm-logistics train NAME` knows these without a file:

{presets}
"""


def page() -> str:
    """Return the page."""
    presets = {name: load_training(name) for name in preset_names()}
    return TEXT.format(
        training=fields(Training),
        tables="\n\n".join(
            f"## `{name}`\n\n{summary(kind)}\n\n{fields(kind)}" for name, kind in TABLES.items()
        ),
        presets="\n".join(
            f"* `{name}`: {training.about} {training.agent_steps:,} agent-steps."
            for name, training in presets.items()
        ),
    )


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
