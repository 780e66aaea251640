"""The Swarm Performance Indicators as rewards."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import SetupError, suggest
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.rewards import finite_number
from swarm_logistics_env.environment.spaces import ArrayStep

from .indicator_payments import (
    INDICATORS,
    PERFORMANCES,
    GivenPerformances,
    Payment,
    RunningMeans,
    derivative_of,
    indicator_of,
)
from .wrapper import Condition, Wrapper, changes_of, condition_of

CREDITS = ("team", "deliverer")


class IndicatorReward(Wrapper):
    """Pays indicators: the undiscounted return of an episode is the indicator of that episode.

    Each delivery pays its share, and the first step the constant (paper, equations S, FT, R, A):

    ========= ================== ==================== ===================================
    indicator share              constant             paid in episodes with
    ========= ================== ==================== ===================================
    S         N / (m P_N)        -N / m               N + m robots, N the environment's own
    FT        1 / P_o            -P_S / P_o           m faulty robots
    R         1 / P_o            -1 + m / N           m faulty robots
    A         1 / (P_o abs(dx))  1 - 1 / abs(dx)      one parameter changed by dx [relative]
    P         1                  0                    any conditions
    ========= ================== ==================== ===================================

    The `Condition` of an episode is read from the warehouse. So it may come from the options of a
    reset or from wrappers inside or outside of this one. Removed robots do not count as faulty.
    When a parameter changes in mid-run, or a fault by role chooses its robots, the next reward
    corrects what was paid before, so that the return is still the indicator.

    *References as numbers.* Give P_o of the environment's own scenario, which then stands for
    episodes with other parameters as well, or a performance for each condition, for instance the
    means of a study. Then episodes without faults and changes pay
    nothing (except P). Beware: **R, FT, S and A rise when P_o falls**, and nothing in such a
    reward holds P_o up. So `measured` has P_o of the episodes that are played beside it. Look at
    both, or add P to the weights.

    *References as running means.* Give a `RunningMeans` to measure references in episodes of the
    policy in training, which are played in between. Its means at the start of an episode hold for
    the whole episode. The indicator then depends on the policy through its references too.
    Therefore reference episodes are paid the derivative of the indicator with respect to their
    performance:

    * no faults: -(n_F / n_o) P_F / P_o^2 per delivery for R; -(n_F / n_o) (P_F - P_S) / P_o^2 for
      FT; the same as for R times N/m or 1/abs(dx), with P_(N+m) or P_new for P_F, for S and A;
    * m robots removed: -(n_F / n_S) / P_o per delivery for FT;

    summed over all conditions F that have this one as reference; n are the episodes so far, so
    that the mean return over any mix of episodes has the gradient of the mean indicator (with as
    many of either, the ratio is 1). Their constant makes their mean return 0, so that all terms
    are of one size. A performance in no divisor that was not measured yet counts as 0.

    Args:
        env: the environment, or a wrapper of one.
        weights: "R", or several with their weights, e.g. {"R": 1.0, "P": 0.02}.
        references: P_o [items], {condition: P}, or `RunningMeans`, which several may share.
        credit: the robots that get the share of a delivery. "team": each robot present gets all
            of it, so that the return of each is the indicator. "deliverer": the robot that
            delivers; the constant is divided among all robots present, so that the sum of all
            returns is the indicator. Robots that are away count as present.
        constant: whether to pay the constant.
        own_reward: weight of the wrapped environment's own reward, which is added, for shaping.

    Attributes:
        condition: the condition of this episode.
        payments: the payments of this episode by indicator, without weights.
        measured: running means of all conditions played, also if references are numbers. An
            episode counts when the next one begins.

    Raises:
        SetupError: an argument is not allowed. The reset, and `payments_of` before it, raise it
            if a reference is missing, P_o = 0, or the indicator is undefined, as FT with m = N.

    Example:
        >>> from swarm_logistics_env import Fault, swarm_logistics_v0
        >>> env = swarm_logistics_v0.parallel_env(n_robots=25)
        >>> env = IndicatorReward(env, "R", references=33.0)
        >>> observations, infos = env.reset(seed=0, options={"faults": [Fault("FM1", 2)]})
        >>> env.condition
        Condition(n_robots=25, modes=('FM1',), n_failed=2, n_removed=0, changes=())
        >>> env.payments["R"].share == 1 / 33, round(env.payments["R"].constant, 9)
        (True, -0.92)

        Worlds that share their means, every other one with faults; `SwarmVecEnv(make_env=...)`:

        >>> from swarm_logistics_env.wrappers import FaultInjection
        >>> means = RunningMeans(window=20)
        >>> def make_env(world):
        ...     env = swarm_logistics_v0.parallel_env(n_robots=25)
        ...     env = FaultInjection(env, "FM1", robots=2) if world % 2 else env
        ...     return IndicatorReward(env, {"R": 1.0, "P": 0.02}, references=means)
    """

    def __init__(
        self,
        env: SwarmLogisticsEnv | Wrapper,
        weights: str | Mapping[str, float],
        *,
        references: float | Mapping[Condition, float] | RunningMeans,
        credit: Literal["team", "deliverer"] = "team",
        constant: bool = True,
        own_reward: float = 0.0,
    ) -> None:
        super().__init__(env)
        self.weights = _checked_weights(weights)
        if credit not in CREDITS:
            raise SetupError(f"credit = {credit!r}{suggest(str(credit), CREDITS)}")
        self.credit = credit
        self.constant = constant
        self.own_reward = finite_number("own_reward", own_reward)
        self._base = self.unwrapped.scenario
        self.condition = Condition(self._base.n_robots)
        self._references: GivenPerformances | RunningMeans
        if isinstance(references, RunningMeans):
            self._references = self.measured = references
        else:
            performances = (
                references if isinstance(references, Mapping) else {self.condition: references}
            )
            is_single_number = performances is not references
            self._references = GivenPerformances(performances, whatever_changes=is_single_number)
            self.measured = RunningMeans()
            if is_single_number:
                self._references.divisor(self.condition)
        # Errors that can be known before the first episode are raised now.
        for scenario in self.env.scenarios:
            self.payments_of(Condition(scenario.n_robots, changes=changes_of(scenario, self._base)))
        self.payments: dict[str, Payment] = {}
        self._indicators: dict[str, Payment] = {}
        self._is_over = False
        self._delivered = 0

    def payments_of(self, condition: Condition) -> dict[str, Payment]:
        """Return the unweighted payments of an episode of that condition, by indicator.

        Raises:
            SetupError: a reference is missing or 0, or an indicator is undefined.
        """
        payments = {}
        for name in self.weights:
            payment = indicator_of(name, condition, self._base, self._references) or Payment()
            if isinstance(self._references, RunningMeans):
                slope = derivative_of(name, condition, self._base, self._references)
                payment = Payment(payment.share + slope.share, payment.constant + slope.constant)
            payments[name] = payment
        return payments

    @property
    def episode_info(self) -> dict[str, float]:
        """The wrapped environment's infos, and the values of the indicators so far.

        "n_robots", "n_failed" and "n_removed" are those of `condition`. Each indicator but P has
        these entries, here for R: "R" is its value so far, constant included. "R_tested" is 1 if
        the episode tests it; otherwise it and the following are 0. "R_P_o" is the reference
        [items]. FT has the same for P_S, and S has P_N instead of P_o.
        """
        condition = self.condition
        info = {
            **self.env.episode_info,
            "n_robots": condition.n_robots,
            "n_failed": condition.n_failed,
            "n_removed": condition.n_removed,
        }
        delivered = self.unwrapped.warehouse.state.delivered
        for name in self.weights:
            if name not in PERFORMANCES:
                continue
            test = self._indicators.get(name, Payment())
            info[name] = test.share * delivered + test.constant
            info[f"{name}_tested"] = int(name in self._indicators)
            for role in PERFORMANCES[name]:
                info[f"{name}_{role}"] = test.performances.get(role, 0.0)
        return info

    def begun(self, seed: int) -> None:
        """Count the episode before if it came to its end; store what this one is and pays."""
        if self._is_over:
            self.measured.add(self.condition, self._delivered)
        self._is_over = False
        self._paid = Payment()
        self._delivered = 0
        self._take_condition()

    def after_step(self, outcome: ArrayStep) -> ArrayStep:
        """Return the result of the step with this wrapper's rewards."""
        observations, inner_rewards, terminations, truncations = outcome
        world = self.unwrapped.warehouse
        state = world.state
        rewards = self.own_reward * inner_rewards if self.own_reward else np.zeros(state.n_robots)
        deliverers = state.delivered_by[self._delivered :]
        if world.is_eventful and condition_of(world, self._base) != self.condition:
            self._take_condition()
        if self._paid is not self._due or deliverers:
            self._pay(rewards, deliverers, state.in_episode | terminations)
        self._delivered = state.delivered
        self._is_over = not self.env.agents
        return observations, rewards, terminations, truncations

    def _pay(
        self, rewards: NDArray[np.float64], deliverers: list[int], in_episode: NDArray[np.bool_]
    ) -> None:
        lump_sum = self._due.constant - self._paid.constant
        # Items that were delivered before a change in mid-run were paid another share.
        lump_sum += (self._due.share - self._paid.share) * self._delivered
        self._paid = self._due
        if self.credit == "team":
            rewards[in_episode] += lump_sum + self._due.share * len(deliverers)
            return
        rewards[in_episode] += lump_sum / max(int(np.count_nonzero(in_episode)), 1)
        for robot in deliverers:
            rewards[robot] += self._due.share

    def _take_condition(self) -> None:
        self.condition = condition_of(self.unwrapped.warehouse, self._base)
        self.payments = self.payments_of(self.condition)
        self._indicators = {
            name: indicator
            for name in self.weights
            if (indicator := indicator_of(name, self.condition, self._base, self._references))
        }
        weighted = [(self.weights[name], payment) for name, payment in self.payments.items()]
        share = sum(weight * payment.share for weight, payment in weighted)
        constant = sum(weight * payment.constant for weight, payment in weighted)
        self._due = Payment(share, constant if self.constant else 0.0)


def _checked_weights(weights: str | Mapping[str, float]) -> dict[str, float]:
    checked = {weights: 1.0} if isinstance(weights, str) else dict(weights)
    if not checked:
        raise SetupError(f"weights = {weights!r}: should name at least one indicator")
    names = (*INDICATORS, "P")
    for name, weight in checked.items():
        if name not in names:
            raise SetupError(f"no indicator {name!r} is paid{suggest(str(name), names)}")
        finite_number(f"weights[{name!r}]", weight)
    return checked
