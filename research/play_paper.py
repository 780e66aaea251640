"""The paper's experiments in docs/results.md: its table, its figures and its sentences.

`make tables` plays and writes all of it with `play_tables`.
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
from more_itertools import map_reduce

from research.tables import percent_change, side, signed_percent, table
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.report.drawing import svg_image
from swarm_logistics_env.study.report.figures import indicator_figures
from swarm_logistics_env.study.report.tables import claims, sentences
from swarm_logistics_env.study.verdicts.agreement import Agreement, agreement
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.reference import PAPER
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import UNDEFINED, Verdict

SEEDS = 20
SEEDS_WHERE_SKEWED = 100
NO_DRIFT = {"heading_drift": 0.0}
KINDS = ("size", "fault", "parameter")
FAULTS = {
    "removed": "robots removed",
    "FM1": "FM1 (always tells timer 0)",
    "FM2": "FM2 (never picks up)",
    "FM3": "FM3 (neither sends nor hears)",
    "FM3_send": "FM3_send (sends nothing, but hears; chosen after the tables were seen)",
    "FM4": "FM4 (delivers nothing)",
}
Cells = Mapping[Setting, Cell]


def paper_studies(out: Path, first_seed: int) -> tuple[Study, ...]:
    """Return the paper's study in parts: the faults, where P is skewed, with more seeds.

    No family of claims is divided: FT and R are asked of faults only, S, A and change of the rest.
    The third part is the other reading of FM3, the last two are the first two without drift.
    """
    without_faults: dict[str, object] = {"seeds": SEEDS, "faults": ()}
    faults = {"seeds": SEEDS_WHERE_SKEWED, "sizes": (), "parameters": (), "ablations": ()}
    send = [{"title": "Table II, another reading of FM3", "modes": ["FM3_send"]}]
    sizes = [int(setting.value) for setting in PAPER.performance if setting.kind == "size"]
    large = [{"values": sizes, "scenario": {"preset": "paper_scalability", **NO_DRIFT}}]
    parts = {
        "paper": without_faults,
        "paper-faults": faults,
        "paper-send": {**faults, "faults": send},
        "paper-no-drift": {**without_faults, "scenario": NO_DRIFT, "sizes": large, "ablations": ()},
        "paper-faults-no-drift": {**faults, "seeds": SEEDS, "scenario": NO_DRIFT},
    }
    return tuple(
        Study.preset("paper", out=out / name, first_seed=first_seed, **fields)
        for name, fields in parts.items()
    )


def paper_block(parts: Sequence[StudyResults]) -> str:
    """Return the paper's table: P of the paper beside ours, and how well they agree."""
    with_drift = _published_cells(parts[:3])
    exact = _published_cells(parts[3:])
    as_shipped = _agreement(with_drift)
    rows = list(_rows(with_drift.values(), as_shipped.misses))
    rows += [
        (f"without taxis, N = {c.arm.setting.value:g}", "", section.mean_p(c), "", str(c.n_seeds))
        for c in parts[0].cells
        if c.arm.setting.name == "random-walk"
    ]
    measures = (
        "reading",
        "mean of |ln(ours / paper's)|",
        "typically off by",
        "paper's values in the 95 % interval of our mean",
    )
    readings = [
        ("as shipped", *_nearness(as_shipped)),
        ("FM3_send in the place of FM3", *_nearness(_agreement(with_drift, reading="FM3_send"))),
        ("headings that do not drift", *_nearness(_agreement(exact))),
    ]
    return f"""\
{_summary(parts)}

{table(("", "paper's P", "ours, mean [95 %]", "ours / paper's", "seeds"), rows)}

Seeds from {parts[0].plan.seeds[0]:,} on, on which nothing was fitted.
{len(as_shipped.misses)} of the paper's values lie outside the 95 % prediction interval of one run
of ours (bold).
{section.SATURATED}: in some run every item was delivered, so this P is capped. A
verdict that rests on it is given only where a larger P could not turn it.

{table(measures, readings)}

Without drift the deliveries of all conditions of this table together change by
{_change(_published_cells(parts[:2]), exact)}, over {SEEDS} seeds."""


def _published_cells(parts: Iterable[StudyResults]) -> Cells:
    """Return the cells with a published value in the order of the paper's tables."""
    modes = list(FAULTS)

    def position(cell: Cell) -> tuple[int, int]:
        kind, name, value, *_ = cell.arm.setting
        return KINDS.index(kind), modes.index(name) if kind == "fault" and value else -1

    cells = [cell for part in parts for cell in part.cells]
    published = [cell for cell in cells if cell.counted or cell.arm.setting.name == "FM3_send"]
    by_setting: dict[Setting, Cell] = {}
    for cell in sorted(published, key=position):
        by_setting.setdefault(cell.arm.setting, cell)
    return by_setting


def _agreement(cells: Cells, reading: str = "FM3") -> Agreement:
    excluded = {"FM3", "FM3_send"} - {reading}
    return agreement("", [cell for setting, cell in cells.items() if setting.name not in excluded])


def _nearness(paper: Agreement) -> tuple[str, str, str]:
    """Return how near the published values are to ours."""
    error = paper.mean_log_error or 0.0
    return f"{error:.3f}", f"{math.expm1(error):.0%}", f"{len(paper.met)} of {len(paper.cells)}"


def _change(drift: Cells, exact: Cells) -> str:
    """Return the relative change of P without drift, over the cells and seeds of both."""
    settings = [setting for setting in exact if setting in drift]
    totals = (
        np.sum([cells[setting].by_seed[:SEEDS] for setting in settings], axis=0)
        for cells in (drift, exact)
    )
    change = percent_change(*totals)
    text = signed_percent(change, 1)
    return text if side(change) else f"{text}: no clear effect"


def _rows(cells: Iterable[Cell], missed: Sequence[Cell]) -> Iterator[tuple[str, ...]]:
    """Yield the rows, in which the levels of a fault or a parameter stand side by side."""
    by_factor: dict[str, list[Cell]] = map_reduce(cells, lambda cell: cell.arm.setting.name)
    for levels in by_factor.values():
        is_size = levels[0].arm.setting.kind == "size"
        for row in [[level] for level in levels] if is_size else [levels]:
            published = [f"**{c.published:g}**" if c in missed else f"{c.published:g}" for c in row]
            ratios = [f"{c.mean.value / c.published:.2f}" for c in row if c.published]
            seeds = dict.fromkeys(str(c.n_seeds) for c in row)
            columns = published, map(section.mean_p, row), ratios, seeds
            yield _label(row), *map(", ".join, columns)


def _label(row: Sequence[Cell]) -> str:
    kind, name, level, *_ = row[0].arm.setting
    values = ", ".join(f"{cell.arm.setting.value:g}" for cell in row)
    if kind == "size":
        n_items = row[0].arm.case.scenario.model_dump()["n_items"]
        return f"N = {values} ({n_items} items)"
    if kind == "parameter":
        unit = " m" if name.endswith("_width") else ""
        return f"{name} = {values}{unit}"
    return f"{FAULTS[name]}, m = {values}" if level else "no fault"


def sentences_block(parts: Sequence[StudyResults]) -> str:
    """Return each sentence of the paper with the verdicts on the claims that it makes."""
    of_text, without_taxis, fm3_send = _claims(parts)
    rows = [
        *sentences(PAPER, of_text),
        *claims("(P falls without taxis)", without_taxis),
        *claims("(the same of FM3_send)", fm3_send),
    ]
    seeds = f"FT and R: {len(parts[1].plan.seeds)} seeds, all else {len(parts[0].plan.seeds)}."
    return table(("the paper's text", "claim", "ours [95 %]", "verdict"), rows, seeds)


def claim_rows(parts: Sequence[StudyResults]) -> Iterator[tuple[str, str, str]]:
    """Yield what each claim of the text is on, the claim, and its verdict."""
    of_text, _, _ = _claims(parts)
    for test, (_, claim, *_) in zip(of_text, claims("", of_text)):
        subject = "N" if test.after.kind == "size" else test.after.name
        yield subject, claim, _verdict(test)


def _summary(parts: Sequence[StudyResults]) -> str:
    """Return how many claims are supported and contradicted, and what that means."""
    of_text, without_taxis, fm3_send = _claims(parts)
    counts = Counter(map(_verdict, of_text))
    contradicted = Counter(
        subject for subject, _, verdict in claim_rows(parts) if verdict == "contradicted"
    )
    subjects = ", ".join(f"{count} on {subject}" for subject, count in contradicted.most_common())
    about = f" ({subjects})" if subjects else ""
    return f"""\
Of {len(of_text)} claims of the paper's text this re-implementation supports
{counts["supported"]} and contradicts {counts["contradicted"]}{about};
{counts["open"]} are open; {counts["untestable"]}, on the
warehouse's width, are untestable: A cannot fall below 0 where a
parameter at least doubles. {len(without_taxis)} more, that P falls without taxis, are not in
the text: {_counts(without_taxis)}. Of FM3_send, the other reading of FM3: {_counts(fm3_send)}.
{PAPER.whose}"""


def _claims(parts: Sequence[StudyResults]) -> tuple[list[Verdict], list[Verdict], list[Verdict]]:
    """Return the verdicts on claims: of the paper's text, without taxis, and with FM3_send."""
    tests = [test for part in parts[:2] for test in part.verdicts if test.claim]
    of_text = [test for test in tests if test.compared.question in PAPER.claims]
    without_taxis = [test for test in tests if test not in of_text]
    return of_text, without_taxis, [test for test in parts[2].verdicts if test.claim]


def _counts(tests: Iterable[Verdict]) -> str:
    return ", ".join(f"{n} {verdict}" for verdict, n in Counter(map(_verdict, tests)).items())


def _verdict(test: Verdict) -> str:
    """Return the verdict on a claim as the page counts it."""
    word = section.word_to_count(test, test.on_claim.adjusted if test.on_claim else UNDEFINED)
    return "contradicted" if word == "refuted" else word


def draw_figures(parts: Sequence[StudyResults], media: Path) -> None:
    """Draw the paper's figures with its values as crosses and ours with their intervals."""
    for figure in chain.from_iterable(map(indicator_figures, parts[:2])):
        if figure.name.startswith(("S-", "FT-", "A-")):
            svg = svg_image(figure.draw, figure.height, figure.note)
            (media / f"paper-{figure.name}.svg").write_text(svg, encoding="utf-8")
