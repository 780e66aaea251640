"""What the README shows runs as written."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env import Scenario, run_episode

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
END = "<!-- end of tables -->"
BLOCKS = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The script `docs/front_page.py`."""
    monkeypatch.syspath_prepend(ROOT / "docs")
    return importlib.import_module("front_page")


def run(block: str) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(compile(block, "README.md", "exec"), names)
    return names


def test_every_block_of_code_runs_as_written(capsys: pytest.CaptureFixture[str]) -> None:
    first, environment = BLOCKS
    run(first)
    delivered = re.findall(r"^(\S+) +(\d+) items", capsys.readouterr().out, flags=re.MULTILINE)
    rows = re.findall(r"^\| `(\S+)`.*? \| (\d+) \| (\d+) \| (\d+) \|$", README, flags=re.MULTILINE)
    assert delivered == [(name, count) for name, *counts in rows for count in counts]
    assert len(rows) == 5
    names = run(environment.replace("n_robots=25", "n_robots=25, duration=2.0"))
    assert len(names["observations"]) == 25
    assert all(names["truncations"].values())
    assert "swarm-logistics judge wanderer:Wanderer" in README
    wanderer = run((ROOT / "examples" / "wanderer.py").read_text(encoding="utf-8"))["Wanderer"]
    assert run_episode(Scenario(), wanderer(), seed=0).delivered > 3


def test_what_it_says_of_results_is_what_the_page_of_results_says(
    script: Any, tmp_path: Path
) -> None:
    assert script.written() == README, "stale: run `python docs/front_page.py`"
    # Every number with an interval there stands in a table of that page.
    results = script.RESULTS.read_text(encoding="utf-8")
    told = re.findall(r"-?[\d.]+ \[-?[\d.]+, -?[\d.]+\]", script.findings(results))
    assert len(told) >= 6
    assert all(number in results for number in told)
    pytest.importorskip("matplotlib", reason="needs the extra study")
    script.draw(script.rows_of(script.block_of(results, "policies")), tmp_path / "anew.svg")
    assert (tmp_path / "anew.svg").stat().st_size > 10_000


@pytest.mark.parametrize("address", [None, "https://forge.example/swarm"])
def test_links_lead_to_files_or_the_page_says_where_they_do_not(
    address: str | None, script: Any
) -> None:
    page = script.with_address(README, address)
    targets = re.findall(r'^\[[^]]+\]: (\S+)|src="([^"]+)"|\]\(([^)]+)\)', page, flags=re.MULTILINE)
    found = {target for group in targets for target in group if target}
    assert {"docs/media/fm4.gif", "docs/training.md"} <= {t.removeprefix(f"{address}/raw/main/")
        .removeprefix(f"{address}/blob/main/") for t in found}  # fmt: skip
    relative = {target for target in found if "://" not in target}
    assert all((ROOT / target).is_file() for target in relative)
    assert bool(relative) == ("A package index does not show them" in page) == (address is None)


def test_its_lines_fit_and_what_it_names_exists() -> None:
    for block in re.findall(r"```\w*\n(.*?)```", README, flags=re.DOTALL):
        assert max(map(len, block.splitlines())) <= 104
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in set(re.findall(r"^make (\w+)|`make (\w+)", README, flags=re.MULTILINE)):
        assert f"{target[0] or target[1]}:" in makefile
