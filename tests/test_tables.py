"""The tables of docs/results.md: written from studies, none typed by hand."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.report import wording
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.performance_table import rows_of
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
        "<!-- tables: policies -->\nold\n<!-- end of tables -->\nAfter.\n"
    )
    short: dict[str, Any] = {"seeds": 2, "first_seed": 3, "scenario": {"duration": 40.0}}

    def paper_studies(out: Path) -> tuple[Study, ...]:
        paper: dict[str, Any] = {**short, "name": "paper", "reference": "paper"}
        widths = {"name": "delivery_width", "values": [2.0, 1.5]}
        return (
            Study(out=out / "1", sizes=[{"values": [5, 10]}], parameters=[widths], **paper),
            Study(out=out / "2", faults=[{"modes": ["FM4"], "robots": [1, 2]}], **paper),
        )

    def policy_studies(out: Path) -> tuple[Study, ...]:
        small: dict[str, Any] = {**short, "faults": [{"modes": ["FM4"], "robots": [2]}]}
        policies = ["swarm-dt", "homing", "ppo-delivery"]
        return (
            Study(out=out / "3", policies=policies, sizes=[{"values": [5, 25]}], **small),
            Study(out=out / "4", policies=policies[:1], **{**small, "seeds": 3}),
        )

    monkeypatch.setattr(tables, "PAGE", page)
    monkeypatch.setattr(tables.front_page, "main", lambda: None)
    monkeypatch.setattr(tables.score_cards, "main", lambda: None)
    monkeypatch.setattr(tables, "OUT", tmp_path / "out")
    monkeypatch.setattr(tables, "BENCHMARK", tmp_path / "benchmark.json")
    monkeypatch.setattr(tables, "PROCESSES", 1)
    monkeypatch.setattr(tables, "paper_studies", paper_studies)
    monkeypatch.setattr(tables, "policy_studies", policy_studies)
    return page


def test_a_second_call_plays_nothing_and_leaves_the_page_as_it_is(
    tables: Any, small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tables.main()
    first = small.read_text()
    assert first.startswith("Before.\n\n<!-- tables: paper -->\n\n| ")
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
    assert played == [0, 0, 0, 0]
    # Nor does what is played anew change a digit.
    monkeypatch.setattr(tables, "OUT", tmp_path / "anew")
    tables.main()
    assert small.read_text() == first
    assert sum(played) > 20


def test_the_blocks_quote_what_was_played(tables: Any, small: Path, tmp_path: Path) -> None:
    tables.main()
    paper, policies = (text for _, text in BLOCK.findall(small.read_text()))
    first, second = (study.findings() for study in tables.paper_studies(tmp_path / "out"))
    sizes = next(line for line in paper.splitlines() if line.startswith("| N = 5, 10 (60 items)"))
    assert "| 9, 18 |" in sizes.replace("**", "")
    for mean in first.performance["mean"][:2]:
        assert f"{wording.fixed(mean, wording.digits_of(mean))} [" in sizes
    counted = [c for part in (first, second) for c in rows_of(part.performance) if c.counted]
    inside = sum(c.low <= c.published <= c.high for c in counted)
    assert f"{inside} of {len(counted)} lie inside the 95 % interval of our mean" in paper
    logs = [abs(np.log(c.mean / c.published)) for c in counted]
    assert f"is {np.mean(logs):.3f} over the {len(counted)} published values" in paper

    main, skewed = (study.findings() for study in tables.policy_studies(tmp_path / "out"))
    unbroken = {c.policy: c.by_seed for c in rows_of(main.performance) if c.factor == "none"}
    change = spi.relative_change(unbroken["homing"], unbroken["ppo-delivery"])
    assert f"`ppo-delivery` {abs(100 * change.value):.1f} %" in policies
    assert policies.rstrip().endswith("less." if change.value < 0 else "more.")
    assert "Compared with the script `homing`" in policies
    # FM4 of swarm-dt comes from the study with more seeds, of the others from the first.
    row = next(line for line in policies.splitlines() if line.startswith("| R, FM4, m = 2"))
    values = {j.policy: j for j in rows_of(main.indicators) if j.indicator == "R"}
    (more,) = [j for j in rows_of(skewed.indicators) if j.indicator == "R"]
    assert row.split("|")[2].strip().startswith(f"{more.value:.3f}")
    assert row.split("|")[3].strip().startswith(f"{values['homing'].value:.3f}")


def test_costs_are_written_from_the_last_benchmark(tables: Any) -> None:
    rows = [
        {"name": "floor", "includes": "bodies", "agent_steps_per_second": 1234567.0,
         "microseconds_per_step": 33.4, "base": None, "cost_to_base": None},
        {"name": "step", "includes": "all", "agent_steps_per_second": 600000.0,
         "microseconds_per_step": 53.0, "base": "floor", "cost_to_base": 1.588},
    ]  # fmt: skip
    machine = {"processor": "A", "cores": 2, "python": "3.11.7"}
    text = tables.costs_block({"contestants": rows, "machine": machine, "bytes_per_robot": 6212.0})
    assert "| step: all | 600,000 | 53 | 1.59 x floor |" in text
    assert "6.2 kB" in text


def test_a_page_without_markers_is_refused(tables: Any) -> None:
    with pytest.raises(SystemExit, match="tables: paper"):
        tables.rewritten("<!-- tables: paper -->", {"paper": "x"})


def test_its_seeds_are_clear_of_those_that_anything_was_fitted_on(tables: Any) -> None:
    studies = (*tables.paper_studies(Path("a")), *tables.policy_studies(Path("a")))
    for study in studies:
        seeds = study.plan().seeds
        assert min(seeds) >= 20_000
        assert max(seeds) < FIRST_OF_TRAININGS
    assert [len(study.plan().seeds) for study in studies] == [20, 100, 20, 100]


@pytest.mark.parametrize("page", [PAGE, README], ids=["results.md", "README.md"])
def test_no_table_is_typed_by_hand(page: str) -> None:
    assert [name for name, _ in BLOCK.findall(PAGE)] == ["paper", "policies", "costs"]
    rest = BLOCK.sub("", re.sub(r"```.*?```", "", page, flags=re.DOTALL))
    assert not [line for line in rest.splitlines() if line.startswith("|")]
    # Nor is a value with its interval: "9.2 [8.3, 10.1]".
    assert not re.findall(r"\d \[-?\d", rest)
