"""Signs in numbers: before decimals and between thousands, as said or as the cells show."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from swarm_logistics_env.spi.inputs import IndicatorError

from .complaints import Complaints
from .table import Cells, Table, like_a_number
from .words import means_no_number

# With a sign between thousands and the other one before decimals.
_BOTH_SIGNS = re.compile(r"[+-]?\d{1,3}((\.\d{3})+,\d+|(,\d{3})+\.\d+)")
# How a decimal comma looks that can stand between no thousands.
_DECIMAL_COMMA = re.compile(r"[+-]?(\d+,(\d{1,2}|\d{4,})|0,\d+|\d{4,},\d+)")


def with_signs(
    table: Table,
    numbers: Sequence[str],
    decimal: str | None,
    thousands: str | None,
    complaints: Complaints,
) -> tuple[Table, list[str]]:
    """Return a table with the signs in its numbers, and notes on what was guessed.

    Args:
        numbers: the names of columns that hold numbers.
        decimal: the sign before decimals, "." or ","; None: ".", unless a column says otherwise.
        thousands: the sign between thousands; None: none, but where it can be nothing else.
        complaints: take a column in which a sign may stand before decimals or between thousands.

    Raises:
        IndicatorError: there is no such sign, or it is asked to be both.
    """
    for option, sign in (("--decimal", decimal), ("--thousands", thousands)):
        if sign not in (None, ".", ","):
            raise IndicatorError(f"{option} {sign}: should be . or ,")
    if decimal is not None and decimal == thousands:
        raise IndicatorError(f"--thousands {thousands}: should be another sign than --decimal")
    notes = []
    columns = [table.columns[name] for name in numbers if name in table.columns]
    decimal = decimal or table.decimal or ("," if thousands == "." else None)
    if decimal is None and thousands is None and (text := _both_signs(columns)):
        signs = re.sub(r"[\d+-]", "", text)
        thousands = signs[0]
        decimal = signs[-1]
        notes.append(
            f"Numbers are taken to have {thousands} between thousands and {decimal} before "
            f"decimals, as in {text}."
        )
    if decimal is None and (text := _decimal_comma(columns)):
        decimal = ","
        notes.append(f"Decimals are taken to have a comma, as in {text}.")
    if decimal is None and thousands is None:
        for cells in columns:
            with complaints.noted():
                _refuse_thousands(cells)
    return replace(table, decimal=decimal or ".", thousands=thousands), notes


def sign_before_decimals(
    table: Table, columns: Sequence[Cells], decimal: str | None, thousands: str | None
) -> str:
    """Return the sign before decimals, as said or as these columns show; see `with_signs`."""
    said = decimal or table.decimal or ("," if thousands == "." else None)
    if said is not None or thousands is not None:
        return said or "."
    if text := _both_signs(columns):
        return re.sub(r"[\d+-]", "", text)[-1]
    return "," if _decimal_comma(columns) else "."


def _both_signs(columns: Sequence[Cells]) -> str | None:
    """Return a cell with a sign between thousands and one before decimals; None: none has both."""
    texts = {text for cells in columns for text in cells.texts}
    return min((text for text in texts if _BOTH_SIGNS.fullmatch(text)), default=None)


def _decimal_comma(columns: Sequence[Cells]) -> str | None:
    """Return a cell whose comma stands before decimals, if no number has a point; None: none."""
    texts = {text for cells in columns for text in cells.texts if not means_no_number(text)}
    if any("." in text and like_a_number(text) for text in texts):  # a date is none
        return None
    return min((text for text in texts if _DECIMAL_COMMA.fullmatch(text)), default=None)


def _refuse_thousands(cells: Cells) -> None:
    """Refuse a column in which "1.200" beside "980" may be 1200 or 1.2."""
    first = {text: row for row, text in reversed([*enumerate(cells.texts)]) if text}
    plain_numbers = {text: row for text, row in first.items() if text.isdecimal()}
    with_points = [text for text in first if re.fullmatch(r"[1-9]\d{0,2}\.\d{3}", text)]
    if not (plain_numbers and with_points) or len(plain_numbers) + len(with_points) < len(first):
        return
    largest = max(plain_numbers, key=float)
    smallest = min(with_points, key=float)
    if float(largest) >= 10.0 * float(smallest):
        table = cells.table
        raise cells.error(
            first[smallest],
            f"is {smallest.replace('.', '')} or {float(smallest):g}, beside {largest} in "
            f"{table.line_word} {table.lines[plain_numbers[largest]]}: should be without a sign "
            "between thousands; or say --thousands . where it is one, --decimal . where decimals "
            "have a point",
        )
