"""What a policy is, and what names its behaviour."""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import inspect
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.records import Record
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import WarehouseState


@runtime_checkable
class Policy(Protocol):
    """Decides for all robots at once, one row a robot; a class with these two methods is one.

    A policy may also have

    * `needs_state = True`: `act` gets the WarehouseState as a second argument (a central
      controller that sees everything); robots that do not hear get no commands then, see
      `mask_unreachable_commands`;
    * `configure(scenario)`: called before `reset`, for what a robot's maker writes into it, such
      as its control period;
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
    if not isinstance(policy, Policy):
        raise PolicyError(
            f"policy = {policy!r}: should have the methods reset and act, as what "
            "policies.load(name) returns has"
        )


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Let torch, if it is loaded, compute in one thread, and in as many as before afterwards.

    Its sums are other bits with another number of threads, so that a run would depend on who plays
    it; and networks as small as those of robots are slower on several.
    """
    torch: Any = sys.modules.get("torch")
    n_threads = 1 if torch is None else torch.get_num_threads()
    if n_threads == 1:
        yield
        return
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
    """Return the commands of `policy`, with the state for those that need it.

    A policy that needs the state is a central controller: its commands reach robots that hear.
    They are checked where they are used, by `Warehouse.step`.
    """
    with one_thread():
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
    deaf = state.robot_present & ~state.hears
    if not deaf.any():
        return commands
    try:
        masked = np.array(commands, dtype=np.float64)
    except (TypeError, ValueError):
        return commands  # the warehouse says what is wrong with them
    if masked.shape[:1] == deaf.shape:
        masked[deaf] = 0.0
    return masked


OWN_PACKAGE = __name__.partition(".")[0]
# These hold messages and validation, so that they decide nothing that a policy does. The package
# itself imports all that it offers, whatever a policy uses of it.
WITHOUT_BEHAVIOUR = frozenset({OWN_PACKAGE, f"{OWN_PACKAGE}.errors", f"{OWN_PACKAGE}.records"})


def identity(policy: Policy) -> str:
    """Return text that changes whenever the policy's behaviour may have changed.

    It is the policy's own attribute `identity` if it has one. Otherwise it names the class, its
    `parameters`, and a digest of the code (see `code_digest`).
    """
    own = getattr(policy, "identity", None)
    if own is not None:
        return str(own)
    kind = type(policy)
    parameters: Any = getattr(policy, "parameters", {})
    if isinstance(parameters, Record):
        parameters = parameters.model_dump(mode="json")
    return json.dumps(
        {
            "class": f"{kind.__module__}:{kind.__qualname__}",
            "parameters": parameters,
            "source": code_digest(kind),
        },
        sort_keys=True,
        default=repr,
    )


@functools.cache
def code_digest(*kinds: type) -> str:
    """Return 16 hexadecimal digits that change with the code which classes use.

    That code is the modules of `modules_used`. Docstrings, lines that only comment and blank lines
    do not count. The digest is empty if the source of no class can be found.
    """
    return _digest(modules_used(*kinds))


def modules_used(*kinds: type) -> dict[str, Path]:
    """Return name and file of the modules of classes and of their base classes.

    Whatever these import from their own package and from this one, directly or not, is among them.
    """
    used: dict[str, Path] = {}
    for kind in kinds:
        packages = {OWN_PACKAGE, kind.__module__.partition(".")[0]}
        for base in kind.__mro__:
            if base.__module__.partition(".")[0] in packages:
                _begin(base, packages, used)
    return used


def function_digest(function: object) -> str:
    """Return 16 hexadecimal digits that change with the module of a function.

    Whatever that module imports from its own package counts as well, unless this is the package.
    An object that is no function has the module of its class. Empty if there is no source.
    """
    found: Any = getattr(function, "func", function)  # functools.partial
    if not (inspect.isroutine(found) or inspect.isclass(found)):
        found = type(found)
    used: dict[str, Path] = {}
    _begin(found, {str(found.__module__).partition(".")[0]} - {OWN_PACKAGE}, used)
    return _digest(used)


def _digest(used: dict[str, Path]) -> str:
    digest = hashlib.sha256()
    for name, path in sorted(used.items()):
        content = path.read_bytes()
        if path.suffix == ".py":
            content = without_prose(content.decode()).encode()
        digest.update(name.encode() + b"\0" + content + b"\0")
    return digest.hexdigest()[:16] if used else ""


def without_prose(source: str) -> str:
    """Return Python source without docstrings, lines that only comment, and blank lines."""
    prose: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            continue
        if ast.get_docstring(node, clean=False) is not None:
            first = node.body[0]
            prose.update(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    lines = enumerate(source.splitlines(), start=1)
    return "\n".join(
        line.rstrip()
        for number, line in lines
        if number not in prose and line.strip() and not line.lstrip().startswith("#")
    )


def _begin(found: Any, packages: set[str], used: dict[str, Path]) -> None:
    """Add the module of a class or function to `used`, if it has one, and those that it imports."""
    with contextlib.suppress(TypeError, OSError):  # typed into an interpreter
        _follow(found.__module__, Path(inspect.getfile(found)), packages, used)


def _follow(name: str, path: Path, packages: set[str], used: dict[str, Path]) -> None:
    """Add a module to `used`, and those of `packages` that it imports."""
    used[name] = path
    if path.suffix != ".py":
        return
    parent = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for imported in _imported(ast.parse(path.read_text(encoding="utf-8")), parent):
        # What is imported may be a module, or something in the module that is named before it.
        for module in (imported, imported.rpartition(".")[0]):
            found = _file_of(module) if module.partition(".")[0] in packages else None
            if found is not None:
                if module not in used and module not in WITHOUT_BEHAVIOUR:
                    _follow(module, found, packages, used)
                break


def _imported(tree: ast.AST, parent: str) -> Iterator[str]:
    """Return the full name of everything that is imported anywhere in a module of `parent`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = parent.split(".")[: 1 - node.level or None] if node.level else []
            base = ".".join([*above, node.module] if node.module else above)
            yield from (f"{base}.{alias.name}" for alias in node.names)


def _file_of(module: str) -> Path | None:
    """Return the file of a module whose package is loaded; None if there is none."""
    package, *rest = module.split(".")
    for folder in getattr(sys.modules.get(package), "__path__", ()):
        place = Path(folder, *rest)
        for file in (place / "__init__.py", place.with_suffix(".py")):
            if file.is_file():
                return file
    return None
