"""The public interface is the one in docs/api.txt, and the changelog tells what changes in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from docs import api

REMEDY = "say it in CHANGELOG.md under [Unreleased], then run `python -m docs.api`"
SECTION = "## [Unreleased]\n\n- The option `--full-report`, and `Scenario.n_racks`.\n"
FORMER = "\n## [0.3.0] - 2026-11-23\n\n- `n_doors`\n"


def test_the_list_is_that_of_the_code() -> None:
    listed = api.FILE.read_text(encoding="utf-8").splitlines()
    of_the_code = api.api_text().splitlines()
    changes = [f"- {line}" for line in listed if line not in of_the_code]
    changes += [f"+ {line}" for line in of_the_code if line not in listed]
    assert changes == [], f"the public interface changed: {REMEDY}"
    assert listed == of_the_code, f"its order changed: {REMEDY}"


@pytest.mark.parametrize(
    ("line", "is_told"),
    [
        ("scenario field: n_racks: 0", True),
        ("scenario field: n_doors: 0", False),  # an older version told that
        ("scenario field: racks: 0", False),
        ("option: swarm-logistics judge --full-report", True),
        ("option: swarm-logistics judge --full", False),
        ("python: swarm_logistics_env.Scenario.n_racks: ()", True),
        ("training field: scores[].n_racks: none", True),
    ],
)
def test_what_the_changelog_does_not_tell_is_not_written(line: str, is_told: bool) -> None:
    changelog = f"# Changelog\n\n{SECTION}{FORMER}"
    expected = [] if is_told else [line]
    assert api.untold_changes("", line, changelog) == [f"+ {text}" for text in expected]
    assert api.untold_changes(line, "", changelog) == [f"- {text}" for text in expected]
    assert api.untold_changes(line, line, FORMER) == []
    # After a release, whose section told it, a change has to be told anew.
    released = changelog.replace("[Unreleased]", "[1.0.0rc1] - 2026-11-29")
    after_a_release = f"## [Unreleased]\n\n{released}"
    assert api.untold_changes("", line, after_a_release) == [f"+ {line}"]
    assert api.untold_changes(line, line, after_a_release) == []


def test_a_change_is_refused_until_it_is_told(tmp_path: Path) -> None:
    file = tmp_path / "api.txt"
    changelog = tmp_path / "CHANGELOG.md"
    changelog.write_text(FORMER, encoding="utf-8")
    api.write(file, changelog)
    before = file.read_text(encoding="utf-8")
    assert before == api.api_text()
    # As if the code had lost that field since.
    file.write_text(before + "scenario field: n_racks: 0\n", encoding="utf-8")
    with pytest.raises(SystemExit, match=r"Unreleased.*\n- scenario field: n_racks: 0"):
        api.write(file, changelog)
    assert "n_racks" in file.read_text(encoding="utf-8")
    changelog.write_text(SECTION, encoding="utf-8")
    api.write(file, changelog)
    assert file.read_text(encoding="utf-8") == before
