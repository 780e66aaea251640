"""A pytest plugin: tests in the order of the command line, until they have cost enough.

Seconds are those of a core, so that a busy machine runs the same tests.

MUTANT_SECONDS=60 python -m pytest -p verification.mutants.budget tests/spi tests/study/report
"""

import os
import resource

import pytest

SECONDS = "MUTANT_SECONDS"  # environment variable: seconds of a core after which no test begins


class _Budget:
    end = float("inf")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put tests in the order in which they, or else their files, were named; start the clock."""
    ranks = {name: rank for rank, name in reversed([*enumerate(config.args)])}
    tests = {item.nodeid: item for item in items}  # one that was named twice runs once
    files = {name: name.partition("::")[0] for name in tests}
    ranked = sorted(tests, key=lambda name: ranks.get(name, ranks.get(files[name], len(ranks))))
    items[:] = [tests[name] for name in ranked]
    _Budget.end = _seconds() + float(os.environ[SECONDS])
    # One test that never ends costs no more than all others.
    most = round(2.0 * _Budget.end) + 60
    resource.setrlimit(resource.RLIMIT_CPU, (most, most))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """Skip what would begin too late."""
    if _seconds() > _Budget.end:
        pytest.skip("no time is left")


def _seconds() -> float:
    """Return what this process and those that it started and that ended have cost [s]."""
    return sum(os.times()[:4])
