"""Files of ours with a bit flipped: what is read is what was written, or the damage is told."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from swarm_logistics_env import policies
from swarm_logistics_env.errors import PolicyError, TrainingError
from swarm_logistics_env.policies.files import read_policy
from swarm_logistics_env.policies.spec import WEIGHTS

FLIPS = max(40, settings().max_examples // 10)  # 200 at night


def flipped(whole: bytes, first: int = 0) -> Iterator[bytes]:
    """Yield the content with one bit flipped, at places that are the same every time.

    Args:
        first: the byte from which on most of them lie; the others lie anywhere.
    """
    source = random.Random(51)
    for number in range(FLIPS):
        place = source.randrange(first if number % 4 else 0, len(whole))
        yield (
            whole[:place] + bytes([whole[place] ^ (1 << source.randrange(8))]) + whole[place + 1 :]
        )


@pytest.mark.parametrize("part", ["header", "numbers"])
def test_a_policy_file_with_a_flipped_bit_is_refused_or_the_same(part: str, tmp_path: Path) -> None:
    file = WEIGHTS / "ppo-robust.safetensors"
    whole, sound = file.read_bytes(), read_policy(file)
    end = 8 + int.from_bytes(whole[:8], "little")
    path, refused = tmp_path / "mine.safetensors", 0
    changed, rest = (whole[:end], whole[end:]) if part == "header" else (whole, b"")
    for content in flipped(changed, 0 if part == "header" else end):
        path.write_bytes(content + rest)
        said = None
        try:
            found: Any = policies.load(str(path))
        except PolicyError as error:
            said = str(error)
        if said is None:
            assert found.card == sound.card
            assert policies.identity(found) == policies.identity(sound)
        else:
            assert str(path) in said
            assert len(said.splitlines()) == 1
            refused += 1
    assert refused > 0.9 * FLIPS


def test_a_checkpoint_with_a_flipped_bit_is_refused_before_it_is_unpickled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("stable_baselines3")
    from swarm_logistics_env.train import Training, learner

    training = Training(
        worlds=[{"n_robots": 2}], network={"hidden": (4,)}, scenario={"n_items": 2}, threads=1
    )
    trained = learner.make_learner(training, learner.NetworkView(training), "cpu")
    trained.env.reset()
    learner.save_checkpoint(tmp_path, trained, log={})
    path = tmp_path / learner.CHECKPOINT
    whole, unpickled = path.read_bytes(), []
    assert learner.read_checkpoint(tmp_path) is not None
    monkeypatch.setattr(learner.torch, "load", lambda *_, **__: unpickled.append(1))
    for content in (*flipped(whole), *flipped(whole[:100]), whole[:-1], b"", whole + b"x"):
        path.write_bytes(content)
        with pytest.raises(TrainingError, match=r"checkpoint.pt is damaged .*begin anew"):
            learner.read_checkpoint(tmp_path)
    assert not unpickled
