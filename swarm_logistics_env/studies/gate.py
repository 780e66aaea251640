"""Gates: conditions under which a comparison of two studies fails, for continuous integration.

    gate     := ["possibly"] subject ("<" | ">") number ["at" text]
    subject  := "S" | "FT" | "R" | "A" | "change"

S, FT, R and A are those of the newer study; `change` is (P_new - P_old) / P_old of every condition
under which both studies judge a policy, over the seeds that they share. "R < 0" fails where R lies
below 0 beyond chance, "possibly R < 0" wherever that is not ruled out, for want of seeds as well.
`at` keeps the comparisons and conditions whose name holds the text, e.g. "R < 0 at FM4, m = 1".
Verdicts are Holm-adjusted over what is kept. What cannot be judged fails: a policy without a match
in the other study, failed runs, studies that share no seed. Where the runs of both studies are the
same the change is exactly 0, and the gate fails where "0 < number" (or ">") is true.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, Self, cast

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.estimate import Verdict

Subject = Literal["S", "FT", "R", "A", "change"]

_GATE = re.compile(
    r"(?P<possibly>possibly\s+)?(?P<subject>S|FT|R|A|change)\s*(?P<sign>[<>])\s*(?P<number>\S+)"
    r"(\s+at\s+(?P<at>.+))?"
)


@dataclass(frozen=True)
class Gate:
    """One condition to fail on; see the grammar above.

    Attributes:
        text: as it was written.
        possibly: whether it is enough that the condition is not refuted.
        below: "<" rather than ">".
        number: the threshold.
        at: part of the names that it is about; empty: all.
    """

    text: str
    possibly: bool
    subject: Subject
    below: bool
    number: float
    at: str

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the gate that `text` describes.

        Raises:
            StudyError: the text does not read so.
        """
        match = _GATE.fullmatch(text.strip())
        if match is None:
            raise StudyError(
                f"gate {text!r}: should be [possibly] S|FT|R|A|change <|> NUMBER [at TEXT], "
                'e.g. "R < 0" or "possibly change < -0.1 at N = 25"'
            )
        try:
            number = float(match["number"])
        except ValueError:
            number = float("nan")
        if not abs(number) < float("inf"):
            raise StudyError(f"gate {text!r}: {match['number']} should be a number")
        return cls(
            text.strip(),
            match["possibly"] is not None,
            cast("Subject", match["subject"]),
            match["sign"] == "<",
            number,
            (match["at"] or "").strip(),
        )

    def holds_for(self, value: float) -> bool:
        """Return whether an exact value, which leaves nothing to chance, makes the gate fail."""
        return value < self.number if self.below else value > self.number

    def fails_on(self, verdict: Verdict) -> bool:
        """Return whether a verdict on "above the number" makes the gate fail."""
        holds, opposite = ("refuted", "supported") if self.below else ("supported", "refuted")
        return verdict != opposite if self.possibly else verdict == holds
