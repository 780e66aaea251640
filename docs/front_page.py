"""Writes the README's numbers from the tables of docs/results.md, and draws their picture.

`python docs/front_page.py`; `make tables` calls it. Nothing is played here: `make tables` records
that page.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from tables import block_of, rewritten

DOCS = Path(__file__).parent
README, RESULTS = DOCS.parent / "README.md", DOCS / "results.md"
MEDIA = DOCS / "media"

_REFERENCE = "swarm-dt"  # the paper's controller
_LEARNED = "ppo-"
_TRAINED = "ppo-robust"  # among faults: whether it bears them is told, whatever came of it
_STOCK = "homing-stock"
_NUMBER = r"-?(?:[\d.,]+|∞)"
_VALUE = re.compile(rf"({_NUMBER}) \[({_NUMBER}), ({_NUMBER})\]")


class Value(NamedTuple):
    """A number of a table as it stands there, and with the limits of its 95 % interval."""

    text: str
    value: float
    low: float
    high: float


Rows = Mapping[str, Mapping[str, Value]]  # by the row's label and the column's heading


def rows_of(block: str) -> Rows:
    """Return the values with intervals in the table of a block."""
    head, _, *lines = [line for line in block.splitlines() if line.startswith("|")]
    columns = [_plain(cell) for cell in head.split("|")[2:-1]]
    found: dict[str, dict[str, Value]] = {}
    for line in lines:
        label, *cells = [cell.strip() for cell in line.split("|")[1:-1]]
        matches = {name: _VALUE.match(cell) for name, cell in zip(columns, cells, strict=True)}
        found[label] = {
            name: Value(match[0], *(float(part.replace("∞", "inf")) for part in match.groups()))
            for name, match in matches.items()
            if match
        }
    return found


def _plain(name: str) -> str:
    """Return a policy's name without how many trainings it stands for."""
    bare = name.strip(" `")
    return bare.partition(",")[0] if bare.startswith(_LEARNED) else bare


_MODES = {
    "FM1": "tells a false timer",
    "FM2": "lifts nothing",
    "FM3": "radio dead",
    "FM4": "delivers nothing",
}
_PANELS = {
    "P, N = 25": "P, N = 25\n[items in 500 s]",
    "S, N 25 -> 100": "S, scalability\nN 25 → 100",
}
_PANELS |= {f"R, {mode}, m = 2": f"R, {mode}\n{what}" for mode, what in _MODES.items()}

# -- what one finds out -------------------------------------------------------------------------


def findings(page: str) -> str:
    """Return what the tables show, as a list: the numbers stand beside their intervals."""
    rows = rows_of(block_of(page, "policies"))
    seeds, times, slow = (
        _seeds(block_of(page, name)) for name in ("policies", "clearing", "leans")
    )
    told = [
        *_clearing(block_of(page, "clearing")),
        *_learned(rows),
        *_slow_lifting(block_of(page, "leans")),
        *_faults(rows),
        *_sizes(rows),
        *_paper(block_of(page, "paper")),
    ]
    lines = [f"* {one}" for one in told]
    note = (
        f"95 % intervals: {seeds} seeds ({times} for times, {slow} for slow lifting), of networks "
        "over trainings too."
    )
    return "\n".join([*lines, "", note])


def _seeds(block: str) -> int:
    (found,) = re.findall(r"(\d+) seeds from ", block)
    return int(found)


def _clearing(block: str) -> Iterator[str]:
    """Yield how fast the best learned swarm clears the paper's warehouse."""
    times = {name: row["no fault"] for name, row in rows_of(block).items()}
    times = {_plain(name): one for name, one in times.items()}
    best = min((name for name in times if name.startswith(_LEARNED)), key=lambda n: times[n].value)
    ratio = times[_REFERENCE].value / times[best].value
    beside = ""
    if script := times.get(_STOCK):
        beside = f"; `{_STOCK}`, a script, in {script.text} s"
    yield (
        f"**The paper's warehouse, cleared {ratio:.0f} times as fast**: `{best}` delivers its 60 "
        f"items in {times[best].text} s, the paper's Swarm D-T in {times[_REFERENCE].text} s"
        f"{beside} (lifting takes no time)."
    )


def _learned(rows: Rows) -> Iterator[str]:
    p = rows["P, N = 25"]
    best = max((name for name in p if name.startswith(_LEARNED)), key=lambda name: p[name].value)
    yield (
        f"**Where items come back, {p[best].value / p[_REFERENCE].value:.1f} times as many**: "
        f"`{best}` {p[best].text} in 500 s; Swarm D-T {p[_REFERENCE].text}."
    )


def _slow_lifting(block: str) -> Iterator[str]:
    """Yield what becomes of the large numbers where lifting takes time."""
    p = rows_of(block)["lifting takes 1 s"]
    best = max((name for name in p if name.startswith(_LEARNED)), key=lambda name: p[name].value)
    yield (
        f"**They lean on lifting that takes no time**: where it takes 1 s, `{best}` delivers "
        f"{p[best].text}, `homing`, a script, {p['homing'].text}."
    )


def _faults(rows: Rows) -> Iterator[str]:
    """Yield the greatest difference that a failure mode makes."""
    r = {mode: row for mode in _MODES if (row := rows.get(f"R, {mode}, m = 2"))}
    worst = {mode: min(row, key=lambda name: row[name].high) for mode, row in r.items()}
    best = {mode: max(row, key=lambda name: row[name].low) for mode, row in r.items()}
    mode = max(r, key=lambda mode: r[mode][best[mode]].value - r[mode][worst[mode]].value)
    lost, kept = worst[mode], best[mode]
    told = [kept, *(name for name in r[mode] if name.startswith(_TRAINED) and name != kept)]
    others = ", ".join(f"of `{name}` {r[mode][name].text}" for name in told)
    yield (
        f"**One collapses under a fault that another bears**: with two robots in {mode} R of "
        f"`{lost}` is {r[mode][lost].text}, {others}."
    )


def _sizes(rows: Rows) -> Iterator[str]:
    s = rows["S, N 25 -> 100"]
    most = max(s, key=lambda name: s[name].value)
    least = min(s, key=lambda name: s[name].value)
    title = "Four times the robots do not deliver four times as much"
    if max(one.high for one in s.values()) >= 1.0:
        title = "More robots help some swarms more than others"
    yield (
        f"**{title}**: from 25 to 100 S of `{most}` is {s[most].text}, of `{least}` "
        f"{s[least].text}."
    )


def _paper(block: str) -> Iterator[str]:
    pattern = r"Of (\d+) claims .*?\ssupports\s(\d+) and (contradicts \d+ ?.*?);\s(\d+ are open)\."
    for count, supported, contradicts, still in re.findall(pattern, block):
        yield (
            f"**Of {count} claims of the paper's text** this re-implementation, with constants "
            f"that are partly fitted, supports {supported} and {contradicts}; {still}."
        )


def speed(page: str) -> str:
    """Return the sentence on speed, from the table of costs."""
    costs = block_of(page, "costs")
    cells = {
        line.split("|")[1].partition(":")[0].strip(): [c.strip() for c in line.split("|")[2:-1]]
        for line in costs.splitlines()
        if line.startswith("| ")
    }
    arrays = cells["env.step_arrays"]
    (machine,) = re.findall(r"^On (.*), \d+ cores?, Python .*\.$", costs, flags=re.MULTILINE)
    return f"A step of 25 robots takes {arrays[1]} µs on one core of {machine}."


# -- the picture --------------------------------------------------------------------------------


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
                colour = "#d55e00" if name.startswith(_LEARNED) else "#0072b2"
                marker = "s" if name.startswith(_LEARNED) else "o"
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


# -- links --------------------------------------------------------------------------------------

NOTE = "A package index does not show them: relative pictures and links.\n"


def with_address(text: str, address: str | None) -> str:
    """Return the README whose pictures and links lead to a repository, "https://.."; None: as is.

    A package index shows nothing else; relative links stand below a note that says so.
    """
    if address is None:
        return text
    text = re.sub(r'(src="|!\[[^]]*\]\()(?=docs/)', rf"\g<1>{address}/raw/main/", text)
    links = rf"\g<1>{address}/blob/main/"
    return re.sub(r"(?<!!)(\[[^]]+\]\()(?!https://)", links, text.replace(NOTE, ""))


def written() -> str:
    """Return the README as the tables have it, with links to the repository of [project.urls]."""
    project = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    address = project.get("urls", {}).get("Repository")
    page, readme = RESULTS.read_text(encoding="utf-8"), README.read_text(encoding="utf-8")
    blocks = {"findings": findings(page), "speed": speed(page)}
    return with_address(rewritten(readme, blocks), address and address.rstrip("/"))


def main() -> None:
    """Write the README and its pictures."""
    README.write_text(written(), encoding="utf-8")
    page = RESULTS.read_text(encoding="utf-8")
    draw(rows_of(block_of(page, "policies")), MEDIA / "policies.svg")


if __name__ == "__main__":
    main()
