"""Conditions of two phases in words, and how near each policy is to its critical size."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from swarm_logistics_env import spi
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.collapses import Collapse, Edge

from .section import NOTHING, P_LEVEL, Section, bracketed, fixed, plural

_MOST_CONDITIONS = 2  # that a note of the answer names


def collapsed_in_words(
    named: Sequence[Collapse], *, names_policies: bool, most: int | None = _MOST_CONDITIONS
) -> str:
    """Return which share of the runs collapsed where, e.g. "at N = 128 in 16 % [10, 23]".

    Args:
        names_policies: whether to say of which policy.
        most: how many conditions are named, those with the largest shares; None: all.
    """
    ordered = sorted(named, key=lambda collapse: collapse.share.value, reverse=True)
    words = []
    for collapse in ordered[:most]:
        policy = f"of {collapse.cell.policy} " if names_policies else ""
        words.append(
            f"{policy}at {collapse.cell.words} in "
            f"{share_in_words(collapse.share)}{_breaks_in_words(collapse)}"
        )
    left = len(ordered) - len(words)
    listed = ", ".join(words)
    return f"{listed} and {left} conditions more (--full)" if left > 0 else listed


def untestable_in_words(by_reason: Mapping[str, Sequence[Cell]], *, names_policies: bool) -> str:
    """Return which conditions were not tested, and why, e.g. "N = 4 and 2 more (counts ..)"."""
    words = []
    for reason, cells in by_reason.items():
        first = f"of {cells[0].policy} at {cells[0].words}" if names_policies else cells[0].words
        more = f" and {plural(len(cells) - 1, 'condition')} more" if len(cells) > 1 else ""
        words.append(f"{first}{more} ({reason})")
    return ", ".join(words)


def _breaks_in_words(collapse: Collapse) -> str:
    """Return how many of the runs collapsed in mid-run, and when; empty where none is known to."""
    breaks = collapse.breaks
    if not len(breaks):
        return ""
    when = f"after {np.median(breaks):.0f} s (median)"
    return f" (of these {len(breaks)} of {collapse.n_collapsed} in mid-run, {when})"


def share_in_words(share: spi.Interval) -> str:
    """Return a share with its interval, e.g. "16 % [10, 23]"."""
    low, high = (0.0 if end is None else 100.0 * end for end in (share.low, share.high))
    return f"{100.0 * share.value:.0f} % [{low:.0f}, {high:.0f}]"


def edge_sections(edges: Sequence[Edge]) -> Iterator[Section]:
    """Yield how near each policy is to the size at which half of its runs collapse."""
    for edge in edges:
        first = edge.cells[0]
        columns = "N", f"runs collapsed, {P_LEVEL}", "S of all runs", "S of the runs that did not"
        line = (
            f"{critical_size_in_words(edge)} (logistic in log N, quasi-likelihood). Two phases "
            "are named where a test with 5 % of error over the sizes says so; the other sizes are "
            "told by the one that shows them most clearly."
        )
        title = f"{first.policy}: how near the edge, {first.table}"
        yield Section(title, columns, tuple(_rows(edge)), (line,))


def critical_size_in_words(edge: Edge) -> str:
    """Return at which size half of the runs collapse; nothing is told beyond the largest."""
    largest = edge.cells[-1].words
    if edge.size.value > edge.cells[-1].arm.setting.value:
        return f"Less than half of the runs collapse up to {largest}"
    if edge.size.low == 0.0 and edge.size.high == math.inf:
        return (
            f"Half of the runs collapse at about N = {fixed(edge.size.value, 0)}, without "
            "interval: the sizes do not show both that few and that nearly all runs collapse"
        )
    return f"Half of the runs collapse at N = {bracketed(edge.size, 0)}"


def _rows(edge: Edge) -> Iterator[tuple[str, ...]]:
    yield edge.cells[0].words, share_in_words(edge.shares[0]), NOTHING, NOTHING
    runs = [cell.by_seed.ravel() for cell in edge.cells]
    for before, after in pairwise(range(len(edge.cells))):
        of_all = _scalability(edge, runs[before], runs[after], after)
        of_good = _scalability(edge, edge.good_runs[before], edge.good_runs[after], after)
        yield edge.cells[after].words, share_in_words(edge.shares[after]), of_all, of_good


def _scalability(edge: Edge, before: Numbers, after: Numbers, index: int) -> str:
    """Return S from the size before, of means; one that all runs left has none."""
    if not (len(before) and len(after)) or before.mean() <= 0.0:
        return NOTHING
    n_before, n_after = (edge.cells[at].arm.setting.value for at in (index - 1, index))
    gain = after.mean() / before.mean() - 1.0
    return fixed(gain / (n_after / n_before - 1.0), 3)
