"""A failure mode of your own, met by a swarm: robots that hoard what they lift, out of mid-run."""

from __future__ import annotations

from swarm_logistics_env import FAILURE_MODES, policies, spi, swarm_logistics_v0
from swarm_logistics_env.policies.policy import decide, start
from swarm_logistics_env.world.warehouse.failure_modes import FailureMode
from swarm_logistics_env.wrappers import FaultInjection

# Any combination of lost capabilities is a mode.
FAILURE_MODES["hoarder"] = FailureMode(
    "tells timer 0, delivers nothing, and drives at a third of its speed",
    speed=1 / 3,
    delivers=False,
    honest=False,
)


def delivered(env, seed):
    """Play Swarm D-T in an environment with wrappers; return P."""
    policy = policies.load("swarm-dt")
    observations = env.reset_arrays(seed=seed)
    start(policy, env.warehouse.scenario, seed)
    while env.agents:
        observations, *_ = env.step_arrays(decide(policy, observations, env.warehouse.state))
    return env.warehouse.state.delivered


def main(seeds=10, n_robots=25, m=2, duration=300.0):
    def play(mode):
        env = swarm_logistics_v0.parallel_env(n_robots=n_robots, duration=duration)
        if mode is not None:
            env = FaultInjection(env, mode, robots=m, onset=duration / 3)
        return [delivered(env, seed) for seed in range(seeds)]

    p_o, p_f, p_s = play(None), play("hoarder"), play("removed")
    estimates = [
        spi.robustness(p_o, p_f, n=n_robots, m=m),
        spi.fault_tolerance(p_o, p_f, p_s, n=n_robots, m=m),
    ]
    for estimate in estimates:
        limits = ""
        if estimate.low is not None:  # seeds that do not differ give no interval
            limits = f" [{estimate.low:.2f}, {estimate.high:.2f}]"
        print(f"{estimate.indicator} = {estimate.value:.2f}{limits}: {estimate.verdict}")
    return estimates


if __name__ == "__main__":
    main()
