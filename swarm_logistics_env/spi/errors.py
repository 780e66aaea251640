"""The one error of the indicators."""

from __future__ import annotations


class IndicatorError(ValueError):
    """Input from which an indicator is undefined; the message names the field and the value."""
