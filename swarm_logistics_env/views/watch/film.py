"""Films of runs, side by side on one clock."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import pygame

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.world.rendering.palette import SURROUNDINGS
from swarm_logistics_env.world.rendering.picture import Picture
from swarm_logistics_env.world.rendering.sprites import Pixels, new_canvas, to_array, words

MOST_TAKES = 4
LAST_FRAME = 2.0  # [s] it stays so long, so that a looping film can be read


class Take(NamedTuple):
    """One of the runs that a film shows.

    Attributes:
        name: the title above it.
        play: the run, at its beginning.
    """

    name: str
    play: Play


class Film:
    """Frames of runs side by side; the same runs give the same frames.

    Args:
        takes: the runs, at most `MOST_TAKES`.
        until: the time of the runs at which the film ends [s].
        speed: how many times real time it plays.
        frame_rate: the number of frames per second of film [1/s].
        size: the longer side of each warehouse [px]; twice that of wide warehouses, which stand
            one above the other.

    Attributes:
        n_frames: the number of frames, if the runs last until the end.

    Raises:
        SetupError: an argument is not allowed.
    """

    def __init__(
        self,
        takes: Sequence[Take],
        until: float,
        speed: float,
        frame_rate: float,
        size: int = 600,
    ) -> None:
        if not 1 <= len(takes) <= MOST_TAKES:
            raise SetupError(f"{len(takes)} runs: should be 1 to {MOST_TAKES} side by side")
        if not (math.isfinite(until) and until > 0.0):
            raise SetupError(f"until = {until:g} s: should be above 0")
        if not 0.01 <= speed <= 1000.0:
            raise SetupError(f"speed = {speed:g}: should be 0.01 to 1000 times real time")
        self._takes = tuple(takes)
        self._until = min(until, max(take.play.world.scenario.duration for take in takes))
        self._period = speed / frame_rate
        scenarios = [take.play.world.scenario for take in takes]
        self._is_stacked = all(s.warehouse_width > 2.0 * s.warehouse_height for s in scenarios)
        longer_side = 2 * size if self._is_stacked else size
        self._pictures = [Picture(scenario, longer_side) for scenario in scenarios]
        self._text_height = max(13, round(size / 33))
        self._head_height = 2 * round(1.2 * self._text_height)
        widths = [picture.width for picture in self._pictures]
        heights = [self._head_height + picture.height for picture in self._pictures]
        self._size = (
            (max(widths), sum(heights)) if self._is_stacked else (sum(widths), max(heights))
        )
        self._n_last_frames = round(LAST_FRAME * frame_rate)
        self.n_frames = math.ceil(self._until / self._period) + 1 + self._n_last_frames

    def frames(self) -> Iterator[Pixels]:
        """Play the runs and return their pictures: (H, W, 3), red, green, blue, even sides.

        Raises:
            PolicyError: a policy returned commands of the wrong shape, or not finite.
        """
        for count in range(self.n_frames - self._n_last_frames):
            time = min(count * self._period, self._until)
            for take in self._takes:
                while not take.play.is_over and take.play.world.state.time < time - 5e-7:
                    take.play.step()
            frame = self._draw()
            yield frame
            if all(take.play.is_over for take in self._takes):
                break
        for _ in range(self._n_last_frames):
            yield frame

    def _draw(self) -> Pixels:
        canvas = new_canvas(*self._size)
        canvas.fill(SURROUNDINGS)
        x = y = 0
        for take, picture in zip(self._takes, self._pictures):
            world = take.play.world
            heading = pygame.Rect(x, y, picture.width, self._head_height).inflate(
                -self._text_height, 0
            )
            # Large, so that it can be read where the film is small.
            count = words(str(world.state.delivered), round(2.0 * self._text_height))
            canvas.blit(count, count.get_rect(midright=heading.midright))
            name = words(take.name, round(1.2 * self._text_height))
            heading.width -= count.get_width()
            canvas.blit(name, name.get_rect(midleft=heading.midleft), (0, 0, *heading.size))
            canvas.blit(picture.draw(world.state, world.scenario), (x, y + self._head_height))
            if self._is_stacked:
                y += self._head_height + picture.height
            else:
                x += picture.width
        return to_array(canvas)
