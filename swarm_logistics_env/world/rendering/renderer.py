"""Pictures of a warehouse, as arrays, in a window, or as a film: MP4 or GIF.

pygame is loaded by the first Renderer; imageio-ffmpeg brings the ffmpeg for films.
"""

from __future__ import annotations

import contextlib
import importlib
import itertools
import os
import subprocess
import tempfile
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import SetupError, how_to_install
from swarm_logistics_env.core.records import atomic_write
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.state import WarehouseState

from .palette import film_colours

if TYPE_CHECKING:
    import pygame

RenderMode = Literal["rgb_array", "human"]
LEAST_SIZE = 100  # of a picture's longer side [px]
LARGEST_SIZE = 8000

FRAME_RATE = 25.0  # of films, frames a second


class Renderer:
    """Draws states of a warehouse.

    A frame depends on the state and the arguments alone. A renderer can be pickled and copied; a
    copy opens a window of its own.

    Args:
        scenario: the conditions; another one may come with each frame, and the picture's size
            changes only with the shape of the warehouse.
        mode: "rgb_array" needs no display; "human" opens a window with the first `show`.
        size: longer side of the warehouse, margins included [px]; the caption comes below it.

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

    def __init__(self, scenario: Scenario, mode: RenderMode, size: int = 800) -> None:
        if mode not in get_args(RenderMode):
            raise SetupError(f"mode = {mode!r}: should be one of {list(get_args(RenderMode))}")
        if not LEAST_SIZE <= size <= LARGEST_SIZE:
            raise SetupError(f"size = {size}: should be {LEAST_SIZE} to {LARGEST_SIZE} [px]")
        load_pygame()
        from .picture import Picture

        self.mode = mode
        self._arguments = scenario, mode, size
        self._picture = Picture(scenario, size)
        self._clock: pygame.time.Clock | None = None  # of the window, while it is open
        self._was_closed_by_user = False

    def frame(self, state: WarehouseState, scenario: Scenario) -> Frame:
        """Return the picture of `state` in either mode: (H, W, 3), uint8, red, green and blue."""
        from .sprites import to_array

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
        import pygame

        if self._clock is None:
            _open_display()
            self._clock = pygame.time.Clock()
        picture = self._picture.draw(state, scenario)
        screen = pygame.display.get_surface()
        if screen is None or screen.get_size() != picture.get_size():
            screen = pygame.display.set_mode(picture.get_size())
        screen.blit(picture, (0, 0))
        pygame.display.flip()
        self._clock.tick(1.0 / scenario.control_period)
        if any(event.type == pygame.QUIT for event in pygame.event.get()):
            self._was_closed_by_user = True
            self.close()

    def close(self) -> None:
        """Close the window, if any; harmless when called twice. A later `show` opens it anew."""
        if self._clock is not None:
            import pygame

            pygame.display.quit()
            self._clock = None

    def __reduce__(self) -> tuple[Any, ...]:
        return Renderer, self._arguments


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
        raise SetupError(f"rendering needs pygame ({error}): {how_to_install('render')}") from error


def _open_display() -> None:
    """Begin to use the display: SDL has one in each process.

    Raises:
        SetupError: there is none.
    """
    import pygame

    try:
        pygame.display.init()
        # SDL falls back to a driver that shows nothing.
        if pygame.display.get_driver() == "offscreen" and "SDL_VIDEODRIVER" not in os.environ:
            pygame.display.quit()
            raise pygame.error("SDL found none")
    except pygame.error as error:
        raise SetupError(
            f"a window needs a display ({error}): use render_mode = 'rgb_array', or set "
            "SDL_VIDEODRIVER=dummy to go without"
        ) from error
    pygame.display.set_caption("swarm-logistics")


Frame = NDArray[np.uint8]  # (H, W, 3), both even
FILM_SUFFIXES = (".mp4", ".gif")

# Neither date nor the encoder's name is written, so that the same frames give the same bytes.
_EXACT = ["-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"]
_MP4 = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "20", "-movflags", "+faststart", *_EXACT]
# Between two frames only the rectangle that changed is stored.
_GIF = ["-lavfi", "[0:v][1:v]paletteuse=dither=none:diff_mode=rectangle", *_EXACT]
_PALETTE_SIDE = 16  # px, as ffmpeg wants palettes


def check_film(path: Path) -> None:
    """Check that a film can be written there, before any of it is made.

    Raises:
        SetupError: the name ends otherwise than in .mp4 or .gif, the folder cannot be written to,
            or imageio-ffmpeg is not installed.
    """
    if path.suffix.lower() not in FILM_SUFFIXES:
        raise SetupError(f"{path}: should end in {' or '.join(FILM_SUFFIXES)}")
    if path.is_dir() or not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
        raise SetupError(f"{path}: should be a file in a folder that can be written to")
    _ffmpeg()


def write_film(
    path: Path, frames: Iterable[Frame], frame_rate: float, has_plan: bool = False
) -> int:
    """Write frames of one size as a film and return how many; if it fails, no file is left.

    Args:
        path: a file name that ends in .mp4 or .gif; an older file is replaced when the film is
            complete.
        frame_rate: the number of frames per second [1/s].
        has_plan: whether the frames show a floor plan, which takes further colours.

    Raises:
        SetupError: as `check_film` raises it; or there are no frames, or ffmpeg fails.
    """
    check_film(path)
    with atomic_write(path, SetupError) as partial:
        if path.suffix.lower() == ".mp4":
            return _encode(frames, frame_rate, [*_MP4, str(partial)])
        with tempfile.TemporaryDirectory() as folder:
            palette = Path(folder, "palette")
            palette.write_bytes(_palette(has_plan))
            side = f"{_PALETTE_SIDE}x{_PALETTE_SIDE}"
            source = ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", side, "-i", str(palette)]
            return _encode(frames, frame_rate, [*source, *_GIF, str(partial)])


def _palette(has_plan: bool) -> bytes:
    pixels = np.zeros((_PALETTE_SIDE**2, 4), np.uint8)
    colours = film_colours(has_plan)
    pixels[: len(colours), :3] = colours
    pixels[: len(colours), 3] = 255
    # The last colour is transparent and stands for what did not change.
    return pixels.tobytes()


def _encode(frames: Iterable[Frame], frame_rate: float, output: list[str]) -> int:
    frame_iterator = iter(frames)
    first_frame = next(frame_iterator, None)
    if first_frame is None:
        raise SetupError("a film needs at least one frame")
    height, width, _ = first_frame.shape
    pixels = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
    source = [*pixels, "-r", f"{frame_rate:g}", "-i", "-"]
    command = [_ffmpeg(), "-y", "-hide_banner", "-loglevel", "error", *source, *output]
    count = 0
    with (
        tempfile.TemporaryFile() as messages,
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=messages
        ) as process,
    ):
        assert process.stdin is not None
        try:
            with contextlib.suppress(BrokenPipeError):  # ffmpeg has said why it ended
                for frame in itertools.chain([first_frame], frame_iterator):
                    process.stdin.write(frame.tobytes())
                    count += 1
        except BaseException:
            process.kill()
            raise
        finally:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
        if process.wait() != 0:
            messages.seek(0)
            reason = messages.read().decode(errors="replace").strip()
            raise SetupError(f"ffmpeg cannot write the film (exit {process.returncode}): {reason}")
    return count


def _ffmpeg() -> str:
    try:
        import imageio_ffmpeg

        program: str = imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        raise SetupError(
            f"a film needs imageio-ffmpeg ({error}): {how_to_install('render')}"
        ) from error
    return program
