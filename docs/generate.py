"""Writes docs/environment.md, with the defaults that the code has: `python docs/generate.py`."""

# ruff: noqa: E501  # the lines of the page

from __future__ import annotations

from pathlib import Path

import numpy as np
from record_tables import summary, table

from swarm_logistics_env import FAILURE_MODES, Fault, Scenario, wrappers
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.rewards import DEFAULT_WEIGHTS, REWARD_TERMS
from swarm_logistics_env.environment.spaces import ITEM_FEATURES, ROBOT_FEATURES
from swarm_logistics_env.observations import columns, n_columns
from swarm_logistics_env.scenario import CHANGES_DURING_RUN, SOURCES
from swarm_logistics_env.warehouse.warehouse import COMMAND_COLUMNS

PAGE = Path(__file__).parent / "environment.md"

INFOS = [
    ("`failed`", "0 or 1", "1 while any failure mode holds for the robot, removal included"),
    ("`delivered`", "items", "delivered so far by the whole swarm: the paper's P"),
    ("`active`", "0 or 1", "with `FixedAgents` only: 1 if the agent's robot is there"),
]

# What -1, 0 and 1 do.
COMMANDS = {
    "forward": ("back at top speed", "no motion", "ahead at top speed"),
    "left": ("to the right at top speed", "no motion", "to the left at top speed"),
    "turn": ("right at the top turn rate", "no turn", "left at the top turn rate"),
    "gripper": ("below -0.5: opens", "keeps its state", "above 0.5: holds"),
}

TEXT = """\
# Swarm logistics

<!-- Written by docs/generate.py from the code; change that, not this. -->

```{{figure}} media/warehouse.png
:alt: A swarm of 16 robots in a warehouse seen from above
```

A swarm fetches requested items from the storage of a warehouse to its delivery area. Each robot uses only its own sensors.

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

`swarm_logistics_v0.env` is the same environment with agents that act in turn (AEC). `env.reset_arrays` and `env.step_arrays` take and return
one array for the whole swarm. In `gymnasium.make("swarm_logistics_env:SwarmLogistics-v0")` the swarm is one agent. [In other people's
code](ecosystem.md) says how each library takes them.

## Agents

The agents are `robot_0` to `robot_{last}`, one for each robot of the scenario. A removed robot is not in `agents` for the rest of the episode.

`possible_agents` and all spaces never change. A reset may ask for fewer robots. If it is to ask for more, give `max_robots` when you make
the environment, or wrap it in `SwarmSize`. For trainers that need the same agents from the first step to the last, use `FixedAgents(env)`:
all possible agents are always present, absent robots have rows of zeros, and all agents end together.

## Observation space

Each robot has one float32 row, in its own frame: x forward, y left. Items in view and neighbours are sorted by distance, nearest first; absent
ones are zeros. `observations.unflatten` returns the columns by name.

{observations}

With `message_size` M above 0, `neighbour_message` follows: M numbers in [-1, 1] of each neighbour.

## Action space

The space is `Box(-1, 1, (4,), float32)`. Values beyond the bounds are clipped. With `message_size` M, M numbers to broadcast follow.

{commands}

## State

`env.state()` is one float32 vector for central critics, with {state_length} numbers by default. For each robot it has {robot_features}; for each
item it has {item_features}; the last number is the time [s].

## Rewards

The reward is the weighted sum of these terms, for example `parallel_env(rewards={{"own_delivery": 1.0, "contact": -0.1}})`.

{rewards}

The difference of a potential $\\Phi$ is paid as $\\gamma \\Phi(s') - \\Phi(s)$, which leaves the best behaviour as it is (Ng et al. 1999): what a lift pays is
taken back by the delivery. It needs the learner's discount $\\gamma$ among the weights, as `{{"own_delivery": 1.0, "carrying": 0.5, "discount": 0.99}}`; in
a training file it is `ppo.gamma`. `approach` can be earned in circles: a robot that puts the item down, steps back and lifts it from there has
brought it back unpaid.

## Episode end

All agents terminate when every item is delivered, which never happens with `restock`. A robot terminates when it is removed. All agents are
truncated after `duration` ({duration:g} s, {n_steps} steps), or after `max_cycles` steps if that is sooner.

## Infos

Each agent has a dict of its own. It contains numbers, with the same keys at the reset and at every step. Robots do not sense them: infos
are for those who train or judge robots.

{infos}

`IndicatorReward` adds the indicators and their references; see its `episode_info`. `warehouse.state.failure_modes` names the modes of each
robot. `SwarmVecEnv` adds `world`, `n_robots` and `padding` of each row; in `CentralEnv`, `failed` is an array (N,).

## Arguments

{arguments}

Every field of `Scenario` is an argument, too. Fields marked * can change during a run. Each default either comes from a source ({sources}), or was
fitted to bring the paper's tables closest, or was chosen without a source, or is off: then the default leaves out an addition of this package.

{scenario}

`reset(seed, options)` takes `options={{"scenario": {{...}}, "faults": [...]}}` for one episode. A fault is a `Fault` or, as JSON and YAML
have it, a dict of its arguments: `{{"mode": "FM1", "robots": 2}}`. Any argument, option or command that is not allowed raises a subclass of
`SwarmLogisticsError`, which is a `ValueError`, before anything has changed.

## Failure modes

A fault is `Fault({fault})`. Robots do not sense it; `infos[agent]["failed"]` is 1 while any mode holds.

{failures}

## Wrappers

Wrappers stack in any order, except `FixedAgents`, which has to be the outermost. All of them have the array methods.

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
        fault=", ".join(Fault.model_fields),
        observations=observation_table(scenario),
        commands=table(
            ("column", "name", "-1", "0", "1"),
            [(place, f"`{name}`", *COMMANDS[name]) for place, name in enumerate(COMMAND_COLUMNS)],
        ),
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
