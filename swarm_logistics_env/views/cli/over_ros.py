"""`swarm-logistics ros`: a swarm of nodes of ROS 2 in a world that is a node, or one of them."""

from __future__ import annotations

from typing import Annotated

from typer import Argument, Option, echo

from swarm_logistics_env.core.errors import RobotError
from swarm_logistics_env.robots.middleware import Middleware
from swarm_logistics_env.robots.ros_robot import RobotNode
from swarm_logistics_env.robots.ros_world import (
    WorldNode,
    executor_of_ros,
    play_swarm,
    play_world,
)
from swarm_logistics_env.world.scenario import Scenario

from .policy_choice import TrustOption, policies_of
from .world_choice import (
    FaultOption,
    PresetOption,
    ScenarioOption,
    SeedOption,
    SetOption,
    faults_of,
    scenario_of,
)

WORLD = "world"


def ros_command(
    policy: Annotated[
        str, Argument(help="Name (`list policies`), path of a file, module:Class or my.py:Class.")
    ],
    seed: SeedOption = 0,
    preset: PresetOption = None,
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    faults: FaultOption = None,
    loss: Annotated[float, Option(help="Rows and commands that are lost [probability].")] = 0.0,
    delay: Annotated[float, Option(help="What a row or a command takes [s, simulated].")] = 0.0,
    jitter: Annotated[float, Option(help="It takes up to so much longer [s].")] = 0.0,
    stop_after: Annotated[
        int, Option(help="A robot stands where its row is older [control periods].")
    ] = 5,
    patience: Annotated[
        float,
        Option(
            min=0.0, help="How long the world waits for commands, each period [s of the clock]."
        ),
    ] = 1.0,
    only: Annotated[
        str | None,
        Option(metavar="world|NUMBER", help="That node alone; others run elsewhere."),
    ] = None,
    trust_code: TrustOption = False,
) -> None:
    """Play an episode over ROS 2, the world and each robot a node."""
    (spec,) = policies_of([policy], trust_code)
    scenario = scenario_of(preset, scenario_file, changes, policies=[spec])
    scheduled = faults_of(faults, scenario)
    middleware = Middleware(loss=loss, delay=delay, jitter=jitter, stop_after=stop_after)
    with executor_of_ros() as executor:
        if only not in (None, WORLD):
            number = _number_of(only, scenario)
            robot = RobotNode(
                spec.load(), scenario, number, seed, faults=scheduled, stop_after=stop_after
            )
            echo(f"Robot {number} runs {spec.title}; Ctrl-C ends it.")
            executor.add_node(robot.node)
            try:
                while True:
                    executor.spin_once(timeout_sec=0.1)
            finally:
                robot.stand()
        world = WorldNode(scenario, seed, scheduled, middleware, patience)
        if only == WORLD:
            play_world(world, executor)
        else:
            play_swarm(spec.load(), world, seed, executor)
    state = world.world.state
    echo(
        f"P = {state.delivered} items delivered in {state.time:g} s by {scenario.n_robots} robots "
        f"with {spec.title} over ROS 2, seed {seed}"
    )
    if world.n_late:
        echo(f"{world.n_late} commands came after the world's patience: not to be repeated exactly")


def _number_of(only: str | None, scenario: Scenario) -> int:
    text = str(only)
    if not (text.isdecimal() and int(text) < scenario.n_robots):
        raise RobotError(
            f"--only {text}: should be {WORLD}, or a robot from 0 to {scenario.n_robots - 1}"
        )
    return int(text)
