from __future__ import annotations

import pytest

from swarm_logistics_env.cli.terminal_tables import show
from swarm_logistics_env.report.result_tables import Section


def test_no_number_is_cut_at_a_narrow_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich takes the output for a terminal
    monkeypatch.setenv("COLUMNS", "30")
    value = "123.4567[122.1234,125.9876]"
    show(Section("P", ("policy", "P", "R"), (("swarm-dt-follow", value, value),)))
    printed = capsys.readouterr().out
    assert "…" not in printed
    for digits in ("1", "2", "3", "4", "5", "6", "7", "8", "9"):
        assert printed.count(digits) >= 2 * value.count(digits)
