"""The words of files: what names a column, no fault, removed robots, yes, no and no value.

`words.toml` has them, a table for each language.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from pathlib import Path

from .trial import NO_FAULT_WORD, REMOVED_WORD, REPEATED

CELLS = "cells"  # the column of what was measured, of a wide table
MORE_IS_BETTER = "more_is_better"  # for --column, of a performance that is a time by its name
CONSTANTS = ("n_robots", "faulty", "work")  # numbers that may be the same in all trials
TIMES = ("onset", "time", "time_to_finish", "duration")  # columns
# What programs and people write for no value: a fault so written may be none.
NOT_KNOWN = ("", "na", "n/a", "nan", "null")
_LANGUAGES = tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))


def _words(kind: str, *languages: str) -> tuple[str, ...]:
    """Return the words of a kind in some languages, of all if none is named."""
    texts = [_LANGUAGES[language].get(kind, "") for language in languages or _LANGUAGES]
    return tuple(word.replace("_", " ") for text in texts for word in text.split())


def _words_for(column: str) -> tuple[str, ...]:
    """Return the words that name a column, each once."""
    texts = [language.get("columns", {}).get(column, "") for language in _LANGUAGES.values()]
    return tuple(dict.fromkeys(word for text in texts for word in text.split()))


_ENGLISH_COLUMNS: dict[str, str] = _LANGUAGES["en"]["columns"]
COLUMN_NAMES = {column: _words_for(column) for column in _ENGLISH_COLUMNS}
MEANING = {word: column for column, words in COLUMN_NAMES.items() for word in (column, *words)}
# Those of which a column of another name may be a misspelled one.
ENGLISH_NAMES = [
    word for column, words in _ENGLISH_COLUMNS.items() for word in (column, *words.split())
]
NO_FAULT_WORDS = frozenset(_words("no_fault"))
REMOVED_WORDS = frozenset(_words("removed"))
# Those of the words above that are English.
_ENGLISH = {*ENGLISH_NAMES, *_words("no_fault", "en"), *_words("removed", "en")}
YES_WORDS = frozenset(_words("yes"))
NO_WORDS = frozenset(
    (
        *_words("no"),
        *_words("not"),
        *(f"{no} {yes}" for no in _words("not") for yes in YES_WORDS if len(yes) > 1),
    )
)
TOTALS = frozenset(_words("total"))
REPETITIONS = _words("repetition")
_NO_NUMBER = frozenset((*NOT_KNOWN, *_words("missing")))


def plain(text: str) -> str:
    """Return a text in small letters, without accents, with a blank for each sign between words."""
    decomposed = unicodedata.normalize("NFKD", text.casefold())
    letters = "".join(sign for sign in decomposed if unicodedata.category(sign) != "Mn")
    return re.sub(r"[\s_-]+", " ", letters).strip(" !")


def means_no_number(text: str) -> bool:
    """Return whether a cell stands for a number that is not there."""
    return text.casefold() in _NO_NUMBER


def usual_fault(name: str) -> str | None:
    """Return what a fault is called by a word that is known in any language; None: it is not."""
    word = plain(name)
    if word in NO_FAULT_WORDS or name == "-":
        return NO_FAULT_WORD
    if word in REMOVED_WORDS:
        return REMOVED_WORD
    return REPEATED if word in (REPEATED, "none again") else None


def says_yes(cell: str) -> bool | None:
    """Return what a word says; None: it is neither for yes nor for no."""
    word = plain(cell)
    if word in YES_WORDS:
        return True
    return False if word in NO_WORDS else None


def is_translated(word: str) -> bool:
    """Return whether a word is known in another language than English alone."""
    return word.replace("_", " ") not in _ENGLISH and word.replace(" ", "_") not in _ENGLISH
