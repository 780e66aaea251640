"""The warehouse as a task of BenchMARL, to be dropped in: enum, class and one YAML for each world.

>>> from interop.benchmarl_task import SwarmLogisticsTask
>>> task = SwarmLogisticsTask.SMALL.get_from_yaml()

Once it is imported, `task=swarm_logistics/small` is known to BenchMARL's command line too; the
files of swarm_logistics/ then belong into benchmarl/conf/task/.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarl.environments import task_config_registry
from benchmarl.environments.common import Task, TaskClass

from interop.torchrl_worlds import TorchRLWorlds
from swarm_logistics_env import Scenario, swarm_logistics_v0
from swarm_logistics_env.core.streams import key
from swarm_logistics_env.wrappers import MotionFrame


class SwarmLogisticsClass(TaskClass):  # type: ignore[misc]  # BenchMARL is not in the gate
    """Worlds of one group, "robots", with 95 inputs and 3 outputs within -1 and 1 each.

    The configuration has the fields of `Scenario`, `rewards` (term to weight) and, where robots are
    to fail, `faults`, each as text ("FM4:3") or a dict.
    """

    def get_env_fun(
        self, num_envs: int, continuous_actions: bool, seed: int | None, device: Any
    ) -> Callable[[], TorchRLWorlds]:
        """Return a maker of `num_envs` worlds side by side, which refuses fields that cannot be."""
        config = dict(self.config)
        options = {name: config.pop(name) for name in ("rewards", "faults") if name in config}

        def make() -> MotionFrame:
            return MotionFrame(swarm_logistics_v0.parallel_env(Scenario(**config), **options))

        seeds = [key(seed or 0, "world", world) >> 1 for world in range(num_envs)]
        return lambda: TorchRLWorlds(make, seeds)

    def supports_continuous_actions(self) -> bool:
        return True

    def supports_discrete_actions(self) -> bool:
        return False

    def max_steps(self, env: Any) -> int:
        return env.base_env.worlds.envs[0].warehouse.scenario.n_steps  # type: ignore[no-any-return]

    def has_render(self, env: Any) -> bool:
        return False

    def group_map(self, env: Any) -> dict[str, list[str]]:
        return env.group_map  # type: ignore[no-any-return]

    def observation_spec(self, env: Any) -> Any:
        return env.full_observation_spec_unbatched

    def action_spec(self, env: Any) -> Any:
        return env.full_action_spec_unbatched

    def info_spec(self, env: Any) -> None:
        """Return None: there is no more to tell."""

    def state_spec(self, env: Any) -> None:
        """Return None: central critics read all robots' observations."""

    def action_mask_spec(self, env: Any) -> None:
        """Return None: a robot may do everything at any time."""

    @staticmethod
    def env_name() -> str:
        return "swarm_logistics"


class SwarmLogisticsTask(Task):  # type: ignore[misc]  # as above
    """The worlds; a name in small letters is a YAML's."""

    SMALL = None
    PAPER = None

    @staticmethod
    def associated_class() -> type[SwarmLogisticsClass]:
        return SwarmLogisticsClass

    def get_from_yaml(self, path: str | None = None) -> SwarmLogisticsClass:
        """Return the task as its YAML beside this file has it, or that of another path."""
        default_path = Path(__file__).parent / self.env_name() / f"{self.name.lower()}.yaml"
        return super().get_from_yaml(path or str(default_path))  # type: ignore[no-any-return]


for _task in SwarmLogisticsTask.__members__.values():
    task_config_registry[f"{_task.env_name()}/{_task.name.lower()}"] = _task
