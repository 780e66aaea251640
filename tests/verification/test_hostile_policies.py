"""Policy files that are mangled: refused in one sentence, or played with commands that are numbers.

A file that carries a pickle is refused unread, see tests/policies/test_files.py.
"""

from __future__ import annotations

import random
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env import policies
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.observations import N_COLUMNS
from swarm_logistics_env.policies.files import write_policy
from swarm_logistics_env.policies.learned import Network, PolicyCard, tensor_shapes

pytest.importorskip("safetensors")


def content() -> bytes:
    """A whole policy file."""
    card = PolicyCard(name="small", network=Network(hidden=(8, 6), exploration=0.5))
    rng = np.random.default_rng(0)
    shapes = tensor_shapes(card.network)
    tensors = {name: rng.normal(0, 1, shape).astype("f4") for name, shape in shapes.items()}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "small.safetensors"
        write_policy(path, card, {**tensors, "deviations": np.abs(tensors["deviations"])})
        return path.read_bytes()


WHOLE = content()
HEADER = 8 + int.from_bytes(WHOLE[:8], "little")


def mangled(source: random.Random) -> bytes:
    """Return the file with bytes changed, cut or doubled, mostly where its header is."""
    result = bytearray(WHOLE)
    for _ in range(source.randint(1, 4)):
        end = max(len(result), 1)
        start = source.randrange(min(end, HEADER if source.random() < 0.8 else end))
        stop = start + source.choice([0, 1, 1, 2, 8, 200])
        some = bytes(source.randrange(256) for _ in range(min(stop - start, 8)))
        result[start:stop] = source.choice([b"", some, b"9" * 12, b'"', b"{" * 200, b"null"])
    return bytes(result)


@given(source=st.randoms(use_true_random=False))
def test_any_policy_file_is_refused_or_plays(source: random.Random) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mine.safetensors"
        path.write_bytes(mangled(source))
        try:
            policy = policies.load(str(path))
        except PolicyError as error:
            said = str(error)
        else:
            said = ""
            policy.reset(2, 0)
            commands = policy.act(np.ones((2, N_COLUMNS), np.float32))
            assert commands.shape == (2, 4)
        assert len(said.splitlines()) <= 1, said
        assert [inside.name for inside in Path(folder).iterdir()] == [path.name]
