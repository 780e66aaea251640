"""Faults as people name them, and what the study calls them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from shlex import quote

from .complaints import Complaints
from .table import Cells, Columns
from .trial import NO_FAULT_WORD, REPEATED
from .words import MEANING, NOT_KNOWN, is_translated, plain

ZERO = ("0", "0.0")  # of robots that fail, by a row's word


class FaultNames:
    """What the faults of a file are called in the study.

    Args:
        mapped: what a column is to its name in the file, as somebody says.
        complaints: take a row that names no fault where others do.

    Attributes:
        notes: sentences on what was taken for what.
    """

    def __init__(self, columns: Columns, mapped: Mapping[str, str], complaints: Complaints) -> None:
        self.notes = [*_notes_on_words(columns, mapped)]
        self._names = {"": NO_FAULT_WORD}
        fault = columns.by_meaning.get("fault")
        if fault is None:
            return
        faulty = columns.by_meaning.get("faulty")
        robots = faulty.texts if faulty else [""] * len(fault.texts)  # that fail, in each row
        counts = Counter(fault.texts)
        faults = sorted(counts, key=lambda name: (-counts[name], name))
        # Each fault in small letters to how most rows have it.
        spelled = {name.casefold(): name for name in reversed(faults)}
        harmful = {name.casefold() for name, n in zip(fault.texts, robots) if n not in ZERO}
        harmless = spelled.keys() - harmful if harmful else set[str]()
        for name in faults:
            self._names[name] = fault.usual_faults[name] or spelled[name.casefold()]
            if name.casefold() in NOT_KNOWN:
                with complaints.noted():
                    _refuse_unnamed(fault, name, complaints)
                self._names[name] = NO_FAULT_WORD
                shown = repr(name) if name else "An empty cell"
                self.notes.append(f"{shown} in {fault.name!r} is taken for no fault.")
            elif self._names[name] not in (NO_FAULT_WORD, REPEATED) and name.casefold() in harmless:
                self._names[name] = NO_FAULT_WORD
                self.notes.append(
                    f"The fault {name!r} is taken for no fault, as no robot fails by it; "
                    f"--value fault:{name}={NO_FAULT_WORD} says so."
                )
            elif name not in spelled.values():
                self.notes.append(
                    f"The faults {spelled[name.casefold()]} and {name} are taken for one."
                )
        self.notes += _notes_on_misspelled(Counter(self[name] for name in fault.texts))

    def __getitem__(self, name: str) -> str:
        """Return what a fault is called, by its cell."""
        return self._names[name]

    @property
    def any_fails(self) -> bool:
        """Whether robots fail in some trial."""
        return any(name not in (NO_FAULT_WORD, REPEATED) for name in self._names.values())


def _notes_on_words(columns: Columns, mapped: Mapping[str, str]) -> Iterator[str]:
    """Yield which words of other languages were recognised.

    Args:
        mapped: what a column is to its name in the file, as somebody says.
    """
    words = dict[str, str]()
    for meaning, cells in columns.by_meaning.items():
        word = cells.name.bare
        if cells.name not in mapped.values() and word in MEANING and is_translated(word):
            words[cells.name] = "robots" if meaning == "n_robots" else meaning
    fault = columns.by_meaning.get("fault")
    if fault:
        words |= {
            name: usual
            for name, usual in fault.usual_faults.items()
            if usual and name != "-" and is_translated(plain(name))
        }
    if words:
        pairs = ", ".join(f"{word!r} for {usual}" for word, usual in words.items())
        yield f"Words taken for ours: {pairs}."


def _refuse_unnamed(fault: Cells, name: str, complaints: Complaints) -> None:
    """Refuse a row that names no fault where others do, unless it says that no robot failed."""
    for row in complaints.missing.get(fault.name, ()):
        if fault.texts[row] == name:
            replacement = quote(f"{fault.name}:{name}={NO_FAULT_WORD}")
            raise fault.error(
                row,
                f"should name what failed, as other rows do, or be {NO_FAULT_WORD}; --value "
                f"{replacement} says so of all such cells, unless a group has its name in its "
                "first row alone",
            )


def _notes_on_misspelled(counts: Counter[str]) -> Iterator[str]:
    """Yield the faults of one row whose names are nearly those of faults of several rows."""
    frequent = sorted(name for name, count in counts.items() if count > 1)
    for name, count in sorted(counts.items()):
        similar = get_close_matches(name, frequent, n=1, cutoff=0.8)
        if count == 1 and similar:
            yield (
                f"The fault {name!r} stands in one row alone: if {similar[0]!r} is meant, "
                f"--value {quote(f'fault:{name}={similar[0]}')} says so."
            )
