"""`swarm-logistics ros` without ROS 2; with it, tests/robots/test_ros.py runs the command."""

from __future__ import annotations

import sys
from collections.abc import Callable

import pytest


def test_where_ros_is_missing_a_sentence_says_how_to_get_it(
    command: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    sentence = command("ros homing --set n_robots=2", code=2)
    assert "ROS 2 is missing" in sentence
    assert "[ros]'" in sentence
    assert "loss" in command("ros homing --loss 2", code=2)
