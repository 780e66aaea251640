"""What a search's best is worth on seeds that it was not chosen by."""

from __future__ import annotations

from typing import Any

from swarm_logistics_env import policies, spi
from swarm_logistics_env.policies.card import Score
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.train.evaluation import performances


def confirm(
    policy: str, parameters: dict[str, Any], scenario: Scenario, n_seeds: int, threads: int
) -> tuple[Score, ...]:
    """Return P with these parameters and with the policy's own, and the change, on seeds 0, 1, ..

    The best of many trials looks better than it is, on the seeds of the search.
    """
    p_own, p_best = (
        performances(made, scenario, [()], range(n_seeds), threads)[0]
        for made in (policies.load(policy), policies.load(policy, **parameters))
    )
    condition = f"N = {scenario.n_robots}, no fault"
    scores = [
        Score(measure="P", condition=f"{condition}, {whose}", seeds=n_seeds, **interval._asdict())
        for whose, interval in (
            ("tuned", spi.mean_interval(p_best)),
            ("own parameters", spi.mean_interval(p_own)),
        )
    ]
    if p_own.any():
        change = spi.relative_change(p_own, p_best)
        scores.append(
            Score(
                measure="change",
                condition=f"{condition}, tuned against own parameters",
                value=change.value,
                low=change.low,
                high=change.high,
                seeds=n_seeds,
            )
        )
    return tuple(scores)
