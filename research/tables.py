"""What the scripts share: studies to play, blocks of a page between markers, tables, CSV files."""

import csv
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from swarm_logistics_env import spi
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.report.curves import Curve
from swarm_logistics_env.study.report.tables import contacts_text
from swarm_logistics_env.study.report.write import section_markdown
from swarm_logistics_env.study.runs.engines import usable_cores
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict

ROOT = Path(__file__).parents[1]
BLOCK = "<!-- tables: {name} -->"
END = "<!-- end of tables -->"


def with_blocks(text: str, blocks: Mapping[str, str]) -> str:
    """Return a page with other text between the markers of each block."""
    for name, block in blocks.items():
        begin = BLOCK.format(name=name)
        before, begin_marker, remainder = text.partition(begin)
        _, end_marker, after = remainder.partition(END)
        if not (begin_marker and end_marker):
            raise SystemExit(f"the page has no {begin} followed by {END}")
        text = f"{before}{begin}\n\n{block}\n\n{END}{after}"
    return text


def rewrite(page: Path, blocks: Mapping[str, str]) -> None:
    """Write other text between the markers of each block of a page."""
    text = with_blocks(page.read_text(encoding="utf-8"), blocks)
    page.write_text(text, encoding="utf-8")


def block_rows(page: Path, name: str) -> list[list[str]]:
    """Return the cells of the table between the markers of a block, without its head."""
    _, _, remainder = page.read_text(encoding="utf-8").partition(BLOCK.format(name=name))
    lines = [line for line in remainder.partition(END)[0].splitlines() if line.startswith("| ")]
    _, _, *rows = ([cell.strip("`") for cell in line[2:-2].split(" | ")] for line in lines)
    return rows


def interval_in(text: str) -> spi.Interval:
    """Return the interval that a cell of a page begins with, e.g. "28.7 [27.1, 30.3]"."""
    value, low, high = re.findall(r"-?[\d.]+", text)[:3]
    return spi.Interval(float(value), float(low), float(high))


def curve_of(label: str, places: Sequence[float], texts: Iterable[str]) -> Curve:
    """Return a curve of the intervals that cells of a page begin with."""
    y, low, high = np.array([interval_in(text) for text in texts]).T
    return Curve(label, np.array(places, np.float64), y, low, high)


def table(head: Sequence[object], rows: Iterable[Sequence[object]], *lines: str) -> str:
    """Return a Markdown table as the report has it, and lines of text below."""
    texts = tuple(tuple(map(str, row)) for row in rows)
    return section_markdown(section.Section("", tuple(map(str, head)), texts, lines)).strip()


def read_rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file; the cells that a row which was cut short lacks are None."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write_rows(path: Path, head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV file."""
    path.parent.mkdir(exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        writer.writerows(rows)


def by_policy(
    policies: Sequence[str],
    cells: Iterable[Cell],
    tests: Iterable[Verdict],
    text: Callable[[Verdict], str],
    *lines: str,
) -> str:
    """Return a table of P, contacts per robot-minute and indicators, and lines below.

    Each policy has a column; contacts have rows where they were counted.
    """
    rows: dict[str, dict[str, str]] = {}
    cells = list(cells)
    for cell in cells:
        rows.setdefault(f"P, {cell.words}", {})[cell.policy] = section.mean_p(cell)
    for cell in cells:
        if cell.contacts.value >= 0.0:
            rows.setdefault(f"contacts, {cell.words}", {})[cell.policy] = contacts_text(cell)
    for test in tests:
        label = f"{test.compared.indicator}, {test.compared.label}"
        rows.setdefault(label, {})[test.compared.policy] = text(test)
    body = [(label, *(row.get(policy, "") for policy in policies)) for label, row in rows.items()]
    return table(("", *(f"`{policy}`" for policy in policies)), body, *lines)


def difference_of_means(first: Numbers, second: Numbers) -> spi.Interval:
    """Return the mean of the first less that of the second, with Welch's interval of 95 %."""
    from scipy.stats import ttest_ind

    low, high = ttest_ind(first, second, equal_var=False).confidence_interval(0.95)
    return spi.Interval(float(first.mean() - second.mean()), float(low), float(high))


def percent_change(before: Numbers, after: Numbers) -> spi.Interval:
    """Return the relative change of P in percent, paired by seed.

    Raises:
        IndicatorError: nothing was delivered before.
    """
    change = spi.relative_change(before, after)
    limits = (None if limit is None else 100.0 * limit for limit in (change.low, change.high))
    return spi.Interval(100.0 * change.value, *limits)


def signed_percent(change: spi.Interval, digits: int) -> str:
    """Return a change with its sign and its interval, e.g. "+1.2 % [0.3, 2.1]"."""
    return f"{change.value:+.{digits}f} % {section.limits(change, digits)}".rstrip()


def side(interval: spi.Interval) -> int:
    """Return on which side of 0 an interval lies, 1 or -1; 0: on both."""
    if interval.low is not None and interval.low > 0.0:
        return 1
    if interval.high is not None and interval.high < 0.0:
        return -1
    return 0


def seeds_from(results: StudyResults, noun: str = "seeds") -> str:
    """Return over which seeds a table is, e.g. "20 seeds from 20,000 on"."""
    seeds = results.plan.seeds
    return f"{len(seeds)} {noun} from {seeds[0]:,} on"


def example(out: Path, name: str, **changed: Any) -> Study:
    """Return the study of a file in examples/, which keeps its runs in a folder of `out`."""
    return Study.from_file(ROOT / "examples" / f"{name}.toml", out=out / name, **changed)


def play(studies: Iterable[Study]) -> list[StudyResults]:
    """Play what is missing of each study; return what the runs say, or exit if one failed."""
    results: list[StudyResults] = []
    for study in studies:
        tally = study.run(processes=usable_cores())
        if tally.failed:
            raise SystemExit(f"{tally.failed} runs failed: {tally.error}")
        results.append(study.findings())
    return results
