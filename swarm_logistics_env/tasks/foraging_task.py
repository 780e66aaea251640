"""The task of foraging: the second world that a study can play by its name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from swarm_logistics_env.policies.forager import Forager
from swarm_logistics_env.scenario import Scenario

from .foraging import Foraging, ForagingScenario
from .warehouse_task import WarehouseTask

# What these modes take away means something else here, or nothing.
_OTHER_MEANING = {
    "FM1": "always tells timer 0, as if in the nest",
    "FM4": "its entering the nest delivers nothing",
}
_NO_MEANING = ("FM4_jam",)  # nobody lets anything go in the nest, so it is FM4


class ForagingTask(WarehouseTask):
    """Episodes in which any item counts that comes into the nest; see `Task` for its attributes."""

    name = "foraging"
    performance = "the number of items brought into the nest"
    default = ForagingScenario()
    policies: Mapping[str, Callable[..., Any]] = MappingProxyType({"forager": Forager})
    world = Foraging

    @property
    def fields(self) -> dict[str, str]:
        """The scenario's numeric fields but `n_robots`, each with unit, meaning and source."""
        return {
            name: str(ForagingScenario.model_fields[name].description) for name in super().fields
        }

    @property
    def failure_modes(self) -> dict[str, str]:
        """The failure modes, each with what it does to a robot."""
        known = {**super().failure_modes, **_OTHER_MEANING}
        return {mode: known[mode] for mode in known if mode not in _NO_MEANING}

    def vary(self, base: Scenario, fields: Mapping[str, Any]) -> Scenario:
        """Return `base` with `fields` changed; "preset" gives the robots of a warehouse's preset.

        Raises:
            ScenarioError: there is no such preset, or a field cannot be.
        """
        changes = dict(fields)
        if "preset" in changes:
            preset = Scenario.preset(str(changes.pop("preset")))
            robots = {name: getattr(preset, name) for name in preset.model_fields_set}
            base, changes = ForagingScenario(), {**robots, **changes}
        return base.replace(**changes)


FORAGING = ForagingTask()
