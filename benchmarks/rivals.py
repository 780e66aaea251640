"""The peers, each in a process of its own, as contestants."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

from benchmarks.peers import PEERS
from benchmarks.timing import Contestant

_SCRIPT = Path(__file__).with_name("peers.py")


class Rival:
    """A peer's worker process.

    Args:
        name: a key of `PEERS`.
        interpreter: that has the peer.

    Raises:
        RuntimeError: the peer is not installed or does not start; says why.
    """

    def __init__(self, name: str, interpreter: str) -> None:
        self._process = subprocess.Popen(
            [interpreter, str(_SCRIPT), name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        # Whatever a peer prints while it starts is none of ours.
        for line in self._process.stdout:
            if line.startswith('{"agent_steps"'):
                self.made = json.loads(line)
                return
        said = self._process.communicate()[1].strip().splitlines()
        raise RuntimeError(said[-1] if said else "said nothing")

    def run(self) -> float:
        """Return the seconds its steps took."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        return float(self._process.stdout.readline())

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def rivals(interpreter: str) -> tuple[list[Contestant], list[Rival], dict[str, str]]:
    """Return the peers that start, their processes, and why the others do not."""
    contestants, processes, missing = [], [], {}
    for name, (shown, _) in PEERS.items():
        try:
            rival = Rival(name, interpreter)
        except (RuntimeError, OSError) as error:
            missing[shown] = str(error)
            continue
        processes.append(rival)
        contestants.append(
            Contestant(
                shown,
                rival.made["includes"],
                rival.run,
                rival.made["agent_steps"],
                rival.made["control_steps"],
            )
        )
    return contestants, processes, missing
