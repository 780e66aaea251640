"""A film that plays in a notebook's cell."""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Sequence
from pathlib import Path

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.core.records import atomic_write
from swarm_logistics_env.policies.catalogue import load
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.world.rendering.renderer import FRAME_RATE, load_pygame, write_film
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.faults import FaultLike


class EmbeddedFilm:
    """A film, shown where it is the value of a notebook's cell; `film` makes it.

    Attributes:
        content: of the .mp4 file.
        title: what it shows.
    """

    def __init__(self, content: bytes, title: str) -> None:
        self.content = content
        self.title = title

    def save(self, path: str | Path) -> None:
        """Write it as an .mp4 file.

        Raises:
            SetupError: it cannot be written.
        """
        with atomic_write(Path(path), SetupError) as part:
            part.write_bytes(self.content)

    def __repr__(self) -> str:
        return f"EmbeddedFilm({self.title!r}, {len(self.content) / 1e6:.1f} MB)"

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.content).decode()
        return (
            '<video controls autoplay loop muted style="max-width: 100%" '
            f'src="data:video/mp4;base64,{data}"></video>'
        )


def film(
    *policies: Policy | str,
    scenario: Scenario | None = None,
    seed: int = 0,
    faults: Sequence[FaultLike] = (),
    until: float = 60.0,
    speed: float = 4.0,
) -> EmbeddedFilm:
    """Return a film of one episode, of several policies side by side.

    Args:
        policies: their names, paths or objects, at most four.
        scenario: the conditions; None: the paper's.
        faults: as `run_episode` takes them.
        until: the time of the episode at which it ends [s].
        speed: how many times real time it plays.

    Raises:
        SetupError: an argument is not allowed, or the extra for films is missing.
        PolicyError, FaultError, ScenarioError: as `run_episode`.

    Example:
        >>> film("homing", until=2.0, scenario=Scenario(n_robots=3)).title
        'homing, seed 0'
    """
    load_pygame()
    from swarm_logistics_env.views.watch.film import Film, Take

    scenario = scenario or Scenario()
    takes = []
    for policy in policies:
        name = policy if isinstance(policy, str) else type(policy).__name__
        player = load(policy) if isinstance(policy, str) else policy
        takes.append(Take(name[-24:], Play(scenario, player, seed, faults)))
    frames = Film(takes, until, speed, FRAME_RATE).frames()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "film.mp4")
        write_film(path, frames, FRAME_RATE, has_plan=scenario.floor is not None)
        content = path.read_bytes()
    return EmbeddedFilm(content, f"{', '.join(take.name for take in takes)}, seed {seed}")
