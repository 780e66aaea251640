"""What the value network reads beside a robot's own inputs: what no robot can sense.

It judges while the policy learns and is not shipped, so it may know where the requested item is
(an asymmetric critic, Pinto et al. 2018). The network that decides never sees this.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import create_mlp

from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.motion.frame import INPUTS
from swarm_logistics_env.warehouse import Warehouse
from swarm_logistics_env.warehouse.state import NOBODY

# Lengths are in units of 10 m; directions are in the frame of the robot's motion.
KNOWN = (
    "to_delivery", "y", "frame_cos", "frame_sin", "drift", "swarm_size",
    "lifts", "delivers",
    "requested_along", "requested_aside", "requested_distance", "requested_nearness",
    "is_carried", "carrier_to_delivery", "carrier_delivers",
)  # fmt: skip


def read_known(world: Warehouse, turned: NDArray[np.float64], known: NDArray[np.float32]) -> None:
    """Fill `known` (rows, len(KNOWN)); rows without a robot stay as they are.

    Args:
        turned: how far each row's frame is turned from its robot's body (rows,) [rad].
    """
    state = world.state
    requested = state.requested
    place = np.zeros(2) if requested == NOBODY else state.item_position[requested]
    carrier = NOBODY if requested == NOBODY else int(state.item_carrier[requested])
    fill_known(
        state.robot_position,
        state.robot_heading,
        state.robot_heading_drift,
        state.lifts,
        state.delivers,
        place,
        requested != NOBODY,
        carrier,
        world.scenario.storage_width,
        world.scenario.warehouse_height,
        turned,
        known,
    )


@kernel
def fill_known(
    positions: NDArray[np.float64],
    headings: NDArray[np.float64],
    drifts: NDArray[np.float64],
    lifts: NDArray[np.bool_],
    delivers: NDArray[np.bool_],
    place: NDArray[np.float64],
    is_requested: bool,
    carrier: int,
    edge: float,
    height: float,
    turned: NDArray[np.float64],
    known: NDArray[np.float32],
) -> None:
    """Fill the columns of robots from positions [m], headings [rad] and their rates [rad/s]."""
    for robot in range(positions.shape[0]):
        row = known[robot]
        x, y = positions[robot, 0], positions[robot, 1]
        frame = headings[robot] + turned[robot]
        cos, sin = math.cos(frame), math.sin(frame)
        row[0], row[1] = (edge - x) / 10.0, (y - 0.5 * height) / 10.0
        row[2], row[3] = cos, sin
        row[4] = 10.0 * drifts[robot]
        row[5] = math.log(positions.shape[0]) / 5.0
        row[6] = 1.0 if lifts[robot] else 0.0
        row[7] = 1.0 if delivers[robot] else 0.0
        row[8:] = 0.0
        if is_requested:
            to_x, to_y = place[0] - x, place[1] - y
            away = max(math.sqrt(to_x * to_x + to_y * to_y), 1e-9)
            row[8] = (cos * to_x + sin * to_y) / away
            row[9] = (cos * to_y - sin * to_x) / away
            row[10] = away / 10.0
            row[11] = max(0.0, 1.0 - away / 2.0)
        if carrier >= 0:
            row[12] = 1.0
            row[13] = (edge - positions[carrier, 0]) / 10.0
            row[14] = 1.0 if delivers[carrier] else 0.0


class AsymmetricPolicy(ActorCriticPolicy):  # type: ignore[misc]  # not in the environment of the type check
    """PPO's two networks: the actor reads the first `len(INPUTS)` columns, the critic all."""

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = _TwoReaders(self.features_dim, self.net_arch, self.activation_fn)


class _TwoReaders(torch.nn.Module):
    def __init__(
        self, n_columns: int, widths: dict[str, list[int]], activation: type[torch.nn.Module]
    ) -> None:
        super().__init__()
        self.policy_net = torch.nn.Sequential(
            *create_mlp(len(INPUTS), -1, widths["pi"], activation)
        )
        # Cheaper than tanh, and as good for values.
        self.value_net = torch.nn.Sequential(
            *create_mlp(n_columns, -1, widths["vf"], torch.nn.LeakyReLU)
        )
        self.latent_dim_pi, self.latent_dim_vf = widths["pi"][-1], widths["vf"][-1]

    def forward(self, columns: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return self.forward_actor(columns), self.forward_critic(columns)

    def forward_actor(self, columns: torch.Tensor) -> Any:
        return self.policy_net(columns[:, : len(INPUTS)])

    def forward_critic(self, columns: torch.Tensor) -> Any:
        return self.value_net(columns)
