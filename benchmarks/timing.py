"""Contestants that are run in turns, and what their runs took."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field


@dataclass
class Contestant:
    """Something that is run again and again.

    Attributes:
        name: as the table has it.
        includes: what one of its steps includes.
        run: takes its steps once; returns the seconds they took, or None if this times the run.
        agent_steps: how many steps of one agent a run takes.
        control_steps: how many steps of everything a run takes.
        base: the contestant whose cost its own is divided by, or None.
        uses_wall: timed by the clock, not by processor time, as several threads must be.
        seconds: of each run so far.
    """

    name: str
    includes: str
    run: Callable[[], float | None]
    agent_steps: int
    control_steps: int
    base: str | None = None
    uses_wall: bool = False
    seconds: list[float] = field(default_factory=list)

    def take_turn(self) -> None:
        """Run once and note what it took."""
        # Processor time: on a machine that does other things too, the clock counts them.
        clock = time.perf_counter if self.uses_wall else time.process_time
        began = clock()
        took = self.run()
        self.seconds.append(clock() - began if took is None else took)

    @property
    def microseconds(self) -> float:
        """Median cost of a control step [us]."""
        return statistics.median(self.seconds) / self.control_steps * 1e6

    @property
    def rate(self) -> float:
        """Median agent-steps per second."""
        return self.agent_steps / statistics.median(self.seconds)

    def ratio_to(self, base: Contestant) -> float:
        """Return the median, over turns, of its cost per agent-step as a multiple of `base`'s."""
        here = [seconds / self.agent_steps for seconds in self.seconds]
        there = [seconds / base.agent_steps for seconds in base.seconds]
        return statistics.median(mine / other for mine, other in zip(here, there))


def in_turns(contestants: Sequence[Contestant], repeats: int) -> None:
    """Run everybody once per repeat, so that whatever slows the machine slows all of them."""
    for _ in range(repeats):
        for contestant in contestants:
            contestant.take_turn()
