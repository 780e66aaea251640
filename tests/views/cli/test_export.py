"""`swarm-logistics export`."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from swarm_logistics_env.views.cli import app


def test_a_contract_is_written_for_the_robots_of_a_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    command = ["export", "homing", "--to", "contract", "--preset", "realistic"]
    assert app.run([*command, "--set", "control_period=0.2"]) == 0
    assert capsys.readouterr().out == "Written: homing.yaml\n"
    contract = yaml.safe_load(Path("homing.yaml").read_text(encoding="utf-8"))
    assert (contract["frequency"], contract["body"]["drive"]) == (5.0, "differential")


def test_a_network_is_written(tmp_path: Path) -> None:
    pytest.importorskip("onnx")
    path = tmp_path / "network.onnx"
    assert app.run(["export", "ppo-robust", "--to", "onnx", "--out", str(path)]) == 0
    assert path.stat().st_size > 50_000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["homing", "--to", "yaml"], "--to yaml: no such format; known: c, contract, onnx"),
        (["central", "--to", "contract"], "sees the state of the whole warehouse"),
        (["homing", "--to", "onnx"], "should be a trained one"),
        (["homing", "--to", "contract", "--out", "no/such/folder.yaml"], "cannot write"),
    ],
)
def test_what_cannot_be_exported_is_refused_in_a_sentence(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert app.run(["export", *arguments]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
