"""The verdict matrix: every question of a study as one sign, policies side by side.

Rows are indicators and failure modes (or parameters), columns the steps: numbers m of faulty
robots, swarm sizes, values. Terminal, HTML page and Markdown draw this one structure.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.spi.verdict_signs import SIGNS
from swarm_logistics_env.studies.indicator_table import Finding, findings_of
from swarm_logistics_env.studies.performance_table import groups_of
from swarm_logistics_env.studies.policy_comparison import judged_policies
from swarm_logistics_env.studies.results import StudyResults

if TYPE_CHECKING:
    import pandas as pd

NOT_ASKED = "·"
_LONGEST_AXIS = 32  # characters; a longer chain of sizes is shortened in its middle
_GAP = "  "


@dataclass(frozen=True)
class MatrixCell:
    """One question asked of one policy: its row in the table of indicators, and that one's number.

    Attributes:
        test: the row.
        number: its place in the table.
    """

    test: Finding
    number: int

    @property
    def verdict(self) -> str:
        """The conclusion on the property: a name in `SIGNS`."""
        return self.test.conclusion or "blocked"

    @property
    def mark(self) -> str:
        """The sign of the verdict."""
        return SIGNS[self.verdict].mark

    @property
    def contradicts(self) -> bool:
        """Whether the verdict contradicts what the study's reference claims."""
        return bool(self.test.claim_verdict_holm == "refuted")


@dataclass(frozen=True)
class MatrixRow:
    """One property under one failure mode, parameter or policy.

    Attributes:
        indicator: its symbol, e.g. "FT".
        factor: what is changed, in words; empty for the swarm size.
        asked: the property, where it is not the indicator's usual one, e.g. "superlinear".
        cells: by policy, one for each step of the block; None: not asked.
    """

    indicator: str
    factor: str
    asked: str
    cells: dict[str, tuple[MatrixCell | None, ...]]

    @property
    def label(self) -> str:
        """What is asked, e.g. "FT FM4", "S superlinear" or "A delivery_width"."""
        if self.asked.startswith("P falls"):  # the factor is the policy in its place
            return f"{self.asked.replace('by more than', '>')}: {self.factor}"
        return " ".join(filter(None, (self.indicator, self.factor, self.asked)))


@dataclass(frozen=True)
class Block:
    """The rows that share their steps.

    Attributes:
        title: heading of the table in the report that holds the numbers.
        axis: the steps in words, e.g. "N 5→10→20" or "m = 1 2 3".
        rows: the questions.
    """

    title: str
    axis: str
    rows: tuple[MatrixRow, ...]


@dataclass(frozen=True)
class VerdictMatrix:
    """All questions of a study.

    Attributes:
        policies: labels, the baseline first.
        blocks: in the order of the report.
    """

    policies: tuple[str, ...]
    blocks: tuple[Block, ...]

    @property
    def legend(self) -> str:
        """The signs that occur, each with its word."""
        found = {cell.verdict for cell in self.cells()}
        return _GAP.join(
            f"{sign.mark} {sign.word}" for name, sign in SIGNS.items() if name in found
        )

    def cells(self) -> Iterator[MatrixCell]:
        """Yield every question of every policy."""
        for block in self.blocks:
            for row in block.rows:
                for cells in row.cells.values():
                    yield from filter(None, cells)


def verdict_matrix(results: StudyResults) -> VerdictMatrix:
    """Return the questions of a study with their verdicts."""
    tests = results.indicators
    # Faults of another swarm or onset, and other parameters, have other steps.
    apart = tests["n_robots"].where(tests["kind"] == "fault", 0)
    tests = tests.assign(
        number=range(len(tests)),
        onset=tests["onset"].fillna(0.0),
        apart=apart.astype(object).where(tests["kind"] != "parameter", tests["factor"]),
    )
    blocks = groups_of(tests, "table", "kind", "onset", "apart")
    made = tuple(_block(table, kind, onset, here) for (table, kind, onset, _), here in blocks)
    return VerdictMatrix(judged_policies(results), made)


def _block(table: str, kind: str, onset: float, tests: pd.DataFrame) -> Block:
    at = list(dict.fromkeys(_step(test) for test in findings_of(tests)))
    rows = []
    # "P falls" and "P falls by more than 33 %" are asked of different swarms.
    for (indicator, factor, asked), here in groups_of(tests, "indicator", "factor", "property"):
        cells: dict[str, list[MatrixCell | None]] = {}
        for number, test in zip(here["number"], findings_of(here)):
            line = cells.setdefault(test.policy, [None] * len(at))
            line[at.index(_step(test))] = MatrixCell(test, number)
        start = f" from {onset:g} s" if onset else ""
        rows.append(
            MatrixRow(
                indicator,
                "" if kind == "size" else f"{factor}{start}",
                _told(indicator, asked, tests),
                {policy: tuple(line) for policy, line in cells.items()},
            )
        )
    order = list(DEFINITIONS)
    rows.sort(key=lambda row: order.index(row.indicator))
    return Block(table, _axis(kind, at), tuple(rows))


def _step(test: Finding) -> tuple[float, float]:
    """Return the values of the factor before and after."""
    return (test.n_robots, test.n_robots) if test.kind == "policy" else (test.before, test.after)


def _told(indicator: str, asked: str, tests: pd.DataFrame) -> str:
    """Return the property where the indicator alone does not say what is asked."""
    several = len(tests.loc[tests["indicator"] == indicator, "property"].unique()) > 1
    usual = asked == DEFINITIONS[indicator].adjectives.get(0.0)
    return "" if usual and not several else asked


def _axis(kind: str, steps: Sequence[tuple[float, float]]) -> str:
    after = " ".join(f"{x:g}" for _, x in steps)
    if kind == "fault":
        return f"m = {after}"
    if kind == "policy":
        return f"N = {after}"
    if kind == "parameter":
        return f"{steps[0][0]:g}→{after}"
    sizes = [f"{steps[0][0]:g}", *(f"{x:g}" for _, x in steps)]
    chain = "N " + "→".join(sizes)
    return chain if len(chain) <= _LONGEST_AXIS else f"N {sizes[0]}→{sizes[1]}→…→{sizes[-1]}"


@dataclass(frozen=True)
class Line:
    """A line of the matrix as it is shown: rows of one factor, which have equal steps.

    Attributes:
        label: what is asked.
        axis: the steps in words; empty where the line above has the same.
        rows: their signs stand one after the other; empty for a heading.
    """

    label: str
    axis: str
    rows: tuple[MatrixRow, ...]

    @property
    def text(self) -> str:
        """Label and steps."""
        return f"{self.label}{_GAP}{self.axis}".rstrip()

    def signs(self, policy: str) -> str:
        """Return the signs of a policy, e.g. "✓✓? ✓✓✗"."""
        return " ".join(
            "".join(cell.mark if cell else NOT_ASKED for cell in row.cells.get(policy, ()))
            for row in self.rows
        )


def matrix_lines(matrix: VerdictMatrix) -> Iterator[Line]:
    """Yield the matrix line by line; FT and R of one failure mode share one."""
    labels = [{row.label for row in block.rows} for block in matrix.blocks]
    for place, block in enumerate(matrix.blocks):
        others = set().union(*(found for other, found in enumerate(labels) if other != place))
        if others & labels[place]:
            yield Line(f"{block.title}:", "", ())
        joined: dict[str, list[MatrixRow]] = {}
        for row in block.rows:
            joined.setdefault(row.label if row.asked else row.factor, []).append(row)
        axis = block.axis
        for rows in joined.values():
            label = rows[0].label
            if len(rows) > 1:
                label = f"{', '.join(row.indicator for row in rows)} {rows[0].factor}".strip()
            yield Line(label, axis, tuple(rows))
            axis = ""


def text_lines(matrix: VerdictMatrix, width: int, most: int | None = None) -> list[str]:
    """Return the matrix for a terminal: a heading, then a line a row.

    Args:
        matrix: to show.
        width: of the terminal; more policies than fit stand in further blocks of lines.
        most: lines at most, rows that do not fit are counted in the last one; None: all lines.
    """
    rows = list(matrix_lines(matrix))
    left = max(len(text) for text in (matrix.legend, *(row.text for row in rows)))
    room = width - left
    names, key = list(matrix.policies), []
    signs = [max(len(row.signs(policy)) for row in rows) for policy in matrix.policies]
    if sum(len(_GAP) + max(len(name), n) for name, n in zip(names, signs)) > room:
        key = [f"({number}) {name}" for number, name in enumerate(names, start=1)]
        names = [f"({number})" for number in range(1, len(names) + 1)]
    widths = [max(len(name), n) for name, n in zip(names, signs)]
    shown: list[list[int]] = [[]]
    for place in range(len(widths)):
        if shown[-1] and sum(len(_GAP) + widths[i] for i in (*shown[-1], place)) > room:
            shown.append([])
        shown[-1].append(place)
    lines = _wrapped(key, width)
    for part in shown:
        lines.append(_line(matrix.legend.ljust(left), [names[i].ljust(widths[i]) for i in part]))
        for row in rows:
            cells = [row.signs(matrix.policies[i]).ljust(widths[i]) for i in part]
            lines.append(_line(row.text.ljust(left), cells))
    if most is not None and len(lines) > most:
        lines = [*lines[: most - 1], f"and {len(lines) - most + 1} lines more: --full"]
    return lines


def _line(label: str, cells: Sequence[str]) -> str:
    return _GAP.join([label, *cells]).rstrip()


def _wrapped(words: Sequence[str], width: int) -> list[str]:
    """Return words on as few lines as hold them; none is broken."""
    lines: list[str] = []
    for word in words:
        if lines and len(lines[-1]) + len(_GAP) + len(word) <= width:
            lines[-1] += _GAP + word
        else:
            lines.append(word)
    return lines
