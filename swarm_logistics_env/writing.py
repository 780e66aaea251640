"""Files that are written whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from swarm_logistics_env.errors import SwarmLogisticsError


@contextmanager
def becoming(path: Path, error_type: type[SwarmLogisticsError]) -> Iterator[Path]:
    """Give a path beside `path`, of the same ending; the file written there takes its place.

    If the block fails, an older file at `path` stays as it was, and nothing is left beside it. What
    is no plain file, as /dev/stdout, is written itself.

    Raises:
        The `error_type`: the file cannot be written; names it and the reason.
    """
    path = Path(path)
    is_plain = path.is_file() or not path.exists()
    whole = path.resolve()  # a link stays a link
    part = whole.with_name(f".{path.stem[:80]}.part{path.suffix}") if is_plain else path
    try:
        yield part
        if is_plain:
            part.replace(whole)
    except OSError as error:
        raise error_type(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        if is_plain:
            part.unlink(missing_ok=True)
