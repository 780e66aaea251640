"""The studies of the field's questions, and the page that their results are written into."""

from __future__ import annotations

import importlib
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.report import section
from swarm_logistics_env.studies import Study
from swarm_logistics_env.train.evaluation import FIRST_SEED as FIRST_OF_TRAININGS

ROOT = Path(__file__).parents[1]
FILES = sorted((ROOT / "examples" / "questions").glob("*.toml"))
VARIED = ("sizes", "faults", "parameters")
PAGE = ROOT / "docs" / "research" / "questions_of_the_field.md"
TEXT = PAGE.read_text(encoding="utf-8")


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The script `docs/play_questions.py`."""
    monkeypatch.syspath_prepend(ROOT / "docs")
    return importlib.import_module("play_questions")


def in_small(name: str, out: Path) -> Study:
    """The same questions over two seeds of a short run, of policies that soon deliver."""
    asked = Study.from_file(ROOT / "examples" / "questions" / f"{name}.toml").specification
    late = any(onset for part in asked.faults for onset in part.onsets)
    # One mode each; where there is FM4, it is the one that a page may draw.
    fields = {part: [one.model_dump() for one in getattr(asked, part)] for part in VARIED}
    for one in fields["faults"]:
        one["modes"] = ["FM4"] if "FM4" in one["modes"] else one["modes"][:1]
    return Study(
        out=out / name,
        policies=["homing"] if late else ["homing", "central"],
        seeds=2,
        scenario={**asked.scenario.model_dump(), "duration": 210.0 if late else 40.0},
        indicators=asked.indicators,
        **fields,
    )


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_seeds_are_clear_of_those_that_anything_was_fitted_on(file: Path) -> None:
    plan = Study.from_file(file).plan()
    assert min(plan.seeds) >= 20_000
    assert max(plan.seeds) < FIRST_OF_TRAININGS
    assert len(plan.seeds) >= 10
    assert plan.cases


def test_every_question_has_its_command_and_figure(script: Any) -> None:
    assert sorted(script.QUESTIONS) == [file.stem for file in FILES]
    for name in script.QUESTIONS:
        assert f"`python docs/play_questions.py {name}`" in TEXT
        assert f"](../media/{name}.svg)" in TEXT
    assert TEXT.count("What it leans on: ") == TEXT.count("\n## ")


def test_every_interval_in_the_text_stands_in_a_table() -> None:
    prose = re.sub(r"<!-- tables: .*?<!-- end of tables -->", "", TEXT, flags=re.DOTALL)
    values = re.findall(r"-?[\d.]*\d \[[^]]+\]", " ".join(prose.split()))
    assert len(values) > 30
    assert [value for value in values if f"| {value} " not in TEXT] == []


def test_jackknife_of_a_mean_is_its_t_interval(script: Any) -> None:
    sample = np.array([3.0, 5.0, 4.0, 9.0])
    jackknife = importlib.import_module("question_tables").jackknife_interval
    found = jackknife(4, lambda seeds: float(sample[seeds].mean()))
    assert found == pytest.approx(spi.mean_interval(sample))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_page_quotes_what_was_played(
    file: Path, script: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib", reason="needs the extra study")
    name = file.stem
    for folder in ("media", PAGE.parent.name):
        (tmp_path / folder).mkdir()
    page = tmp_path / PAGE.parent.name / PAGE.name
    shutil.copy(PAGE, page)
    monkeypatch.setattr(script, "DOCS", tmp_path)
    monkeypatch.setattr(script, "study", lambda asked, **_: in_small(asked, tmp_path / "out"))
    monkeypatch.setattr(importlib.import_module("play_tables"), "PROCESSES", 1)
    script.main([name])
    text = page.read_text(encoding="utf-8")
    found = in_small(name, tmp_path / "out").findings()
    for test in found.verdicts:
        assert section.ratio(test) in text, test.compared.label
    for cell in found.cells:
        if cell.arm.setting.kind == "size":
            assert section.mean_p(cell) in text
    assert "<svg" in (tmp_path / "media" / f"{name}.svg").read_text(encoding="utf-8")
