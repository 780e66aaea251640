"""Writes docs/study_files.md from the records: `python docs/generate_study_files.py`."""

# ruff: noqa: E501  # the lines of the page

from __future__ import annotations

from pathlib import Path

from record_tables import fields, summary, table

from swarm_logistics_env.scenario import SCENARIO_PRESETS
from swarm_logistics_env.studies.indicator_table import INDICATORS
from swarm_logistics_env.studies.performance_table import PERFORMANCE, Columns
from swarm_logistics_env.studies.presets import PRESETS
from swarm_logistics_env.studies.specification import (
    Ablation,
    Faults,
    Parameter,
    Sizes,
    Specification,
)

PAGE = Path(__file__).parent / "study_files.md"
TABLES = {"sizes": Sizes, "faults": Faults, "parameters": Parameter, "ablations": Ablation}

TEXT = """\
# Study files

<!-- Written by docs/generate_study_files.py from the code; change that, not this. -->

```{{figure}} media/flow-study_files.svg
:alt: From a study file over its plan and its runs to a report
```

A study is a TOML file, or the same fields in Python: `Study(policies=[...], seeds=20, faults=[{{"modes": ["FM1"]}}])`. An unknown field is an
error, which suggests the nearest known field. Each factor that the study varies is a table, and each table may come several times:

{heads}

## The study

{study}

`scenario` is a table of fields of [Scenario](environment.md#arguments); `preset` is one of them and comes first
({scenario_presets}).

{factors}

## Presets

`swarm-logistics study run NAME` knows these by name. Each is a study file in `swarm_logistics_env/studies/preset_studies/`, from which a study of
your own may start:

{presets}

## The tables of results

`Study.performance()` has one row a policy and condition, and `cells.csv` in the directory of a study holds it but for the last three columns:

{performance}

`Study.indicators()` has one row a comparison, and `claims.csv` holds it but for the last three columns:

{indicators}
"""


def page() -> str:
    """Return the page."""
    return TEXT.format(
        heads="\n".join(f"* `[[{name}]]`: {summary(kind)}" for name, kind in TABLES.items()),
        study=fields(Specification, leave_out=TABLES),
        scenario_presets=", ".join(f"`{name}`" for name in SCENARIO_PRESETS),
        factors="\n\n".join(
            f"## `[[{name}]]`\n\n{summary(kind)}\n\n{fields(kind)}" for name, kind in TABLES.items()
        ),
        presets="\n".join(
            f"* `{name}`: {study.seeds} seeds, N = {study.scenario.n_robots}, "
            f"{study.scenario.duration:g} s; {varied(study)}"
            for name, study in PRESETS.items()
        ),
        performance=columns(PERFORMANCE),
        indicators=columns(INDICATORS),
    )


def columns(known: Columns) -> str:
    """Return the columns of a table of results with what they mean."""
    return table(("column", "meaning"), [(f"`{name}`", text) for name, (_, text) in known.items()])


def varied(study: Specification) -> str:
    """Return what a study varies, in words."""
    parts = [f"sizes {', '.join(map(str, factor.values))}" for factor in study.sizes]
    parts += [
        f"{', '.join(factor.modes)} at m = {', '.join(map(str, factor.robots))}"
        + (
            f" from {', '.join(f'{time:g}' for time in factor.onsets)} s"
            if any(factor.onsets)
            else ""
        )
        for factor in study.faults
    ]
    parts += [
        f"{factor.name} {', '.join(f'{value:g}' for value in factor.values)}"
        for factor in study.parameters
    ]
    parts += [f"without a part: {factor.policy}" for factor in study.ablations[:1]]
    return "; ".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
