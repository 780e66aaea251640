"""Cards of the shipped policies, from the files of the networks and the code of the scripts."""

from collections.abc import Iterator
from typing import Any

from research.tables import table
from swarm_logistics_env.policies.catalogue import SCRIPTED, TRAINED, known_policies
from swarm_logistics_env.policies.files import read_policy
from swarm_logistics_env.policies.learned import LearnedPolicy, PolicyCard, Score


def model_cards() -> dict[str, str]:
    """Return the blocks of the page: the card of each recipe, and the table of scripts."""
    recipes = dict.fromkeys(name.partition("@")[0] for name in TRAINED)
    return {"networks": "\n\n".join(map(recipe_card, recipes)), "scripts": script_table()}


def recipe_card(recipe: str) -> str:
    """Return a section: what all trainings of a recipe share, then a row for each training."""
    policies = {
        name: read_policy(path)
        for name, path in TRAINED.items()
        if name.partition("@")[0] == recipe
    }
    card = policies[recipe].card
    rows = [*shared_facts(card), ("files", f"{len(policies)}, `{recipe}@all`, one a training")]
    shared = table(("of all its trainings", ""), rows)
    return f"## {recipe}\n\n{shared}\n\n{training_table(policies)}"


def shared_facts(card: PolicyCard) -> Iterator[tuple[str, str]]:
    """Yield what the cards of all trainings say alike, by name."""
    network = card.network
    widths = " x ".join(map(str, network.hidden))
    command = " ".join(card.command.split()[:3])
    period = network.decides_every
    versions = ", ".join(f"{name} {version}" for name, version in card.versions.items())
    world = ", ".join(f"`{name} = {value}`" for name, value in card.scenario.items())
    yield "what it is", card.about
    yield "reads", f"{len(network.inputs)} numbers of a robot's own row and memory"
    yield "says", ", ".join(network.outputs)
    yield "network", f"layers of {widths}, {network.activation}, the same for every robot"
    yield "decides", f"every {period} control steps, with the noise of its training"
    yield "learned by", f"`{command} --seed SEED`, {card.agent_steps:,} decisions of robots"
    yield "learned in", world
    yield "learned with", versions


def training_table(policies: dict[str, LearnedPolicy]) -> str:
    """Return a row for each training: its seed, the digest of its weights, and its scores of P."""
    columns = dict.fromkeys(
        score.condition for policy in policies.values() for score in scores_of(policy)
    )
    rows = []
    for name, policy in policies.items():
        scores = {score.condition: score for score in scores_of(policy)}
        texts = [in_words(scores.get(condition)) for condition in columns]
        rows.append((f"`{name}`", policy.card.seed, policy.parameters.weights, *texts))
    seeds = {score.seeds for policy in policies.values() for score in scores_of(policy)}
    note = f"P with its 95 % interval over {max(seeds)} seeds, as the file's own card has it."
    head = ("file", "seed", "digest of its weights", *(f"P, {name}" for name in columns))
    return f"{table(head, rows)}\n\n{note}"


def scores_of(policy: LearnedPolicy) -> Iterator[Score]:
    """Yield the scores of P of a card."""
    return (score for score in policy.card.scores if score.measure == "P")


def in_words(score: Score | None) -> str:
    """Return a score with its interval; "": there is none."""
    if score is None:
        return ""
    return f"{score.value:.1f} [{score.low:.1f}, {score.high:.1f}]"


def script_table() -> str:
    """Return a row for each script: what it is, and whether it needs to see everything."""
    about = {name: text for name, _, text in known_policies()}
    rows = []
    for name, maker in SCRIPTED.items():
        kind: Any = getattr(maker, "func", maker)
        sees_all = getattr(kind, "needs_state", False)
        rows.append((f"`{name}`", about[name], "the whole state" if sees_all else "its own row"))
    return table(("script", "what it is", "reads"), rows)
