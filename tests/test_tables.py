"""The tables of docs/results.md: written from studies, none typed by hand."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.studies import Study
from swarm_logistics_env.train.evaluation import FIRST_SEED as FIRST_OF_TRAININGS

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"<!-- tables: (\w+) -->\n(.*?)\n<!-- end of tables -->", re.DOTALL)


@pytest.fixture
def tables(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The script `docs/play_tables.py`."""
    monkeypatch.syspath_prepend(ROOT / "docs")
    return importlib.import_module("play_tables")


@pytest.fixture
def small(tables: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A page of markers, and studies of seconds instead of minutes."""
    page = tmp_path / "page.md"
    page.write_text(
        "Before.\n\n<!-- tables: paper -->\n<!-- end of tables -->\n\nBetween.\n\n"
        "<!-- tables: clearing -->\n<!-- end of tables -->\n"
        "<!-- tables: sentences -->\n<!-- end of tables -->\n"
        "<!-- tables: ladder -->\n<!-- end of tables -->\n"
        "<!-- tables: leans -->\n<!-- end of tables -->\n"
        "<!-- tables: robust -->\n<!-- end of tables -->\n"
        "<!-- tables: benchmark -->\n<!-- end of tables -->\n"
        "<!-- tables: policies -->\nold\n<!-- end of tables -->\nAfter.\n"
    )
    short: dict[str, Any] = {"seeds": 2, "first_seed": 3, "scenario": {"duration": 40.0}}

    def paper_studies(out: Path, first_seed: int) -> tuple[Study, ...]:
        paper: dict[str, Any] = {**short, "name": "paper", "reference": "paper"}
        widths = {"name": "delivery_width", "values": [2.0, 1.5]}
        rest: dict[str, Any] = {"sizes": [{"values": [5, 10]}], "parameters": [widths]}
        faults = [{"modes": ["FM4"], "robots": [1, 2]}]
        parts: tuple[dict[str, Any], ...]
        parts = rest, {"faults": faults}, {"faults": [{"modes": ["FM3_send"]}]}, rest
        return tuple(Study(out=out / f"{i}", **fields, **paper) for i, fields in enumerate(parts))

    def clearing_study(out: Path) -> Study:
        return Study(
            out=out / "clearing",
            task="clearing",
            policies=["homing", "ppo-delivery"],
            seeds=2,
            scenario={"n_items": 4, "duration": 200.0},
            sizes=[{"values": [10, 25]}],
        )

    def policy_studies(out: Path) -> tuple[Study, ...]:
        small: dict[str, Any] = {**short, "faults": [{"modes": ["FM4"], "robots": [2]}]}
        policies = ["swarm-dt", "homing", "ppo-delivery"]
        return (
            Study(out=out / "of policies", policies=policies, sizes=[{"values": [5, 25]}], **small),
            Study(out=out / "robust", policies=policies[:1], **{**small, "seeds": 3}),
        )

    def ladder_studies(out: Path) -> tuple[Study, ...]:
        slow = [{"policy": "swarm-dt", "title": "slow", "scenario": {"handling_time": 1.0}}]
        fields: dict[str, Any] = {
            "policies": ["swarm-dt", "homing"],
            "ablations": [{"policy": "swarm-dt", "title": "fast"}, *slow],
            "seeds": 2,
            "scenario": {"n_items": 6, "duration": 100.0},
        }
        tasks = "clearing", "warehouse", "warehouse"
        return tuple(Study(out=out / f"l{i}", task=task, **fields) for i, task in enumerate(tasks))

    def benchmark_studies(out: Path) -> tuple[Study, ...]:
        widths = {"name": "delivery_width", "values": [2.0, 1.0], "title": "Held out: narrow"}
        fields: dict[str, Any] = {**short, "parameters": [widths]}
        return (Study(out=out / "benchmark", policies=["homing"], **fields),)

    monkeypatch.setattr(tables.front_page, "main", lambda: None)
    for name, value in {
        "PAGE": page,
        "record_scores": lambda out: None,
        "OUT": tmp_path / "out",
        "BENCHMARK": tmp_path / "benchmark.json",
        "PROCESSES": 1,
        "paper_studies": paper_studies,
        "policy_studies": policy_studies,
        "clearing_study": clearing_study,
        "ladder_studies": ladder_studies,
        "benchmark_studies": benchmark_studies,
        "ENTRIES": tmp_path / "entries.json",
        "MEDIA": tmp_path,
    }.items():
        monkeypatch.setattr(tables, name, value)
    return page


def test_a_second_call_plays_nothing_and_leaves_the_page_as_it_is(
    tables: Any, small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tables.main()
    first = small.read_text()
    assert first.startswith("Before.\n\n<!-- tables: paper -->\n\nOf ")
    assert first.endswith("\n\n<!-- end of tables -->\nAfter.\n")
    assert "Between." in first
    assert "\nold\n" not in first
    small.write_text(first.replace("N = 5", "N = 6"))
    played = []
    run = Study.run

    def watched(self: Study, *args: Any, **fields: Any) -> Any:
        tally = run(self, *args, **fields)
        played.append(tally.played)
        return tally

    monkeypatch.setattr(Study, "run", watched)
    tables.main()
    assert small.read_text() == first
    drawn = {path.name.split("-")[1] for path in tmp_path.glob("paper-*.svg")}
    assert drawn == {"S", "FT", "A"}
    assert played == [0] * 11
    # Nor does what is played anew change a digit.
    monkeypatch.setattr(tables, "OUT", tmp_path / "anew")
    tables.main()
    assert small.read_text() == first
    assert sum(played) > 20


def test_its_seeds_are_clear_of_those_that_anything_was_fitted_on(tables: Any) -> None:
    out = Path("a")
    first = tables.FIRST_SEED
    paper = tables.paper_studies(out, first)
    studies = (*paper, *tables.policy_studies(out), tables.clearing_study(out))
    studies = (*studies, *tables.ladder_studies(out))
    for study in studies:
        seeds = study.plan().seeds
        assert min(seeds) >= 20_000
        assert max(seeds) < FIRST_OF_TRAININGS
    counts = [20, 100, 100, 20, 20, 6, 20, 30, 30, 10, 34]
    assert [len(one.plan().seeds) for one in studies] == counts


@pytest.mark.parametrize("page", [PAGE, README], ids=["results.md", "README.md"])
def test_no_table_is_typed_by_hand(page: str) -> None:
    named = [name for name, _ in BLOCK.findall(PAGE)]
    assert named == [
        "clearing", "paper", "sentences", "ladder", "leans", "policies", "robust", "benchmark",
        "costs",
    ]  # fmt: skip
    rest = BLOCK.sub("", re.sub(r"```.*?```", "", page, flags=re.DOTALL))
    # `test_readme` plays what this one says.
    rest = re.sub(r"^\| items in 200 s.*?\n\n", "", rest, flags=re.DOTALL | re.MULTILINE)
    assert not [line for line in rest.splitlines() if line.startswith("|")]
