"""The browser that tests drive."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from verification.browser import Browser


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Browser]:
    try:
        one = Browser(tmp_path / "profile", (1280, 860))
    except FileNotFoundError as error:
        pytest.skip(str(error))
    yield one
    one.close()
