"""Records the score cards of the shipped policies, beside which `judge` ranks others.

`python docs/score_cards.py` plays what is missing; `make tables` calls it. A policy that needs the
whole state is no swarm, so it has none.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

from swarm_logistics_env import policies
from swarm_logistics_env.report.score_card import RECORDED, STUDY, as_recorded
from swarm_logistics_env.studies import Study

OUT = Path(__file__).parents[1] / "results" / "tables" / "scorecards"


def shipped() -> list[str]:
    """Return the names of the policies that read observations only."""
    return [
        name for name in policies.NAMES if not getattr(policies.load(name), "needs_state", False)
    ]


def main(names: list[str] | None = None) -> None:
    """Play the study for every policy, and write what it says.

    Args:
        names: of the policies; None: all that are shipped.

    Raises:
        SystemExit: a run failed.
    """
    found = {}
    for name in names or shipped():
        study = Study.preset(STUDY, out=OUT / name, policies=(name,))
        tally = study.run(processes=os.cpu_count() or 1)
        if tally.failed:
            raise SystemExit(f"{tally.failed} runs failed: {tally.error}")
        found[name] = as_recorded(study.findings())
    seeds = study.plan().seeds
    recorded = {
        "command": "python docs/score_cards.py",
        "seeds": [seeds[0], seeds[-1]],
        "policies": found,
    }
    RECORDED.write_text(json.dumps(recorded, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
