"""Faults drawn by operators: what can be drawn, which tests are near, and what is told of them."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from coverage import CoverageData

from verification.mutants import copies, reached, sampling
from verification.mutants.mutation import PACKAGE, ROOT, read_equal
from verification.mutants.nearest import Nearest
from verification.mutants.places import find_places, required_parameters


def replacements(source: str) -> list[str]:
    """Return all that a module can become by one fault, each as `before -> after`."""
    tree = ast.parse(source)
    return [
        f"{sampling.shown(place.node)} -> {sampling.shown(new)}"
        for place in find_places(tree, required_parameters([tree]))
        for new in place.replacements
    ]


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("LIMIT = 2", ["2 -> 3", "2 -> 1"]),
        ("SHARE = 0.5", ["0.5 -> 1.0", "0.5 -> 0.25"]),
        ("a < b", ["a < b -> a <= b", "a < b -> a >= b"]),
        ("a is not b", ["a is not b -> a is b"]),
        ("a * b", ["a * b -> a", "a * b -> b", "a * b -> a / b"]),
        ("a and b", ["a and b -> a or b", "a and b -> b", "a and b -> a"]),
        ("-a", ["-a -> a"]),
        ("f(a, b=c)", ["f(a, b=c) -> f(a)"]),
        ("max(a, b)", ["max(a, b) -> min(a, b)", "max(a, b) -> a", "max(a, b) -> b"]),
        ("[a for a in b if c]", ["[a for a in b if c] -> [a for a in b]"]),
        ("{**a, 'b': c}", ["{**a, 'b': c} -> {'b': c}"]),
        ("def f(): g()", ["g() -> pass"]),
        ("def f():\n if a: return", ["a -> not a", "return -> pass"]),
        ("def f() -> bool: return a", ["return a -> return not a"]),
        ("def f() -> float: return a", ["return a -> return a + 1"]),
        ("def f() -> A | None: return a", ["return a -> return None"]),
        ("def f(): raise AError(1)", ["raise AError(1) -> pass"]),
        # Parameters that a function cannot do without stay; those with a default go.
        ("def f(a, *, b=c): ...\nf(a=x, b=y)", ["f(a=x, b=y) -> f(a=x)"]),
    ],
)
def test_operators(source: str, expected: list[str]) -> None:
    assert replacements(source) == expected


@pytest.mark.parametrize(
    "source",
    [
        "__all__ = [*names, 'a']",
        "if TYPE_CHECKING:\n    a = 1",
        "a: Literal[1]",
        "@cache(size=1)\nclass A:\n    'Text.'",
        "def f(a: Literal[1]) -> Literal[1]: 'Text.'",
        "def f():\n warnings.warn(f'{1}', stacklevel=2)",
        "A = TypeVar('A', bound=B)",
        "f'{a:.2f}'",
        "'a' + b",
    ],
)
def test_what_only_readers_see_is_not_drawn(source: str) -> None:
    assert replacements(source) == []


MIRROR = "tests/old/test_sizes.py"
MODULE = '''"""A module."""


def is_large(number: float) -> bool:
    return number > 3.0


def is_small(number: float) -> bool:
    return number < 1.0
'''
TEST = """from swarm_logistics_env.{room}.sizes import is_large


def test_three_is_not_large():
    assert not is_large(3.0)
    assert is_large(4.0)
    assert is_large(6.0)
    assert not is_large(2.5)
"""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Root of a small package with one folder, `old`, with tests."""
    root = tmp_path / "tree"
    files = {
        f"{PACKAGE}/__init__.py": "",
        f"{PACKAGE}/fast_kernels.py": "def _digest():\n    return digest.hexdigest()\n",
        f"{PACKAGE}/old/__init__.py": "",
        f"{PACKAGE}/old/sizes.py": MODULE,
        f"{PACKAGE}/old/user.py": "from .sizes import is_large\n",
        "tests/old/test_sizes.py": TEST.format(room="old"),
        "tests/old/test_other.py": "",
        "tests/old/test_user.py": "",
        "tests/test_door.py": "from swarm_logistics_env.old import sizes\n",
    }
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    return root


def test_nearest_tests_follow_a_folder_that_is_renamed(tree: Path) -> None:
    in_room = ["tests/old/test_user.py", "tests/old/test_other.py"]  # the first is of a user
    assert Nearest(tree).of("old/sizes.py") == [MIRROR, "tests/test_door.py", *in_room]
    for folder in (tree / PACKAGE, tree / "tests"):
        (folder / "old").rename(folder / "new")
    (tree / "tests/test_door.py").write_text("from swarm_logistics_env.new import sizes\n", "utf-8")
    expected = ["tests/new/test_sizes.py", "tests/test_door.py"]
    assert Nearest(tree).of("new/sizes.py")[:2] == expected


def test_tests_that_run_a_line_come_first_the_quickest_before_the_others(
    tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seconds = {"test_slow": 9.0, "test_three[3]": 2.0, "test_quick": 1.0}

    def record(copy: Path, folder: Path, n_workers: int) -> None:
        """Write what a run of pytest would."""
        data = CoverageData(str(folder / "reached.coverage"))
        for name in seconds:
            data.set_context(f"{MIRROR}::{name}|run")
            data.add_lines({str(copy / PACKAGE / "old/sizes.py"): [5]})
        data.write()
        cases = [
            f'<testcase classname="tests.old.test_sizes" name="{name}" time="{time}" />'
            for name, time in seconds.items()
        ]
        (folder / "reached.xml").write_text(f"<suite>{''.join(cases)}</suite>")

    monkeypatch.setattr(reached, "_record", record)
    of_tree = reached.Reached(tree, tmp_path, 1)
    in_order = [f"{MIRROR}::{name}" for name in ("test_quick", "test_three[3]", "test_slow")]
    assert of_tree.of("old/sizes.py", [5, 6], seconds=99.0) == in_order
    assert of_tree.of("old/sizes.py", [5], seconds=4.0) == in_order[:2]
    assert of_tree.of("old/sizes.py", [9], seconds=99.0) == []
    assert of_tree.files_of("old/sizes.py", [5, 6]) == {MIRROR}
    quick, _, slow = in_order
    assert of_tree.quickest_first([MIRROR, slow, quick]) == [quick, slow, MIRROR]
    monkeypatch.setattr(reached, "_record", None)  # it is made once for a tree
    package = sampling.Package(tree, ["sizes"], reached.Reached(tree, tmp_path, 1))
    faults = {fault.line: fault for fault in sampling.draw(package, 0)}
    assert {line: fault.tests[0] for line, fault in faults.items()} == {5: in_order[0], 9: MIRROR}
    # The generated pages are in the record of no line, and are asked of a line without one.
    pages = ("tests/test_docs.py::test_generated_tables_are_current",)
    assert {line: fault.wide for line, fault in faults.items()} == {5: (), 9: (pages,)}


def test_faults_are_those_of_their_seed_and_change_the_code(tree: Path) -> None:
    package = sampling.Package(tree)
    faults = list(sampling.draw(package, 3))
    assert faults == list(sampling.draw(package, 3))
    assert faults != list(sampling.draw(package, 4))
    assert len({fault.source for fault in faults}) == len(faults) == len(package.places)


def test_shares_and_survivors_are_told(
    tree: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def run_tests(copy: Path, tests: Iterable[str], **_: object) -> str:
        """Run the tests without pytest, which takes seconds to start."""
        if "::" in next(iter(tests)):
            return ""  # those that caught faults, without any
        names: dict[str, Any] = {}
        exec((copy / PACKAGE / "old/sizes.py").read_text("utf-8"), names)
        is_right = names["is_large"](4.0) and not names["is_large"](3.0)
        return "" if is_right else f"{MIRROR}::test_three_is_not_large"

    def type_errors(copy: Path) -> Counter[str]:
        text = (copy / PACKAGE / "old/sizes.py").read_text("utf-8")
        return Counter(["an old one", *(["no bool"] if "not number < 1.0" in text else [])])

    monkeypatch.setattr(sampling, "run_tests", run_tests)
    monkeypatch.setattr(sampling, "type_errors", type_errors)
    borrowed = copies.Copies(1, tree, tree.parent / "copies")
    package = sampling.Package(tree, ["sizes"])

    def measure() -> list[str]:
        record = sampling.Made(tree / "made.jsonl", "this tree")
        assert sampling.measure_sample(99, 0, package, borrowed, 1, 60.0, record) == 0
        return capsys.readouterr().out.splitlines()

    *made, total, by_tests, first, second, _, _ = measure()
    assert total == "all: 2 of 6 survive, 33.3% [9.7%, 70.0%]"
    assert by_tests == "tests alone: 3 of 6 survive, 50.0% [18.8%, 81.2%]"
    assert first.startswith("SURVIVES old/sizes.py:9 1.0 -> ")
    assert second.startswith("SURVIVES old/sizes.py:9 number < 1.0 -> number ")
    assert sum(line.endswith(": mypy: no bool") for line in made) == 1
    with (tree / "made.jsonl").open("a") as file:
        file.write('\n["this tr')  # a kill cut it off
    again = measure()  # nothing is made twice
    assert not [line for line in again if " s  old/" in line]
    assert total in again


def test_no_fault_is_made_where_a_golden_trajectory_fails_without_one(
    tree: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    trajectories = tree / "tests/verification/test_trajectories.py"
    trajectories.parent.mkdir()
    trajectories.write_text("")

    def run_tests(copy: Path, tests: Iterable[str], **_: object) -> str:
        assert list(tests) == ["tests/verification/test_trajectories.py"]
        return "that of this name"

    monkeypatch.setattr(sampling, "run_tests", run_tests)
    borrowed = copies.Copies(1, tree, tree.parent / "copies")
    record = sampling.Made(tree / "made.jsonl", "this tree")
    package = sampling.Package(tree, ["sizes"])
    assert sampling.measure_sample(9, 0, package, borrowed, 1, 60.0, record) == 2
    assert capsys.readouterr().out == (
        "that of this name fails without any fault, so it catches none\n"
    )


def test_faults_that_change_nothing_can_still_be_drawn() -> None:
    files = {mutant.file for mutant in read_equal()}
    trees = {file: ast.parse((ROOT / PACKAGE / file).read_text("utf-8")) for file in files}
    required = required_parameters(trees.values())
    drawable = {
        (file, place.where, sampling.shown(place.node), sampling.shown(new))
        for file, tree in trees.items()
        for place in find_places(tree, required)
        for new in place.replacements
    }
    for mutant in read_equal():
        assert (mutant.file, mutant.where, mutant.node, mutant.becomes) in drawable, mutant.name
        assert mutant.survives, mutant.name


def test_the_test_that_fails_is_named_whole_whatever_its_parameters_are(tmp_path: Path) -> None:
    (tmp_path / "test_names.py").write_text(
        "import pytest\n\n\n@pytest.mark.parametrize('name', ['a', 'day (1) - Copy.csv'])\n"
        "def test_short(name):\n    assert len(name) < 9, 'too long - really'\n"
    )
    name = "test_names.py::test_short[day (1) - Copy.csv]"
    assert copies.run_tests(tmp_path, ["test_names.py"], interpreted=False, limit=60.0) == name
    assert copies.run_tests(tmp_path, [name], interpreted=False, limit=60.0) == name
