"""Yes and no in the words of those who noted which trials finished."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.study.trials import read_trials
from swarm_logistics_env.study.trials.words import NO_WORDS, YES_WORDS

HEAD = "robots,completion_time,finished,work,delivered,duration\n"


def read(tmp_path: Path, words: tuple[str, str, str], **options: object) -> list[float]:
    """Return P of three trials of which the last delivered 3 of 20 until 600 s."""
    measured = zip((100, 110, 600), words, (20, 20, 3))
    rows = [f'10,{time},"{word}",20,{done},600' for time, word, done in measured]
    (tmp_path / "t.csv").write_text(HEAD + "\n".join(rows))
    trials = read_trials(tmp_path / "t.csv", **options)  # type: ignore[arg-type]
    return [row.performance for row in trials.rows]


@pytest.mark.parametrize(
    "words",
    [
        *("yes no", "Y N", "TRUE FALSE", "1 0", "1.0 0.0", "1,0 0,0", "x no", "✓ ✗", "✔️ ❌"),
        *("ok timeout", "OK nok", "success failed", "done aborted", "completed incomplete"),
        *("finished unfinished", "reached|not reached", "solved|NOT_SOLVED", "done|timed out"),
        *("ja nein", "WAHR FALSCH", "TRUE FALSCH", "erreicht|nicht erreicht", "i.O. n.i.O."),
        *("fertig abgebrochen", "vollständig unvollstaendig", "Erfolg Misserfolg"),
        *("oui non", "VRAI FAUX", "terminé|pas terminé", "réussi échec", "atteint|non atteint"),
        *("sí no", "si no", "VERDADERO FALSO", "completado|no completado", "éxito fracaso"),
        *("sì no", "VERO FALSO", "riuscito fallito", "raggiunto|non raggiunto"),
        *("sim não", "VERDADEIRO FALSO", "concluído interrompido", "alcançado|não alcançado"),
    ],
)
def test_yes_and_no_are_read_in_six_languages(tmp_path: Path, words: str) -> None:
    yes, no = words.split("|") if "|" in words else words.split()
    assert read(tmp_path, (yes, yes.upper(), no)) == [20 / 100, 20 / 110, 3 / 600]


def test_no_word_says_both() -> None:
    assert not YES_WORDS & NO_WORDS


@pytest.mark.parametrize(
    ("words", "line"),
    [
        *((("ja", "ja", word), 4) for word in ("", "terminated", "stopped", "2", "?", "n.b.")),
        (("x", "x", ""), 4),
        (("ok", "ok", "x"), 4),  # a cross
        (("", "yes", "no"), 2),
    ],
)
def test_a_word_of_neither_list_is_refused_with_what_to_say(
    tmp_path: Path, words: tuple[str, str, str], line: int
) -> None:
    with pytest.raises(spi.IndicatorError) as caught:
        read(tmp_path, words)
    assert f"line {line}, column 'finished': " in str(caught.value)
    option = str(caught.value).partition("--value ")[2].partition(" where")[0].strip("'")
    if line == 4:
        assert read(tmp_path, words, values=[option])[-1] == 3 / 600


def test_without_a_word_trials_count_as_finished_if_their_work_is_done(tmp_path: Path) -> None:
    with pytest.raises(spi.IndicatorError, match="line 4, column 'delivered': '3': should be its"):
        read(tmp_path, ("", "", ""))
    done = read(tmp_path, ("", "", ""), values=["delivered:3=20"])
    assert done == [20 / 100, 20 / 110, 20 / 600]


@pytest.mark.parametrize(
    ("name", "cells", "option"),
    [
        ("status", "ok ok timeout", "--column finished=status, or leave"),
        ("completed", "1 1 0", "--column finished=completed, or leave"),
        ("timed_out", "0 0 1", "=timed_out --value finished:0=yes --value finished:1=no, or leave"),
    ],
)
def test_a_column_of_yes_and_no_that_nobody_names_is_asked_about(
    tmp_path: Path, name: str, cells: str, option: str
) -> None:
    rows = [f"10,{time},{cell}" for time, cell in zip((100, 110, 600), cells.split())]
    (tmp_path / "t.csv").write_text(f"robots,makespan,{name}\n" + "\n".join(rows))
    with pytest.raises(spi.IndicatorError) as caught:
        read_trials(tmp_path / "t.csv")
    assert option in str(caught.value)


def test_times_that_contradict_each_other_are_refused(tmp_path: Path) -> None:
    for row, words in (
        ("10,0,no,20,3,0", "column 'duration': '0': should be more than 0"),
        ("10,600,yes,20,3,600", "column 'delivered': '3': should be its work of 20, as the trial"),
        ("10,700,yes,20,20,600", "column 'completion_time': '700': should not be after its durat"),
        ("10,,yes,20,3,600", "column 'completion_time': nothing: should be a number"),
    ):
        (tmp_path / "t.csv").write_text(HEAD + row)
        with pytest.raises(spi.IndicatorError, match=words):
            read_trials(tmp_path / "t.csv")


def test_a_time_beside_a_column_of_finished_trials_is_asked_about(tmp_path: Path) -> None:
    file = tmp_path / "t.csv"
    file.write_text("robots,time,finished,trial\n4,20,yes,1\n4,60,no,2\n2,30,yes,3\n2,31,yes,4\n")
    with pytest.raises(spi.IndicatorError, match="--column time_to_finish=time says so; where"):
        read_trials(file)
    took = read_trials(file, columns={"time_to_finish": "time"})
    assert [trial.performance for trial in took.rows] == [1 / 20, 1 / 60, 1 / 30, 1 / 31]
    deliveries = read_trials(file, columns={"time": "time"}).rows
    assert {trial.performance for trial in deliveries} == {1.0}
