"""The words of files: what names a column, no fault, removed robots, yes, no and no value.

Each list has the language that its words are of: English and those of most labs. A word that may
mean two things, as "terminated", "tag" or "data", is in no list: it is asked about, never guessed.
"""

from __future__ import annotations

import re
import unicodedata

CELLS = "cells"  # the column of what was measured, of a wide table
MORE_IS_BETTER = "more_is_better"  # for --column, of a performance that is a time by its name


def plain(text: str) -> str:
    """Return a text in small letters, without accents, with a blank for each sign between words."""
    decomposed = unicodedata.normalize("NFKD", text.casefold())
    letters = "".join(sign for sign in decomposed if unicodedata.category(sign) != "Mn")
    return re.sub(r"[\s_-]+", " ", letters).strip(" !")


# All words below are as `plain` writes them, those of columns with "_" for its blanks.
# What a column is, and the words that name it.
_COLUMNS = {
    "performance": {
        "en": f"p delivered items score throughput avg_throughput {MORE_IS_BETTER}",
        "de": "geliefert abgeliefert ausgeliefert durchsatz lieferungen",
        "fr": "objets_livres livraisons debit",
        "es": "entregados entregas rendimiento",
        "it": "consegnati consegne rendimento punteggio",
        "pt": "entregues entregas desempenho",
        "nl": "geleverd afgeleverd leveringen doorvoer",
    },
    "n_robots": {
        "en": "robots n swarm_size num_agents n_agents agents num_robots number_of_robots",
        "de": "roboter anzahl_roboter anzahl_der_roboter roboteranzahl roboterzahl schwarmgrosse "
        "schwarmgroesse",
        "fr": "nombre_de_robots nb_robots nb_de_robots taille_de_l_essaim taille_essaim",
        "es": "numero_de_robots num_robots tamano_del_enjambre",
        "it": "numero_di_robot numero_robot numero_dei_robot dimensione_dello_sciame",
        "pt": "robos numero_de_robos n_robos tamanho_do_enxame",
        "nl": "aantal_robots zwermgrootte",
    },
    "fault": {
        "en": "failure mode fault_mode failure_mode",
        "de": "ausfall ausfallart fehler fehlerart storung stoerung",
        "fr": "panne type_de_panne defaillance defaut",
        "es": "fallo falla tipo_de_fallo averia",
        "it": "guasto tipo_di_guasto avaria",
        "pt": "falha tipo_de_falha avaria",
        "nl": "storing uitval",
    },
    "faulty": {
        "en": "m failed n_faulty",
        "de": "ausgefallen ausgefallene ausgefallene_roboter defekte defekte_roboter",
        "fr": "en_panne robots_en_panne defaillants robots_defaillants",
        "es": "averiados robots_averiados robots_con_fallo",
        "it": "guasti robot_guasti",
        "pt": "avariados robos_avariados robos_com_falha",
        "nl": "uitgevallen uitgevallen_robots defecte_robots",
    },
    "onset": {"en": "fault_time"},
    "policy": {
        "en": "controller algorithm planner method",
        "de": "regler steuerung strategie verfahren methode algorithmus",
        "fr": "controleur strategie methode algorithme",
        "es": "controlador estrategia metodo algoritmo",
        "it": "controllore strategia algoritmo",
        "pt": "controlador estrategia",
        "nl": "regelaar strategie algoritme",
    },
    "seed": {
        "en": "pair block map map_name layout instance day date operator",
        "de": "paar karte datum versuchstag",
        "fr": "paire carte jour",
        "es": "mapa dia fecha",
        "it": "coppia mappa giorno",
        "pt": "mapa dia",
        "nl": "paar kaart dag datum",
    },
    "trial": {
        "en": "run id",
        "de": "versuch versuchsnummer lauf durchlauf durchgang",
        "fr": "essai",
        "es": "ensayo prueba intento",
        "it": "prova",
        "pt": "ensaio tentativa",
        "nl": "proef poging",
    },
    "time": {},
    "time_to_finish": {"en": "finish_time completion_time makespan"},
    "finished": {
        "en": "success succeeded solved",
        "de": "fertig geschafft abgeschlossen erfolg",
        "fr": "termine reussi succes",
        "es": "terminado completado exito",
        "it": "finito completato riuscito",
        "pt": "terminado concluido sucesso",
        "nl": "klaar voltooid geslaagd",
    },
    "work": {},
    "duration": {
        "en": "length",
        "de": "dauer versuchsdauer",
        "fr": "duree",
        "es": "duracion",
        "it": "durata",
        "pt": "duracao",
        "nl": "duur",
    },
    "table": {},
    "contacts": {"en": "contacts_per_robot_minute"},
}
COLUMN_NAMES = {
    column: tuple(dict.fromkeys(word for text in words.values() for word in text.split()))
    for column, words in _COLUMNS.items()
}
MEANING = {word: column for column, words in COLUMN_NAMES.items() for word in (column, *words)}
CONSTANTS = ("n_robots", "faulty", "work")  # numbers that may be the same in all trials
# Those of which a column of another name may be a misspelled one.
ENGLISH_NAMES = [
    word for column, words in _COLUMNS.items() for word in (column, *words.get("en", "").split())
]

_NO_FAULT = {
    "en": "none|no fault|no faults|baseline|healthy|0",
    "de": "kein|keine|keiner|keines|ohne|kein ausfall|kein fehler|kein defekt|keine storung|"
    "ohne ausfall|ohne fehler|ohne defekt|ohne storung|intakt",
    "fr": "aucun|aucune|sans|aucune panne|aucun defaut|sans panne|sans defaut|sans defaillance",
    "es": "ninguno|ninguna|ningun fallo|ninguna falla|sin fallo|sin fallos|sin falla|sin averia",
    "it": "nessuno|nessuna|nessun guasto|senza guasto|senza guasti",
    "pt": "nenhum|nenhuma|nenhuma falha|sem falha|sem falhas|sem avaria",
    "nl": "geen|geen storing|geen fout|geen uitval|zonder storing",
}
_REMOVED = {
    "en": "removed",
    "de": "entfernt|herausgenommen|weggenommen",
    "fr": "retire|retires|retiree|retirees|enleve|enleves",
    "es": "retirado|retirados|quitado|quitados",
    "it": "rimosso|rimossi|tolto|tolti",
    "pt": "removido|removidos|retirado|retirados",
    "nl": "verwijderd|weggehaald",
}


def _all_of(words: dict[str, str], separator: str | None = None) -> frozenset[str]:
    return frozenset(word for text in words.values() for word in text.split(separator))


NO_FAULT_WORDS = _all_of(_NO_FAULT, "|")
REMOVED_WORDS = _all_of(_REMOVED, "|")
# Those of the words above that a reader of English does not know.
_ENGLISH = {
    *ENGLISH_NAMES,
    *_NO_FAULT["en"].split("|"),
    *_REMOVED["en"].split("|"),
}

# Words for yes and no. What may mean either, as "stopped" and "beendet", is in no list.
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
    "nl": "waar klaar voltooid geslaagd gelukt bereikt volledig gehaald",
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
    "nl": "nee n onwaar onvoltooid onvolledig mislukt afgebroken geannuleerd",
}
_NOT = ("not", "nicht", "pas", "non", "no", "nao", "niet")
_NO_PHRASES = ("timed out", "time out", "did not finish", "tempo scaduto", "tempo esgotado")
YES_WORDS = _all_of(_YES)
NO_WORDS = frozenset(
    (
        *_all_of(_NO),
        *_NOT,
        *_NO_PHRASES,
        *(f"{no} {yes}" for no in _NOT for yes in YES_WORDS if len(yes) > 1),
    )
)

# What programs and people write for no value: a fault so written may be none. Further ones, which
# mean no value where a number should be.
NOT_KNOWN = ("", "na", "n/a", "nan", "null")
NO_NUMBER = (
    *NOT_KNOWN,
    *("-", "--", "–", "—", "?", ".", "none", "nil", "missing", "<na>", "nat", "n.a.", "k.a."),
    *("n.d.", "n.v.t.", "s/d", "fehlt", "manquant", "falta", "mancante", "ausente", "ontbreekt"),
)

# What stands in the row of a table that sums up the rows above it.
TOTALS = _all_of(
    {
        "en": "total totals sum mean average avg median sd std min max",
        "de": "summe gesamt mittel mittelwert mw durchschnitt standardabweichung",
        "fr": "somme moyenne mediane",
        "es": "suma promedio media mediana",
        "it": "totale somma mediana",
        "pt": "soma",
        "nl": "totaal som gemiddelde mediaan",
    }
)

# Before the number of a repetition, in the heading of a column.
REPETITIONS = (
    *("run", "trial", "rep", "repetition", "replicate", "try", "test", "versuch", "lauf"),
    *("durchlauf", "durchgang", "wiederholung", "wdh", "essai", "ensayo", "prueba", "prova"),
    *("ensaio", "proef", "poging"),
)


def means_no_number(text: str) -> bool:
    """Return whether a cell stands for a number that is not there."""
    return text.casefold() in NO_NUMBER


def is_translated(word: str) -> bool:
    """Return whether a word is known in another language than English alone."""
    return word.replace("_", " ") not in _ENGLISH and word.replace(" ", "_") not in _ENGLISH
