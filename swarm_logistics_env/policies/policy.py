"""What a policy is, and what names its behaviour."""

from __future__ import annotations

import contextlib
import html
import math
import sys
from collections import namedtuple
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self, cast, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.code_files import PACKAGE
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.fingerprint import fingerprint, joined
from swarm_logistics_env.core.records import Record, canonical_json
from swarm_logistics_env.policies.evaluation_mode import in_evaluation
from swarm_logistics_env.policies.row_policy import Robot
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.state import WarehouseState


@runtime_checkable
class Policy(Protocol):
    """Decides for all robots at once, one row a robot; a class with these two methods is one.

    A policy may also have

    * `needs_state = True`: `act` gets the WarehouseState as a second argument (a central
      controller that sees everything); robots that do not hear get no commands then, see
      `mask_unreachable_commands`;
    * `configure(scenario)`: called before `reset`, for what a robot's maker writes into it, such
      as its control period;
    * `wrap(env)`: returns wrappers around `env`, an environment: what the policy senses and how it
      commands, if not by rows and commands of the warehouse (see `policies.within`);
    * `play_steps(world_address, rows, positions)`: plays many steps in one call, as
      `LearnedPolicy.play_steps` does; None where `act` has to be called for each;
    * `identity`: text that names everything its behaviour depends on (see `identity`).
    """

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode of `n_robots` rows; what is random follows from `seed` and the row."""

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) in [-1, 1] for observation rows (N, D)."""


def check_policy(policy: object) -> None:
    """Check that `policy` is one.

    Raises:
        PolicyError: it is none.
    """
    if isinstance(policy, type):
        raise PolicyError(
            f"policy = the class {policy.__name__}: should be an object, as {policy.__name__}(), "
            "which each run copies"
        )
    if not isinstance(policy, Policy):
        raise PolicyError(
            f"policy = {policy!r}: should have the methods reset and act, as what "
            "policies.load(name) returns has"
        )


class Described:
    """A policy that says in a line what it is: in a session, and with a sentence in a notebook."""

    def robot(self, body: Scenario, period: float, seed: int, number: int = 0) -> Robot:
        """Return one robot that it steers, of the `number` in its swarm; see `Robot`.

        Raises:
            PolicyError: it does not decide from rows alone.
        """
        return Robot(self, body, period, seed, number)

    def _repr_html_(self) -> str:
        about = (type(self).__doc__ or "").partition("\n\n")[0]
        return f"<b>{html.escape(repr(self))}</b><br>{html.escape(' '.join(about.split()))}"


FITTED_RADIUS = 0.125  # of the robots for which parameters were fitted [m]
FITTED_SPEED = 1.0  # from which on `of_fast_robots` begins to act [m/s]
SMALL_RADIUS = 0.05  # of those for which `of_small_robots` was: DotBots [m]
HIGH_SPEED = 2.0  # of those for which `of_fast_robots` was: the paper's [m/s]


class ScriptParameters(Record):
    """The parameters of a script, each with its unit and its meaning. This one has none.

    Compiled code reads them by the same names, see `for_kernels`.

    Attributes:
        of_small_robots: how many times as large parameters are among robots of 0.05 m, lengths
            beside their radius; what is left out stays.
        of_fast_robots: the same of robots of 2 m/s.
    """

    error_type = PolicyError
    of_small_robots: ClassVar[Mapping[str, float]] = {}
    of_fast_robots: ClassVar[Mapping[str, float]] = {}

    @classmethod
    def for_kernels(cls) -> Callable[..., Self]:
        """Return what makes a NamedTuple with the fields of this record, in their order.

        Kernels take no record; their annotations say the record, as mypy knows its fields. The
        kernel that Python calls takes the plain `values` and names them: numba looks at each field
        of a tuple with names, which takes a microsecond.
        """
        return cast("Callable[..., Self]", namedtuple(cls.__name__, cls.model_fields))

    def values(self) -> tuple[Any, ...]:
        """Return the values of the fields, in their order."""
        return tuple(dict(self).values())

    def scaled_to(self, swarm: Scenario) -> Self:
        """Return these for robots as large and as fast as the largest and the fastest of a swarm.

        Lengths go with the radius; those that were published stay. Between 0.125 m and 0.05 m a
        parameter goes with the power of the radius that leads to `of_small_robots`, and between
        1 m/s and 2 m/s with that of the speed that leads to `of_fast_robots`; beyond, they stay.
        """
        scale = swarm.robot_radius / FITTED_RADIUS
        factors = {
            name: scale
            for name, field in type(self).model_fields.items()
            if field.description and "[m]" in field.description
            if "source" not in field.description
        }
        share_of_small = _way(FITTED_RADIUS, swarm.robot_radius, SMALL_RADIUS)
        # A contract lists the fields that a policy reads: of robots of one kind the plain one.
        top_speed = swarm.highest_speed if swarm.robot_kinds else swarm.max_speed
        share_of_fast = _way(FITTED_SPEED, top_speed, HIGH_SPEED)
        for share, changes in (
            (share_of_small, self.of_small_robots),
            (share_of_fast, self.of_fast_robots),
        ):
            for name, change in changes.items():
                factors[name] = change**share * factors.get(name, 1.0)
        return self.model_copy(
            update={name: factor * getattr(self, name) for name, factor in factors.items()}
        )


def _way(start: float, value: float, end: float) -> float:
    """Return how far it is from `start` to `end` on a logarithmic scale, in [0, 1]."""
    return min(max(math.log(value / start) / math.log(end / start), 0.0), 1.0)


class Scripted(Described):
    """A script of this package. What it was made with are its `parameters`, and nothing else.

    Its keyword arguments are the fields of `parameters_type`.

    Attributes:
        parameters: which its repr and its identity read, as its decisions do.

    Raises:
        PolicyError: a parameter is unknown or out of range.
    """

    parameters_type: ClassVar[type[ScriptParameters]] = ScriptParameters
    parameters: Any  # of that type, as subclasses declare

    def __init__(self, **parameters: Any) -> None:
        self.parameters = self.parameters_type(**parameters)
        self.configure(Scenario.preset("paper"))
        self.reset(0, 0)

    def __repr__(self) -> str:
        changed = self.parameters.model_dump(exclude_defaults=True)
        listed = ", ".join(f"{name}={value!r}" for name, value in changed.items())
        return f"{type(self).__name__}({listed})"

    def configure(self, scenario: Scenario) -> None:
        """Take what a robot's maker knows."""
        raise NotImplementedError

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode of `n_robots` rows."""
        raise NotImplementedError


class Holding(Described):
    """A policy of this package around something of a user's: a network, or another policy.

    Attributes:
        identity: text that changes with what it holds, as that is now, or with the code around it.
    """

    def identity_parts(self) -> dict[str, Any]:
        """Return what identifies it, by name, with a `fingerprint` of what it holds."""
        raise NotImplementedError

    @property
    def identity(self) -> str:
        return canonical_json(self.identity_parts())


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Let torch, if it is loaded, compute in one thread, and in as many as before afterwards.

    Its sums are other bits with another number of threads, so that a run would depend on who plays
    it; and networks as small as those of robots are slower on several.
    """
    torch: Any = sys.modules.get("torch")
    if torch is None or torch.get_num_threads() == 1:
        yield
        return
    n_threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(n_threads)


def start(policy: Policy, scenario: Scenario, seed: int) -> None:
    """Let `policy` begin an episode.

    Raises:
        PolicyError: it is none.
    """
    check_policy(policy)
    configure = getattr(policy, "configure", None)
    with one_thread():
        if configure is not None:
            configure(scenario)
        policy.reset(scenario.n_robots, seed)


def decide(
    policy: Policy, observations: NDArray[np.float32], state: WarehouseState
) -> NDArray[np.float64]:
    """Return the commands of `policy` in use, with the state for those that need it.

    A policy that needs the state is a central controller: its commands reach robots that hear.
    They are checked where they are used, by `Warehouse.step`.
    """
    with one_thread(), in_evaluation(policy):
        return decide_in_use(policy, observations, state)


def decide_in_use(
    policy: Policy, observations: NDArray[np.float32], state: WarehouseState
) -> NDArray[np.float64]:
    """Do as `decide` where torch has one thread, and networks are in evaluation mode, already."""
    if getattr(policy, "needs_state", False):
        # The protocol knows the one argument that all policies take.
        return mask_unreachable_commands(policy.act(observations, state), state)  # type: ignore[call-arg]
    return policy.act(observations)


def mask_unreachable_commands(commands: NDArray[Any], state: WarehouseState) -> NDArray[Any]:
    """Return a central controller's commands (N, 4) with zeros for the robots that do not hear.

    A command of zeros lets a robot stand still, leaves its gripper as it is and broadcasts
    nothing new. So the failure modes FM3 and FM3_hear act on central control as they would in
    reality. The controller sees from above and reaches every robot that hears, wherever it is:
    it makes no difference whether a robot sends, nor do radio range, loss and sensor noise.
    """
    if state.hears.all():  # nearly always
        return commands
    deaf = state.robot_present & ~state.hears
    try:
        masked = np.array(commands, dtype=np.float64)
    except (TypeError, ValueError):
        return commands  # the warehouse says what is wrong with them
    if masked.shape[:1] == deaf.shape:
        masked[deaf] = 0.0
    return masked


def identity(policy: Policy) -> str:
    """Return text that changes whenever the policy's behaviour may have changed.

    It is the policy's own attribute `identity` if it has one. Otherwise it is the JSON of
    `identity_parts`. Ask for it before the policy's first episode.
    """
    parts = identity_parts(policy)
    return str(parts["identity"]) if "identity" in parts else canonical_json(parts)


def identity_parts(policy: Policy, files: Iterable[Path] = ()) -> dict[str, Any]:
    """Return what identifies a policy, by name.

    Of a policy of this package that is its class and its `parameters`, a record, as a task's code
    version tells the rest; of any other one its class and its `fingerprint`.

    Args:
        files: Python files that it was loaded from.
    """
    if isinstance(policy, Holding):
        parts = policy.identity_parts()
        return parts | joined([parts, fingerprint(None, files)]) if files else parts
    stated = getattr(policy, "identity", None)
    if stated is not None:
        return {"identity": str(stated)}
    kind = type(policy)
    if kind.__module__.partition(".")[0] != PACKAGE.name:
        return {"class": kind.__qualname__, **fingerprint(policy, files)}
    name = f"{kind.__module__}:{kind.__qualname__}"
    parameters = getattr(policy, "parameters", None)
    if isinstance(parameters, Record):
        return {"class": name, "parameters": parameters.model_dump(mode="json")}
    return {"class": name, **fingerprint(policy)}
