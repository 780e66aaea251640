"""An episode and a policy's text take short ways, as CONTRIBUTING.md promises."""

from __future__ import annotations

from pathlib import Path

from verification.trace import episode_to_table, text_to_policy


def test_ways_are_short(tmp_path: Path) -> None:
    episode, policy = episode_to_table(tmp_path), text_to_policy()
    assert {"episode.run_episode", "tables.cell_tables"} <= episode.hops.keys()
    # A row of the store is compared with its digest; a cell says itself how it stands still, and
    # asks what P of a run is; P of a trial that was stopped lies between two ends.
    assert len(episode.hops) <= 14
    assert len(episode.containers) <= 5
    assert {"spec.PolicySpec.of", "spec.PolicySpec.load"} <= policy.hops.keys()
    # It is compared with what was planned, where it is played, and copied with shared sessions.
    assert len(policy.hops) <= 12
