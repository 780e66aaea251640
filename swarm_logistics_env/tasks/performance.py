"""What the performance P of a run in a parallel environment is: the sum of what each step gives."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from swarm_logistics_env.errors import StudyError

from .parallel_policies import Env, Value

# What one step adds to P: of the environment after the step, its rewards and its infos.
Gain = Callable[[Env, Mapping[str, Value], Mapping[str, Value]], float]

REMEDY = (
    "the indicators are ratios, so P needs a true zero: give another measure (performance=a "
    "function of env, rewards and infos, e.g. a count of what was done), or normalise the scores "
    "by two declared references (references=(score that counts as 0, score that counts as 1))"
)


@dataclass(frozen=True)
class SumOfRewards:
    """The sum of all rewards.

    Args:
        shared: whether each agent is given the reward of the whole team, so that it counts once.
    """

    shared: bool = False

    def __call__(self, env: Env, rewards: Mapping[str, Value], infos: Mapping[str, Value]) -> float:
        """Return what one step adds."""
        return _total(rewards.values(), self.shared)


@dataclass(frozen=True)
class SumOfInfos:
    """The sum of one key of the agents' infos; an agent without it adds nothing.

    Args:
        key: e.g. "deliveries", of what an agent did in this step.
        shared: whether each agent is told the number of the whole team, so that it counts once.
    """

    key: str
    shared: bool = False

    def __call__(self, env: Env, rewards: Mapping[str, Value], infos: Mapping[str, Value]) -> float:
        """Return what one step adds."""
        return _total((info[self.key] for info in infos.values() if self.key in info), self.shared)


def in_words(gain: Gain, references: tuple[float, float] | None) -> str:
    """Return what P is, for a report."""
    if isinstance(gain, SumOfRewards):
        words = "the sum of the rewards"
    elif isinstance(gain, SumOfInfos):
        words = f"the sum of {gain.key!r} in the infos"
    else:
        document = inspect.getdoc(gain) or f"the sum of {name_of(gain)} over the steps"
        words = document.splitlines()[0].rstrip(".")
    if references is not None:
        words += f", as a score between {references[0]:g} (0) and {references[1]:g} (1)"
    return words


def name_of(function: Callable[..., Value]) -> str:
    """Return the import path of a function, or how it writes itself."""
    if hasattr(function, "__qualname__"):
        return f"{getattr(function, '__module__', '')}:{function.__qualname__}"
    return repr(function)


def performance_of(gains: list[float], references: tuple[float, float] | None) -> float:
    """Return P of a run from what its steps gave.

    Raises:
        StudyError: P is no number of 0 or more, or without references a step takes from it.
    """
    for step, gain in enumerate(gains, start=1):
        if not math.isfinite(gain):
            raise StudyError(f"P: step {step} adds {gain}: should be a finite number")
        if gain < 0 and references is None:
            raise StudyError(f"P: step {step} adds {gain:g}: should be 0 or more; {REMEDY}")
    total = math.fsum(gains)
    if references is None:
        return total
    zero, one = references
    score = (total - zero) / (one - zero)
    if score < 0:
        raise StudyError(
            f"P: the score {total:g} is below the reference {zero:g} that counts as 0: should be "
            "a reference that no run falls below"
        )
    return score


def _total(values: Iterable[Value], shared: bool) -> float:
    numbers = [float(value) for value in values]
    if not shared:
        return math.fsum(numbers)
    return math.fsum(numbers) / max(len(numbers), 1)
