from __future__ import annotations

import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from safetensors.numpy import save_file

from swarm_logistics_env import policies
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies import PolicyCard, files, identity, read_card
from swarm_logistics_env.policies.files import CARD, DIGEST, content_digest, write_policy

Tensors = dict[str, NDArray[np.float32]]


def refused(path: Path, sentence: str) -> None:
    with pytest.raises(PolicyError, match=sentence) as error:
        policies.load(str(path))
    assert "\n" not in str(error.value)


def test_what_is_written_is_read_back(card: PolicyCard, tensors: Tensors, file: Path) -> None:
    policy: Any = policies.load(str(file))
    assert policy.card == read_card(file) == card
    assert policy.tensors.keys() == tensors.keys()
    assert all((policy.tensors[name] == tensors[name]).all() for name in tensors)
    assert identity(policy) == identity(policies.load(str(file)))
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_a_file_has_equal_bytes_each_time_and_says_when_it_is_not_what_was_written(
    card: PolicyCard, tensors: Tensors, file: Path
) -> None:
    content, identity_before = file.read_bytes(), identity(policies.load(str(file)))
    for _ in range(8):
        write_policy(file, card, tensors)
        assert file.read_bytes() == content
    other = {**tensors, "layers.0.bias": tensors["layers.0.bias"] + 1}
    for held, text in (
        (other, card.to_json()),
        (tensors, card.to_json().replace('"seed":3', '"seed":4')),
        (tensors, card.to_json().replace('"seed":3', '"seed": 3')),
    ):
        save_file(held, file, {CARD: text, DIGEST: content_digest(card.to_json(), tensors)})
        refused(file, "is damaged: its card and numbers are not those that were written")
    save_file(tensors, file, {CARD: card.to_json(), "swarm_logistics_digesu": "0"})
    refused(file, "its header has 'swarm_logistics_digesu'")
    # As version 0.3.0 wrote them.
    save_file(tensors, file, {CARD: card.to_json()})
    with pytest.warns(UserWarning, match=r"small.safetensors has no digest.*write_policy"):
        policy: Any = policies.load(str(file))
    assert identity(policy) == identity_before
    policies.files.write_policy(file, policy.card, policy.tensors)
    assert file.read_bytes() == content


@pytest.mark.parametrize("wrap", ["pickle", "zip"])
def test_a_pickle_is_refused_and_not_executed(file: Path, tmp_path: Path, wrap: str) -> None:
    class Bomb:
        def __reduce__(self) -> Any:
            return Path.touch, (tmp_path / "executed",)

    if wrap == "pickle":
        file.write_bytes(pickle.dumps(Bomb()))
    else:
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr("data.pkl", pickle.dumps(Bomb()))
    refused(file, "is cut short or no safetensors file")
    assert not (tmp_path / "executed").exists()


def test_a_file_that_is_too_large_or_cut_short_is_refused(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = file.read_bytes()
    monkeypatch.setattr(files, "LARGEST_FILE", len(content))
    policies.load(str(file))
    file.write_bytes(content + b" ")
    refused(file, f"has {len(content) + 1} bytes")
    for length in (0, 5, len(content) // 2, len(content) - 1):
        file.write_bytes(content[:length])
        refused(file, "is cut short or no safetensors file")


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"layers.1.weight": np.zeros((6, 9), np.float32)}, r"layers.1.weight .*\(6, 9\).*\(6, 8"),
        ({"deviations": np.zeros(3)}, "its tensor deviations is float64"),
        ({"deviations": np.full(3, np.nan, np.float32)}, "its tensor deviations is not finite"),
        ({"other": np.zeros(3, np.float32)}, r"tensors are .*'other'\]: should be .*weight'\]"),
    ],
)
def test_tensors_that_the_network_has_no_use_for_are_refused(
    card: PolicyCard, tensors: Tensors, file: Path, changed: Tensors, sentence: str
) -> None:
    save_file({**tensors, **changed}, file, {CARD: card.to_json()})
    refused(file, sentence)
    with pytest.raises(PolicyError, match=sentence):
        write_policy(file, card, {**tensors, **changed})


def test_a_card_that_is_none_or_of_another_version_is_refused(
    card: PolicyCard, tensors: Tensors, file: Path
) -> None:
    about: dict[str, str] | None
    for about in (None, {"format": "pt"}):
        save_file(tensors, file, about)
        refused(file, "is safetensors without a card")
    for text in ("", "[1]", '{"name": "x"}', '{"a": 1}', "\0"):
        save_file(tensors, file, {CARD: text})
        refused(file, "cannot be used: PolicyCard")
    for old, new, sentence in (
        ('"format":1', '"format":2', "PolicyCard.format = 2"),
        ("wall_3", "wall_33", "inputs = .* should be the 95 names that this version knows"),
    ):
        save_file(tensors, file, {CARD: card.to_json().replace(old, new)})
        refused(file, sentence)


def test_a_file_that_is_missing_of_another_kind_or_not_trusted_is_refused(tmp_path: Path) -> None:
    refused(tmp_path / "none.safetensors", "cannot read the policy file .*No such file")
    (tmp_path / "weights.pt").write_bytes(b"weights")
    refused(tmp_path / "weights.pt", "no policy .* or a .safetensors or .zip file")
    refused(tmp_path / "model.zip", r"executes the code in it.*trust_code=True.*--trust-code")
