"""What a trained policy's file says of itself: how it decides, how it was made, how good it is."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, NonNegativeFloat, NonNegativeInt, PositiveFloat, PositiveInt

from swarm_logistics_env.errors import PolicyError, SwarmLogisticsError
from swarm_logistics_env.records import Record

# What a command row is made of, in its order.
COMMANDS = ("forward", "left", "turn", "gripper")
CommandName = Literal["forward", "left", "turn", "gripper"]
Width = Annotated[int, Field(ge=1, le=4096)]


class _Part(Record):
    error_type: ClassVar[type[SwarmLogisticsError]] = PolicyError


class Output(_Part):
    """One output of the network: y, clipped to [-1, 1], commands `scale` y + `offset`.

    Args:
        command: which one; those that no output has are 0.
        scale, offset: e.g. 0.5 and 0.5: speeds forward alone.
    """

    command: CommandName
    scale: Annotated[float, Field(ge=-1, le=1)] = 1.0
    offset: Annotated[float, Field(ge=-1, le=1)] = 0.0


class Network(_Part):
    """What a trained policy reads, computes and commands.

    Args:
        columns: names of `observations.columns` whose values it reads, in this order.
        remembers_command: it also reads its last outputs, clipped, 0 at first.
        noise: so many numbers that wander slowly about 0 with standard deviation 1, from the
            robot's own stream, are read as well: what a random walk needs.
        noise_time: after which they are forgotten to 1/e [s].
        hidden: widths of the hidden layers.
        activation: between layers.
        outputs: what the outputs command.
        exploration: standard deviations of the training's Gaussian noise that are added to the
            outputs, 0: none.
    """

    columns: Annotated[tuple[str, ...], Field(min_length=1)]
    remembers_command: bool = False
    noise: Annotated[int, Field(ge=0, le=16)] = 0
    noise_time: PositiveFloat = 1.0
    hidden: Annotated[tuple[Width, ...], Field(max_length=8)]
    activation: Literal["tanh", "relu"] = "tanh"
    outputs: Annotated[tuple[Output, ...], Field(min_length=1, max_length=4)]
    exploration: NonNegativeFloat = 0.0


class Score(_Part):
    """One measured value with its 95 % interval.

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


class PolicyCard(_Part):
    """All that a policy file says beside its weights.

    Args:
        format: of the file.
        name: of the policy.
        about: what it is, in a sentence or two.
        network: how it decides.
        command: the command line that made it.
        versions: of the packages that made it.
        scenario: what it was trained in, fields that differ from the defaults.
        training: the specification of the training.
        seed: of the training.
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
