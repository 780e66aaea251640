"""A pytest plugin: tests in the order of the command line, none of which begins late.

MUTANT_SECONDS=60 python -m pytest -p verification.mutants.budget tests/spi tests/report
"""

import os
import time

import pytest

SECONDS = "MUTANT_SECONDS"  # environment variable: after which no further test begins


class _Budget:
    end = float("inf")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the tests of the file that was named first before the others, and start the clock."""
    paths = [config.rootpath / name.partition("::")[0] for name in config.args]
    items.sort(key=lambda item: paths.index(item.path))
    _Budget.end = time.monotonic() + float(os.environ[SECONDS])


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """Skip what would begin too late."""
    if time.monotonic() > _Budget.end:
        pytest.skip("no time is left")
