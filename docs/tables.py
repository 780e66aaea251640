"""What the scripts share: blocks of a page between markers, and tables to put there."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from swarm_logistics_env.report import section
from swarm_logistics_env.studies import Study
from swarm_logistics_env.verdicts.cell import Cell
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.verdicts.verdict import Verdict

ROOT = Path(__file__).parents[1]
BLOCK = "<!-- tables: {name} -->"
END = "<!-- end of tables -->"


def _split(text: str, name: str) -> tuple[str, str, str]:
    """Return what stands before, between and after the inner sides of a block's markers."""
    before, found, rest = text.partition(BLOCK.format(name=name))
    block, ended, after = rest.partition(END)
    if not (found and ended):
        raise SystemExit(f"the page has no {BLOCK.format(name=name)} followed by {END}")
    return before + found, block.strip(), ended + after


def block_of(text: str, name: str) -> str:
    """Return what stands between the markers of a block."""
    return _split(text, name)[1]


def rewritten(text: str, blocks: Mapping[str, str]) -> str:
    """Return a page with other text between the markers of each block."""
    for name, block in blocks.items():
        before, _, after = _split(text, name)
        text = f"{before}\n\n{block}\n\n{after}"
    return text


def rewrite(page: Path, blocks: Mapping[str, str]) -> None:
    """Write other text between the markers of each block of a page."""
    text = rewritten(page.read_text(encoding="utf-8"), blocks)
    page.write_text(text, encoding="utf-8")


def table(head: Sequence[object], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def by_policy(
    policies: Sequence[str],
    cells: Iterable[Cell],
    tests: Iterable[Verdict],
    told: Callable[[Verdict], str],
) -> str:
    """Return a table of P and of indicators, as they are told, with a column for each policy."""
    rows: dict[str, dict[str, str]] = {}
    for cell in cells:
        rows.setdefault(f"P, {cell.words}", {})[cell.policy] = section.mean_p(cell)
    for test in tests:
        label = f"{test.compared.indicator}, {test.compared.label}"
        rows.setdefault(label, {})[test.compared.policy] = told(test)
    body = [(label, *(row.get(policy, "") for policy in policies)) for label, row in rows.items()]
    return table(("", *(f"`{policy}`" for policy in policies)), body)


def seeds_from(results: StudyResults, noun: str = "seeds") -> str:
    """Return over which seeds a table is, e.g. "20 seeds from 20,000 on"."""
    seeds = results.plan.seeds
    return f"{len(seeds)} {noun} from {seeds[0]:,} on"


def example(out: Path, name: str, **changed: Any) -> Study:
    """Return the study of a file in examples/, which keeps its runs in a folder of `out`."""
    return Study.from_file(ROOT / "examples" / f"{name}.toml", out=out / name, **changed)
