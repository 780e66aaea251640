"""Settings for all tests: how hard hypothesis searches, and what needs the package's sources."""

from __future__ import annotations

import contextlib
import importlib
import math
import os
import pkgutil
import sys
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import Phase, settings

import swarm_logistics_env
from swarm_logistics_env.compiler import fast_kernels
from swarm_logistics_env.study.report import drawing
from swarm_logistics_env.study.studies import Study

# Takes the name of a file in tests/frozen, and the lines that should stand in it.
Check = Callable[[str, Sequence[str]], None]
# Derandomized: the gate gives the same answer twice. No deadline: a time would test the machine.
settings.register_profile("default", max_examples=100, derandomize=True, deadline=None)
settings.register_profile("nightly", max_examples=2000, deadline=None)
# Only whether there is an example that fails, not the simplest: see verification.mutants.
settings.register_profile(
    "mutants", parent=settings.get_profile("default"), phases=(Phase.explicit, Phase.generate)
)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))

# Whether compiling is told would depend on the machine's speed, and tests read what is printed.
fast_kernels._SILENCE = math.inf

# To draw is half of the time of a report, and few tests look at what is drawn.
_draw_file = drawing._file


def _draw_nothing(_: Any, ending: str) -> bytes:
    return b'<svg xmlns="http://www.w3.org/2000/svg"/>' if ending == "svg" else b""


vars(drawing).update(_file=_draw_nothing)


@contextlib.contextmanager
def figures_drawn(*formats: str) -> Iterator[None]:
    """Draw figures in these formats, without any in all three, for a test that looks at them."""

    def draw(canvas: Any, ending: str) -> bytes:
        function = _draw_file if ending in (formats or drawing._METADATA) else _draw_nothing
        return function(canvas, ending)

    vars(drawing).update(_file=draw)
    try:
        yield
    finally:
        vars(drawing).update(_file=_draw_nothing)


ROOT = Path(__file__).parents[1]
# Where it is recorded which tests run which lines, see verification/mutants/reached.py.
MEASURES_ALL = "MEASURE_ALL_TESTS" in os.environ
PACKAGE = Path(swarm_logistics_env.__file__).parent
# Beside an installed package (`make test-lowest`) there is no source tree to read.
if not (ROOT / "swarm_logistics_env").is_dir():
    collect_ignore = ["test_imports.py", "test_packaging.py", "verification/test_mutants.py"]


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """Import all modules before the tests, so that their lines count whichever test comes first."""
    if session.config.getoption("--cov", None):
        for module in pkgutil.walk_packages(swarm_logistics_env.__path__, "swarm_logistics_env."):
            importlib.import_module(module.name)
    with _uncovered():
        return (yield)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the tests that mirror nothing first: kernels compile faster without coverage."""
    items.sort(key=lambda item: mirrors(item.path))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Measure coverage with tests that mirror the package alone: measured ones are slower."""
    measured = MEASURES_ALL or mirrors(item.path)
    with contextlib.nullcontext() if measured else _uncovered():
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Measure the fixtures of a test that is marked `unmeasured`, but not the test."""
    measured = MEASURES_ALL or item.get_closest_marker("unmeasured") is None
    with contextlib.nullcontext() if measured else _uncovered():
        return (yield)


@contextlib.contextmanager
def _uncovered() -> Iterator[None]:
    # pytest-cov's `no_cover` ends one of the two measurements that a worker of xdist starts.
    trace, trace_of_threads = sys.gettrace(), threading.gettrace()
    sys.settrace(None)
    threading.settrace(None)
    try:
        yield
    finally:
        sys.settrace(trace)
        threading.settrace(trace_of_threads)


def mirrors(test: Path) -> bool:
    """Return whether a file of tests is of one module or folder of the package."""
    folder = test.parent.relative_to(ROOT / "tests")
    name = folder if folder.name else test.stem.removeprefix("test_")
    return any((PACKAGE / f"{name}{suffix}").exists() for suffix in ("", ".py"))


SMALL: dict[str, Any] = {
    "name": "small",
    "seeds": 3,
    "scenario": {
        "n_robots": 4,
        "n_items": 8,
        "warehouse_width": 3.0,
        "warehouse_height": 3.0,
        "delivery_width": 1.0,
        "duration": 20.0,
    },
    "sizes": [{"values": [2, 4, 6]}],
    "faults": [{"modes": ["FM1", "FM4"], "robots": [1, 2], "onsets": [0.0, 10.0]}],
    "parameters": [{"name": "delivery_width", "values": [1.0, 0.5]}],
    "ablations": [{"policy": "random-walk"}],
}


@pytest.fixture
def small() -> dict[str, Any]:
    """Fields of a study with all four kinds of factor, of 20 s of simulated time."""
    return {**SMALL}


@pytest.fixture
def sizes(small: dict[str, Any]) -> dict[str, Any]:
    """Fields of the same study, of the three swarm sizes alone."""
    return {**small, "faults": [], "parameters": [], "ablations": []}


@pytest.fixture(scope="session")
def played(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Directory of the small study, played in this process; not to be changed."""
    directory = tmp_path_factory.mktemp("played")
    assert Study(out=directory, **SMALL).run().failed == 0
    return directory


@pytest.fixture
def check_recorded(tmp_path_factory: pytest.TempPathFactory) -> Check:
    """Compares lines with those that tests/frozen holds, and says where the new ones lie."""
    frozen = Path(__file__).parent / "frozen"

    def check(name: str, lines: Sequence[str]) -> None:
        made = tmp_path_factory.mktemp("made") / name
        made.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
        recorded = (frozen / name).read_text(encoding="utf-8").splitlines()
        assert lines == recorded, f"if {made} is as it should be, put it into {frozen}"

    return check
