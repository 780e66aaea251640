"""Writes docs/environment.md, with the defaults that the code has: `python docs/generate.py`."""

# ruff: noqa: E501  # the lines of the page

from __future__ import annotations

from pathlib import Path

import numpy as np
from record_tables import summary, table

from swarm_logistics_env import FAILURE_MODES, Scenario, wrappers
from swarm_logistics_env.environment.central_state import ITEM_FEATURES, ROBOT_FEATURES
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.rewards import DEFAULT_WEIGHTS, REWARD_TERMS
from swarm_logistics_env.observations import columns, n_columns
from swarm_logistics_env.scenario import CHANGES_DURING_RUN, SOURCES
from swarm_logistics_env.warehouse.warehouse import COMMAND_COLUMNS

PAGE = Path(__file__).parent / "environment.md"

INFOS = [
    ("`failed`", "0 or 1", "1 while any failure mode holds for the robot, removal included"),
    ("`delivered`", "items", "delivered so far by the whole swarm: the paper's P"),
    ("`active`", "0 or 1", "with `FixedAgents` only: 1 if the agent's robot is there"),
]

TEXT = """\
# Swarm logistics

<!-- Written by docs/generate.py from the code; change that, not this. -->

A swarm fetches requested items from the storage of a warehouse to its delivery area. Each robot has its own sensors only.

{facts}

## Use

```python
from swarm_logistics_env import swarm_logistics_v0

env = swarm_logistics_v0.parallel_env(n_robots=5)
observations, infos = env.reset(seed=0)
while env.agents:
    actions = {{agent: env.action_space(agent).sample() for agent in env.agents}}
    observations, rewards, terminations, truncations, infos = env.step(actions)
env.close()
```

`swarm_logistics_v0.env` is the same with agents in turn (AEC). `env.reset_arrays` and `env.step_arrays` give and take one array for the
whole swarm. `gymnasium.make("swarm_logistics_env:SwarmLogistics-v0")` is the swarm as one agent. [In other
people's code](ecosystem.md) says how each library takes them.

## Agents

`robot_0` to `robot_{last}`, as many as the scenario has robots. A removed robot is gone from `agents` for the rest of the episode.

`possible_agents` and all spaces stay as they were made. A reset may ask for fewer robots; for more, give `max_robots` when the environment
is made, or wrap it in `SwarmSize`. Trainers that need the same agents from the first step to the last take `FixedAgents(env)`: all
possible agents are always there, absent ones with rows of zeros, and all end together.

## Observation space

One float32 row for each robot, in its own frame: x forward, y left. Things in view and neighbours are sorted by distance, nearest first;
absent ones are zeros. `observations.unflatten` gives the columns by name.

{observations}

With `message_size` M above 0, `neighbour_message` follows: M numbers in [-1, 1] of each neighbour.

## Action space

`Box(-1, 1, (4,), float32)`: {commands}. Forward and left are fractions of the top speed, turn of the top turn rate (to the left); the
gripper holds above 0.5, opens below -0.5 and stays as it is between. Beyond the bounds is cut. With `message_size` M, M numbers to
broadcast follow.

## State

`env.state()` is one float32 vector for central critics, of {state_length} numbers by default: for each robot {robot_features}; for each
item {item_features}; then the time [s].

## Rewards

The weighted sum of terms, `parallel_env(rewards={{"own_delivery": 1.0, "contact": -0.1}})`.

{rewards}

## Episode end

All agents terminate when every item is delivered (never with `restock`); a robot terminates when it is removed. All are truncated after
`duration` ({duration:g} s, {n_steps} steps), or after `max_cycles` steps if that is sooner.

## Infos

A dict of its own for each agent, of numbers, with the same keys at the reset and at every step. Robots do not
sense them: infos are for those who train or judge robots.

{infos}

`IndicatorReward` adds the indicators and their references, see its `episode_info`. `warehouse.state.failure_modes` names the modes of each
robot. `SwarmVecEnv` tells `world`, `n_robots` and `padding` of each row besides; `CentralEnv` tells `failed` as an array (N,).

## Arguments

{arguments}

Every field of `Scenario` is an argument too. Those marked * can change during a run. Each default comes from a source ({sources}), was
fitted to bring the paper's tables closest, was chosen without a source, or is off: an addition of this package that the default leaves out.

{scenario}

`reset(seed, options)` takes `options={{"scenario": {{...}}, "faults": [...]}}` for one episode. A fault is a `Fault` or, as JSON and YAML
have it, a dict of its arguments: `{{"mode": "FM1", "robots": 2}}`. Any argument, option or command that cannot be
raises a subclass of `SwarmLogisticsError`, itself a `ValueError`, before anything has happened.

## Failure modes

`Fault(mode, robots, onset, duration, factor)`; robots are not told, `infos[agent]["failed"]` is 1 while any mode holds.

{failures}

## Wrappers

They stack in any order, but for `FixedAgents`, which goes around all others, and keep the array path.

{wrappers}

`swarm_logistics_env.testing` checks environments with wrappers of your own.

## Version history

* v0: first version.
"""


def page() -> str:
    """Return the page."""
    scenario = Scenario()
    env = SwarmLogisticsEnv(scenario)
    return TEXT.format(
        facts=table(
            ("", ""),
            [
                ("Import", "`from swarm_logistics_env import swarm_logistics_v0`"),
                ("Actions", "continuous"),
                ("Parallel API", "yes"),
                ("Manual control", "no"),
                ("Agents", f"`[robot_0, .., robot_{scenario.n_robots - 1}]`"),
                ("Number of agents", scenario.n_robots),
                ("Action shape", env.action_space("robot_0").shape),
                ("Action values", "[-1, 1]"),
                ("Observation shape", env.observation_space("robot_0").shape),
                ("Observation values", "see below"),
                ("State shape", env.state_space.shape),
                ("Render modes", ", ".join(env.metadata["render_modes"])),
            ],
        ),
        last=scenario.n_robots - 1,
        observations=observation_table(scenario),
        commands=", ".join(COMMAND_COLUMNS),
        state_length=env.state_space.shape[0],
        robot_features=", ".join(ROBOT_FEATURES),
        item_features=", ".join(ITEM_FEATURES),
        rewards=table(
            ("term", "default weight", "pays"),
            [
                (f"`{name}`", f"{DEFAULT_WEIGHTS.get(name, 0.0):g}", summary(term))
                for name, term in REWARD_TERMS.items()
            ],
        ),
        infos=table(("key", "unit", "meaning"), INFOS),
        duration=scenario.duration,
        n_steps=scenario.n_steps,
        arguments=arguments_list(),
        sources=", ".join(f"[{name}]({address})" for name, address in SOURCES.items()),
        scenario=scenario_table(scenario),
        failures=table(
            ("mode", "the robot"),
            [(f"`{name}`", mode.description) for name, mode in FAILURE_MODES.items()],
        ),
        wrappers=table(
            ("wrapper", ""),
            [(f"`{name}`", summary(getattr(wrappers, name))) for name in wrappers.__all__],
        ),
    )


def observation_table(scenario: Scenario) -> str:
    """Return the table of the named columns of a row."""
    rows = []
    for column in columns(scenario):
        places = np.arange(n_columns(scenario))[column.columns]
        where = str(places[0])
        if len(places) > 1:
            step = places[1] - places[0]
            where = f"{places[0]}-{places[-1]}" + (f", every {step}th" if step > 1 else "")
        between = f"[{column.low:g}, {column.high:g}]"
        rows.append((where, f"`{column.name}`", column.unit, between, column.meaning))
    return table(("columns", "name", "unit", "values", "meaning"), rows)


def scenario_table(scenario: Scenario) -> str:
    """Return the table of all conditions."""
    rows = []
    for name, field in Scenario.model_fields.items():
        mark = " *" if name in CHANGES_DURING_RUN else ""
        rows.append((f"`{name}`{mark}", f"`{getattr(scenario, name)!r}`", field.description))
    return table(("field", "default", "meaning; where the default comes from"), rows)


def arguments_list() -> str:
    """Return the arguments in the environment's docstring as a list."""
    text = (SwarmLogisticsEnv.__doc__ or "").split("Args:\n")[1].split("\n\n")[0]
    entries: list[str] = []
    for line in text.splitlines():
        if line.startswith(" " * 12):
            entries[-1] += " " + line.strip()
        else:
            entries.append(line.strip())
    pairs = (entry.split(":", 1) for entry in entries)
    return "\n".join(f"* `{name}`:{meaning}" for name, meaning in pairs)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
