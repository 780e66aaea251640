"""Units of time in the names of columns."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.study.trials import Trials, read_trials
from swarm_logistics_env.study.trials.units import word_of_time


def read(tmp_path: Path, text: str, **columns: str) -> Trials:
    (tmp_path / "t.csv").write_text(text)
    return read_trials(tmp_path / "t.csv", columns=columns)


@pytest.mark.parametrize(
    ("name", "time"),
    [
        *((name, "2.5") for name in ("time [min]", "time (Min.)", "time_min", "time in minutes")),
        *((name, "2.5") for name in ("Dauer [min]", "minutes", "Zeit / min", "tiempo (minutos)")),
        *((name, "150000") for name in ("time (ms)", "time_ms", "t_ms", "T [MS]", "timeMs")),
        *(
            (name, "150")
            for name in ("time", "time []", "time [s]", "Zeit [Sek.]", "time (seconds)")
        ),
        *((name, "0.041666666666666666") for name in ("time [h]", "temps [heures]", "time_hrs")),
        *((name, "0.001736111111111111") for name in ("time [d]", "Zeit [Tage]", "days to clear")),
        *((name, "150000000") for name in ("time [µs]", "time [us]", "time_usec")),
        *((name, "150") for name in ("tiempo [segundos]", "tempo [secondi]", "Sekunden")),
        *((name, "150000") for name in ("milisegundos", "Zeit [Millisekunden]")),
    ],
)
def test_times_are_converted_to_seconds(tmp_path: Path, name: str, time: str) -> None:
    text = f"robots,{name},delivered,duration [min],finished\n4,{time},8,4,yes\n4,{time},5,4,no\n"
    finished, stopped = read(tmp_path, text, time_to_finish=name).rows
    assert finished.performance == pytest.approx(1 / 150)
    assert (stopped.performance, stopped.duration) == (5 / 240, 240.0)
    (log,) = read(tmp_path, f"trial,robots,{name}\n1,4,{time}\n", time=name).rows
    assert log.times == (150.0,)


def test_what_is_converted_is_told(tmp_path: Path) -> None:
    trials = read(tmp_path, "robots,work,makespan [min],fault,m,onset [min]\n4,6,2,jam,1,0.5\n")
    assert trials.rows[0].onset == 30.0
    assert trials.notes == (
        "'onset [min]' is converted to seconds.",
        "'makespan [min]' is converted to seconds.",
        "P is work divided by makespan [s]: more is better.",
    )
    assert trials.performance_name == "work / makespan [s]"
    # As exact as it was written: 9 ms lie within 0.009 s.
    assert read(tmp_path, "trial,time [ms],duration\n1,9,0.009\n").rows[0].times == (0.009,)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("makespan [m]", r"'makespan [m]' (time_to_finish) has the unit '[m]': should have one of"),
        ("makespan (total)", "has the unit '(total)': should have one of time, us, ms, s, min, h"),
        ("makespan [10 ms]", "has the unit '10 ms'"),
        ("makespan [s] (min)", "has the unit 's' and 'min'"),
        ("length [m]", "has the unit '[m]'"),
        ("contacts [1/s]", "contacts should be per robot and minute"),
    ],
)
def test_what_is_no_unit_of_a_time_is_refused(tmp_path: Path, name: str, words: str) -> None:
    with pytest.raises(spi.IndicatorError) as caught:
        read(tmp_path, f"robots,delivered,{name}\n4,8,3\n")
    assert words in str(caught.value)


def test_steps_and_seconds_are_not_mixed(tmp_path: Path) -> None:
    text = "robots,finish_time [steps],delivered,duration [{}]\n4,,5,60\n"
    assert read(tmp_path, text.format("steps")).rows[0].performance == 5 / 60
    with pytest.raises(spi.IndicatorError, match="have times in steps and in others"):
        read(tmp_path, text.format("s"))


TIMES = (
    *(
        "Time",
        "total time",
        "result [s]",
        "steps [steps]",
        "time_s",
        "minutes to clear",
        "makespan",
    ),
    *("clear time", "clear_time_ms", "s to clear", "min to clear", "seconds per box", "s/item"),
    *("P [min]", "runtime", "Laufzeit", "durée", "tiempo", "steps", "t", "uptime [h]"),
)


@pytest.mark.parametrize("name", TIMES)
def test_a_time_as_performance_is_asked_about(tmp_path: Path, name: str) -> None:
    text = f"robots,{name}\n5,925\n10,510\n"
    with pytest.raises(spi.IndicatorError, match="is a time by its name") as caught:
        read(tmp_path, text, performance=name)
    assert f"--column time_to_finish={name!r}" in str(caught.value)
    assert f"--column more_is_better={name!r}" in str(caught.value)
    less, more = (read(tmp_path, text, **{to: name}) for to in ("time_to_finish", "more_is_better"))
    assert [row.performance for row in more.rows] == [925.0, 510.0]
    assert less.rows[0].performance < less.rows[1].performance


def test_rates_and_counts_in_some_time_are_no_times() -> None:
    for name in (
        *("delivered", "boxes per minute", "boxes/min", "items_per_hour", "boxes per 10 min"),
        *("boxes in 5 minutes", "deliveries_in_10min", "score (10 min)", "boxes after 600 s"),
        *("throughput [1/min]", "score [items/s]", "boxes min^-1", "boxes s⁻¹", "avg_throughput"),
        *("Kisten pro Minute", "caisses par minute", "cajas por minuto", "robots' boxes", "return"),
        *("min_score", "items [items/step]", "boxes in 1,000 steps"),
    ):
        assert word_of_time(name) is None, name
