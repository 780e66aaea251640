"""Judging trials that somebody else recorded, from Python and for the command line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swarm_logistics_env.study.runs.recorded import RecordedStudy
from swarm_logistics_env.study.trials import read_trials
from swarm_logistics_env.study.verdicts import results

if TYPE_CHECKING:
    import pandas as pd

    from swarm_logistics_env.study.report.findings import Findings


def judge(
    trials: str | Path | pd.DataFrame,
    *,
    out: str | Path | None = None,
    setup: Mapping[str, str] | None = None,
    **reading: Any,
) -> Findings:
    """Judge trials: S, R, FT and A of what varies in them.

    Args:
        trials: path of a file or folder, or a data frame of pandas, with a row for each trial.
        out: directory of the study, for `swarm-logistics study report`; None: it is not kept.
        setup: name and value of conditions for the report to state.
        reading: how the trials are read, see `study.read_trials`, e.g. `columns={"performance":
            "boxes"}`.

    Raises:
        IndicatorError: the trials cannot be read.
        StudyError: nothing in them can be compared, or `out` holds another study.

    Example:
        >>> import pandas as pd
        >>> robots, boxes = [4, 4, 4, 8, 8, 8], [10, 11, 12, 17, 19, 18]
        >>> results = judge(pd.DataFrame({"robots": robots, "delivered": boxes}))
        >>> results.verdicts[0].compared.indicator
        'S'
    """
    from swarm_logistics_env.study.report.findings import Findings

    study = RecordedStudy.of(read_trials(trials, **reading), setup)
    if out is not None:
        study.keep(Path(out))
    return Findings.of(results.judge(study.plan, study.outcomes))
