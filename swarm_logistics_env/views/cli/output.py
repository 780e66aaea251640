"""Standard output and error that no encoding and no closed reader can break."""

from __future__ import annotations

import codecs
import errno
import io
import os
import sys
from typing import Any, TextIO

PROGRAM = "swarm-logistics"

# What a command ends with.
DONE = 0
FAILED = 1
BAD_INPUT = 2
STOPPED = 130
EXIT_CODES = {
    DONE: "done",
    FAILED: "a run failed, or a gate, or code of your own",
    BAD_INPUT: "bad input, told in one sentence",
    STOPPED: "stopped by Ctrl-C",
}

# What is written instead of a sign that the encoding of a terminal or a pipe lacks.
_SPELLINGS = {
    "→": "->", "–": "-", "—": "-", "−": "-", "…": "...", "†": "+", "∞": "inf", "×": "x",
    "≤": "<=", "≥": ">=", "±": "+/-", "µ": "u", "μ": "u", "°": " deg", "─": "-", "━": "-",
}  # fmt: skip
_SPELLED = "swarm-logistics-spelled"  # the name of the error handler


def _spell(error: UnicodeError) -> tuple[str, int]:
    """Return ASCII for signs that cannot be encoded: a spelling, or an escape."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    signs = error.object[error.start : error.end]
    escaped = (sign.encode("ascii", "backslashreplace").decode() for sign in signs)
    spelled = (_SPELLINGS.get(sign, escape) for sign, escape in zip(signs, escaped))
    return "".join(spelled), error.end


codecs.register_error(_SPELLED, _spell)


class _Unbroken(io.RawIOBase):
    """Writes where `raw` does, and nowhere once its reader is gone: the work goes on."""

    def __init__(self, raw: io.RawIOBase) -> None:
        self._raw = raw

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._raw.fileno()

    def isatty(self) -> bool:
        return self._raw.isatty()

    def close(self) -> None:
        super().close()
        self._raw.close()

    def write(self, data: Any) -> int | None:
        try:
            return self._raw.write(data)
        except OSError as error:
            # Windows calls a pipe whose reader is gone an invalid argument.
            is_gone = isinstance(error, ConnectionError) or (
                sys.platform == "win32" and error.errno == errno.EINVAL
            )
            if not is_gone:
                raise
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            return memoryview(data).nbytes


class _Ascii(io.TextIOWrapper):
    """A stream of ASCII alone: click takes it for a mistake, and would write UTF-8 beside it."""

    buffer: Any = None


def prepare_output() -> None:
    """Let standard output and error write every text in their encodings, read or not.

    A sign that the encoding lacks is spelled in ASCII. What nobody reads, as the pipe is closed or
    was never open, is lost without an error.
    """
    _occupy_closed()
    sys.stdout, sys.stderr = _prepare(sys.stdout), _prepare(sys.stderr)


def _occupy_closed() -> None:
    """Open the standard streams that are closed: the next file would be taken for one of them."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(number)


def _prepare(stream: TextIO | None) -> TextIO:
    if stream is None:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        stream = os.fdopen(nowhere, "w", encoding="utf-8")
    if not isinstance(stream, io.TextIOWrapper):
        return stream  # of a notebook, a test or a program that has taken it over
    encoding = stream.encoding
    in_lines = stream.line_buffering
    at_once = stream.write_through
    buffer = stream.detach()
    raw: Any = buffer.detach() if isinstance(buffer, io.BufferedWriter) else buffer
    is_ascii = codecs.lookup(encoding).name == "ascii"
    return (_Ascii if is_ascii else io.TextIOWrapper)(
        io.BufferedWriter(_Unbroken(raw)), encoding, _SPELLED, "\n", in_lines, at_once
    )
