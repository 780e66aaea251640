"""The paper's experiments in docs/results.md: its table, its figures and its sentences.

`make tables` plays and writes all of it with docs/play_tables.py.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from tables import table

from swarm_logistics_env.report import section
from swarm_logistics_env.report.drawing import images
from swarm_logistics_env.report.figures import indicator_figures
from swarm_logistics_env.report.tables import claims, sentences
from swarm_logistics_env.spi import relative_change
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparison import Setting
from swarm_logistics_env.studies.measures import Agreement, agreement
from swarm_logistics_env.studies.presets import PAPER
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import Cell, Verdict, grouped

SEEDS, SEEDS_WHERE_SKEWED = 20, 100
NO_DRIFT = {"heading_drift": 0.0}
FAULTS = {
    "removed": "robots removed",
    "FM1": "FM1 (always tells timer 0)",
    "FM2": "FM2 (never picks up)",
    "FM3": "FM3 (neither sends nor hears)",
    "FM3_send": "FM3_send (sends nothing, but hears; chosen after the tables were seen)",
    "FM4": "FM4 (delivers nothing)",
}


def paper_studies(out: Path, first_seed: int) -> tuple[Study, ...]:
    """Return the paper's study in parts: the faults, where P is skewed, with more seeds.

    No family of claims is divided: FT and R are asked of faults only, S, A and change of the rest.
    The third part is the other reading of FM3, the last two are the first two without drift.
    """
    rest: dict[str, object] = {"seeds": SEEDS, "faults": ()}
    faults = {"seeds": SEEDS_WHERE_SKEWED, "sizes": (), "parameters": (), "ablations": ()}
    send = [{"title": "Table II, another reading of FM3", "modes": ["FM3_send"]}]
    sizes = [int(setting.value) for setting in PAPER.performance if setting.kind == "size"]
    large = [{"values": sizes, "scenario": {"preset": "paper_scalability", **NO_DRIFT}}]
    parts = {
        "paper": rest,
        "paper-faults": faults,
        "paper-send": {**faults, "faults": send},
        "paper-no-drift": {**rest, "scenario": NO_DRIFT, "sizes": large, "ablations": ()},
        "paper-faults-no-drift": {**faults, "seeds": SEEDS, "scenario": NO_DRIFT},
    }
    return tuple(
        Study.preset("paper", out=out / name, first_seed=first_seed, **fields)
        for name, fields in parts.items()
    )


def paper_block(parts: Sequence[StudyResults]) -> str:
    """Return the paper's table: P of the paper beside ours, and how well they agree."""
    with_drift = _published_cells(parts[:3])
    found = _agreement(with_drift)
    send = _agreement(with_drift, reading="FM3_send")
    exact = _agreement(_published_cells(parts[3:]))
    missed = {cell.arm.setting for cell in found.misses}
    rows = [
        _row(label, [with_drift[level] for level in levels], missed)
        for label, levels in _paper_rows(with_drift)
    ]
    rows += [
        (
            f"without taxis, N = {cell.arm.setting.value:g}",
            "",
            section.mean_p(cell),
            "",
            str(cell.n_seeds),
        )
        for cell in parts[0].cells
        if cell.arm.setting.name == "random-walk"
    ]
    nearness = {
        "as shipped": found,
        "FM3_send in the place of FM3": send,
        "headings that do not drift": exact,
    }
    lines = [
        *_summary(parts),
        table(("", "paper's P", "ours, mean [95 %]", "ours / paper's", "seeds"), rows),
        "",
        f"Seeds from {parts[0].plan.seeds[0]:,} on, on which nothing was fitted.",
        f"{len(missed)} of the paper's values lie outside the 95 % prediction interval of one run",
        "of ours (bold).",
        *_notes(with_drift),
        "",
        table(
            (
                "reading",
                r"mean of \|ln(ours / paper's)\|",
                "typically off by",
                "paper's values in the 95 % interval of our mean",
            ),
            [(reading, *_near(one)) for reading, one in nearness.items()],
        ),
        "",
        "Without drift the deliveries of all conditions of this table together change by",
        f"{_change(parts)}, over {SEEDS} seeds.",
    ]
    return "\n".join(lines)


def _notes(cells: Mapping[Setting, Cell]) -> list[str]:
    if not any(cell.saturated for cell in cells.values()):
        return []
    return [
        f"{section.SATURATED}: in some run every item was delivered, so this P is capped. A",
        "verdict that rests on it is given only where a larger P could not turn it.",
    ]


def _published_cells(parts: Sequence[StudyResults]) -> dict[Setting, Cell]:
    """Return the cells with a published value in the order of the paper's tables."""
    kinds = ["size", "fault", "parameter"]
    cells = [
        cell
        for part in parts
        for cell in part.cells
        if cell.counted or (cell.arm.setting.name == "FM3_send")
    ]
    cells.sort(key=lambda cell: kinds.index(cell.arm.setting.kind))
    by_setting = grouped(cells, lambda cell: cell.arm.setting)
    modes = list(FAULTS)

    def place(setting: Setting) -> int:
        return modes.index(setting.name) if setting.kind == "fault" and setting.value else -1

    found = {setting: here[0] for setting, here in by_setting.items()}
    faults = sorted((s for s in found if s.kind == "fault"), key=place)
    order = [s for kind in kinds for s in (faults if kind == "fault" else found) if s.kind == kind]
    return {setting: found[setting] for setting in order}


def _agreement(cells: Mapping[Setting, Cell], reading: str = "FM3") -> Agreement:
    left_out = {"FM3", "FM3_send"} - {reading}
    return agreement("", [cell for s, cell in cells.items() if s.name not in left_out])


def _near(found: Agreement) -> tuple[str, str, str]:
    """Return how near the published values are to ours."""
    off = found.mean_log_error or 0.0
    return f"{off:.3f}", f"{math.expm1(off):.0%}", f"{len(found.met)} of {len(found.cells)}"


def _change(parts: Sequence[StudyResults]) -> str:
    """Return the relative change of P without drift, over the cells and seeds of both."""
    drift, exact = _published_cells(parts[:2]), _published_cells(parts[3:])
    both = [one for one in exact if one in drift]
    totals = [sum(cells[one].by_seed[:SEEDS] for one in both) for cells in (drift, exact)]
    found = relative_change(*totals)
    low, high = found.low or 0.0, found.high or 0.0
    told = f"{100 * found.value:+.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
    return f"{told}: no clear effect" if low <= 0.0 <= high else told


def _paper_rows(cells: Mapping[Setting, Cell]) -> list[tuple[str, list[Setting]]]:
    """Return the rows: a label, and the levels that stand side by side in it."""
    rows = []
    for levels in grouped(cells, lambda level: level.name).values():
        one_each = levels[0].kind == "size"
        beside = [[level] for level in levels] if one_each else [levels]
        rows += [(_label(some, cells[some[0]]), some) for some in beside]
    return rows


def _label(levels: list[Setting], first: Cell) -> str:
    values = ", ".join(f"{level.value:g}" for level in levels)
    kind, name = levels[0].kind, levels[0].name
    if kind == "size":
        return f"N = {values} ({first.arm.case.scenario.model_dump()['n_items']} items)"
    if kind == "parameter":
        return f"{name} = {values}" + (" m" if name.endswith("_width") else "")
    return f"{FAULTS[name]}, m = {values}" if levels[0].value else "no fault"


def _row(label: str, cells: list[Cell], missed: set[Setting]) -> tuple[str, ...]:
    published = [
        f"**{cell.published:g}**" if cell.arm.setting in missed else f"{cell.published:g}"
        for cell in cells
    ]
    ratios = [f"{cell.mean.value / cell.published:.2f}" for cell in cells if cell.published]
    seeds = dict.fromkeys(str(cell.n_seeds) for cell in cells)
    ours = map(section.mean_p, cells)
    return label, *map(", ".join, (published, ours, ratios, seeds))


def sentences_block(parts: Sequence[StudyResults]) -> str:
    """Return each sentence of the paper with the verdicts on the claims that it makes."""
    of_text, beside, other = _claims(parts)
    rows = [
        *sentences(PAPER, of_text),
        *claims("(P falls without taxis)", beside),
        *claims("(the same of FM3_send)", other),
    ]
    lines = [
        '"Up to m robots" is read as "and not with m + 1".',
        "",
        f"FT and R have {len(parts[1].plan.seeds)} seeds, all else {len(parts[0].plan.seeds)}, the",
        "same ones in all conditions; N is 25 but for S. Intervals are of 95 % each and hold one",
        "by one; verdicts hold for all claims on one indicator together (Holm). So a claim may be",
        'open although its interval lies on one side: "leans for" or "leans against" says which.',
        '"change" is that of P without taxis, relative to P with it.',
        "",
        table(("the paper's text", "claim", "ours [95 %]", "verdict"), rows),
    ]
    return "\n".join(lines)


def _summary(parts: Sequence[StudyResults]) -> list[str]:
    """Return how many claims are supported and contradicted, and what that means."""
    of_text, beside, other = _claims(parts)
    counted = Counter(map(_said, of_text))
    of = Counter(_about(test) for test in of_text if _said(test) == "refuted")
    about = ", ".join(f"{count} on {what}" for what, count in of.most_common())
    about = about and f" ({about})"
    sure = sum(_about(test) == "warehouse_width" for test in of_text)
    return [
        f"Of {len(of_text)} claims of the paper's text this re-implementation supports",
        f"{counted['supported']} and contradicts {counted['refuted']}{about};",
        f"{counted['open']} are open. {sure} of",
        "those supported, on the warehouse's width, cannot fail, as A cannot fall below 0 where a",
        f"parameter at least doubles. {len(beside)} more, that P falls without taxis, are not in",
        f"the text: {_counted(beside)}. Of FM3_send, the other reading of FM3: {_counted(other)}.",
        PAPER.whose,
        "",
    ]


def _claims(parts: Sequence[StudyResults]) -> tuple[list[Verdict], ...]:
    """Return the verdicts on claims: of the paper's text, beside it, and with FM3_send."""
    tests = [test for part in parts[:2] for test in part.verdicts if test.claim]
    told = {asked for questions in PAPER.sentences.values() for asked in questions}
    of_text = [test for test in tests if test.compared.question in told]
    beside = [test for test in tests if test not in of_text]
    return of_text, beside, [test for test in parts[2].verdicts if test.claim]


def _counted(tests: Sequence[Verdict]) -> str:
    counted = Counter("contradicted" if _said(t) == "refuted" else _said(t) for t in tests)
    return ", ".join(f"{count} {said}" for said, count in counted.items())


def _said(test: Verdict) -> str:
    return section.counted_as(test, test.claim_verdict_holm)


def _about(test: Verdict) -> str:
    setting = test.compared.changed.setting
    return "N" if setting.kind == "size" else setting.name


def draw_figures(parts: Sequence[StudyResults], media: Path) -> None:
    """Draw the paper's figures with its values as crosses and ours with their intervals."""
    for figure in (one for part in parts[:2] for one in indicator_figures(part)):
        if figure.name.startswith(("S-", "FT-", "A-")):
            drawn, _ = images(figure.draw, figure.height)
            (media / f"paper-{figure.name}.svg").write_text(drawn, encoding="utf-8")
