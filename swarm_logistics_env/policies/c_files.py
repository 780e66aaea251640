"""Controllers in C as policies: "c:hold.c" is compiled, and decides in a process of its own.

The file defines what a robot keeps, `swarm_robot`, and two functions, `swarm_reset` and
`swarm_step`; docs/c.md says how. A fault in it ends that process, which becomes a PolicyError.
"""

from __future__ import annotations

import contextlib
import hashlib
import signal
import struct
import subprocess
import weakref
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.streams import key
from swarm_logistics_env.policies.c_compiler import COMPILERS, compiled_controller, sources_of
from swarm_logistics_env.policies.policy import Holding
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.scenario import Scenario

PREFIX = "c:"
# As the host in c_host/host.c has them.
_FACTS = struct.Struct("QQQQd64s")
_REQUEST = struct.Struct("IIQ")
_RESET = 0
_STEP = 1
_TIME = 2


def is_c_name(name: str) -> bool:
    """Return whether a policy's name is that of a controller in C, as "c:hold.c"."""
    return name.startswith(PREFIX) and Path(name).suffix in COMPILERS


class _Facts(NamedTuple):
    """What a compiled controller tells of itself.

    Attributes:
        robot_size: bytes that a robot keeps.
        row: numbers that it reads.
        command: numbers that it commands.
        number: `float` or `double`, what these numbers are.
        period: control period that it is made for [s]; 0: any.
        stream: purpose of its random numbers.
    """

    robot_size: int
    row: int
    command: int
    number: np.dtype[Any]
    period: float
    stream: str


class _Server:
    """A process that decides for robots: it gets all that they keep, and gives it back.

    Args:
        program: a compiled controller.
        name: of its policy, for errors.

    Raises:
        PolicyError: the program does not run.
    """

    def __init__(self, program: Path, name: str) -> None:
        self._name = name
        try:
            # Ctrl-C is not for it: it ends when nobody asks any more.
            process = subprocess.Popen(
                [program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
            )
        except OSError as error:
            raise PolicyError(f"{name} cannot be run: {error.strerror or error}") from error
        assert process.stdin is not None
        assert process.stdout is not None
        self._process = process
        self._requests = process.stdin
        self._answers = process.stdout
        self._finalizer = weakref.finalize(self, _end, process)
        size, width, n_commands, number_size, period, stream = _FACTS.unpack(
            self._read(_FACTS.size)
        )
        purpose = stream.rstrip(b"\0").decode(errors="replace")
        number = np.dtype(f"f{number_size}")
        self.facts = _Facts(size, width, n_commands, number, period, purpose)

    def ask(self, request: bytes, length: int) -> bytes:
        """Return the answer to a request, of so many bytes.

        Raises:
            PolicyError: the process ended.
        """
        try:
            self._requests.write(request)
            self._requests.flush()
        except OSError:  # it ended before it read all
            raise self._error() from None
        return self._read(length)

    def _read(self, length: int) -> bytes:
        answer = self._answers.read(length)
        if len(answer) < length:
            raise self._error()
        return answer

    def _error(self) -> PolicyError:
        code = self._process.wait()
        end = f"exit status {code}"
        if code < 0:
            end = signal.strsignal(-code) or f"signal {-code}"
        return PolicyError(f"{self._name}: its program ended amid a step ({end})")


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()


class CFile(Holding):
    """A controller in C or C++, compiled from its file: for swarms of any size.

    What robots keep stands here from step to step, so that a copy goes on by itself.

    Args:
        name: "c:" and the path of the file.

    Raises:
        PolicyError: the file cannot be read or compiled, or there is no compiler.
    """

    def __init__(self, name: str) -> None:
        path = Path(name.removeprefix(PREFIX))
        self._name = name
        self._files = {
            file.name: hashlib.sha256(content).hexdigest()[:16]
            for file, content in sources_of(path).items()
        }
        self._program = compiled_controller(path)
        self._server: _Server | None = None
        self._facts = self._running().facts
        self.reset(0, 0)

    @property
    def robot_size(self) -> int:
        """How many bytes a robot keeps."""
        return self._facts.robot_size

    def __repr__(self) -> str:
        return f"CFile({self._name!r})"

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_server": None}  # a copy begins its own

    def identity_parts(self) -> dict[str, Any]:
        """Return the digests of the file and of those that it includes by name."""
        return {"class": f"{__name__}:{type(self).__qualname__}", "value": "", "files": self._files}

    def configure(self, scenario: Scenario) -> None:
        """Check that the controller is made for the scenario's control period and rows.

        Raises:
            PolicyError: it is made for others.
        """
        period = self._facts.period
        if period and np.float32(period) != np.float32(scenario.control_period):
            raise PolicyError(
                f"{self._name}: SWARM_PERIOD is {np.float32(period)} s: should be the scenario's "
                f"control_period, {scenario.control_period} s"
            )
        self._check_width(row.n_columns(scenario))

    def _check_width(self, n_columns: int) -> None:
        if n_columns < self._facts.row:
            raise PolicyError(
                f"{self._name}: SWARM_ROW is {self._facts.row}: should be at most {n_columns}, the "
                "numbers of a row"
            )

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode; each robot is told 64 random bits of the seed, and its number."""
        self._n_robots = n_robots
        request = _REQUEST.pack(_RESET, n_robots, key(seed, self._facts.stream))
        self._robots = self._ask(request, n_robots * self._facts.robot_size)

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, SWARM_COMMAND) for observation rows (N, D).

        Raises:
            PolicyError: there are more or fewer rows than robots at `reset`, a row is too short,
                or the controller's process ended.
        """
        n_bytes = len(self._robots)
        number = self._facts.number
        length = n_bytes + number.itemsize * self._n_robots * self._facts.command
        answer = self._ask(self._request(_STEP, observations), length)
        self._robots = answer[:n_bytes]
        commands = np.frombuffer(answer, number, offset=n_bytes)
        return commands.reshape(self._n_robots, self._facts.command).astype(np.float64)

    def seconds_of_step(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return how long each robot's step takes (N,) [s]; the robots stay as they are.

        Raises:
            PolicyError: as `act`.
        """
        answer = self._ask(self._request(_TIME, observations), 8 * self._n_robots)
        return np.frombuffer(answer, np.float64)

    def _request(self, what: int, observations: NDArray[np.float32]) -> bytes:
        if len(observations) != self._n_robots:
            raise PolicyError(
                f"observations of {len(observations)} robots: reset was told {self._n_robots}"
            )
        self._check_width(observations.shape[1])
        rows = np.ascontiguousarray(observations[:, : self._facts.row], np.float32)
        return _REQUEST.pack(what, self._n_robots, 0) + self._robots + rows.tobytes()

    def _running(self) -> _Server:
        if self._server is None:
            self._server = _Server(self._program, self._name)
        return self._server

    def _ask(self, request: bytes, length: int) -> bytes:
        server = self._running()
        self._server = None  # one that ends is not asked again
        answer = server.ask(request, length)
        self._server = server
        return answer
