"""Pages and README: what is generated is current, code prints what it says, names exist."""

from __future__ import annotations

import ast
import importlib.util
import os
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from docs import blocks, generate, python_reference, site_parts
from swarm_logistics_env import Scenario, run_episode
from swarm_logistics_env.study.questions.specification import read_study_file
from swarm_logistics_env.train.training import load_training
from swarm_logistics_env.views.cli import app

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = {page.name: page.read_text(encoding="utf-8") for page in sorted(DOCS.glob("*.md"))}
EACH = pytest.mark.parametrize("name", ["../README.md", *PAGES])
# Their studies and trainings take three quarters of the time of all pages.
ONCE_A_DAY = {"own.md", "studies.md", "tasks.md", "training.md"}


def test_generated_tables_are_current() -> None:
    for page in generate.PAGES:
        text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
        assert text == generate.page_text(page), "run `python -m docs.generate`"


def test_what_examples_import_is_in_the_list_of_stable_names() -> None:
    names = [name for names in python_reference.STABLE.values() for name in names]
    names += python_reference.VALUES
    stable = {f"swarm_logistics_env.{name}" for name in names}
    for path in sorted((ROOT / "examples").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("swarm_logistics"):
                for alias in node.names:
                    imported = f"{node.module}.{alias.name}"
                    is_module = any(name.startswith(f"{imported}.") for name in stable)
                    assert imported in stable or is_module, f"{path.name}: {imported}"


@pytest.mark.daily
@pytest.mark.parametrize("page", blocks.pages(), ids=lambda page: page.name)
def test_page_runs_and_prints_what_it_shows(page: Path) -> None:
    if page.name in ONCE_A_DAY and os.environ.get("HYPOTHESIS_PROFILE") != "nightly":
        pytest.skip("takes as long as all other pages: make docs-check")
    text = PAGES[page.name]
    for module in re.findall(r"<!-- needs: (\w+) -->", text):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is not installed")
    recorded, normalise = blocks.record(text), blocks.normalise
    assert normalise(recorded) == normalise(text), f"stale: run `python -m docs.blocks {page}`"


def test_changed_output_is_noticed() -> None:
    page = "```python\nprint(1 + 1)\n```\n\n```text\n3\n```\n"
    assert blocks.record(page) == page.replace("3", "2")


def test_a_command_of_a_page_reads_what_python_of_the_page_writes() -> None:
    python = 'from pathlib import Path\n\nPath("few.json").write_text(\'{"n_robots": 3}\')\n'
    command = "swarm-logistics list scenario --scenario few.json\n"
    blocks.run_in_small({"page.md": f"```python\n{python}```\n\n```sh\n{command}```\n"})


@EACH
def test_what_a_page_names_exists_and_its_files_can_be_read(name: str, tmp_path: Path) -> None:
    text, file = (DOCS / name).read_text(encoding="utf-8"), tmp_path / "block.toml"
    for block in (block for block in blocks.blocks(text) if block.language == "toml"):
        file.write_text(block.code, encoding="utf-8")
        fields = tomllib.loads(block.code)
        if {"worlds", "ppo", "base"} & fields.keys():
            load_training(str(file))
        elif "seeds" in fields and "task" not in fields:  # a page's own task is run with it
            read_study_file(file, trust_code=True)
    for arguments in blocks.commands(text, blocks.LANGUAGES):
        assert app.run([*arguments, "--help"]) == 0, arguments
    for target in re.findall(r"(?:^|`)make ([\w-]+)", text, flags=re.MULTILINE):
        assert re.search(rf"^[\w -]*\b{target}\b[\w -]*:(?!=)", MAKEFILE, flags=re.MULTILINE)
    prose = re.sub(r"^```\w.*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)
    for link in re.findall(r'(?:\]\(|src="|^```{figure} )([^)#\s"]+)', prose, flags=re.MULTILINE):
        assert "://" in link or ((DOCS / name).parent / link).exists(), link


# What may stand in brackets without a command: the range that a value can have.
RANGES = {"[-1, 1]", "[-2, 2]", "[-4, 4]", "[0, 1]", "[0, 2]", "[0, 10]"}
MARKED = re.compile(r"<!-- tables: .*?<!-- end of tables -->|^```.*?^```|`[^`\n]*`", re.S | re.M)
INTERVAL = re.compile(r"\[[-+]?\d*\.?\d+(?: ?%)?,\s[-+]?\d*\.?\d+(?: ?%)?\]|\d ± \d")


def typed_by_hand(page: str) -> set[str]:
    """Return the intervals outside of what commands write."""
    return set(INTERVAL.findall(MARKED.sub("", page))) - RANGES


@EACH
def test_every_interval_comes_from_a_command(name: str) -> None:
    assert not typed_by_hand((DOCS / name).read_text(encoding="utf-8"))
    block = "<!-- tables: x -->\n9.2 [8.3, 10.1]\n<!-- end of tables -->\n"
    assert typed_by_hand(f"{block}R = .007 [-.001,\n.015], in [0, 1]") == {"[-.001,\n.015]"}


def test_every_page_of_the_site_is_two_clicks_from_its_first_one_and_in_its_menu() -> None:
    pages = {str(path.relative_to(DOCS)): path for path in DOCS.rglob("*.md")}
    del pages["releasing.md"]  # for maintainers, who have a clone

    def linked_from(name: str) -> set[str]:
        text = pages[name].read_text(encoding="utf-8")
        folder = pages[name].parent
        paths = [(folder / target).resolve() for target in re.findall(r"\]\(([^)#\s]+)", text)]
        return {str(path.relative_to(DOCS)) for path in paths if path.is_relative_to(DOCS)}

    first = linked_from("index.md") & pages.keys()
    second = set().union(*map(linked_from, first))
    assert pages.keys() - first - second - {"index.md"} == set()
    menu = (DOCS / "conf.py").read_text(encoding="utf-8")
    names = {name.removesuffix(".md") for name in pages} - {"index"}
    assert {name for name in names if not re.search(rf'[<"]{re.escape(name)}[>"]', menu)} == set()


def test_the_page_of_examples_names_each_and_links_to_them_lead_to_what_the_site_shows() -> None:
    folders = site_parts.EXAMPLE_FOLDERS
    files = [path for folder in folders for path in site_parts.example_files(folder)]
    names = [path.relative_to(ROOT).as_posix() for path in files]
    assert [name for name in names if f"](../{name})" not in PAGES["examples.md"]] == []
    labels = re.findall(r"^\((\S+)\)=$", site_parts.examples_markdown(), flags=re.MULTILINE)
    assert len(labels) == len(files) + len(folders)
    for path in DOCS.rglob("*.md"):
        page = path.relative_to(DOCS).with_suffix("").as_posix()
        text = site_parts.with_example_links(path.read_text(encoding="utf-8"), page)
        assert set(re.findall(r"\]\(#(examples-[^)]+)\)", text)) <= set(labels)
    linked = site_parts.with_example_links(
        "`examples/wanderer.py`, `examples/none.py`", "quickstart"
    )
    assert linked.startswith("[`examples/wanderer.py`](#examples-wanderer-py), ")
    assert linked.endswith("(../examples/none.py)")


def run(block: str) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(compile(block, "README.md", "exec"), names)
    return names


def test_readme_runs_as_written() -> None:
    environment, controller = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    interval = r" \| [\d.]+ \[[\d.]+, [\d.]+\]"
    rows = re.findall(rf"^\| `\S+`, [^|]+(?:{interval}){{5}} \|$", README, re.MULTILINE)
    assert len(rows) == 4
    names = run(environment.replace("n_robots=25", "n_robots=25, duration=2.0"))
    assert len(names["observations"]) == 25
    assert all(names["truncations"].values())
    circles = run(controller)["Circles"]
    assert run_episode(Scenario(duration=2.0), circles(), seed=0).delivered == 0
    assert "swarm-logistics judge my:Circles" in README
    example = (ROOT / "examples" / "wanderer.py").read_text(encoding="utf-8")
    assert example.partition("\n\n")[2] in PAGES["quickstart.md"]
    wanderer = run(example)["Wanderer"]
    assert run_episode(Scenario(duration=150.0), wanderer(), seed=0).delivered > 0
