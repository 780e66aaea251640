"""The report as files: HTML and Markdown to read, CSV to compute with.

Equal rows give equal bytes.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi import Verdict
from swarm_logistics_env.studies.judgement import Cell, Findings, Judgement
from swarm_logistics_env.studies.reporting import wording
from swarm_logistics_env.studies.reporting.document import document, figures_of
from swarm_logistics_env.studies.reporting.html import html
from swarm_logistics_env.studies.reporting.images import (
    how_to_get_figures,
    inline_svg,
    missing_packages,
    write_images,
)
from swarm_logistics_env.studies.reporting.markdown import markdown
from swarm_logistics_env.studies.store import Store

Value = str | float | int | bool | list[float] | None


def write_report(findings: Findings, directory: Path) -> tuple[Path, ...]:
    """Write report.md, cells.csv, claims.csv, every figure's data, and with the extra `study`
    installed report.html and every figure as SVG and PNG; return the paths of report and tables.

    Raises:
        StudyError: a file cannot be written.
    """
    pictures = directory / "figures"
    try:
        pictures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"cannot write to {pictures}: {error.strerror}") from error
    cells = [cell_record(cell) for cell in findings.cells]
    claims = [judgement_record(judgement) for judgement in findings.judgements]
    whole = document(findings)
    for figure in figures_of(whole):
        write_csv(pictures / f"{figure.name}.csv", figure.columns, figure.rows)
    missing = missing_packages()
    if missing:
        text = markdown(whole, note=how_to_get_figures(missing))
    else:
        text = markdown(whole, pictures=pictures.name)
        drawings = {
            figure.name: inline_svg(figure, write_images(figure, pictures))
            for figure in figures_of(whole)
        }
        write_text(directory / "report.html", html(whole, drawings))
    files = directory / "report.md", directory / "cells.csv", directory / "claims.csv"
    write_text(files[0], text)
    write_csv(files[1], list(cells[0]), (list(cell.values()) for cell in cells))
    write_csv(files[2], list(claims[0]), (list(claim.values()) for claim in claims))
    return files if missing else (directory / "report.html", *files)


def cell_record(cell: Cell) -> dict[str, Value]:
    """Return one cell as a flat record; intervals are at 95 %, P in items."""
    level, mean, prediction = cell.arm.level, cell.mean, cell.prediction
    return {
        "policy": cell.policy,
        "table": cell.table,
        "cell": str(level),
        "factor": level.name,
        "value": level.value,
        "onset": level.onset,
        "published": cell.published,
        "counted": cell.counted,
        "n_seeds": len(cell.performance),
        "mean": mean.value if mean else None,
        "low": mean.low if mean else None,
        "high": mean.high if mean else None,
        "prediction_low": prediction.low if prediction else None,
        "prediction_high": prediction.high if prediction else None,
        "published_inside": cell.published_inside,
        "saturated": cell.saturated,
        "problem": cell.problem,
    }


def judgement_record(judgement: Judgement) -> dict[str, Value]:
    """Return one judged comparison as a flat record."""
    comparison, estimate, claim = judgement.comparison, judgement.estimate, judgement.claim
    unaffected = "unaffected" if judgement.unaffected else None
    return {
        "policy": comparison.policy,
        "table": comparison.table,
        "indicator": comparison.indicator,
        "comparison": comparison.label,
        "threshold": comparison.threshold,
        "value": estimate.value if estimate else None,
        "low": estimate.low if estimate else None,
        "high": estimate.high if estimate else None,
        "level": estimate.level if estimate else None,
        "probability": estimate.probability if estimate else None,
        "p_value": estimate.p_value if estimate else None,
        "p_holm": judgement.adjusted_p,
        "verdict": unaffected or (estimate.verdict if estimate else None),
        "verdict_holm": unaffected or judgement.adjusted_verdict,
        "n_seeds": estimate.n_seeds if estimate else None,
        "pairing_correlation": estimate.pairing_correlation if estimate else None,
        "flags": " ".join(estimate.flags) if estimate else None,
        "saturated": judgement.saturated,
        "claim": None if claim is None else wording.claimed(judgement),
        "published": judgement.published,
        "claim_verdict": _on_claim(judgement, estimate.verdict if estimate else None),
        "claim_verdict_holm": _on_claim(judgement, judgement.adjusted_verdict),
        "seeds_for_power_80": judgement.seeds_needed,
        "no_plan": judgement.no_plan,
        "problem": judgement.problem,
    }


def _on_claim(judgement: Judgement, verdict: Verdict | None) -> str | None:
    if judgement.claim is not None and judgement.unaffected:
        return "unaffected"
    return judgement.on_claim(verdict)


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[Value]]) -> None:
    """Write a CSV file with Unix line ends; floats in shortest exact form.

    Raises:
        StudyError: the file cannot be written.
    """
    try:
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(_texts(row) for row in rows)
    except OSError as error:
        raise StudyError(f"cannot write {path}: {error.strerror}") from error


def _texts(row: Sequence[Value]) -> Iterator[str]:
    for value in row:
        if isinstance(value, list):
            yield " ".join(repr(number) for number in value)
        elif isinstance(value, float):
            yield repr(value)
        else:
            yield "" if value is None else str(value)


def export_rows(store: Store, path: Path) -> int:
    """Write every stored run as CSV, sorted by key, without wall times; return how many.

    Raises:
        StudyError: the file cannot be written.
    """
    rows = list(store.rows())
    columns = list(rows[0]) if rows else []
    write_csv(path, columns, (list(row.values()) for row in rows))
    return len(rows)


def write_text(path: Path, text: str) -> None:
    """Write a text file with Unix line ends.

    Raises:
        StudyError: the file cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise StudyError(f"cannot write {path}: {error.strerror}") from error
