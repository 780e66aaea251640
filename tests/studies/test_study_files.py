from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env.errors import StudyError, SwarmLogisticsError
from swarm_logistics_env.studies import Study

FILE = """
seeds = 3
policies = ["swarm-dt", "random-walk"]
scenario = { preset = "paper", duration = 50 }

[[sizes]]
values = [5, 10]

[[faults]]
modes = ["FM1"]
robots = [1]
onsets = [10]

[[parameters]]
name = "delivery_width"
values = [2.0, 1.0]
"""


def test_file_says_what_python_says(tmp_path: Path) -> None:
    path = tmp_path / "small.toml"
    path.write_text(FILE)
    from_file = Study.from_file(path)
    written = Study(
        name="small",
        seeds=3,
        policies=("swarm-dt", "random-walk"),
        scenario={"duration": 50},
        sizes=[{"values": (5, 10)}],
        faults=[{"modes": ("FM1",), "robots": (1,), "onsets": (10,)}],
        parameters=[{"name": "delivery_width", "values": (2.0, 1.0)}],
    )
    assert from_file.specification == written.specification
    assert Study.from_file(path, seeds=5).plan().seeds == range(5)


def test_robots_may_fail_and_be_repaired_at_random_lose_parts_of_a_mode_or_a_factor(
    tmp_path: Path,
) -> None:
    path = tmp_path / "repair.toml"
    path.write_text(
        """
        seeds = 2
        scenario = { n_robots = 4, warehouse_width = 4, warehouse_height = 4, duration = 20 }

        [[faults]]
        modes = ["dead[move,send]"]
        robots = [1]
        intermittent = [2.0, 3]
        duration = 15

        [[faults]]
        modes = ["motor_slow"]
        robots = [2]
        factor = 0.1
        """
    )
    study = Study.from_file(path, out=tmp_path / "out")
    faults = {fault for c in study.plan().cases for fault in c.faults}
    assert faults == {
        Fault("dead[move,send]", 1, duration=15.0, intermittent=(2.0, 3.0)),
        Fault("motor_slow", 2, factor=0.1),
        Fault("removed", 1),
        Fault("removed", 2),
    }
    assert study.run().failed == 0
    study.report()
    told = (tmp_path / "out" / "report.md").read_text()
    assert "Fault tolerance and robustness (for 15 s, 2 s failed, 3 s not, in turn)" in told
    assert "Fault tolerance and robustness (factor 0.1)" in told
    assert "keeps what it carries; of this: move, send |" in told
    assert Study.stored(tmp_path / "out").plan().comparisons == study.plan().comparisons


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("modes = ['FM1']\nfactor = 0.5", "FM1 takes no factor"),
        ("modes = ['dead[mov]']", "not 'mov'; did you mean 'move'?"),
        ("modes = ['FM1']\nintermittent = [0.001, 5]", "greater than or equal to 0.01"),
        ("modes = ['FM1']\nintermittent = 5", "Faults.intermittent = 5: should be a list"),
    ],
)
def test_a_fault_that_cannot_be_is_refused_before_any_run(
    tmp_path: Path, text: str, words: str
) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(f"[[faults]]\n{text}")
    with pytest.raises(SwarmLogisticsError) as caught:
        Study.from_file(path).plan()
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("seedz = 3", "Specification has no field 'seedz'; did you mean 'seeds'?"),
        ("[[faults]]\nmode = ['FM1']", "Faults has no field 'mode'; did you mean 'modes'?"),
        ("[[faults]]\nmodes = ['FM1', 'FM1']", "each value once"),
        ("[[faults]]\nmodes = ['FM1']\nrobots = [1, 1]", "each value once"),
        ("[faults]\nmodes = ['FM1']", "Specification.faults = {'modes': ['FM1']}"),
        ("indicators = ['Q']", "Specification.indicators = ['Q']: no indicator 'Q'"),
        ("scenario = { n_robot = 3 }", "did you mean 'n_robots'?"),
        ("scenario = 3", "Specification.scenario = 3"),
        ("seeds = ", "is not TOML: Invalid value"),
        ("\udc00", "is not TOML"),
    ],
)
def test_bad_file_is_refused_in_one_sentence_that_names_it(
    tmp_path: Path, text: str, words: str
) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(text.encode(errors="surrogatepass"))
    with pytest.raises(StudyError) as caught:
        Study.from_file(path)
    assert str(path) in str(caught.value)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=r"cannot read the study file .*No such file"):
        Study.from_file(tmp_path / "none.toml")
