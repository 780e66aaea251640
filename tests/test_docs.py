"""The pages: what is generated is current, code runs, outputs are those that came, links exist."""

from __future__ import annotations

import importlib
import importlib.util
import io
import re
import runpy
import tomllib
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.cli.app import command_line
from swarm_logistics_env.studies.specification import read_study_file
from swarm_logistics_env.train.training import load_training

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
BLOCKS = runpy.run_path(str(DOCS / "blocks.py"))
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
PAGES = {page.name: page.read_text(encoding="utf-8") for page in sorted(DOCS.glob("*.md"))}


def test_generated_tables_are_current(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)  # as for a script there
    generator = runpy.run_path(str(DOCS / "generate.py"))
    for page in generator["PAGES"]:
        assert PAGES[f"{page}.md"] == generator["written"](page), "run `python docs/generate.py`"


@pytest.mark.parametrize("page", BLOCKS["pages"](), ids=lambda page: page.name)
def test_page_runs_and_prints_what_it_shows(page: Path) -> None:
    text = PAGES[page.name]
    for module in re.findall(r"<!-- needs: (\w+) -->", text):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is not installed")
    said = BLOCKS["recorded"](text)
    comparable = BLOCKS["comparable"]
    assert comparable(said) == comparable(text), f"stale: run `python docs/blocks.py {page}`"


def test_changed_output_is_noticed() -> None:
    page = "```python\nprint(1 + 1)\n```\n\n```text\n3\n```\n"
    assert BLOCKS["recorded"](page) == page.replace("3", "2")


@pytest.mark.parametrize("name", sorted(PAGES))
def test_what_a_page_names_exists(name: str) -> None:
    text = PAGES[name]
    for block in BLOCKS["blocks"](text):
        assert block.language in BLOCKS["LANGUAGES"], f"```{block.language}"
    for arguments in BLOCKS["commands"](text):
        parse(arguments)
    for target in re.findall(r"(?:^|`)make ([\w-]+)", text, flags=re.MULTILINE):
        assert re.search(rf"^[\w -]*\b{target}\b[\w -]*:(?!=)", MAKEFILE, flags=re.MULTILINE)
    prose = re.sub(r"^```\w.*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)
    for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", prose):
        assert "://" in link or (DOCS / link).exists(), link
    pictures = re.findall(
        r"^(?:!\[[^]]+\]\(|```{figure} )(media/[^)\s]+)", text, flags=re.MULTILINE
    )
    assert pictures
    assert all((DOCS / picture).exists() for picture in pictures)


@pytest.mark.parametrize("name", sorted(PAGES))
def test_files_that_a_page_shows_can_be_read(name: str, tmp_path: Path) -> None:
    for number, block in enumerate(BLOCKS["blocks"](PAGES[name])):
        if block.language != "toml":
            continue
        file = tmp_path / f"block_{number}.toml"
        file.write_text(block.code, encoding="utf-8")
        fields = tomllib.loads(block.code)
        if {"worlds", "ppo", "base"} & fields.keys():
            load_training(str(file))
        elif "seeds" in fields and "task" not in fields:  # a page's own task is run with it
            read_study_file(file, trust_code=True)


def parse(arguments: list[str]) -> None:
    """Parse a command line down to its last command, without running it."""
    command: Any = command_line()
    context = None
    while True:
        context = command.make_context(command.name, list(arguments), parent=context)
        if not hasattr(command, "resolve_command"):
            return
        rest = [*context._protected_args, *context.args]
        _, command, arguments = command.resolve_command(context, rest)


# What may stand in brackets without a command: the range that a value can have.
RANGES = {"[-1, 1]", "[-2, 2]", "[-4, 4]", "[0, 1]", "[0, 2]", "[0, 10]"}
MARKED = re.compile(r"<!-- tables: .*?<!-- end of tables -->|^```.*?^```|`[^`\n]*`", re.S | re.M)
INTERVAL = re.compile(r"\[[-+]?\d*\.?\d+(?: ?%)?,\s[-+]?\d*\.?\d+(?: ?%)?\]|\d ± \d")


def typed_by_hand(page: str) -> set[str]:
    """Return the intervals outside of what commands write."""
    return set(INTERVAL.findall(MARKED.sub("", page))) - RANGES


@pytest.mark.parametrize("name", ["../README.md", *PAGES])
def test_every_interval_comes_from_a_command(name: str) -> None:
    page = (DOCS / name).read_text(encoding="utf-8")
    assert not typed_by_hand(page)


def test_an_interval_that_is_typed_is_seen() -> None:
    block = "<!-- tables: x -->\n9.2 [8.3, 10.1]\n<!-- end of tables -->\n"
    assert not typed_by_hand(f"{block}```text\n[1.5, 2]\n```\nin [0, 1]\n")
    assert typed_by_hand(f"{block}R = .007 [-.001, .015]") == {"[-.001, .015]"}
    assert typed_by_hand("81.3 [72.3,\n90.3]") == {"[72.3,\n90.3]"}
    assert typed_by_hand("0.175 ± 0.026") == {"5 ± 0"}


@pytest.mark.filterwarnings("ignore")  # the libraries that build the site warn about each other
def test_site_builds_without_warnings(tmp_path: Path) -> None:
    sphinx = pytest.importorskip("sphinx.application", reason="needs the extra docs")
    pytest.importorskip("furo", reason="needs the extra docs")
    # What sphinx imports in the place of missing packages must not stay for later tests.
    importlib.import_module("swarm_logistics_env.adapters.sb3")
    warnings, (out, trees) = io.StringIO(), (tmp_path / "site", tmp_path / "trees")
    sphinx.Sphinx(DOCS, DOCS, out, trees, "html", status=None, warning=warnings).build()
    assert warnings.getvalue() == ""
    assert "<math" in (out / "indicators.html").read_text(encoding="utf-8")
    for built in out.glob("*.html"):
        loads = re.findall(r'(?:src|<link[^>]* href)="(https?:[^"]+)"', built.read_text("utf-8"))
        assert not loads, f"{built.name} loads {loads[0]}"
