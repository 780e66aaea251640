"""Policies of a learner's model: any network that turns rows into outputs.

How networks of each library are called stands in `networks`, what prepares rows in `normalizers`.
What `MotionFrame`, `DiscreteActions` and a normaliser do around an environment is done here around
the model, by the same code, so that it plays as it learned.
"""

from __future__ import annotations

import contextlib
import copy
import functools
from collections.abc import Callable
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import RAISED_BY_OTHERS, PolicyError
from swarm_logistics_env.core.fingerprint import deep_copy, fingerprint, joined, package_code
from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.policies.model_spaces import (
    check_spaces,
    check_statistics,
    check_width,
    width_of,
)
from swarm_logistics_env.policies.networks import (
    Decide,
    OnnxNetwork,
    PredictingPolicy,
    Rows,
    TorchNetwork,
    outputs_of,
    predictor_in,
    tried,
)
from swarm_logistics_env.policies.normalizers import normalizer_of
from swarm_logistics_env.policies.policy import Holding, Policy, check_policy, identity_parts
from swarm_logistics_env.world.motion.actions import ACTIONS, MOTION_ACTIONS
from swarm_logistics_env.world.motion.frame import MotionView
from swarm_logistics_env.world.observations import N_COLUMNS, N_NEIGHBOURS
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Warehouse

_CODE = (
    "policies/models.py", "policies/model_spaces.py", "policies/networks.py",
    "policies/normalizers.py", "policies/sb3_files.py",
)  # fmt: skip
# Networks whose libraries tell how they are used; a function is the user's own code.
_OF_LIBRARIES = (TorchNetwork, PredictingPolicy, OnnxNetwork)
_LONGEST_MESSAGE = 64  # numbers, as of Scenario.message_size
_COMMANDS_BY_NUMBER = np.array(list(ACTIONS.values()))
_OUTPUTS_BY_NUMBER = np.array(list(MOTION_ACTIONS.values()))


def of(
    network: Any, *, frame: bool = False, listens: bool = True, normalize: Any = None
) -> ModelPolicy:
    """Return the policy of a model: whatever turns rows of inputs (N, D) into outputs (N, k).

    Torch modules play in evaluation mode, and get their own mode back after each decision. Of
    several outputs the one called "action" is played, or the first.

    Args:
        network: a function of rows, a torch module, a program of `torch.export`, a model of
            stable-baselines3 (its most likely action), or an InferenceSession of onnxruntime. It
            has no memory of its own.
        frame: whether it learned through `MotionFrame`: it reads rows of `motion.INPUTS` and gives
            rows of `motion.OUTPUTS`. Else it reads observations (N, D) and gives commands (N, 4).
            Whole numbers (N,) are actions of `DiscreteActions`, in either case.
        listens: as of `MotionFrame`.
        normalize: what its rows went through: None, a function of rows, a pair (mean, standard
            deviation), or a `VecNormalize` of stable-baselines3, whose statistics may go on.

    Raises:
        PolicyError: `network` or `normalize` is none of these, or cannot be played: it is tried
            once with the rows of a swarm.

    Example:
        >>> policy = of(lambda rows: np.tanh(rows[:, :3]), frame=True)
        >>> policy.reset(n_robots=2, seed=0)
        >>> policy.act(np.zeros((2, 141), np.float32)).shape
        (2, 4)
    """
    decide = decider_of(network)
    prepare = normalizer_of(normalize)
    about = type(network).__name__
    return ModelPolicy(decide, prepare, about=about, frame=frame, listens=listens)


def within(model: Any, wrap: Callable[[Any], Any], *, normalize: Any = None) -> Within:
    """Return a policy that plays in an environment of its own: its sensors, its form of commands.

    Episodes and studies then play it through that environment, with their faults, sizes and
    parameters as ever.

    Args:
        model: a network, as of `of`, or a policy: what turns that environment's rows into actions.
        wrap: returns wrappers around the environment that it gets; it leaves the conditions alone.
        normalize: of a network, as of `of`.

    Raises:
        PolicyError: one of them is something else. A network is tried with the first rows.

    Example:
        >>> from swarm_logistics_env import Scenario, run_episode
        >>> from swarm_logistics_env.wrappers import DiscreteActions
        >>> forward = within(lambda rows: np.ones(len(rows), int), DiscreteActions)
        >>> run_episode(Scenario(n_robots=2, duration=1.0), forward, seed=0).ended_at
        1.0
    """
    if not callable(wrap):
        raise PolicyError(f"wrap = {wrap!r}: should be a function of an environment")
    if hasattr(model, "act"):
        check_policy(model)
        if normalize is not None:
            raise PolicyError(f"normalize: is for a network, and {model!r} is a policy")
        return Within(model, wrap)
    return Within(_BareModel(model, normalize), wrap)


class _Model(Holding):
    """What turns rows into outputs, and what prepares rows for it."""

    _decide: Decide
    _prepare: Decide

    def identity_parts(self) -> dict[str, Any]:
        """Return what identifies it: both of them as they are now, and the code of this module."""
        content = fingerprint((self._decide, self._prepare))
        return {"class": type(self).__name__, "code": package_code(*_CODE), **content}


class _BareModel(_Model):
    """A network whose outputs are actions as they are."""

    def __init__(self, network: Any, normalize: Any) -> None:
        self._decide = decider_of(network)
        self._prepare = normalizer_of(normalize)
        self._about = type(network).__name__
        self._tried = None if isinstance(self._decide, _OF_LIBRARIES) else self._decide

    def __repr__(self) -> str:
        return self._about

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode; nothing here is random."""

    def act(self, observations: Rows) -> NDArray[Any]:
        """Return an action for each row of observations (N, D)."""
        if self._tried is None:
            self._tried = tried(self._decide, self._prepare, observations, self._about)
        return outputs_of(self._tried, self._prepare, observations, self._about)


class Within(Holding):
    """A policy and the wrappers that it plays in; made by `within`.

    Attributes:
        wrap: as given.
        identity: text that changes with the policy as it is now, or with the code of the wrappers.
    """

    def __init__(self, policy: Policy, wrap: Callable[[Any], Any]) -> None:
        self._policy = policy
        self.wrap = wrap
        self.needs_state = getattr(policy, "needs_state", False)

    def __repr__(self) -> str:
        return f"policies.within({self._policy!r}, {self.wrap!r})"

    def identity_parts(self) -> dict[str, Any]:
        """Return what identifies it: the policy, and the wrappers."""
        inner = identity_parts(self._policy)
        prints = joined([inner, fingerprint(self.wrap)])
        policy = {name: part for name, part in inner.items() if name not in prints}
        return {"class": "Within", "policy": policy, **prints}

    def configure(self, scenario: Scenario) -> None:
        """Let the policy take what a robot's maker knows."""
        if hasattr(self._policy, "configure"):
            self._policy.configure(scenario)

    def reset(self, n_robots: int, seed: int) -> None:
        """Let the policy begin an episode."""
        self._policy.reset(n_robots, seed)

    def act(self, *seen: Any) -> NDArray[Any]:
        """Return the policy's actions for the environment's rows, and the state if need be."""
        return self._policy.act(*seen)


@functools.cache
def _rows_of_a_swarm() -> Rows:
    """Return what five robots sense at the start of an episode."""
    return Warehouse(Scenario(n_robots=5)).reset(seed=0)


class ModelPolicy(_Model):
    """A model between what a robot senses and its command; made by `of` and `from_sb3`.

    Args:
        decide: turns rows (N, D) into outputs.
        prepare: turns rows into what the model learned to read.
        about: what people call the model.
        frame, listens: as `of`.

    Attributes:
        identity: text that changes with the model as it is now, its form, or the code of this
            module: weights, buffers, attributes, layers and their code. What cannot be compared is
            another one each time, so that it is played again.
    """

    def __init__(
        self,
        decide: Decide,
        prepare: Decide,
        *,
        about: str,
        frame: bool,
        listens: bool,
    ) -> None:
        self._decide = decide
        self._prepare = prepare
        self._has_frame = frame
        self._listens = listens
        self._about = about
        if hasattr(decide, "policy") and hasattr(decide.policy, "observation_space"):
            check_spaces(about, decide.policy, frame)
        check_width(about, width_of(decide), frame)
        check_statistics(width_of(prepare), width_of(decide), frame)
        self.configure(Scenario.preset("paper"))
        if isinstance(decide, _OF_LIBRARIES):
            self._try_out()
        self.reset(0, 0)

    def __repr__(self) -> str:
        return f"policies.of({self._about}, frame={self._has_frame})"

    def identity_parts(self) -> dict[str, Any]:
        """Return what identifies it: the model as it is now, and its form."""
        form = {"frame": self._has_frame, "listens": self._listens}
        return {**super().identity_parts(), **form}

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        # Each run has a memory of its own; a model should have none, but may note what it did.
        other = copy.copy(self)
        other._view = copy.deepcopy(self._view, memo)
        with contextlib.suppress(*RAISED_BY_OTHERS):
            other._decide, other._prepare = deep_copy((self._decide, self._prepare))
        return other

    def configure(self, scenario: Scenario) -> None:
        """Take what a robot's maker knows: its control period and its body."""
        self._view = MotionView(scenario, self._listens)

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode, with the memories that `MotionFrame` would begin with."""
        self._view.begin(row_keys(seed, "motion frame", n_robots))

    def act(self, observations: Rows) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D).

        Raises:
            PolicyError: the model fails, or its outputs are no commands.
        """
        rows = self._view.read(observations) if self._has_frame else observations
        actions = self._actions_of(outputs_of(self._decide, self._prepare, rows, self._about), rows)
        return self._view.command(actions) if self._has_frame else actions

    def _try_out(self) -> None:
        """Let the network answer once, so that what cannot be played is refused before any run."""
        rows = _rows_of_a_swarm()
        self.reset(len(rows), 0)
        trials = [self._view.read(rows)] if self._has_frame else self._possible_rows(rows)
        failures: list[PolicyError] = []
        for trial in trials:
            try:
                decide = tried(self._decide, self._prepare, trial, self._about)
            except PolicyError as error:
                failures.append(error)
            else:
                self._decide = decide
                self._actions_of(outputs_of(decide, self._prepare, trial, self._about), trial)
                return
        raise failures[0]

    def _possible_rows(self, rows: Rows) -> list[Rows]:
        """Return rows (N, D) for each D that the network may read, as longer ones hold messages."""
        lengths = [length for part in (self._decide, self._prepare) if (length := width_of(part))]
        longest = N_COLUMNS + _LONGEST_MESSAGE * N_NEIGHBOURS
        return [
            np.pad(rows, [(0, 0), (0, length - N_COLUMNS)])
            for length in lengths[:1] or range(N_COLUMNS, longest + 1, N_NEIGHBOURS)
        ]

    def _actions_of(self, outputs: NDArray[Any], rows: Rows) -> NDArray[Any]:
        """Return outputs as commands (N, 4), or as outputs of the frame (N, 3)."""
        n_robots = len(rows)
        actions = _OUTPUTS_BY_NUMBER if self._has_frame else _COMMANDS_BY_NUMBER
        if outputs.dtype.kind in "iu" and outputs.size == n_robots:
            numbers = outputs.reshape(n_robots)
            if not ((numbers >= 0) & (numbers < len(actions))).all():
                raise PolicyError(
                    f"{self._about} gave actions {numbers}: should be 0 to {len(actions) - 1}, as "
                    "those of DiscreteActions"
                )
            outputs = actions[numbers]
        wanted = (n_robots, actions.shape[1])
        # Rows have columns for the messages of all neighbours.
        most = wanted[1] if self._has_frame else 4 + (rows.shape[1] - N_COLUMNS) // N_NEIGHBOURS
        is_wider = outputs.ndim == 2 and wanted[1] < outputs.shape[1] <= most
        if outputs.shape != wanted and not (is_wider and len(outputs) == n_robots):
            columns = "along, aside and gripper" if self._has_frame else "commands of each robot"
            raise PolicyError(
                f"{self._about} gave outputs of shape {outputs.shape}: should be {wanted}, "
                f"{columns}, or ({n_robots},), numbers of actions, as argmax makes of "
                f"{len(actions)} values"
            )
        return outputs


def decider_of(network: Any) -> Decide:
    """Return what turns rows into outputs.

    Raises:
        PolicyError: `network` is none, or one that cannot be played.
    """
    predictor = predictor_in(network)
    if predictor is not None:
        return PredictingPolicy(predictor)
    if hasattr(network, "module") and hasattr(network, "graph_signature"):
        network = network.module()  # of a program that torch exported
    if hasattr(network, "state_dict") and callable(network):
        return TorchNetwork(network)
    if hasattr(network, "run") and hasattr(network, "get_inputs"):
        return OnnxNetwork(network)
    if not callable(network) or isinstance(network, type):
        raise PolicyError(
            f"network = {network!r}: should be a function of rows, a torch module, a model of "
            "stable-baselines3 or an InferenceSession of onnxruntime"
        )
    decide: Decide = network
    return decide
