"""What a study found, as it stands in a session and in a notebook's cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from html import escape
from typing import Self

from swarm_logistics_env.study.verdicts.results import StudyResults

from .answer import Answer, answer
from .section import Section
from .terminal_answer import terminal_answer


@dataclass(frozen=True, repr=False, eq=False)
class Findings(StudyResults):
    """`StudyResults` that say their answer: a line a question, with value, interval and verdict."""

    @classmethod
    def of(cls, results: StudyResults) -> Self:
        """Return the same results."""
        return cls(**{field.name: getattr(results, field.name) for field in fields(results)})

    @cached_property
    def _answer(self) -> Answer:
        return answer(self)

    def __repr__(self) -> str:
        title = f"Results of the study {self.plan.specification.name!r}"
        return f"{title}\n{terminal_answer(self._answer)}"

    def _repr_html_(self) -> str:
        parts = _paragraphs(self._answer.opening)
        if self._answer.overview is not None:
            parts += html_table(self._answer.overview)
        return parts + _paragraphs(self._answer.summary) + html_table(self._answer.section)


def _paragraphs(sentences: Sequence[str]) -> str:
    return "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences)


def html_table(section: Section) -> str:
    """Return a section as an HTML table with its lines below."""
    head = "".join(f"<th style='text-align: left'>{escape(name)}</th>" for name in section.columns)
    rows = [
        "<tr>" + "".join(f"<td style='text-align: left'>{escape(text)}</td>" for text in row)
        for row in section.rows
    ]
    lines = [f"<p>{escape(line)}</p>" for line in section.lines if line]
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>" + "".join(
        lines
    )
