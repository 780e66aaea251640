"""Builds paper.pdf of paper.md, as a draft to read: `make joss`. The journal sets it by itself."""

import sys
from pathlib import Path

import pypandoc
import typst

FOLDER = Path(__file__).parent


def build(out: Path) -> None:
    """Write the paper as a PDF: pandoc resolves the citations, typst sets the pages."""
    options = ["--citeproc", f"--resource-path={FOLDER}", "--standalone"]
    options.append(f"--bibliography={FOLDER / 'paper.bib'}")
    source = out.with_suffix(".typ")
    pypandoc.convert_file(FOLDER / "paper.md", "typst", outputfile=source, extra_args=options)
    typst.compile(source, output=out)


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.parent.mkdir(parents=True, exist_ok=True)
    build(target)
