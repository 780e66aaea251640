"""The window that render_mode "human" opens."""

from __future__ import annotations

import os

import pygame

from swarm_logistics_env.errors import SetupError


class Window:
    """Shows pictures at a steady rate. There is one window per process: SDL's display.

    Raises:
        SetupError: there is no display.
    """

    def __init__(self) -> None:
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
        screen = pygame.display.get_surface()
        if screen is None or screen.get_size() != picture.get_size():
            screen = pygame.display.set_mode(picture.get_size())
        screen.blit(picture, (0, 0))
        pygame.display.flip()
        self._clock.tick(rate)
        return not any(event.type == pygame.QUIT for event in pygame.event.get())

    def close(self) -> None:
        """Close the window; harmless when called twice."""
        pygame.display.quit()


def _no_display(reason: str) -> SetupError:
    return SetupError(
        f"a window needs a display ({reason}): use render_mode = 'rgb_array', or set "
        "SDL_VIDEODRIVER=dummy to go without"
    )
