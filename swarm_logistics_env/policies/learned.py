"""A trained policy, played without the library that it was trained with."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.kernels import gaussian, kernel, pair_key
from swarm_logistics_env.motion.frame import MotionFrame
from swarm_logistics_env.policies.card import Network, PolicyCard
from swarm_logistics_env.policies.network import FeedForward
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import row_keys

STREAM = "trained policy"


class LearnedPolicy:
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

    def __init__(self, card: PolicyCard, tensors: Mapping[str, NDArray[np.float32]]) -> None:
        check_tensors(card.network, tensors)
        self.card = card
        self.tensors = dict(tensors)
        network = card.network
        layers = range(len(network.hidden) + 1)
        self._network = FeedForward(
            [tensors[f"layers.{layer}.weight"] for layer in layers],
            [tensors[f"layers.{layer}.bias"] for layer in layers],
            rectify=network.activation == "relu",
        )
        self._deviations = tensors["deviations"] * np.float32(network.exploration)
        self.parameters = {
            "network": network.model_dump(mode="json"),
            "weights": digest(tensors),
        }
        self.configure(Scenario())

    def configure(self, scenario: Scenario) -> None:
        """Take what a robot's maker knows: the control period."""
        self._frame = MotionFrame(scenario, self.card.network.listens)
        self.reset(0, 0)

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode."""
        self._keys = row_keys(seed, STREAM, n_robots)
        self._frame.begin(self._keys)
        self._step = 0

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D)."""
        if observations.shape[0] != len(self._keys):
            raise PolicyError(
                f"observations of {observations.shape[0]} robots: reset was told {len(self._keys)}"
            )
        outputs = self._network(self._frame.read(observations))
        if self.card.network.exploration:
            explore(self._keys, self._step, self._deviations, outputs)
        self._step += 1
        return self._frame.command(outputs)


@kernel
def explore(
    keys: NDArray[np.uint64],
    count: int,
    deviations: NDArray[np.float32],
    outputs: NDArray[np.float32],
) -> None:
    """Add Gaussian noise, from each robot's own stream, to `outputs` (N, k) of decision `count`."""
    for robot in range(outputs.shape[0]):
        for place in range(outputs.shape[1]):
            drawn = gaussian(pair_key(keys[robot], place), count)
            outputs[robot, place] += np.float32(deviations[place] * drawn)


def tensor_shapes(network: Network) -> dict[str, tuple[int, ...]]:
    """Return the shape of each tensor that such a policy has.

    `layers` are as torch has them, weight (outputs, inputs); `deviations` those of the training's
    noise, of each output.
    """
    widths = [len(network.inputs), *network.hidden, len(network.outputs)]
    shapes: dict[str, tuple[int, ...]] = {"deviations": (widths[-1],)}
    for layer, (n_in, n_out) in enumerate(pairwise(widths)):
        shapes[f"layers.{layer}.weight"] = (n_out, n_in)
        shapes[f"layers.{layer}.bias"] = (n_out,)
    return shapes


def check_tensors(network: Network, tensors: Mapping[str, NDArray[Any]]) -> None:
    """Raise PolicyError unless these are the tensors of such a network."""
    shapes = tensor_shapes(network)
    if tensors.keys() != shapes.keys():
        missing = sorted(shapes.keys() - tensors.keys())
        unknown = sorted(tensors.keys() - shapes.keys())
        raise PolicyError(f"its tensors lack {missing} and have {unknown} that no layer is for")
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
