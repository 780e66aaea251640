"""Pictures of a warehouse, as arrays or in a window. pygame is loaded by the first Renderer."""

from __future__ import annotations

import functools
import importlib
import os
import warnings
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import WarehouseState

from .projection import LARGEST_SIZE, LEAST_SIZE

if TYPE_CHECKING:
    import pygame

RenderMode = Literal["rgb_array", "human"]


class Renderer:
    """Draws states of a warehouse.

    A frame depends on the state and the arguments alone; with `trails` also on the states before
    it. A renderer can be pickled and copied; a copy opens a window of its own.

    Args:
        scenario: the conditions; another one may come with each frame, and the picture's size
            changes only with the shape of the warehouse.
        mode: "rgb_array" needs no display; "human" opens a window with the first `show`.
        size: longer side of the warehouse, margins included [px]; the caption comes below it.
        show_beams_of: a robot whose sensor beams and view range are drawn.
        trails: whether robots leave their paths of the last 2.5 seconds.
        all_links: whether every robot is linked to the neighbour with the lowest timer it hears,
            rather than only the one that carries the requested item.

    Raises:
        SetupError: pygame is not installed, or an argument is not allowed.

    Example:
        >>> from swarm_logistics_env import Scenario, Warehouse
        >>> world = Warehouse(Scenario(n_robots=3))
        >>> observations = world.reset(seed=0)
        >>> renderer = Renderer(world.scenario, "rgb_array", size=200)
        >>> renderer.frame(world.state, world.scenario).dtype
        dtype('uint8')
    """

    def __init__(
        self,
        scenario: Scenario,
        mode: RenderMode,
        size: int = 800,
        *,
        show_beams_of: int | None = None,
        trails: bool = False,
        all_links: bool = False,
    ) -> None:
        if mode not in get_args(RenderMode):
            raise SetupError(f"mode = {mode!r}: should be one of {list(get_args(RenderMode))}")
        if not LEAST_SIZE <= size <= LARGEST_SIZE:
            raise SetupError(f"size = {size}: should be {LEAST_SIZE} to {LARGEST_SIZE} [px]")
        if show_beams_of is not None and not 0 <= show_beams_of < scenario.n_robots:
            raise SetupError(
                f"show_beams_of = {show_beams_of}: should be None or a robot, "
                f"0 to {scenario.n_robots - 1}"
            )
        load_pygame()
        from .picture import Picture

        self.mode = mode
        self._make_copy = functools.partial(
            Renderer, scenario, mode, size,
            show_beams_of=show_beams_of, trails=trails, all_links=all_links,
        )  # fmt: skip
        self._picture = Picture(scenario, size, show_beams_of, trails, all_links)
        self._window: _Window | None = None
        self._was_closed_by_user = False

    def frame(self, state: WarehouseState, scenario: Scenario) -> NDArray[np.uint8]:
        """Return the picture of `state` in either mode: (H, W, 3), uint8, red, green and blue."""
        from .canvas import to_array

        return to_array(self._picture.draw(state, scenario))

    def show(self, state: WarehouseState, scenario: Scenario) -> None:
        """Show `state` in the window, at most one state per control period of real time.

        After the user has closed the window, nothing is shown any more.

        Raises:
            SetupError: the mode is not "human", or there is no display.
        """
        if self.mode != "human":
            raise SetupError(f"show with mode = {self.mode!r}: should be 'human'")
        if self._was_closed_by_user:
            return
        self._window = self._window or _Window()
        picture = self._picture.draw(state, scenario)
        if not self._window.show(picture, 1.0 / scenario.control_period):
            self._was_closed_by_user = True
            self.close()

    def close(self) -> None:
        """Close the window, if any; harmless when called twice. A later `show` opens it anew."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def __reduce__(self) -> tuple[Any, ...]:
        return self._make_copy, ()


def load_pygame() -> None:
    """Import pygame, without the greeting that it prints.

    Raises:
        SetupError: it is not installed.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        with warnings.catch_warnings():
            # pygame uses old parts of setuptools, which the caller cannot change.
            warnings.simplefilter("ignore")
            for module in ("pygame", "pygame.font", "pygame.pkgdata"):
                importlib.import_module(module)
    except ImportError as error:
        raise SetupError(
            f"rendering needs pygame ({error}): pip install 'swarm-logistics-env[render]'"
        ) from error


class _Window:
    """Shows pictures at a steady rate. There is one window per process: SDL's display.

    Raises:
        SetupError: there is no display.
    """

    def __init__(self) -> None:
        import pygame

        try:
            pygame.display.init()
        except pygame.error as error:
            raise _no_display(str(error)) from error
        # SDL falls back to a driver that shows nothing.
        if pygame.display.get_driver() == "offscreen" and "SDL_VIDEODRIVER" not in os.environ:
            pygame.display.quit()
            raise _no_display("SDL found none")
        pygame.display.set_caption("swarm-logistics")
        self._clock = pygame.time.Clock()

    def show(self, picture: pygame.Surface, rate: float) -> bool:
        """Show a picture, wait until it is due at `rate` [1/s]; False once the user has closed."""
        import pygame

        screen = pygame.display.get_surface()
        if screen is None or screen.get_size() != picture.get_size():
            screen = pygame.display.set_mode(picture.get_size())
        screen.blit(picture, (0, 0))
        pygame.display.flip()
        self._clock.tick(rate)
        return not any(event.type == pygame.QUIT for event in pygame.event.get())

    def close(self) -> None:
        """Close the window; harmless when called twice."""
        import pygame

        pygame.display.quit()


def _no_display(reason: str) -> SetupError:
    return SetupError(
        f"a window needs a display ({reason}): use render_mode = 'rgb_array', or set "
        "SDL_VIDEODRIVER=dummy to go without"
    )
