"""Writes the README's numbers from the tables of docs/results.md, and draws their picture.

`python docs/front_page.py`; `make tables`, which records that page, calls it. Nothing is played.
"""

import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from tables import ROOT, block_of, rewritten

README, RESULTS = ROOT / "README.md", ROOT / "docs" / "results.md"

_REFERENCE = "swarm-dt"  # the paper's controller
_LEARNED = "ppo-"
_TRAINED = "ppo-robust"  # among faults: whether it bears them is told, whatever came of it
_STOCK = "homing-stock"
_NUMBER = r"-?(?:[\d.,]+|∞)"
_VALUE = re.compile(rf"({_NUMBER}) \[({_NUMBER}), ({_NUMBER})\]")
_MODES = {
    "FM1": "tells a false timer",
    "FM2": "lifts nothing",
    "FM3": "radio dead",
    "FM4": "delivers nothing",
}
_R = {mode: f"R, {mode}, m = 2" for mode in _MODES}
_PANELS = {
    "P, N = 25": "P, N = 25\n[items in 500 s]",
    "S, N 25 -> 100": "S, scalability\nN 25 → 100",
    **{_R[mode]: f"R, {mode}\n{what}" for mode, what in _MODES.items()},
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


def findings(page: str) -> str:
    """Return what the tables show, as a list: the numbers stand beside their intervals."""
    names = "policies", "clearing", "leans", "paper"
    policies, clearing, leans, paper = (block_of(page, name) for name in names)
    rows = rows_of(policies)
    times = {_plain(name): row["no fault"] for name, row in rows_of(clearing).items()}
    told = [
        *_deliveries(times, rows["P, N = 25"], rows_of(leans)["lifting takes 1 s"]),
        _faults({mode: rows[label] for mode, label in _R.items() if rows.get(label)}),
        _sizes(rows["S, N 25 -> 100"]),
        *_paper(paper),
    ]
    seeds, timed, slow = (
        re.findall(r"(\d+) seeds from ", block)[0] for block in (policies, clearing, leans)
    )
    note = (
        f"95 % intervals: {seeds} seeds ({timed} for times, {slow} for slow lifting), of networks "
        "over trainings too."
    )
    return "\n".join([*(f"* {one}" for one in told), "", note])


def _learned(values: Row) -> list[str]:
    """Return the networks, the one with the least value first."""
    learned = [name for name in values if name.startswith(_LEARNED)]
    return sorted(learned, key=lambda name: values[name].value)


def _deliveries(times: Row, p: Row, slow: Row) -> Iterator[str]:
    """Yield how fast the best learned swarms are, and what becomes of it with slow lifting."""
    best, script = _learned(times)[0], times.get(_STOCK)
    beside = f"; `{_STOCK}`, a script, in {script.text} s" if script else ""
    yield (
        f"**The paper's warehouse, cleared {times[_REFERENCE].value / times[best].value:.0f} times "
        f"as fast**: `{best}` delivers 60 items in {times[best].text} s, the paper's Swarm D-T "
        f"in {times[_REFERENCE].text} s{beside} (lifting takes no time)."
    )
    best = _learned(p)[-1]
    yield (
        f"**Where items come back, {p[best].value / p[_REFERENCE].value:.1f} times as many**: "
        f"`{best}` {p[best].text} in 500 s; Swarm D-T {p[_REFERENCE].text}."
    )
    best = _learned(slow)[-1]
    yield (
        f"**They lean on lifting that takes no time**: where it takes 1 s, `{best}` delivers "
        f"{slow[best].text}, `homing`, a script, {slow['homing'].text}."
    )


def _faults(r: Rows) -> str:
    """Return the greatest difference that a failure mode makes."""
    worst = {mode: min(row, key=lambda name: row[name].high) for mode, row in r.items()}
    best = {mode: max(row, key=lambda name: row[name].low) for mode, row in r.items()}
    mode = max(r, key=lambda mode: r[mode][best[mode]].value - r[mode][worst[mode]].value)
    lost, kept = worst[mode], best[mode]
    told = [kept, *(name for name in r[mode] if name.startswith(_TRAINED) and name != kept)]
    others = ", ".join(f"of `{name}` {r[mode][name].text}" for name in told)
    return (
        f"**One collapses under a fault that another bears**: with two robots in {mode} R of "
        f"`{lost}` is {r[mode][lost].text}, {others}."
    )


def _sizes(s: Row) -> str:
    title = "Four times the robots do not deliver four times as much"
    if max(one.high for one in s.values()) >= 1.0:
        title = "More robots help some swarms more than others"
    least, *_, most = sorted(s, key=lambda name: s[name].value)
    told = f"S of `{most}` is {s[most].text}, of `{least}` {s[least].text}"
    return f"**{title}**: from 25 to 100 {told}."


def _paper(block: str) -> Iterator[str]:
    pattern = r"Of (\d+) claims .*?\ssupports\s(\d+) and (contradicts \d+ ?.*?);\s(\d+ are open)\."
    for count, supported, contradicts, still in re.findall(pattern, block):
        fm1 = " FM1 is not reproduced." if "FM1" in contradicts else ""
        yield (
            f"**Of {count} claims of the paper's text** this re-implementation (constants "
            f"partly fitted) supports {supported} and {contradicts}; {still}.{fm1}"
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
                colour, marker = "#0072b2", "o"
                if name.startswith(_LEARNED):
                    colour, marker = "#d55e00", "s"
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


def with_address(text: str, address: str | None) -> str:
    """Return the README with absolute links to a repository, "https://.."; None: as it is."""
    if address is None:
        return text
    text = re.sub(r'(src="|!\[[^]]*\]\()(?=docs/)', rf"\g<1>{address}/raw/main/", text)
    links = rf"\g<1>{address}/blob/main/"
    return re.sub(r"(?<!!)(\[[^]]+\]\()(?!https://)", links, text)


def written() -> str:
    """Return the README as the tables have it, with links to the repository of [project.urls]."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    address = project.get("urls", {}).get("Repository")
    page, readme = RESULTS.read_text(encoding="utf-8"), README.read_text(encoding="utf-8")
    blocks = {"findings": findings(page), "speed": speed(page)}
    return with_address(rewritten(readme, blocks), address and address.rstrip("/"))


def main() -> None:
    """Write the README and its picture."""
    README.write_text(written(), encoding="utf-8")
    policies = block_of(RESULTS.read_text(encoding="utf-8"), "policies")
    draw(rows_of(policies), ROOT / "docs" / "media" / "policies.svg")


if __name__ == "__main__":
    main()
