"""The card in a trained policy's file: how it decides, how it was made, how good it is."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveInt,
    ValidationInfo,
    field_validator,
)

from swarm_logistics_env.errors import PolicyError, SwarmLogisticsError
from swarm_logistics_env.motion.frame import INPUT_COUNTS, INPUTS, OUTPUTS
from swarm_logistics_env.records import Record

Width = Annotated[int, Field(ge=1, le=4096)]


class _Part(Record):
    error_type: ClassVar[type[SwarmLogisticsError]] = PolicyError


class Network(_Part):
    """The inputs, layers and outputs of a trained policy.

    Args:
        inputs: the names of its inputs in order, see `motion.INPUTS`; or their number, for the
            first of them.
        outputs: the names of its outputs in order, see `motion.OUTPUTS`.
        listens: whether it reads the lowest timer heard; if not, those inputs are zeros.
        hidden: widths of the hidden layers.
        activation: the activation function between layers.
        exploration: the training's noise, times this factor, is added to the outputs, from each
            robot's own stream; 0 means none.

    Raises:
        PolicyError: the inputs or outputs are not those that this version knows.
    """

    inputs: tuple[str, ...] = INPUTS
    outputs: tuple[str, ...] = OUTPUTS
    listens: bool = True
    hidden: Annotated[tuple[Width, ...], Field(max_length=8)] = (128, 128)
    activation: Literal["tanh", "relu"] = "tanh"
    exploration: NonNegativeFloat = 0.0

    @field_validator("inputs", mode="before")
    @classmethod
    def _named(cls, inputs: Any) -> Any:
        if not isinstance(inputs, int):
            return inputs
        if inputs not in INPUT_COUNTS:
            raise ValueError(f"should be one of {', '.join(map(str, INPUT_COUNTS))}")
        return INPUTS[:inputs]

    @field_validator("inputs", "outputs")
    @classmethod
    def _known(cls, names: tuple[str, ...], about: ValidationInfo) -> tuple[str, ...]:
        right = INPUTS if about.field_name == "inputs" else OUTPUTS
        for place, (name, wanted) in enumerate(zip(names, right)):
            if name != wanted:
                raise ValueError(f"column {place} is {name!r}: should be {wanted!r}")
        allowed = INPUT_COUNTS if right is INPUTS else (len(right),)
        if len(names) not in allowed:
            counts = " or ".join(map(str, allowed))
            raise ValueError(f"has {len(names)} columns: should have {counts}")
        return names


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
    def _finite(cls, limit: Any) -> Any:
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
            world's code (`tasks.code_version`) at that time.
        scored_with: the version of this package, and the digest, with which it was scored.
        scenario: what it was trained in, fields that differ from the defaults, and always
            `heading_drift`: cards from before there was one read it as 0.
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

    @field_validator("scenario")
    @classmethod
    def _with_drift(cls, scenario: dict[str, Any]) -> dict[str, Any]:
        return {"heading_drift": 0.0, **scenario}
