"""The stable names of the package in Markdown, from their docstrings, for `generate.py`."""

import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from typing import Any

PACKAGE = "swarm_logistics_env"
# Programs may rely on these: heading -> name -> the members that are told with it.
STABLE: dict[str, dict[str, tuple[str, ...]]] = {
    "Worlds and runs": {
        "Scenario": ("preset", "replace", "from_json", "to_json", "conditions"),
        "run_episode": (),
        "Episode": ("delivered",),
        "Fault": (),
        "world.warehouse.failure_modes.FailureMode": (),
        "Warehouse": ("reset", "step", "observe", "change", "set_faults"),
        "world.observations.columns": (),
        "world.observations.unflatten": (),
        "core.streams.generator": (),
        "core.streams.row_keys": (),
    },
    "Bodies of robots": {
        "world.bodies.Placement": (),
        "world.bodies.Orders": (),
        "world.bodies.Poses": (),
    },
    "The environment": {
        "environment.parallel_env.SwarmLogisticsEnv": (
            "reset_arrays", "step_arrays", "declare_spaces", "render", "state",
        ),
        "wrappers.FaultInjection": (),
        "wrappers.SwarmSize": (),
        "wrappers.ParameterChange": (),
        "wrappers.FixedAgents": (),
        "wrappers.DiscreteActions": (),
        "wrappers.MotionFrame": (),
        "wrappers.IndicatorReward": ("payments_of", "episode_info"),
        "wrappers.RunningMeans": ("add", "mean", "count"),
        "wrappers.Condition": (),
        "wrappers.Wrapper": ("plan", "begun", "robot_info"),
    },
    "Learners": {
        "adapters.SwarmVecEnv": ("present", "seed", "set_options"),
        "adapters.SwarmVecNormalize": (),
        "adapters.LogDeliveries": (),
        "adapters.SwarmRows": (),
        "adapters.CentralEnv": (),
        "world.motion.MotionView": ("begin", "read", "command"),
        "record": (),
        "policies.demonstrations.Demonstrations": ("transitions", "to_parquet", "to_minari"),
    },
    "Policies": {
        "policies.load": (),
        "policies.of": (),
        "policies.from_sb3": (),
        "policies.within": (),
        "policies.read_card": (),
        "policies.Policy": ("reset", "act"),
        "policies.policy.start": (),
        "policies.policy.decide": (),
    },
    "Robots": {
        "policies.row_policy.Robot": ("step", "memory"),
        "robots.contract_of": (),
        "robots.Contract": ("to_yaml",),
        "robots.check_rows": (),
        "robots.write_c": (),
        "robots.FaultLayer": ("modes", "counts", "sensed", "driven", "broadcast"),
        "robots.append_trial": (),
        "robots.Middleware": (),
        "robots.OverMiddleware": (),
    },
    "Indicators": {
        "spi.scalability": (),
        "spi.robustness": (),
        "spi.fault_tolerance": (),
        "spi.adaptability": (),
        "spi.relative_change": (),
        "spi.Estimate": (),
        "spi.Options": (),
        "study.read_trials": (),
        "study.Trials": ("select", "performance"),
        "study.Trial": (),
        "spi.equivalence": (),
        "spi.Equivalence": ("p_value", "verdict", "flags"),
        "spi.adjust": (),
        "spi.fault_budget": (),
        "spi.FaultBudget": (),
        "spi.look_alphas": (),
        "spi.seeds_for_power": (),
        "spi.lower_decile_of_power": (),
        "spi.seeds_for_equivalence": (),
        "spi.seeds_against_stalls": (),
        "spi.share_stalled": (),
        "spi.minimum_detectable_effect": (),
        "spi.repair_times": (),
    },
    "Studies": {
        "study.Study": (
            "plan", "run", "findings", "results", "indicators", "report", "preset", "from_file",
            "stored",
        ),
        "judge": (),
        "study.verdicts.gate.Gate": (),
        "study.verdicts.gate.answers": (),
    },
    "Other swarms": {
        "study.tasks.ParallelTask": (),
        "study.tasks.SumOfRewards": (),
        "study.tasks.SumOfInfos": (),
        "study.tasks.PaddedAgents": (),
        "study.tasks.ChangingAgents": (),
        "study.tasks.FailingRobots": (),
        "study.tasks.RobotFault": (),
        "study.tasks.Task": (),
        "study.tasks.TaskWorld": (),
    },
    "Tests of your code": {
        "policies.testing.check_policy": (),
        "policies.testing.check_wrapper": (),
        "film": (),
        "core.errors.SwarmLogisticsError": (),
    },
}  # fmt: skip
# Values, which have no docstring.
VALUES = {
    "swarm_logistics_v0": "The environment as PettingZoo has it: `parallel_env(**fields)`, `env`.",
    "FAILURE_MODES": "The failure modes by name; a `FailureMode` of yours goes into it.",
    "world.motion.INPUTS": "The names of the inputs of a network behind `MotionFrame`, in order.",
    "world.motion.OUTPUTS": "The names of its outputs, in order.",
}
_HEADINGS = ("Args", "Attributes", "Returns", "Yields", "Raises", "Example", "Source")


def python_names() -> str:
    """Return a section for each group of stable names."""
    return "\n\n".join(_sections())


def _sections() -> Iterator[str]:
    rows = [f"* `{PACKAGE}.{name}`: {meaning}" for name, meaning in VALUES.items()]
    yield "## Values\n\n" + "\n".join(rows)
    for heading, names in STABLE.items():
        yield f"## {heading}"
        for name, members in names.items():
            value = named(name)
            yield f"### {name}\n\n{_described(f'{PACKAGE}.{name}', value)}"
            for member in members:
                description = _described(member, inspect.getattr_static(value, member))
                yield f"#### {member}\n\n{description}"


def named(name: str) -> Any:
    """Return what a stable name stands for."""
    module, _, attribute = f"{PACKAGE}.{name}".rpartition(".")
    return getattr(import_module(module), attribute)


def _described(name: str, value: Any) -> str:
    """Return the signature and the docstring of a function, class or property."""
    function = getattr(value, "__func__", getattr(value, "fget", value))
    text = docstring_markdown(inspect.getdoc(function) or "")
    signature = signature_text(value)
    if not signature:
        return f"`{name}`\n\n{text}"
    return f"```text\n{name}{signature}\n```\n\n{text}"


def signature_text(value: Any) -> str:
    """Return the names of the arguments, and their defaults; "": it is a property or a value."""
    function = getattr(value, "__func__", value)
    if isinstance(function, property) or not callable(function):
        return ""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return "(...)"
    texts = []
    is_keyword_only = False
    for parameter in parameters:
        if parameter.name in ("self", "cls"):
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and not is_keyword_only:
            is_keyword_only = True
            texts.append("*")
        stars: dict[Any, str] = {parameter.VAR_POSITIONAL: "*", parameter.VAR_KEYWORD: "**"}
        text = stars.get(parameter.kind, "") + parameter.name
        if parameter.default is not parameter.empty:
            value = repr(parameter.default)
            text += f"={value}" if len(value) <= 24 and "<" not in value else "=..."
        is_keyword_only |= parameter.kind is parameter.VAR_POSITIONAL
        texts.append(text)
    return f"({', '.join(texts)})"


def docstring_markdown(text: str) -> str:
    """Return a docstring as Markdown: lists of arguments and errors, examples as code."""
    parts = re.split(rf"^({'|'.join(_HEADINGS)}):\n", text, flags=re.MULTILINE)
    blocks = [_escaped(parts[0].strip())]
    for heading, body in zip(parts[1::2], parts[2::2]):
        indented, after = _split_indented(body)
        if heading == "Example":
            blocks.append(f"```text\n{indented}\n```")
        else:
            items = re.split(r"\n(?=\S)", indented)
            lines = [_item(item) for item in items if item.strip()]
            blocks.append(f"{heading}:\n\n" + "\n".join(lines))
        if after:
            blocks.append(_escaped(after))
    return "\n\n".join(block for block in blocks if block)


def _split_indented(body: str) -> tuple[str, str]:
    """Return the indented lines at the beginning of a text, without indent, and what follows."""
    lines = body.split("\n")
    n_indented = next(
        (n for n, line in enumerate(lines) if line and not line.startswith("    ")), len(lines)
    )
    indented = inspect.cleandoc("\n" + "\n".join(lines[:n_indented]))
    return indented, "\n".join(lines[n_indented:]).strip()


def _item(item: str) -> str:
    """Return an argument, attribute or error with its meaning, as an item of a list."""
    item = " ".join(item.split())
    name, colon, meaning = item.partition(": ")
    return f"* `{name}`: {_escaped(meaning)}" if colon else f"* {_escaped(item)}"


def _escaped(text: str) -> str:
    """Return text of a docstring in which Markdown sees no markup but code."""
    parts = re.split(r"(`[^`\n]+`)", text)
    return "".join(
        part if part.startswith("`") else re.sub(r"([*_<|])", r"\\\1", part) for part in parts
    )
