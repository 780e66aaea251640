from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import threading
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import swarm_logistics_env
from swarm_logistics_env.core.fingerprint import (
    UNSTABLE,
    changes,
    fingerprint,
    package_code,
)
from swarm_logistics_env.core.records import canonical_json
from swarm_logistics_env.study.tasks.warehouse_task import EPISODE_CODE

PACKAGE = Path(swarm_logistics_env.__file__).parent

CONTENTS = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5)
    | st.binary(max_size=5),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(st.text(max_size=3), inner, max_size=3)
    | st.frozensets(st.integers() | st.text(max_size=3), max_size=3)
    | st.tuples(inner, inner),
    max_leaves=8,
)  # fmt: skip


class Holder:
    def __init__(self, content: Any) -> None:
        self.content = content
        self.again = content

    def act(self, observations: Any) -> Any:
        return observations


def value_of(value: object) -> str:
    return str(fingerprint(value)["value"])


@pytest.mark.daily
@given(CONTENTS, CONTENTS)
def test_objects_of_one_class_differ_exactly_if_their_contents_do(left: Any, right: Any) -> None:
    assert value_of(Holder(left)) == value_of(Holder(left))
    if left != right:
        assert value_of(Holder(left)) != value_of(Holder(right))


@pytest.mark.parametrize(
    ("value", "different"),
    [
        (np.zeros(3), np.zeros((3, 1))),
        (np.zeros(3), np.zeros(3, np.float32)),
        (np.array([1.0, 2.0]), np.array([1.0, 2.5])),
        (np.random.default_rng(1), np.random.default_rng(2)),
        ([1, 2], (1, 2)),
        (1, True),
        ({"a": 1, "b": 2}, {"b": 2, "a": 1}),
        (lambda x: x, lambda x: -x),
        (Holder(1).act, Holder(2).act),
    ],
)  # fmt: skip
def test_what_differs_in_kind_shape_order_or_code_is_another_value(
    value: Any, different: Any
) -> None:
    assert value_of(value) != value_of(different)
    assert value_of(value) == value_of(value)


def files_of(path: Path) -> dict[str, str]:
    files: dict[str, str] = fingerprint(None, [path])["files"]
    return files


def scaled(gain: float) -> Any:
    class Scaled:
        def act(self, observations: Any) -> Any:
            return gain * observations

    return Scaled()


def test_closures_defaults_and_helpers_count() -> None:
    assert value_of(scaled(1.0)) == value_of(scaled(1.0)) != value_of(scaled(2.0))

    def made(source: str) -> str:
        members: dict[str, Any] = {"__name__": "typed"}
        exec(textwrap.dedent(source), members)
        return value_of(members["act"])

    source = """
        GAINS = {"far": 1.0}
        def helper(x): return x + 1
        class Base:
            speed = 1.0
        class Part(Base):
            def go(self, x=2): return [helper(y) for y in x]
        def act(x, part=Part(), *, gain=3): return part.go(x) * gain * GAINS["far"]
    """
    unchanged = made(source)
    assert unchanged == made(source) == made(source.replace("class Base", "\n\n        class Base"))
    for old, new in (
        ("x + 1", "x + 2"), ("speed = 1.0", "speed = 2.0"), ("x=2", "x=4"), ("gain=3", "gain=4"),
        ('"far": 1.0', '"far": 1.5'), ("(Base)", ""), ("helper(y)", "y"),
    ):  # fmt: skip
        assert made(source.replace(old, new)) != unchanged, new


def test_is_equal_in_every_process_and_folder(tmp_path: Path) -> None:
    source = """
        import functools, json, sys
        import numpy as np
        from swarm_logistics_env.core.fingerprint import fingerprint
        sys.path.append("modules")
        from mine import Mine, act
        print(json.dumps([fingerprint(Mine(3)), fingerprint(functools.partial(act, gain=2.0))]))
    """
    for name, hash_seed in (("first", "1"), ("second", "2")):
        folder = tmp_path / name / "modules"
        folder.mkdir(parents=True)
        (folder / "gains.py").write_text("GAIN = 1.0\nNAMES = {'a', 'b', 'c', 'd', 'e'}\n")
        (folder / "mine.py").write_text(
            "import enum, gains\nfrom dataclasses import dataclass\n"
            "class Kind(enum.Enum):\n    A = 1\n    B = 2\n"
            "@dataclass\nclass Mine:\n    n: int\n    kind: Kind = Kind.B\n"
            "    names = frozenset({'x', 'y', 'z'})\n"
            "    def act(self, o): return o in {'p', 'q', 'r'} or gains.GAIN or gains.NAMES\n"
            "def act(o, gain): return gain\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", textwrap.dedent(source)],
            cwd=folder.parent,
            env={**os.environ, "PYTHONHASHSEED": hash_seed},
            capture_output=True,
            text=True,
            check=True,
        )
        (tmp_path / f"{name}.json").write_text(done.stdout)
    texts = [(tmp_path / f"{name}.json").read_text() for name in ("first", "second")]
    assert texts[0] == texts[1]
    assert UNSTABLE not in texts[0]
    assert '"gains.py"' in texts[0]


def test_what_cannot_be_compared_is_never_the_same() -> None:
    values = [value_of(Holder(threading.Lock())) for _ in range(2)]
    assert values[0] != values[1]
    assert all(value.startswith(UNSTABLE) for value in values)
    loop: list[Any] = []
    loop.append(loop)
    assert value_of(Holder(loop)) == value_of(Holder(loop))


def test_a_file_counts_with_the_neighbours_that_its_text_names(tmp_path: Path) -> None:
    package = tmp_path / "kit"
    (package / "inner").mkdir(parents=True)
    files = {
        "kit/__init__.py": "",
        "kit/mine.py": "def act():\n    from .inner import deep\n    import_module('later')\n"
        "    import fast\n",
        f"kit/fast{EXTENSION_SUFFIXES[0]}": "\0",  # machine code
        "kit/fast.txt": "",
        "kit/inner/__init__.py": "",
        "kit/inner/deep.py": "import beside\n",
        "kit/later.py": "X = 1\n",
        "kit/unused.py": "X = 1\n",
        "beside.py": "X = 1\n",
        "stranger.py": "X = 1\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    before = files_of(package / "mine.py")
    fast = f"fast{EXTENSION_SUFFIXES[0]}"
    assert before.keys() == {"__init__.py", "mine.py", "deep.py", "later.py", "beside.py", fast}
    for name in files:
        (tmp_path / name).write_text(f"{files[name]}Y = 2\n")
        after = files_of(package / "mine.py")
        changed = {file for file in before | after if before.get(file) != after.get(file)}
        expected = (
            {Path(name).name} if Path(name).name in before and "unused" not in name else set()
        )
        assert changed == expected - ({"__init__.py"} if name == "kit/__init__.py" else set()), name
        (tmp_path / name).write_text(files[name])


def test_comments_and_encoding_do_not_count(tmp_path: Path) -> None:
    bare = "def f(x: int) -> int:\n    return x\nclass A:\n    b = '''text\n# inside'''\n"
    contents = (
        bare.encode(),
        bare.encode("utf-8-sig"),
        bare.replace("return x", "# why\n\n    return x  # what").encode(),
        ("# coding: latin-1\n# B\u00e4r\n" + bare).encode("latin-1"),
        bare.replace("# inside", "# within").encode(),
    )
    digests = []
    for content in contents:
        (tmp_path / "mine.py").write_bytes(content)
        digests.append(files_of(tmp_path / "mine.py"))
    assert [digest == digests[0] for digest in digests] == [True, True, True, True, False]


def test_changes_are_told_by_the_file() -> None:
    before = {"class": "Mine", "value": "1", "files": {"mine.py": "a", "gains.py": "b"}}
    text = canonical_json(before)
    assert changes(text, text) == ""
    for other, words in (
        ({"files": {"mine.py": "a", "gains.py": "c"}}, "gains.py changed"),
        ({"files": {"mine.py": "d"}}, "gains.py, mine.py changed"),
        ({"value": "2"}, "its parameters, attributes or functions changed"),
        ({"value": UNSTABLE + "x"}, ""),
        ({"value": UNSTABLE + "x", "files": {"mine.py": "d", "gains.py": "b"}}, "mine.py changed"),
    ):
        assert changes(text, canonical_json(before | other)) == words
    assert changes("weights 1", "weights 2") == "its parameters, attributes or functions changed"


@pytest.mark.parametrize(
    ("name", "old", "new", "counts"),
    [
        ("core/errors.py", "class ", "MORE = 1\n\n\nclass ", False),
        ("study/report/answer.py", "import ", "import os\nimport ", False),
        ("policies/spec.py", "import ", "import os\nimport ", False),
        ("policies/swarm_dt.py", "2.0 * uniform", "1.9 * uniform", True),
        ("world/motion/memory.py", "STANDS = 0.2", "STANDS = 0.3", True),
        ("compiler/kernels.py", "2.0 * math.pi", "6.28", True),
    ],
)
def test_the_code_version_is_that_of_what_decides_an_episode(
    monkeypatch: pytest.MonkeyPatch, name: str, old: str, new: str, counts: bool
) -> None:
    file, read = PACKAGE / name, Path.read_text
    assert old in file.read_text()

    def read_changed(path: Path, encoding: str) -> str:
        content = read(path, encoding)
        return content.replace(old, new, 1) if path == file else content

    before = package_code(*EPISODE_CODE)
    monkeypatch.setattr(Path, "read_text", read_changed)
    assert (package_code.__wrapped__(*EPISODE_CODE) != before) == counts


def test_patterns_without_an_exclamation_mark_exclude_nothing() -> None:
    assert package_code("**/report/*.py") == package_code("study/report/*.py")
