"""The indicators of published swarms: `python -m research.play_published NAME=PATH ...`.

Judges the results that others published, each a file or folder that is read unedited, and writes
the tables of docs/published.md. NAME is one of `SETS`; sets that are not given keep their rows.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import Any, NamedTuple

from more_itertools import map_reduce

from research.tables import ROOT, rewrite, table
from swarm_logistics_env import judge
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.study.report.section import NOTHING, bracketed, fixed, share_in_words
from swarm_logistics_env.study.report.tables import critical_size_in_words
from swarm_logistics_env.study.verdicts.collapses import collapses, edges
from swarm_logistics_env.study.verdicts.results import StudyResults

PAGE = ROOT / "docs" / "published.md"
ROWS = ROOT / "docs" / "results" / "published.json"


class PublishedSet(NamedTuple):
    """Results that somebody published.

    Attributes:
        source: repository and folder.
        licence: of the results.
        options: of `judge`, as arguments of `read_trials`.
        command: the same on the command line.
    """

    source: str
    licence: str
    options: Mapping[str, Any] = MappingProxyType({})
    command: str = "judge PATH"


_POGEMA = "CognitiveAISystems/pogema-benchmark, raw_data_LMAPF"
_MILNER = {"columns": {"work": "boxes", "seed": "boxes"}}
SETS = {
    "pogema-warehouse": PublishedSet(f"{_POGEMA}/03-warehouse", "Apache 2.0"),
    "pogema-cities": PublishedSet(f"{_POGEMA}/04-movingai", "Apache 2.0"),
    "milner-times": PublishedSet(
        "emmilner/swarm_sim, steps until all boxes are delivered",
        "none seen",
        _MILNER,
        "judge PATH --column work=boxes --column seed=boxes",
    ),
    "milner-rates": PublishedSet("emmilner/swarm_sim, boxes in 1,000 steps", "none seen"),
    "foraging-faults": PublishedSet("MARSLab-UTRGV/RL-FL-Foraging, results/exp4b", "none seen"),
    "foraging-sizes": PublishedSet("MARSLab-UTRGV/RL-FL-Foraging, 4 to 16 robots", "none seen"),
}


def scalability_rows(results: StudyResults) -> Iterator[list[str]]:
    """Yield a row for each policy: sizes, S from each to the next, and what is told of collapse."""
    sized = [v for v in results.verdicts if v.compared.indicator == "S"]
    named = map_reduce(collapses(results.cells), lambda collapse: collapse.cell.policy)
    critical = {edge.cells[0].policy: edge for edge in edges(results.cells)}
    for policy, verdicts in map_reduce(sized, lambda verdict: verdict.compared.policy).items():
        sizes = [int(verdicts[0].compared.original.setting.value)]
        sizes += [int(verdict.after.value) for verdict in verdicts]
        assert all(before < after for before, after in pairwise(sizes))
        words = [
            f"{collapse.cell.words}: {share_in_words(collapse.share)}"
            for collapse in named.get(policy, [])
        ]
        if policy in critical:
            words.append(critical_size_in_words(critical[policy]))
        values = " ".join(NOTHING if v.value is None else fixed(v.value, 2) for v in verdicts)
        counts = Counter(verdict.on_property.adjusted for verdict in verdicts)
        verdict_words = ", ".join(f"{count} {word}" for word, count in counts.items())
        chain = " → ".join(map(str, sizes))
        yield [policy, chain, values, verdict_words, "; ".join(words) or NOTHING]


def other_rows(results: StudyResults) -> Iterator[list[str]]:
    """Yield a row for each question that is none of scalability."""
    for verdict in results.verdicts:
        comparison = verdict.compared
        if comparison.indicator != "S" and verdict.interval is not None:
            question = f"{comparison.indicator} {verdict.after}"
            value = bracketed(verdict.interval, 2)
            yield [comparison.policy, question, value, verdict.on_property.adjusted]


def judged(name: str, path: str) -> dict[str, Any]:
    """Return the rows of a set, or why it is refused."""
    try:
        results = judge(path, **SETS[name].options)
    except StudyError as error:
        return {"refused": str(error).partition(": ")[2]}
    rows = {"scalability": [*scalability_rows(results)], "others": [*other_rows(results)]}
    return {**rows, "runs": len(results.outcomes)}


def blocks(rows: Mapping[str, Any]) -> dict[str, str]:
    """Return the tables of the page, from the rows of each set."""
    sets = {name: rows[name] for name in SETS if name in rows}
    sources = [
        [name, SETS[name].source, SETS[name].licence, f"`{SETS[name].command}`", _outcome(of_set)]
        for name, of_set in sets.items()
    ]
    scaling = [[name, *row] for name in sets for row in sets[name].get("scalability", [])]
    questions = [[name, *row] for name in sets for row in sets[name].get("others", [])]
    head = ("set", "policy", "N", "S from each to the next", "S > 0", "runs that collapse")
    return {
        "published sources": table(("set", "source", "licence", "command", "read"), sources),
        "published s": table(head, scaling),
        "published others": table(("set", "policy", "question", "value", "> 0"), questions),
    }


def _outcome(of_set: Mapping[str, Any]) -> str:
    return f"refused: {of_set['refused']}" if "refused" in of_set else f"{of_set['runs']:,} runs"


def main() -> None:
    """Judge the sets that are given, and write the page's tables."""
    rows: dict[str, Any] = json.loads(ROWS.read_text(encoding="utf-8"))
    for name, _, path in (argument.partition("=") for argument in sys.argv[1:]):
        rows[name] = judged(name, path)
    ROWS.write_text(json.dumps(rows, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    rewrite(PAGE, blocks(rows))


if __name__ == "__main__":
    main()
