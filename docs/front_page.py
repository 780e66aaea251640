"""Writes the README's numbers from the CSV files in docs/results, and draws their picture.

`python docs/front_page.py`; `make tables`, which writes these files, calls it. Nothing is played.
"""

import csv
import math
import re
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from play_paper_fit import claim_rows, word
from tables import ROOT, table, with_blocks

from swarm_logistics_env.report import drawing, section
from swarm_logistics_env.spi.summaries import Interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
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
    with (RESULTS / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


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


# Which policies and which mode are told is decided here: after a change, look at the tables.
FINDINGS = """\
* **Robots that could exist** (preset `realistic`; N = 25, 500 s): `ppo-robust` delivers \
{realistic[ppo-robust].text}, {share[ppo-robust].text} times as much{undecided} as \
`homing-stock`, the best script that senses locally, at {contacts[ppo-robust].text} contacts a \
robot-minute ({contacts[homing-stock].text}); `central-stock`, which sees everything, \
{realistic[central-stock].text}.
* **Broken robots there**: with two that deliver nothing (FM4) R is {fm4[ppo-delivery].text} of \
`ppo-delivery`, {fm4[ppo-robust].text} of `ppo-robust`, {fm4[homing-stock].text} of `homing-stock`.
* **More robots there**: from 25 to 100 S is {s[homing-stock].text} of `homing-stock`, \
{s[ppo-robust].text} of `ppo-robust`.
* **The paper's warehouse**, where lifting takes no time: `ppo-robust` clears it in \
{times[ppo-robust].text} s, `homing-stock` in {times[homing-stock].text} s, Swarm D-T in \
{times[swarm-dt].text} s.
* **Of {n_claims} claims of the paper's text** {sets[supported]} hold ({n_untestable} cannot \
fail), {sets[contradicted]} fail and {sets[open]} are open under nine in ten of [{n_sets} sets of \
constants](docs/research/paper_fit.md) that fit its cells without faults.

95 % intervals: {seeds[realistic]} seeds ({seeds[policies]} for R and S), of networks over their \
trainings too; if one training in ten collapses, such an interval over seven holds R in \
{coverage} of studies. Collapsed: a training keeps less than half of its P."""


def findings() -> str:
    """Return what the tables show, as a list: the numbers stand beside their intervals."""
    estimates = read("estimates")
    policies = values(estimates, "policies")
    realistic = values(estimates, "realistic")
    claims = read("claims")
    of_sets = claim_rows(RESULTS / "paper_fit")
    low, high = realistic[SHARE]["ppo-robust"].interval[1:]
    is_open = low is not None and high is not None and low < 1.0 < high
    return FINDINGS.format(
        realistic=realistic["P"],
        undecided=" (undecided)" if is_open else "",
        share=realistic[SHARE],
        contacts=realistic["contacts"],
        fm4=policies["R, FM4, m = 2"],
        s=policies["S, N 25 -> 100"],
        times=values(estimates, "clearing")["no fault"],
        n_claims=len(claims),
        n_untestable=sum(claim["verdict"] == "untestable" for claim in claims),
        n_sets=of_sets[0][2],
        sets=Counter(word(n_holding, n_sets) for _, n_holding, n_sets in of_sets),
        seeds={line["study"]: line["seeds"] for line in estimates},
        coverage=section.percent(_coverage_over_trainings()),
    )


def _coverage_over_trainings() -> float:
    """Return how often an interval of R over seven trainings holds R if one in ten collapses."""
    (row,) = (
        row
        for row in read("verdict_errors")
        if row["world"] == "1 in 10 collapses"
        and (row["trainings"], row["seeds"]) == ("7.000", "20.000")
    )
    return float(row["coverage"])


# How each policy of the first table came about.
_POLICIES = {
    "swarm-dt": "the paper's",
    "homing-stock": "a script",
    "ppo-delivery": "learned",
    "ppo-robust": "learned among faults",
}
_CONDITIONS = {
    "no fault": "no fault",
    "FM1, m = 2": "FM1: two mislead the others",
    "FM4, m = 2": "FM4: two deliver nothing",
    "FM4_jam, m = 2": "FM4_jam: nor let go of the item",
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


def speed() -> str:
    """Return the sentence on speed."""
    (cost,) = read("cost")
    microseconds = f"{float(cost['microseconds_per_step']):,.0f}"
    return f"A step of 25 robots takes {microseconds} µs on one core of {cost['processor']}."


def draw(rows: Rows, path: Path) -> None:
    """Draw the forest plot: a row a policy, a panel a question; equal rows give equal bytes."""
    names = list(rows["P, N = 25"])

    def draw_panels(canvas: "Figure") -> None:
        canvas.set_size_inches(9.2, 2.7)
        panels = canvas.subplots(1, len(_PANELS), sharey=True)
        for axes in panels[3:]:  # the modes on one scale
            axes.sharex(panels[2])
        for axes, (label, title) in zip(panels, _PANELS.items(), strict=True):
            axes.set_title(title, fontsize=8.5)
            axes.axvline(0.0, color=drawing.INK, linewidth=0.8)
            for height, name in enumerate(names):
                if name in rows[label]:
                    _mark(axes, height, rows[label][name].interval, name.startswith(_LEARNED))
            axes.set_ylim(len(names) - 0.4, -0.6)
            axes.spines["left"].set_visible(False)
            axes.tick_params(axis="y", length=0)
        panels[0].set_yticks(range(len(names)), names)
        panels[0].set_xlim(left=0.0)

    path.write_text(drawing.svg_image(draw_panels, 2.7), encoding="utf-8")


def _mark(axes: "Axes", height: float, interval: Interval, is_learned: bool) -> None:
    style = 1 if is_learned else 0
    colour = drawing.COLOURS[style]
    value, low, high = interval
    if low is not None and high is not None:
        if math.isinf(high - low):  # no limit: dotted from side to side
            axes.axhline(height, color=colour, linewidth=1.4, linestyle=":")
        else:
            axes.plot([low, high], [height, height], color=colour, linewidth=2.2)
    axes.plot([value], [height], drawing.MARKERS[style], color=colour, markersize=5.5)


def with_address(text: str, address: str) -> str:
    """Return the README with absolute links to a repository, "https://.."."""
    text = re.sub(r'(src="|!\[[^]]*\]\()(?=docs/)', rf"\g<1>{address}/raw/main/", text)
    links = rf"\g<1>{address}/blob/main/"
    return re.sub(r"(?<!!)(\[[^]]+\]\()(?!https://)", links, text)


def readme_text() -> str:
    """Return the README as the tables have it, with links to the repository of [project.urls]."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    address = project.get("urls", {}).get("Repository")
    readme = README.read_text(encoding="utf-8")
    text = with_blocks(readme, {"broken": broken(), "findings": findings(), "speed": speed()})
    return with_address(text, address.rstrip("/")) if address else text


def main() -> None:
    """Write the README and its picture."""
    README.write_text(readme_text(), encoding="utf-8")
    draw(values(read("estimates"), "policies"), ROOT / "docs" / "media" / "policies.svg")


if __name__ == "__main__":
    main()
