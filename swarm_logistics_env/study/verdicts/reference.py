"""Reference: what was published of the paper's swarm."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from swarm_logistics_env.spi.definitions import DEFINITIONS, FactorKind
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.study.questions.comparison import NO_FAULT, Comparison, Question, Setting


@dataclass(frozen=True)
class Reference:
    """Performances and yes/no claims that somebody published, without a number of runs.

    Each performance is treated as one run.

    Attributes:
        source: whose they are, for the report.
        performance: P at each setting [items].
        cells: the settings that count as cells of the tables; a baseline repeated under another
            name is none.
        sentences: each sentence of the text, with the questions that it answers: whether the
            indicator is above the threshold.
        whose: what a verdict on these claims can mean, and what not.
    """

    source: str
    performance: Mapping[Setting, float]
    cells: tuple[Setting, ...]
    sentences: Mapping[str, Mapping[Question, bool]]
    whose: str

    @cached_property
    def claims(self) -> Mapping[Question, bool]:
        """Whether the text says that the indicator is above the threshold."""
        return {
            question: is_above
            for claims in self.sentences.values()
            for question, is_above in claims.items()
        }

    def estimate(self, comparison: Comparison) -> Estimate | None:
        """Return the published value of an indicator, without interval, where there is one."""
        if any(arm.setting not in self.performance for arm in comparison.arms):
            return None
        return comparison.estimate(
            {arm: np.array([self.performance[arm.setting]]) for arm in comparison.arms}
        )


def _setting(kind: FactorKind, name: str, value: float) -> Setting:
    return NO_FAULT if kind == "fault" and not value else Setting(kind, name, value)


def _read_reference(path: Path) -> Reference:
    """Return the published values in a TOML file; `paper_values.toml` says what it holds."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    performance = {
        Setting(kind, name, float(value)): p
        for kind, rows in table["performance"].items()
        for name, row in rows.items()
        for value, p in row.items()
    }
    repeated = {Setting(*setting) for setting in table["repeated"]}
    cells = tuple(setting for setting in performance if setting not in repeated)
    sentences: dict[str, dict[Question, bool]] = {}
    for sentence in table["sentences"]:
        claims = sentences[sentence["text"]] = {}
        for claim in sentence["claims"]:
            symbol = claim["indicator"]
            name = claim["name"]
            threshold = claim.get("threshold", 0.0)
            kind = DEFINITIONS[symbol].compares
            for before, after in claim["steps"]:
                settings = _setting(kind, name, before), _setting(kind, name, after)
                claims[Question(symbol, *settings, threshold)] = claim["above"]
    return Reference(table["source"], performance, cells, sentences, table["whose"])


PAPER = _read_reference(Path(__file__).parent / "paper_values.toml")
