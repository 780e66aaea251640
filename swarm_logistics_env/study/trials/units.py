"""Units of time in the names of columns, as "duration [min]", "t_ms" or "minutes to clear"."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from swarm_logistics_env.spi.inputs import IndicatorError

from .words import TIMES

STEPS = "steps"  # of a simulation, however long
SECONDS = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
# Each unit in words, small letters, in English, German, French, Spanish, Italian and Portuguese.
_WORDS = {
    "us": "us µs μs usec microseconds",
    "ms": "ms msec msecs millis millisecond milliseconds millisekunden millisecondes milisegundos "
    "millisecondi milissegundos",
    "s": "s sec secs second seconds sek sekunde sekunden seconde secondes seg segundo segundos "
    "secondo secondi",
    "min": "min mins minute minutes minuten minuto minutos minuti",
    "h": "h hr hrs hour hours stunde stunden heure heures hora horas",
    "d": "d day days tage jours dias giorni",
    STEPS: "step steps timestep timesteps tick ticks frame frames rounds iterations cycles "
    "schritte pas pasos passi passos",
}
UNIT_OF = {word: unit for unit, words in _WORDS.items() for word in words.split()}
# Words that may mean something else: units in brackets, at the end of a name, or before these.
_AMBIGUOUS = frozenset(
    ("us", "s", "second", "seg", "min", "h", "hr", "d", "day", "days", "step", "tick", "frame")
)
_BEFORE = re.compile(
    r"(?i)\s*/|[\s_]+(per|to|until|till|pro|bis|par|por|hasta|fino|ate|até)(?![^\W_])"
)
# What names a time without its unit, also as the end of a word: "makespan", "runtime", "Laufzeit".
_TIME = re.compile(
    r".*(time|zeit|dauer)|times|duration|makespan|latency|delay|temps|duree|durée|tiempo|"
    r"duracion|duración|tempo|durata|duracao|duração"
)
_T = re.compile(r"(?i)t\s*($|[/\[(])")  # the symbol of a time, alone or before its unit
_TOKEN = re.compile(r"\d+(?:[.,]\d+)?|[A-Z]+(?![a-z])|[A-Z]?[^\W\d_A-Z]+")
_BRACKETS = re.compile(r"[\[(]([^\])]*)[\])]")
_COUNT = re.compile(r"\d[\d.,]*[\s_-]*$")
_INVERSE = re.compile(r"\s*(\^|\*\*)?\s*([-−]1\b|⁻¹)")
_PER = frozenset(("per", "pro", "par", "por", "al", "je", "every", "each"))
_OTHER_UNITS = frozenset(("m", "mm", "cm", "dm", "km", "hz"))  # at the end of a name

KNOWN_UNITS = frozenset((*UNIT_OF, *_OTHER_UNITS, "m/s", "%"))


class NamedUnit(NamedTuple):
    """A unit of time in a name.

    Attributes:
        word: as it stands there.
        start: of the word in the name.
        unit: a key of `SECONDS`, or `STEPS`.
    """

    word: str
    start: int
    unit: str


def units_of_times(source: str, names: Mapping[str, str]) -> dict[str, NamedUnit]:
    """Return the units that the names of times have, by what the column is.

    Args:
        source: what messages call the file.
        names: of columns, by what they are.

    Raises:
        IndicatorError: a time has a unit of something else, times have units that cannot be
            converted into each other, or contacts are not per minute.
    """
    units: dict[str, NamedUnit] = {}
    for column in TIMES:
        name = names.get(column, "")
        try:
            unit = unit_of_time(name)
        except ValueError as error:
            raise IndicatorError(
                f"{source}: {name!r} ({column}) has the unit {error}: should have one of "
                f"time, {', '.join(SECONDS)} or steps: rename it, or leave it out by "
                f"--ignore {name!r}"
            ) from None
        if unit:
            units[column] = unit
    in_steps = {column: unit for column, unit in units.items() if unit.unit not in SECONDS}
    if 0 < len(in_steps) < len(units):
        named = " and ".join(repr(names[column]) for column in units)
        raise IndicatorError(
            f"{source}: {named} have times in steps and in others: should have one unit"
        )
    contacts = names.get("contacts", "")
    if not is_per_minute(contacts):
        raise IndicatorError(f"{source}: {contacts!r}: contacts should be per robot and minute")
    return units


def unit_of_time(name: str) -> NamedUnit | None:
    """Return the unit in the name of a time; None: it names none.

    Raises:
        ValueError: it names two, or what stands for a unit is none of time.
    """
    units = [*_units_in(name)] or [*_units_in(name, by_it=True)]  # "t / min", as in physics
    if len({unit.unit for unit in units}) > 1:
        raise ValueError(f"{units[0].word!r} and {units[1].word!r}")
    for unit in units:
        if counted := _COUNT.search(name, 0, unit.start):  # "[10 ms]"
            raise ValueError(repr(counted[0] + unit.word))
    if units:
        return units[0]
    in_brackets = [brackets[0] for brackets in _BRACKETS.finditer(name) if brackets[1].strip()]
    last_words = [token[0] for token in _TOKEN.finditer(name)][-1:]
    for text in (*in_brackets, *last_words):
        if text in in_brackets or text.casefold() in _OTHER_UNITS:
            raise ValueError(repr(text))
    return None


def is_per_minute(name: str) -> bool:
    """Return whether a name counts by no unit of time but minutes, as "contacts [1/min]"."""
    return {unit.unit for unit in _units_in(name, by_it=True)} <= {"min"}


def word_of_time(name: str) -> str | None:
    """Return the word by which a name is one of a time, as of "clear time"; None: there is none.

    "boxes per minute", "boxes/h" and "boxes in 10 min" are no times; "seconds per box" is one.
    """
    for unit in _units_in(name):
        return unit.word
    tokens = [*_TOKEN.finditer(name)]
    for number, token in enumerate(tokens):
        is_time = _TIME.fullmatch(token[0].casefold()) is not None
        if is_time and not _is_divided_by(name, tokens, number):
            return token[0]
    return name[:1] if _T.match(name) else None


def without_unit(word: str) -> str:
    """Return a name, in small letters with "_" for blanks, without ms, s, min or h at its end."""
    stem, _, last = word.rpartition("_")
    # "time_step" and "time_us" may be something else.
    return stem.removesuffix("_in") if UNIT_OF.get(last) in ("ms", "s", "min", "h") else word


def in_seconds(name: str, unit: NamedUnit) -> str:
    """Return a name with seconds for its unit."""
    return f"{name[: unit.start]}s{name[unit.start + len(unit.word) :]}"


def _units_in(name: str, *, by_it: bool = False) -> Iterator[NamedUnit]:
    """Yield the units of time in a name: those that something is counted by, or the others."""
    tokens = [*_TOKEN.finditer(name)]
    for number, token in enumerate(tokens):
        word = token[0].casefold()
        if word in UNIT_OF and _is_divided_by(name, tokens, number) == by_it:
            is_last = number == len(tokens) - 1
            is_before = number == 0 and _BEFORE.match(name, token.end()) is not None
            is_unit = is_last or is_before or word not in _AMBIGUOUS
            if by_it or is_unit or _bracket(name, token.start()):
                yield NamedUnit(token[0], token.start(), UNIT_OF[word])


def _bracket(name: str, position: int) -> int:
    """Return where the bracket begins that holds a position; 0: none does."""
    return max(
        (match.start() for match in _BRACKETS.finditer(name) if position in range(*match.span())),
        default=0,
    )


def _is_divided_by(name: str, tokens: list[re.Match[str]], number: int) -> bool:
    """Return whether something is counted by a word of a name, or within the time that it names."""
    token = tokens[number]
    start = _bracket(name, token.start())
    before = name[start : token.start()].rstrip(" 0123456789.,([")
    is_counted = _COUNT.search(name, 0, token.start()) is not None  # "boxes (600 s)"
    if is_counted or _INVERSE.match(name, token.end()) or before.endswith("/"):
        return True
    words = [earlier[0].casefold() for earlier in tokens[:number] if earlier.start() >= start]
    return bool(_PER & {*words[-4:]})
