"""The tables of docs/results.md and of the questions of the field: from studies, none by hand."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from research import (
    front_page,
    play_bodies,
    play_floors,
    play_paper,
    play_paper_fit,
    play_published,
    play_questions,
    play_tables,
    question_tables,
    tables,
)
from swarm_logistics_env import spi
from swarm_logistics_env.study.questions.benchmark_cells import DEVELOPMENT, HELD_OUT, REFERENCE
from swarm_logistics_env.study.report import benchmark, section
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.train.evaluation import FIRST_SEED as FIRST_OF_TRAININGS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"<!-- tables: (\w+) -->\n(.*?)\n<!-- end of tables -->", re.DOTALL)
QUESTIONS = sorted((ROOT / "examples" / "questions").glob("*.toml"))
ANSWERS = ROOT / "docs" / "research" / "questions_of_the_field.md"
TEXT = ANSWERS.read_text(encoding="utf-8")
EACH = pytest.mark.parametrize("question", QUESTIONS, ids=lambda file: file.stem)


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A page of markers, and studies of seconds instead of minutes."""
    page = tmp_path / "page.md"
    names = (
        "paper", "clearing", "sentences", "ladder", "realistic", "leans", "robust", "benchmark",
        "policies",
    )  # fmt: skip
    blocks = (f"<!-- tables: {name} -->\nold\n<!-- end of tables -->\n" for name in names)
    page.write_text("Before.\n\n" + "Between.\n".join(blocks) + "After.\n")
    paper: dict[str, Any] = {"name": "paper", "reference": "paper"}
    widths = {"name": "delivery_width", "values": [2.0, 1.5], "title": "narrow"}
    without_faults = {**paper, "sizes": [{"values": [5, 10]}], "parameters": [widths]}
    fault = {"faults": [{"modes": ["FM4"], "robots": [1, 2]}]}
    sizes: dict[str, Any] = {"sizes": [{"values": [5, 25]}]}
    policies = ["swarm-dt", "homing", "ppo-delivery"]
    slow = {"policy": "swarm-dt", "title": "slow", "scenario": {"handling_time": 1.0}}
    few = {"n_items": 6, "duration": 100.0}
    ladder: dict[str, Any] = {"policies": policies[:2], "scenario": few}
    ladder["ablations"] = [{"policy": "swarm-dt", "title": "fast"}, slow]
    studies_fields: dict[str, list[dict[str, Any]]] = {
        "paper": [
            without_faults,
            {**paper, **fault},
            {**paper, "faults": [{"modes": ["FM3_send"]}]},
            without_faults,
        ],
        "benchmark": [
            {
                "policies": [policy],
                "ablations": [
                    {"policy": REFERENCE, "title": f"{half} 1", "scenario": few}
                    for half in (DEVELOPMENT, HELD_OUT)
                ],
            }
            for policy in ("homing", "swarm-dt")
        ],
    }
    examples = {
        "clearing": {"task": "clearing", "policies": policies[1:], "scenario": few, **sizes},
        "ladder": {"task": "clearing", **ladder},
        "ladder_restocked": ladder,
        "ladder_realistic": {
            "policies": policies[:2],
            "ablations": [{"policy": policy, "title": "realistic"} for policy in policies[:2]],
        },
        "leans": ladder,
        "shipped_policies": {"policies": policies, **sizes, **fault},
        "robust_policy": {"seeds": 3, **fault},
        "broken_robots": {"policies": policies, **fault},
    }

    def study(out: Path, fields: dict[str, Any]) -> Study:
        short: dict[str, Any] = {"seeds": 2, "first_seed": 3, "scenario": {"duration": 40.0}}
        return Study(out=out, **{**short, **fields})

    def studies(name: str, out: Path) -> list[Study]:
        return [study(out / f"{name}{i}", fields) for i, fields in enumerate(studies_fields[name])]

    for name in studies_fields:
        monkeypatch.setattr(play_tables, f"{name}_studies", lambda out, *_, n=name: studies(n, out))
    monkeypatch.setattr(play_tables, "example", lambda out, name: study(out / name, examples[name]))
    for name in ("OUT", "BENCHMARK"):
        monkeypatch.setattr(play_tables, name, tmp_path / name)
    monkeypatch.setattr(benchmark, "ENTRIES", tmp_path / "entries")
    for name, value in {"PAGE": page, "RESULTS": tmp_path / "csv", "MEDIA": tmp_path}.items():
        monkeypatch.setattr(play_tables, name, value)
    monkeypatch.setattr(tables, "usable_cores", lambda: 1)
    monkeypatch.setattr(front_page, "main", lambda: None)
    return page


@pytest.mark.daily
def test_a_second_call_plays_nothing_and_leaves_the_page_as_it_is(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    play_tables.main()
    first = page.read_text()
    assert first.startswith("Before.\n\n<!-- tables: paper -->\n\nOf ")
    assert first.endswith("\n\n<!-- end of tables -->\nAfter.\n")
    assert first.count("Between.\n") == 8
    assert "\nold\n" not in first
    assert {path.name.split("-")[1] for path in tmp_path.glob("paper-*.svg")} == {"S", "FT", "A"}
    monkeypatch.setattr(front_page, "RESULTS", tmp_path / "csv")
    for study in ("policies", "clearing", "realistic", "leans"):
        rows = front_page.values(front_page.read("estimates"), study)
        assert rows
        assert all(value.text in first for row in rows.values() for value in row.values())
    n_supported = sum(claim["verdict"] == "supported" for claim in front_page.read("claims"))
    assert f"this re-implementation supports\n{n_supported} and contradicts" in first
    page.write_text(first.replace("N = 5", "N = 6"))
    played = []
    run = Study.run

    def counting_run(self: Study, *args: Any, **fields: Any) -> Any:
        tally = run(self, *args, **fields)
        played.append(tally.played)
        return tally

    monkeypatch.setattr(Study, "run", counting_run)
    play_tables.main()
    assert page.read_text() == first
    assert played == [0] * 14


def test_seeds_are_clear_of_those_that_anything_was_fitted_on() -> None:
    out = Path("a")
    studies = [
        *play_paper.paper_studies(out, play_tables.FIRST_SEED),
        *(tables.example(out, name) for name in play_tables.EXAMPLES),
    ]
    for study in (*studies, *map(Study.from_file, QUESTIONS)):
        seeds = study.plan().seeds
        assert min(seeds) >= 20_000
        assert max(seeds) < FIRST_OF_TRAININGS
        assert len(seeds) >= 6
        assert study.plan().cases


def test_every_page_names_the_command_that_writes_its_tables() -> None:
    for module in (play_bodies, play_floors, play_paper_fit, play_published, play_tables):
        assert f"python -m {module.__name__}" in module.PAGE.read_text(encoding="utf-8")
    readings = ANSWERS.parent / "readings_and_tries.md"
    assert "python -m research.play_readings 40" in readings.read_text(encoding="utf-8")


@pytest.mark.parametrize("page", [PAGE, README], ids=["results.md", "README.md"])
def test_no_table_is_typed_by_hand(page: str) -> None:
    prose = BLOCK.sub("", re.sub(r"```.*?```", "", page, flags=re.DOTALL))
    assert not [line for line in prose.splitlines() if line.startswith("|")]


def test_every_question_has_its_command_and_figure_and_its_intervals_stand_in_a_table() -> None:
    assert sorted(play_questions.QUESTIONS) == [file.stem for file in QUESTIONS]
    for file in QUESTIONS:
        assert f"`python -m research.play_questions {file.stem}`" in TEXT
        assert f"](../media/{file.stem}.svg)" in TEXT
    values = re.findall(r"-?[\d.]*\d \[[^]]+\]", " ".join(BLOCK.sub("", TEXT).split()))
    assert len(values) > 30
    assert [value for value in values if f"| {value} " not in TEXT] == []


def test_jackknife_of_a_mean_is_its_t_interval() -> None:
    sample = np.array([3.0, 5.0, 4.0, 9.0])
    jackknife = question_tables.jackknife_interval
    interval = jackknife(4, lambda seeds: float(sample[seeds].mean()))
    assert interval == pytest.approx(spi.mean_interval(sample))


@pytest.mark.daily
@EACH
def test_page_quotes_what_was_played(
    question: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same questions over two seeds of a short run, of policies that soon deliver."""
    pytest.importorskip("matplotlib", reason="needs the extra study")
    specification = Study.from_file(question).specification
    name = question.stem
    late = any(onset for part in specification.faults for onset in part.onsets)
    factors = ("sizes", "faults", "parameters")
    fields = {
        factor: [part.model_dump() for part in getattr(specification, factor)] for factor in factors
    }
    # One mode each; where there is FM4, it is the one that a page may draw.
    for fault in fields["faults"]:
        fault["modes"] = ["FM4"] if "FM4" in fault["modes"] else fault["modes"][:1]
    study = Study(
        out=tmp_path / name,
        policies=["homing"] if late else ["homing", "homing-stock"],
        seeds=2,
        scenario={**specification.scenario.model_dump(), "duration": 210.0 if late else 40.0},
        indicators=specification.indicators,
        **fields,
    )
    for folder in ("media", ANSWERS.parent.name):
        (tmp_path / folder).mkdir()
    page = Path(shutil.copy(ANSWERS, tmp_path / ANSWERS.parent.name))
    monkeypatch.setattr(play_questions, "DOCS", tmp_path)
    monkeypatch.setattr(play_questions, "example", lambda *_, **__: study)
    monkeypatch.setattr(tables, "usable_cores", lambda: 1)
    play_questions.main([name])
    text = page.read_text(encoding="utf-8")
    results = study.findings()
    for test in results.verdicts:
        assert section.ratio(test) in text, test.compared.label
    for cell in results.cells:
        assert cell.arm.setting.kind != "size" or section.mean_p(cell) in text
    assert "<svg" in (tmp_path / "media" / f"{name}.svg").read_text(encoding="utf-8")
