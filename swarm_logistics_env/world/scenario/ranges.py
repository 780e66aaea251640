"""Ranges of the numbers that fields of scenarios hold."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

# Numbers beyond these do not survive in float32 observations, or vanish when squared.
SMALLEST = 1e-9
LARGEST = 1e9
Positive = Annotated[float, Field(ge=SMALLEST, le=LARGEST)]
NonNegative = Annotated[float, Field(ge=0, le=LARGEST)]
Count = Annotated[int, Field(ge=1, le=LARGEST)]
Probability = Annotated[float, Field(ge=0, le=1)]
Mix = Annotated[tuple[Annotated[float, Field(gt=0, le=1)], ...], Field(min_length=1)]
