"""A gate for continuous integration: does a changed controller deliver less, or cope worse?

Ends with 1 if it does. At the command line the same is
`swarm-logistics study compare results/gate/old results/gate/new --fail-if "..."`.
"""

from __future__ import annotations

import sys

from swarm_logistics_env import policies
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.verdicts.gate import Gate, answers

GATES = ("change < 0", "R < -0.5 at FM1")


def main(seeds=10, duration=200.0, out="results/gate"):
    controllers = {
        "old": policies.load("swarm-dt"),
        "new": policies.load("swarm-dt", taxis_gain=0.2),  # the change to be judged
    }
    results = {}
    for name, controller in controllers.items():
        study = Study(
            policies=[controller],
            seeds=seeds,
            scenario={"duration": duration},
            faults=[{"modes": ["FM1"], "robots": [2]}],
            out=f"{out}/{name}",
        )
        study.run()
        results[name] = study.findings()

    failed = False
    for text in GATES:
        for answer in answers(Gate.parse(text), results["old"], results["new"]):
            failed |= answer.fails
            print(f"{'FAILS ' if answer.fails else 'passes'} (fails if {text}): {answer.name}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
