"""Writes the README's numbers from the tables of docs/results.md, and draws their picture.

`python docs/front_page.py`; `make tables`, which records that page, calls it. Nothing is played.
"""

import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from tables import ROOT, block_of, rewritten

README, RESULTS = ROOT / "README.md", ROOT / "docs" / "results.md"

_LEARNED = "ppo-"
_NUMBER = r"-?(?:[\d.,]+|∞)"
_VALUE = re.compile(rf"({_NUMBER}) \[({_NUMBER}), ({_NUMBER})\]")
_PANELS = {
    "P, N = 25": "P, N = 25\n[items in 500 s]",
    "S, N 25 -> 100": "S, scalability\nN 25 → 100",
    "R, FM1, m = 2": "R, FM1\ntells a false timer",
    "R, FM2, m = 2": "R, FM2\nlifts nothing",
    "R, FM3, m = 2": "R, FM3\nradio dead",
    "R, FM4, m = 2": "R, FM4\ndelivers nothing",
}


class Value(NamedTuple):
    """A number of a table as it stands there, and with the limits of its 95 % interval."""

    text: str
    value: float
    low: float
    high: float


Row = Mapping[str, Value]  # by the column's heading, of a policy without its trainings
Rows = Mapping[str, Row]  # by the row's label


def rows_of(block: str) -> Rows:
    """Return the values with intervals in the table of a block."""
    head, _, *lines = [line.split("|")[1:-1] for line in block.splitlines() if line[:1] == "|"]
    found: dict[str, dict[str, Value]] = {}
    for label, *cells in lines:
        row = found.setdefault(label.strip(), {})
        for name, cell in zip(head[1:], cells, strict=True):
            if told := _VALUE.match(cell.strip()):
                numbers = (float(part.replace("∞", "inf")) for part in told.groups())
                row[_plain(name)] = Value(told[0], *numbers)
    return found


def _plain(name: str) -> str:
    """Return a policy's name without how many trainings it stands for."""
    bare = name.strip(" `")
    return bare.partition(",")[0] if bare.startswith(_LEARNED) else bare


# Which policies and which mode are told is decided here: after a change, look at the tables.
FINDINGS = """\
* **The paper's warehouse, cleared {faster:.0f} times as fast**: `ppo-indicator` delivers 60 items \
in {times[ppo-indicator].text} s, the paper's Swarm D-T in {times[swarm-dt].text} s; \
`homing-stock`, a script, in {times[homing-stock].text} s (lifting takes no time).
* **Where items come back, {more:.1f} times as many**: `ppo-indicator` {p[ppo-indicator].text} in \
500 s; Swarm D-T {p[swarm-dt].text}.
* **They lean on lifting that takes no time**: where it takes 1 s, `ppo-indicator` delivers \
{slow[ppo-indicator].text}, `homing`, a script, {slow[homing].text}.
* **One collapses under a fault that another bears**: with two robots in FM4 R of `swarm-dt` is \
{r[swarm-dt].text}, of `ppo-indicator` {r[ppo-indicator].text}, of `ppo-robust` \
{r[ppo-robust].text}.
* **Four times the robots do not deliver four times as much**: from 25 to 100 S of \
`swarm-dt-follow` is {s[swarm-dt-follow].text}, of `homing` {s[homing].text}.
* **Of {claims[0]} claims of the paper's text** this re-implementation (constants partly fitted) \
supports {claims[1]} and {claims[2]}; {claims[3]}, {claims[4]} cannot fail. FM1 is not reproduced.

95 % intervals: {seeds[0]} seeds ({seeds[1]} for times, {seeds[2]} for slow lifting), of networks \
over trainings too."""
_CLAIMS = (
    r"Of (\d+) claims .*?\ssupports\s(\d+) and (contradicts \d+ ?.*?);\s(\d+ are open);\s(\d+)"
)


def findings(page: str) -> str:
    """Return what the tables show, as a list: the numbers stand beside their intervals."""
    names = "policies", "clearing", "leans", "paper"
    policies, clearing, leans, paper = (block_of(page, name) for name in names)
    rows = rows_of(policies)
    times = {_plain(name): row["no fault"] for name, row in rows_of(clearing).items()}
    p = rows["P, N = 25"]
    (claims,) = re.findall(_CLAIMS, paper)
    return FINDINGS.format(
        faster=times["swarm-dt"].value / times["ppo-indicator"].value,
        times=times,
        more=p["ppo-indicator"].value / p["swarm-dt"].value,
        p=p,
        slow=rows_of(leans)["lifting takes 1 s"],
        r=rows["R, FM4, m = 2"],
        s=rows["S, N 25 -> 100"],
        claims=claims,
        seeds=[re.findall(r"(\d+) seeds from ", one)[0] for one in (policies, clearing, leans)],
    )


def speed(page: str) -> str:
    """Return the sentence on speed, from the table of costs."""
    costs = block_of(page, "costs")
    (took,) = re.findall(r"^\| env\.step_arrays:[^|]*\|[^|]*\| *([^ |]+)", costs, re.MULTILINE)
    (machine,) = re.findall(r"^On (.*), \d+ cores?, Python .*\.$", costs, re.MULTILINE)
    return f"A step of 25 robots takes {took} µs on one core of {machine}."


def draw(rows: Rows, path: Path) -> None:
    """Draw the forest plot: a row a policy, a panel a question; equal rows give equal bytes."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    names = list(rows["P, N = 25"])
    places = range(len(names), 0, -1)
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams |= {"svg.hashsalt": "front page", "font.size": 9.0, "axes.linewidth": 0.6}
        figure = Figure(figsize=(9.2, 2.7), layout="constrained")
        panels = figure.subplots(1, len(_PANELS), sharey=True)
        for axes in panels[3:]:  # the modes on one scale
            axes.sharex(panels[2])
        for axes, (label, title) in zip(panels, _PANELS.items(), strict=True):
            axes.set_title(title, fontsize=8.5, loc="left")
            axes.axvline(0.0, color="#1b1b1b", linewidth=0.8)
            for place, name in zip(places, names, strict=True):
                if (one := rows[label].get(name)) is None:
                    continue
                is_learned = name.startswith(_LEARNED)
                colour, marker = ("#d55e00", "s") if is_learned else ("#0072b2", "o")
                if math.isinf(one.high - one.low):  # no limit: dotted from side to side
                    axes.axhline(place, color=colour, linewidth=1.4, linestyle=":")
                else:
                    axes.plot([one.low, one.high], [place, place], color=colour, linewidth=2.2)
                axes.plot([one.value], [place], marker, color=colour, markersize=5.5)
            axes.set_ylim(0.4, len(names) + 0.6)
            axes.spines[["top", "right", "left"]].set_visible(False)
            axes.tick_params(axis="y", length=0)
            axes.grid(axis="y", color="#e4e6e9", linewidth=0.6)
            axes.set_axisbelow(True)
        panels[0].set_yticks(list(places), names)
        panels[0].set_xlim(left=0.0)
        figure.savefig(path, format="svg", metadata={"Date": None, "Creator": None})


def with_address(text: str, address: str) -> str:
    """Return the README with absolute links to a repository, "https://.."."""
    text = re.sub(r'(src="|!\[[^]]*\]\()(?=docs/)', rf"\g<1>{address}/raw/main/", text)
    links = rf"\g<1>{address}/blob/main/"
    return re.sub(r"(?<!!)(\[[^]]+\]\()(?!https://)", links, text)


def written() -> str:
    """Return the README as the tables have it, with links to the repository of [project.urls]."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    address = project.get("urls", {}).get("Repository")
    page, readme = RESULTS.read_text(encoding="utf-8"), README.read_text(encoding="utf-8")
    blocks = {"findings": findings(page), "speed": speed(page)}
    text = rewritten(readme, blocks)
    return with_address(text, address.rstrip("/")) if address else text


def main() -> None:
    """Write the README and its picture."""
    README.write_text(written(), encoding="utf-8")
    policies = block_of(RESULTS.read_text(encoding="utf-8"), "policies")
    draw(rows_of(policies), ROOT / "docs" / "media" / "policies.svg")


if __name__ == "__main__":
    main()
