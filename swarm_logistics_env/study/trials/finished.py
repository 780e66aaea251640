"""Which trials finished, in the words of those who noted it.

Yes and no are lists of words in English and the languages of most labs, with those that their
spreadsheets write. A word of neither list is refused: a guess would count a trial that was
stopped as one that finished.
"""

from __future__ import annotations

import re
import unicodedata
from shlex import quote

from swarm_logistics_env.spi.inputs import IndicatorError

from .table import Columns
from .trial_columns import bare

_CROSS = "x"  # marks yes, unless another word of the column does
_NOT = ("not", "nicht", "pas", "non", "no", "nao")
# As `_plain` writes them. Words that may mean either, as "terminated", "stopped" and "beendet", are
# in no list.
_YES = {
    "sign": "1 1.0 1,0 ✓ ✔ ✅ ☑",
    "en": "yes y true t ok okay finished done complete completed success successful succeeded "
    "reached solved passed pass",
    "de": "ja j wahr w richtig fertig abgeschlossen erledigt erreicht vollstandig vollstaendig "
    "geschafft erfolg erfolgreich i.o i.o. io",
    "fr": "oui vrai v fini finie termine terminee acheve achevee complet complete reussi reussie "
    "succes atteint atteinte",
    "es": "si s verdadero cierto terminado terminada acabado acabada completado completada "
    "completo completa finalizado finalizada exito exitoso logrado alcanzado alcanzada hecho",
    "it": "si s vero finito finita terminato terminata completato completata completo riuscito "
    "riuscita successo raggiunto raggiunta concluso fatto",
    "pt": "sim s verdadeiro terminado acabado completado completo concluido concluida sucesso "
    "alcancado alcancada feito",
}
_NO = {
    "sign": "0 0.0 0,0 ✗ ✘ ❌",
    "en": "n false f timeout dnf failed fail failure aborted abort abandoned cancelled canceled "
    "interrupted truncated incomplete unfinished uncompleted unsuccessful unsolved unreached nok "
    "crashed",
    "de": "nein n falsch unfertig unvollstandig unvollstaendig unerreicht erfolglos abgebrochen "
    "abbruch gescheitert misserfolg fehlgeschlagen zeituberschreitung zeitueberschreitung n.i.o "
    "n.i.o. nio",
    "fr": "n faux inacheve inachevee incomplet incomplete interrompu interrompue abandonne "
    "abandonnee echec echoue",
    "es": "n falso inacabado inacabada incompleto incompleta interrumpido interrumpida abortado "
    "abortada cancelado cancelada fracaso fallido fallado",
    "it": "n falso incompiuto incompiuta incompleto incompleta interrotto interrotta fallito "
    "fallita annullato fallimento",
    "pt": "n falso inacabado incompleto interrompido interrompida abortado cancelado fracasso "
    "falhou falha",
}
_NO_PHRASES = ("timed out", "time out", "did not finish", "tempo scaduto", "tempo esgotado")
YES_WORDS = frozenset(word for words in _YES.values() for word in words.split())
NO_WORDS = frozenset(
    (
        *(word for words in _NO.values() for word in words.split()),
        *_NOT,
        *_NO_PHRASES,
        *(f"{no} {yes}" for no in _NOT for yes in YES_WORDS if len(yes) > 1),
    )
)


def finished_words(columns: Columns) -> dict[str, bool]:
    """Return what each cell of the column `finished` says; none where nothing does.

    Raises:
        IndicatorError: a cell is of neither list, or is empty beside others; names its line. Or a
            column may say which trials finished, and would be a parameter.
    """
    if "time_to_finish" not in columns.by_meaning:
        return {}
    cells = columns.by_meaning.get("finished")
    if cells is None:
        _refuse_unnamed(columns)
        return {}
    first_rows = {text: row for row, text in reversed([*enumerate(cells.texts)])}
    if not any(first_rows):
        return {}
    meanings = {}
    for text, row in first_rows.items():
        meaning = says_yes(text)
        word = _plain(text)
        if word == _CROSS:
            other_marks = any(says_yes(other) for other in first_rows if _plain(other) != _CROSS)
            meaning = None if other_marks else True
        if meaning is None:
            option = quote(f"finished:{text}=no")
            raise cells.error(
                row,
                f"should be a word for yes or no: --value {option} where it means that a trial did "
                "not finish, else with =yes",
            )
        meanings[text] = meaning
    return meanings


def _refuse_unnamed(columns: Columns) -> None:
    """Ask of a column that may say which trials finished, and would be a parameter."""
    for cells in (*columns.parameters, *columns.covariates):
        words = {*cells.texts}
        means = says_yes(bare(cells.name))
        is_number = all(word.replace(".", "").isdigit() for word in words)
        if {says_yes(word) for word in words} != {True, False} or (is_number and means is None):
            continue
        values = ""
        if means is False:  # it says who did not finish
            for word in sorted(words):
                finished = "no" if says_yes(word) else "yes"
                values += f" --value {quote(f'finished:{word}={finished}')}"
        raise IndicatorError(
            f"{cells.table.source}: {cells.name!r} may say which trials finished: say --column "
            f"{quote(f'finished={cells.name}')}{values}, or leave it out by --ignore "
            f"{quote(cells.name)}"
        )


def says_yes(cell: str) -> bool | None:
    """Return what a word says; None: it is neither for yes nor for no."""
    word = _plain(cell)
    if word in YES_WORDS:
        return True
    return False if word in NO_WORDS else None


def _plain(cell: str) -> str:
    """Return a word in small letters, without accents, with a blank for each sign between words."""
    decomposed = unicodedata.normalize("NFKD", cell.casefold())
    letters = "".join(sign for sign in decomposed if unicodedata.category(sign) != "Mn")
    return re.sub(r"[\s_-]+", " ", letters).strip(" !")
