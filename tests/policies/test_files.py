from __future__ import annotations

import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from safetensors.numpy import load_file, save_file

from swarm_logistics_env import policies
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.policies import PolicyCard, files, identity, read_card
from swarm_logistics_env.policies.files import CARD, write_policy

Tensors = dict[str, NDArray[np.float32]]


def test_what_is_written_is_read_back(
    card: PolicyCard, tensors: Tensors, file: Path, rows: NDArray[np.float32]
) -> None:
    policy: Any = policies.load(str(file))
    assert policy.card == card
    assert read_card(file) == card
    assert policy.tensors.keys() == tensors.keys()
    assert all((policy.tensors[name] == tensors[name]).all() for name in tensors)
    assert identity(policy) == identity(policies.load(str(file)))
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_a_card_from_before_there_were_drift_and_scores_reads_them_as_none(
    card: PolicyCard, tensors: Tensors, file: Path
) -> None:
    earlier = card.replace(scenario={"n_robots": 7}).to_json()
    for field in (',"scored_with":{}', '"heading_drift":0.0,'):
        assert field in earlier
        earlier = earlier.replace(field, "")
    rewrite(file, earlier, tensors)
    assert read_card(file) == card.replace(scenario={"heading_drift": 0.0, "n_robots": 7})
    drifting = card.replace(scenario={"heading_drift": 0.1})
    assert drifting.scenario == {"heading_drift": 0.1}


def test_a_file_that_is_cut_short_is_refused(file: Path) -> None:
    whole = file.read_bytes()
    for length in (0, 5, 100, len(whole) // 2, len(whole) - 1):
        file.write_bytes(whole[:length])
        refused(file, "is cut short or no safetensors file")


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
    refused(file, "carries a pickle, which executes code")
    assert not (tmp_path / "executed").exists()


def test_a_file_that_is_too_large_is_refused(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "LARGEST_FILE", file.stat().st_size)
    policies.load(str(file))
    monkeypatch.setattr(files, "LARGEST_FILE", file.stat().st_size - 1)
    refused(file, "bytes: a policy file should have at most")


def test_a_tensor_of_another_shape_is_refused(
    card: PolicyCard, tensors: Tensors, file: Path
) -> None:
    wrong = {**tensors, "layers.1.weight": np.zeros((6, 9), np.float32)}
    rewrite(file, card.to_json(), wrong)
    refused(file, r"its tensor layers.1.weight is float32 of shape \(6, 9\).*of shape \(6, 8\)")
    with pytest.raises(PolicyError, match=r"layers\.1\.weight"):
        write_policy(file, card, wrong)


def test_tensors_of_another_type_or_name_or_not_finite_are_refused(
    card: PolicyCard, tensors: Tensors, file: Path
) -> None:
    rewrite(file, card.to_json(), {**tensors, "deviations": np.zeros(3, np.float64)})
    refused(file, "its tensor deviations is float64")
    rewrite(file, card.to_json(), {**tensors, "deviations": np.full(3, np.nan, np.float32)})
    refused(file, "its tensor deviations is not finite")
    others = {("other" if name == "deviations" else name): t for name, t in tensors.items()}
    rewrite(file, card.to_json(), others)
    refused(file, r"lack \['deviations'\] and have \['other'\]")
    for about in (None, {"format": "pt"}):
        save_file(tensors, file, about)
        refused(file, "is safetensors without a card")
    rewrite(file, card.to_json().replace('"format":1', '"format":2'), tensors)
    refused(file, "PolicyCard.format = 2")


def test_columns_that_are_not_read_any_more_are_refused(
    card: PolicyCard, tensors: Tensors, file: Path
) -> None:
    rewrite(file, card.to_json().replace("wall_3", "wall_33"), tensors)
    refused(file, "column 3 is 'wall_33': should be 'wall_3'")
    rewrite(file, card.to_json().replace(',"turns_to_drive"', ""), tensors)
    refused(file, "has 93 columns: should have 94")


@pytest.mark.parametrize("text", ["", "[1]", '{"name": "x"}', '{"a": 1}', "\0"])
def test_foreign_json_is_refused(tensors: Tensors, file: Path, text: str) -> None:
    rewrite(file, text, tensors)
    refused(file, "the card in .* cannot be read")


def test_a_missing_file_and_one_of_another_kind_are_refused(tmp_path: Path) -> None:
    refused(tmp_path / "none.safetensors", "cannot read the policy file .*No such file")
    (tmp_path / "weights.pt").write_bytes(b"weights")
    refused(tmp_path / "weights.pt", "is no policy file: should end in .safetensors or .zip")


def test_a_model_of_stable_baselines3_asks_to_be_trusted(tmp_path: Path) -> None:
    path = tmp_path / "model.zip"
    path.write_bytes(b"")
    refused(path, r"reading it executes the code in it.*trust_code=True.*--trust-code")


def refused(path: Path, sentence: str) -> None:
    with pytest.raises(PolicyError, match=sentence) as error:
        policies.load(str(path))
    assert "\n" not in str(error.value)


def rewrite(file: Path, card: str, tensors: Tensors) -> None:
    assert load_file(file)
    save_file(tensors, file, {CARD: card})
