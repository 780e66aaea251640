"""The same seed gives the same trajectory."""

from __future__ import annotations

import hashlib
import os
import pickle
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from unittest.mock import patch

import numpy as np

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.testing.playing import DeterminismError, Make, Moment, played

HASH_SEEDS = ("0", "20240229")


def check_determinism(
    make: Make, policy: Policy | str = "swarm-dt", seed: int = 0, steps: int = 200
) -> None:
    """Check that a seed fixes the whole trajectory, in any process and beside any other world.

    Plays the episode here, here again while another world steps between every two steps, and in
    fresh processes with other values of PYTHONHASHSEED; compares agents, observations, rewards,
    ends, and where robots and items are, bit for bit.

    Args:
        make: returns a new parallel environment; fresh processes must be able to import it (a
            function of a module, or functools.partial of one, not a lambda).
        policy: the policy that plays: a name, a path, or the object.
        seed: the episode's seed.
        steps: the largest number of steps to play.

    Raises:
        DeterminismError: two trajectories part; it names the first step.
        SetupError: a fresh process cannot import `make` or `policy`.
    """
    first = trajectory(make, policy, seed, steps)
    _compare(first, _beside(make, policy, seed, steps), "beside another live world")
    for hash_seed in HASH_SEEDS:
        fresh = _in_fresh_process(make, policy, seed, steps, hash_seed)
        _compare(first, fresh, f"in a fresh process with PYTHONHASHSEED={hash_seed}")


def trajectory(make: Make, policy: Policy | str, seed: int, steps: int) -> list[str]:
    """Return one digest per moment of an episode."""
    return [_digest(moment) for moment in played(make, policy, seed, steps)]


def _beside(make: Make, policy: Policy | str, seed: int, steps: int) -> list[str]:
    # A policy object keeps what it knows, so each world gets a copy of its own.
    twin = policy if isinstance(policy, str) else pickle.loads(pickle.dumps(policy))
    other = played(make, twin, seed + 1, steps)
    digests = []
    for moment in played(make, policy, seed, steps):
        digests.append(_digest(moment))
        next(other, None)
    return digests


def _in_fresh_process(
    make: Make, policy: Policy | str, seed: int, steps: int, hash_seed: str
) -> list[str]:
    seeded = patch.dict(os.environ, {"PYTHONHASHSEED": hash_seed})
    with seeded, ProcessPoolExecutor(1, get_context("spawn")) as pool:
        try:
            return pool.submit(trajectory, make, policy, seed, steps).result()
        except (pickle.PicklingError, AttributeError, ImportError, BrokenProcessPool) as error:
            raise SetupError(
                f"make = {make!r}: should be a function (or functools.partial of one) that a fresh "
                'process can import, in a script below `if __name__ == "__main__"`; it says: '
                f"{error}"
            ) from error


def _digest(moment: Moment) -> str:
    digest = hashlib.blake2b(digest_size=16)
    ends = (moment.rewards, moment.terminations, moment.truncations)
    digest.update(repr((moment.expected, list(moment.env.agents), ends)).encode())
    for agent, observation in moment.observations.items():
        digest.update(agent.encode())
        digest.update(np.ascontiguousarray(observation).tobytes())
    state = moment.world.state
    for places in (state.robot_position, state.item_position):
        digest.update(places.tobytes())
    return digest.hexdigest()


def _compare(first: list[str], second: list[str], where: str) -> None:
    if first == second:
        return
    pairs = enumerate(zip(first, second))
    parted = next((step for step, (one, other) in pairs if one != other), None)
    if parted is None:
        parted = min(len(first), len(second))
    raise DeterminismError(
        f"the same seed gives another trajectory {where}: they part at step {parted}"
    )
