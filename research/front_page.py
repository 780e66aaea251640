"""Writes the README's numbers from the CSV files in docs/results, and draws the picture of results.

`python -m research.front_page`; `make tables`, which writes these files, calls it. Nothing is
played. The sentences stand in the README alone; here are the numbers of each in their order.
"""

import re
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from research.fit_paper import read_tried
from research.play_claims import judged_claims, runs_a_cell
from research.play_paper_fit import by_set
from research.tables import ROOT, read_rows, table, with_blocks
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.study.report import drawing, section
from swarm_logistics_env.study.report.points import Point

if TYPE_CHECKING:
    from matplotlib.figure import Figure

README = ROOT / "README.md"
RESULTS = ROOT / "docs" / "results"

_LEARNED = "ppo-"
_PANELS = {
    "P, N = 25": "P, N = 25\n[items in 500 s]",
    "S, N 25 -> 100": "S, scalability\nN 25 → 100",
    "R, FM1, m = 2": "R, FM1\ntells a false timer",
    "R, FM2, m = 2": "R, FM2\nlifts nothing",
    "R, FM3, m = 2": "R, FM3\nradio dead",
    "R, FM4, m = 2": "R, FM4\ndelivers nothing",
    "R, FM4_jam, m = 2": "R, FM4_jam\nnor lets go",
}


class Value(NamedTuple):
    """An estimate of a table, and its text there: value and limits of its 95 % interval."""

    interval: Interval
    text: str


SHARE = "times the best script"  # a row of `play_tables`

Rows = Mapping[str, Mapping[str, Value]]  # by the row's label, then by policy


def read(name: str) -> list[dict[str, str]]:
    """Return the rows of a file of docs/results."""
    return read_rows(RESULTS / f"{name}.csv")


def values(estimates: Sequence[Mapping[str, str]], study: str) -> Rows:
    """Return the estimates of a study."""
    rows: dict[str, dict[str, Value]] = {}
    for line in estimates:
        if line["study"] == study:
            low, high = (float(line[end]) if line[end] else None for end in ("low", "high"))
            interval = Interval(float(line["value"]), low, high)
            thresholds = [float(line["threshold"])] if line["threshold"] else []
            text = section.bracketed(interval, int(line["digits"]), thresholds)
            if line["collapsed"]:
                text += f" ({line['collapsed']})"
            rows.setdefault(line["row"], {})[line["policy"]] = Value(interval, text)
    return rows


_NUMBER = re.compile(r"\d+(?:\.\d+)?(?: %)?")
_COST = re.compile(r"[\d,]+ µs on one core of .*(?=\.$)")


def with_numbers(
    text: str, beginning: str, pattern: re.Pattern[str], numbers: Sequence[str]
) -> str:
    """Return a page with these numbers, in their order, in the line that begins so.

    Args:
        pattern: of a number; what it matches in the line are its numbers.
    """
    lines = [line for line in text.splitlines() if line.startswith(beginning)]
    n_matches = [len(pattern.findall(line)) for line in lines]
    if n_matches != [len(numbers)]:
        raise SystemExit(
            f"README.md should have one line that begins with {beginning!r}, with {len(numbers)} "
            f"numbers: it has {len(lines)}, with {n_matches}"
        )
    (line,) = lines
    remaining = iter(numbers)
    return text.replace(line, pattern.sub(lambda _: next(remaining), line))


def counts() -> dict[str, list[str]]:
    """Return the counts of the README's findings, by the words that each line begins with."""
    played = read_tried(RESULTS / "paper_fit" / "claims.csv")
    claims = judged_claims(played)
    words = Counter(claim.word for claim in claims)
    least_runs, _ = runs_a_cell(played)
    of_text = (
        len(claims), words["holds"], words["fails"], words["open"], words["cannot fail"],
        least_runs, len(by_set(played)),
    )  # fmt: skip
    seeds = {line["study"]: line["seeds"] for line in read("estimates")}
    return {
        "**Of ": list(map(str, of_text)),
        "95 % intervals": [section.P_LEVEL, seeds["broken"]],
    }


# How each policy of the first table came about. Which conditions are told, the README decides.
_POLICIES = {
    "swarm-dt": "the paper's",
    "homing-stock": "a script",
    "ppo-delivery": "learned",
    "ppo-robust": "learned among faults",
}
_CONDITIONS = {
    "no fault": "no fault",
    "FM1, m = 2": "two mislead the others (FM1)",
    "FM4, m = 2": "two deliver nothing (FM4)",
    "FM4_jam, m = 2": "two deliver nothing and hold on to the item (FM4_jam)",
    "contacts, no fault": "contacts a robot-minute, no fault",
}


def broken() -> str:
    """Return the table of what two broken robots cost."""
    estimates = values(read("estimates"), "broken")
    rows = [
        (f"`{policy}`, {words}", *(estimates[condition][policy].text for condition in _CONDITIONS))
        for policy, words in _POLICIES.items()
    ]
    return table(("items in 500 s", *_CONDITIONS.values()), rows)


def cost() -> str:
    """Return what a step takes, and where."""
    (measured,) = read("cost")
    microseconds = float(measured["microseconds_per_step"])
    return f"{microseconds:,.0f} µs on one core of {measured['processor']}"


def draw(rows: Rows, path: Path) -> None:
    """Draw the forest plot: a row a policy, a panel a question; equal rows give equal bytes."""
    names = list(rows["P, N = 25"])

    def points(label: str, name: str) -> list[Point]:
        if name not in rows[label]:
            return []
        style = int(name.startswith(_LEARNED))
        return [Point(name, style, "", *rows[label][name].interval, decided=True)]

    def draw_panels(canvas: "Figure") -> None:
        columns = {label: [(name, points(label, name)) for name in names] for label in _PANELS}
        drawing.forest(canvas, columns)
        modes = canvas.axes[2:]  # on one scale
        ends = [end for axes in modes for end in axes.get_xlim()]
        for axes in modes:
            axes.set_xlim(min(ends), max(ends))
        for axes, title in zip(canvas.axes, _PANELS.values(), strict=True):
            axes.set_xlabel("")
            axes.set_title(title, fontsize=8.5)

    note = (
        "Means with 95 % intervals, without an end where they leave the axis; circles: scripts, "
        "squares: learned, over trainings and seeds."
    )
    style = drawing.FigureStyle(9.2)
    path.write_text(drawing.svg_image(draw_panels, 2.7, note, style), encoding="utf-8")


def with_address(text: str, address: str) -> str:
    """Return the README with absolute links to a repository, "https://.."."""
    text = re.sub(r'(src="|!\[[^]]*\]\()(?=docs/)', rf"\g<1>{address}/raw/main/", text)
    links = rf"\g<1>{address}/blob/main/"
    return re.sub(r"(?<!!)(\[[^]]+\]\()(?!https://)", links, text)


def readme_text() -> str:
    """Return the README as the tables have it, with links to the repository of [project.urls]."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    address = project.get("urls", {}).get("Repository")
    text = with_blocks(README.read_text(encoding="utf-8"), {"broken": broken()})
    for beginning, numbers in counts().items():
        text = with_numbers(text, beginning, _NUMBER, numbers)
    text = with_numbers(text, "A step of", _COST, [cost()])
    return with_address(text, address.rstrip("/")) if address else text


def main() -> None:
    """Write the README and its picture."""
    README.write_text(readme_text(), encoding="utf-8")
    draw(values(read("estimates"), "policies"), ROOT / "docs" / "media" / "policies.svg")


if __name__ == "__main__":
    main()
