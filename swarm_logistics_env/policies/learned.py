"""A trained policy, its network in compiled loops without torch, and its card.

The card says how the policy decides, how it was made, and how good it is.
"""

from __future__ import annotations

import hashlib
import html
import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveInt,
    ValidationInfo,
    field_validator,
    model_serializer,
)

from swarm_logistics_env.compiler.packing import packed
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.records import Record
from swarm_logistics_env.policies.policy import Described
from swarm_logistics_env.policies.row_policy import UNREAD, RowPolicy
from swarm_logistics_env.world.motion.classes import N_CLASSES
from swarm_logistics_env.world.motion.frame import OUTPUTS, MotionView
from swarm_logistics_env.world.motion.network_inputs import INPUTS, input_names
from swarm_logistics_env.world.motion.voices import MESSAGES, N_MESSAGES
from swarm_logistics_env.world.scenario import Scenario

from .layers import Layers, in_blocks, padded, run_network
from .network_steps import StepArrays, act_at, play_at

Width = Annotated[int, Field(ge=1, le=4096)]


class _Part(Record):
    error_type = PolicyError


class Network(_Part):
    """The inputs, layers and outputs of a trained policy.

    Args:
        inputs: the names of its inputs in order, see `world.motion.INPUTS`.
        outputs: the names of its outputs in order, see `world.motion.OUTPUTS`.
        listens: whether it reads the lowest timer heard; if not, those inputs are zeros.
        sees_items: whether it reads 41 inputs more, behind the others: the nearness of items all
            around, the six nearest in view, and the distance from the delivery area on a finer
            scale (`world.motion.sight`). Without them a robot sees the requested item alone, and
            the others only while it carries one.
        role: whether it reads two inputs more, behind those: a number from -1 to 1 that each
            robot draws evenly every 40 s, and on which side of 0.2 that lies.
        talks: whether it tells its neighbours two numbers, how near the requested item and the
            delivery area are as it estimates them (`world.motion.voices`), and reads the highest
            that they tell. It plays where `message_size` is 2.
        hidden: widths of the hidden layers.
        activation: the activation function between layers.
        decides_every: control steps from one decision to the next; in between outputs keep their
            direction.
        head: what the last layer says: "outputs", or the logits of "classes", which are 32
            directions in the frame of motion, 5 speeds and 3 grips (`world.motion.classes`).
        exploration: the training's noise, times this factor, is added to the outputs, from each
            robot's own stream; 0 means none. Of classes it is the temperature with which they are
            drawn, in a training as well; 0 means the likeliest, in a training a temperature of 1.

    Raises:
        PolicyError: the inputs or outputs are not those that this version knows.
    """

    inputs: tuple[str, ...] = INPUTS
    outputs: tuple[str, ...] = OUTPUTS
    listens: bool = True
    sees_items: bool = False
    role: bool = False
    talks: bool = False
    hidden: Annotated[tuple[Width, ...], Field(max_length=8)] = (128, 128)
    activation: Literal["tanh"] = "tanh"
    decides_every: PositiveInt = 1
    head: Literal["outputs", "classes"] = "outputs"
    exploration: NonNegativeFloat = 0.0

    @field_validator("inputs", "outputs")
    @classmethod
    def _check_names(cls, names: tuple[str, ...], about: ValidationInfo) -> tuple[str, ...]:
        expected = INPUTS if about.field_name == "inputs" else OUTPUTS
        if names != expected:
            raise ValueError(f"should be the {len(expected)} names that this version knows")
        return names

    @model_serializer(mode="wrap")
    def _leave_out_later_fields(self, serialize: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        # Cards and identities of networks without them stay as they were before these fields.
        fields = serialize(self)
        later = {"sees_items": False, "role": False, "talks": False, "head": "outputs"}
        return {name: v for name, v in fields.items() if name not in later or v != later[name]}

    @property
    def says_classes(self) -> bool:
        """Whether its last layer says logits of classes."""
        return self.head == "classes"

    @property
    def reads(self) -> dict[str, bool]:
        """What it reads besides `INPUTS`, by the arguments of `input_names` and `MotionView`."""
        return {"has_role": self.role, "talks": self.talks, "sees_items": self.sees_items}

    @property
    def widths(self) -> list[int]:
        """The numbers of inputs, of each hidden layer's values, and of what the last layer says."""
        n_answers = N_CLASSES if self.says_classes else len(self.outputs)
        n_messages = N_MESSAGES if self.talks else 0
        return [len(input_names(**self.reads)), *self.hidden, n_answers + n_messages]


class Score(_Part):
    """One measured value with its 95 % interval; a limit that is infinite becomes None.

    Args:
        measure: "P", or an indicator: "R", "FT", "S", "A".
        condition: in words, e.g. "N = 25, FM4, m = 2".
        seeds: how many, 0, 1, ...: none of them was trained on.
    """

    measure: str
    condition: str
    value: float
    low: float | None
    high: float | None
    seeds: PositiveInt

    @field_validator("low", "high", mode="before")
    @classmethod
    def _replace_infinity(cls, limit: Any) -> Any:
        return None if isinstance(limit, float) and math.isinf(limit) else limit


class PolicyCard(_Part):
    """Everything in a policy file beside the weights.

    Args:
        format: the version of the file's format.
        name: the policy's name.
        about: a sentence or two about the policy.
        network: the network that decides.
        command: the command line that trained it.
        versions: the versions of the packages that trained it; "simulation" is the digest of the
            world's code (`study.tasks.warehouse_task.WAREHOUSE.code`) at that time, "start" that of
            the weights that the training began with, if they were not untrained.
        scored_with: the versions with which it was scored.
        scenario: what it was trained in, fields that differ from the defaults.
        training: the specification of the training.
        seed: the training's seed.
        agent_steps: decisions of single robots that it learned from.
        scores: measured after the training, on seeds held out.
    """

    format: Literal[1] = 1
    name: str
    about: str = ""
    network: Network
    command: str = ""
    versions: dict[str, str] = Field(default_factory=dict)
    scenario: dict[str, Any] = Field(default_factory=dict)
    training: dict[str, Any] = Field(default_factory=dict)
    seed: int = 0
    agent_steps: NonNegativeInt = 0
    scores: tuple[Score, ...] = ()
    scored_with: dict[str, str] = Field(default_factory=dict)


class LearnedParameters(_Part):
    """What a trained policy's behaviour depends on.

    Args:
        network: of its card, whose other fields only tell of it.
        weights: the digest of its numbers.
    """

    network: Network
    weights: str


STREAM = "trained policy"
PlaySteps: TypeAlias = Callable[[int, NDArray[np.float32], NDArray[np.float64]], tuple[int, bool]]


class LearnedPolicy(RowPolicy, Described):
    """A network that decides for each robot alone, from its own row: for swarms of any size.

    Args:
        card: what the file says of it.
        tensors: its numbers, float32, as `tensor_shapes` has them.

    Attributes:
        card: as given.
        parameters: what its behaviour depends on.

    Raises:
        PolicyError: a tensor is missing, unknown, of the wrong shape or type, or not finite.
    """

    stream = STREAM
    ignores = UNREAD | {"neighbour_present"}

    def __init__(self, card: PolicyCard, tensors: Mapping[str, NDArray[np.float32]]) -> None:
        check_tensors(card.network, tensors)
        self.card = card
        self.tensors = dict(tensors)
        network = card.network
        numbers = range(len(network.hidden) + 1)
        self._layers = Layers(
            np.concatenate([in_blocks(tensors[f"layers.{n}.weight"].T) for n in numbers]),
            np.concatenate([padded(tensors[f"layers.{n}.bias"]) for n in numbers]),
            np.array(network.widths),
        )
        self._decides_every = network.decides_every
        self._listens = network.listens
        if network.sees_items:
            self.ignores = self.ignores - {"range_items"}
        if network.talks:
            self.ignores = self.ignores - {"neighbour_message"}
            self.messages = MESSAGES
        deviations = tensors.get("deviations", np.ones(1, np.float32))
        self._noise = deviations * np.float32(network.exploration)
        self.parameters = LearnedParameters(network=network, weights=digest(tensors))
        self.configure(Scenario.preset("paper"))

    def __repr__(self) -> str:
        steps = f"{self.card.agent_steps:,} agent-steps"
        return f"LearnedPolicy({self.card.name!r}, seed {self.card.seed}, {steps})"

    def _repr_html_(self) -> str:
        return f"<b>{html.escape(repr(self))}</b><br>{html.escape(self.card.about)}"

    def configure(self, scenario: Scenario) -> None:
        """Take what a robot's maker knows: its control period, its body, the size of messages."""
        network = self.card.network
        self._frame = MotionView(scenario, network.listens, **network.reads)
        self._message_size = scenario.message_size if network.talks else 0
        self.reset(0, 0)

    def begin(self, keys: NDArray[np.uint64]) -> None:
        """Begin an episode.

        Raises:
            PolicyError: the network talks, and messages have another size than its own.
        """
        network = self.card.network
        if network.talks and len(keys) and self._message_size != N_MESSAGES:
            raise PolicyError(
                f"message_size = {self._message_size}: should be {N_MESSAGES} for "
                f"{self.card.name}, whose robots tell each other as many numbers"
            )
        self._frame.begin(keys)
        n_outputs = len(OUTPUTS) + len(self.messages)
        self._outputs = np.zeros((len(keys), n_outputs), np.float32)
        self._n_steps = 0
        self._tell_compiled_code()

    def memories(self) -> dict[str, NDArray[Any]]:
        """Return all that robots remember, the network's last outputs at the end."""
        outputs = zip((*OUTPUTS, *self.messages), self._outputs.T, strict=True)
        return self._frame.memories() | {f"output_{name}": values for name, values in outputs}

    def _tell_compiled_code(self) -> None:
        """Note where the arrays of a step are; they live as long as the address."""
        frame = self._frame
        self._arrays = StepArrays(
            frame.period, self._listens, frame.memory, frame.keys, frame.counts, frame.turned,
            self._outputs, self._noise, self._layers,
        )  # fmt: skip
        self._words = packed(self._arrays)
        self._address: int = self._words.ctypes.data

    def __getstate__(self) -> dict[str, Any]:
        addresses = ("_arrays", "_words", "_address")
        return {name: value for name, value in vars(self).items() if name not in addresses}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._tell_compiled_code()  # a copy has arrays of its own

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D), with its messages if it talks.

        Raises:
            PolicyError: there are more or fewer rows than robots at `reset`.
        """
        self._frame.check(observations)
        commands = np.empty((len(observations), self._outputs.shape[1] + 1))
        decides = self._n_steps % self._decides_every == 0
        act_at(self._address, decides, observations, commands)
        self._n_steps += 1
        return commands

    @property
    def play_steps(self) -> PlaySteps | None:
        """What acts in a world as `act` and `Warehouse.step` do, many steps in one call.

        None where a subclass or somebody's own `act` may decide otherwise.
        """
        is_replaced = type(self) is not LearnedPolicy or "act" in vars(self)
        return None if is_replaced else self._play_steps

    def _play_steps(
        self,
        world_address: int,
        observations: NDArray[np.float32],
        positions: NDArray[np.float64],
    ) -> tuple[int, bool]:
        """Play steps, see `play_steps`.

        Args:
            world_address: `Warehouse.address`; the caller has to `take` the last step.
            observations: (N, D) of the world now; it is filled with those after the last step.
            positions: (K, N, 2) to be filled with the robots' positions after each step [m].

        Returns:
            The number of steps, K or fewer, and whether the last one has more to tell.

        Raises:
            PolicyError: there are more or fewer rows than robots at `reset`.
        """
        self._frame.check(observations)
        n_steps, is_eventful = play_at(
            self._address, world_address, self._n_steps, self._decides_every, observations,
            positions,
        )  # fmt: skip
        self._n_steps += n_steps
        return n_steps, is_eventful

    def outputs_of(self, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return what the last layer says (N, k) for rows of its inputs, without noise."""
        outputs = np.empty((len(inputs), self.card.network.widths[-1]), np.float32)
        run_network(np.ascontiguousarray(inputs), self._layers, outputs)
        return outputs


def tensor_shapes(network: Network) -> dict[str, tuple[int, ...]]:
    """Return the shape of each tensor that such a policy has.

    `layers` are as torch has them, weight (outputs, inputs); `deviations` those of the training's
    noise, of each output; a network that says classes has none.
    """
    shapes: dict[str, tuple[int, ...]] = {}
    if not network.says_classes:
        shapes["deviations"] = (len(network.outputs),)
    for layer, (n_in, n_out) in enumerate(pairwise(network.widths)):
        shapes[f"layers.{layer}.weight"] = (n_out, n_in)
        shapes[f"layers.{layer}.bias"] = (n_out,)
    return shapes


def check_tensors(network: Network, tensors: Mapping[str, NDArray[Any]]) -> None:
    """Raise PolicyError unless these are the tensors of such a network."""
    shapes = tensor_shapes(network)
    if tensors.keys() != shapes.keys():
        raise PolicyError(f"its tensors are {sorted(tensors)}: should be {sorted(shapes)}")
    for name, shape in shapes.items():
        tensor = tensors[name]
        if tensor.shape != shape or tensor.dtype != np.float32:
            raise PolicyError(
                f"its tensor {name} is {tensor.dtype} of shape {tensor.shape}: the network on its "
                f"card should have float32 of shape {shape}"
            )
        if not np.isfinite(tensor).all():
            raise PolicyError(f"its tensor {name} is not finite")


def digest(tensors: Mapping[str, NDArray[np.float32]]) -> str:
    """Return 16 hexadecimal digits that change with any of the numbers."""
    total = hashlib.sha256()
    for name in sorted(tensors):
        total.update(name.encode() + b"\0" + tensors[name].astype("<f4").tobytes())
    return total.hexdigest()[:16]
