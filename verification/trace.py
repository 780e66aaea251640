"""What one value passes on its way: an episode into the paper's table, a policy's text into a run.

    python -m verification.trace

A hop is a function of ours that receives the value and returns or forwards it, alone or in a list,
tuple or dict; one that only reads it is none. A container is a type or table that holds it.
"""

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import swarm_logistics_env
from swarm_logistics_env.policies.episode import Episode
from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report.section import Section
from swarm_logistics_env.study.report.tables import cell_tables
from swarm_logistics_env.study.report.write import section_markdown
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Run
from swarm_logistics_env.study.verdicts.cell import Cell

PACKAGE = str(Path(swarm_logistics_env.__file__).parent)
SMALL: dict[str, Any] = {
    "policies": ["swarm-dt"],
    "seeds": 1,
    "scenario": {"duration": 2.0},
    "sizes": [{"values": [2, 3]}],
}


class Trace:
    """Notes the functions of the package that hand on a value of some kinds, and these kinds."""

    def __init__(self, *kinds: type) -> None:
        self.hops: dict[str, None] = {}  # in the order in which they handed it on
        self.containers: dict[str, None] = {}
        self._kinds = kinds
        self._entered: list[bool] = []  # of each frame: whether one below it hands it on

    def of(self, action: Callable[[], object]) -> None:
        """Note what happens during a call."""
        sys.setprofile(self._note)
        try:
            action()
        finally:
            sys.setprofile(None)

    def _held(self, value: object) -> str | None:
        """Return the name of the kind that a value is or has among its elements."""
        inside = list(value.values()) if isinstance(value, dict) else value
        elements = [value, *(inside if isinstance(inside, list | tuple) else ())]
        pairs = [element for element in elements[1:] if isinstance(element, tuple)]
        for member in (*elements, *(part for pair in pairs for part in pair)):
            if isinstance(member, self._kinds):
                return next(kind.__name__ for kind in self._kinds if isinstance(member, kind))
        return None

    def _note(self, frame: FrameType, event: str, argument: object) -> None:
        code = frame.f_code
        if event not in ("call", "return") or not code.co_filename.startswith(PACKAGE):
            return
        if event == "call":
            self._entered.append(False)
            return
        below = self._entered.pop() if self._entered else False
        arguments = [frame.f_locals.get(n) for n in code.co_varnames[: code.co_argcount]]
        n_bound = code.co_varnames[:1] in (("self",), ("cls",))
        received = [kind for value in arguments[n_bound:] if (kind := self._held(value))]
        returned = self._held(argument)
        self.containers |= dict.fromkeys(filter(None, [*received, returned]))
        is_hop = returned is not None or bool(received and below)
        if is_hop and not code.co_name.startswith(("<", "__")):
            self.hops[f"{Path(code.co_filename).stem}.{code.co_qualname}"] = None
        if self._entered and (is_hop or received or below):
            self._entered[-1] = True


def episode_to_table(out: Path) -> Trace:
    """Trace an episode into a cell of the table that the report prints."""
    trace = Trace(Episode, Outcome, Cell, Section)
    Study(out=out / "study", **SMALL).run()  # compiled, and kept away from what is traced
    traced = Study(out=out / "traced", **SMALL)
    trace.of(traced.run)
    trace.of(lambda: [section_markdown(section) for section in cell_tables(traced.findings())])
    trace.containers["the table `runs` of the store"] = None
    return trace


def text_to_policy() -> Trace:
    """Trace a policy's text into the policy that plays a run, as a worker does."""
    trace = Trace(PolicySpec, Run, Policy)
    trace.of(lambda: [run.play() for run in Study(**SMALL).plan().runs[:1]])
    return trace


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        traces = {
            "An episode to a cell of the paper's table": episode_to_table(Path(folder)),
            "A policy's text to a running policy": text_to_policy(),
        }
    for title, trace in traces.items():
        print(f"{title}: {len(trace.hops)} hops, {len(trace.containers)} containers")
        print("  hops:", *trace.hops, sep="\n    ")
        print("  containers:", ", ".join(trace.containers))
