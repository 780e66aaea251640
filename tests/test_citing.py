"""How to cite the package: files that say the same, and a paper whose references are there."""

from __future__ import annotations

import json
import re
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
CITED = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
DEPOSIT = json.loads((ROOT / ".zenodo.json").read_text(encoding="utf-8"))
PAPER = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
BIBLIOGRAPHY = (ROOT / "paper" / "paper.bib").read_text(encoding="utf-8")


def test_the_deposit_says_what_the_citation_says() -> None:
    assert DEPOSIT["title"] == CITED["title"]
    assert DEPOSIT["description"] == " ".join(CITED["abstract"].split())
    assert [creator["name"] for creator in DEPOSIT["creators"]] == [
        author.get("name") or f"{author['family-names']}, {author['given-names']}"
        for author in CITED["authors"]
    ]
    assert DEPOSIT["license"] == CITED["license"]
    assert DEPOSIT["keywords"] == CITED["keywords"]
    [related] = DEPOSIT["related_identifiers"]
    assert related["identifier"] == CITED["references"][0]["doi"]
    # The archive takes them from the release; a second place would be forgotten.
    assert not {"version", "publication_date"} & DEPOSIT.keys()


def test_the_paper_has_the_parts_and_the_length_that_the_journal_asks_for() -> None:
    _, head, text = PAPER.split("---\n", maxsplit=2)
    assert yaml.safe_load(head)["bibliography"] == "paper.bib"
    wanted = (
        "Summary", "Statement of need", "State of the field", "Software design",
        "Research impact statement", "AI usage disclosure", "Acknowledgements", "References",
    )  # fmt: skip
    assert re.findall(r"^# (.+)$", text, re.MULTILINE) == list(wanted)
    assert 750 <= len(text.split()) <= 1750


def test_every_reference_of_the_paper_is_there_and_used() -> None:
    entries = re.findall(r"^@\w+\{(\w+),$", BIBLIOGRAPHY, re.MULTILINE)
    assert set(re.findall(r"@(\w+)", PAPER)) == set(entries)
    assert re.findall(r"^  doi = \{(?!10\.)", BIBLIOGRAPHY, re.MULTILINE) == []
