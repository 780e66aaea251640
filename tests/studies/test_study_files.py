from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env.errors import StudyError
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


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("seedz = 3", "Specification has no field 'seedz'; did you mean 'seeds'?"),
        ("[[faults]]\nmode = ['FM1']", "Faults has no field 'mode'; did you mean 'modes'?"),
        ("[[faults]]\nmodes = ['FM1', 'FM1']", "each value once"),
        ("[[faults]]\nmodes = ['FM1']\nrobots = [1, 1]", "each value once"),
        ("[faults]\nmodes = ['FM1']", "Specification.faults = {'modes': ['FM1']}"),
        ("indicators = ['Q']", "Specification.indicators = ['Q']: no indicator 'Q'"),
        ("looks = [10, 5]\nseeds = 10", "rising"),
        ("looks = [10, 20]\nseeds = 15", "seeds = 15: should be one of the looks (10, 20)"),
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
