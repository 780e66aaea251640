"""Pictures as a film: MP4 or GIF, by the ffmpeg that imageio-ffmpeg brings along."""

from __future__ import annotations

import contextlib
import itertools
import os
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.writing import becoming

from .palette import film_colours

Frame = NDArray[np.uint8]  # (H, W, 3), both even
SUFFIXES = (".mp4", ".gif")

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
    if path.suffix.lower() not in SUFFIXES:
        raise SetupError(f"{path}: should end in {' or '.join(SUFFIXES)}")
    if path.is_dir() or not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
        raise SetupError(f"{path}: should be a file in a folder that can be written to")
    _ffmpeg()


def write_film(path: Path, frames: Iterable[Frame], frame_rate: float) -> int:
    """Write frames of one size as a film and return how many; if it fails, no file is left.

    Args:
        path: a file name that ends in .mp4 or .gif; an older file is replaced when the film is
            complete.
        frame_rate: the number of frames per second [1/s].

    Raises:
        SetupError: as `check_film` raises it; or there are no frames, or ffmpeg fails.
    """
    check_film(path)
    with becoming(path, SetupError) as whole:
        if path.suffix.lower() == ".mp4":
            return _encode(frames, frame_rate, [*_MP4, str(whole)])
        with tempfile.TemporaryDirectory() as folder:
            palette = Path(folder, "palette")
            palette.write_bytes(_palette())
            side = f"{_PALETTE_SIDE}x{_PALETTE_SIDE}"
            source = ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", side, "-i", str(palette)]
            return _encode(frames, frame_rate, [*source, *_GIF, str(whole)])


def _palette() -> bytes:
    colours = np.zeros((_PALETTE_SIDE**2, 4), np.uint8)
    known = film_colours()
    colours[: len(known), :3], colours[: len(known), 3] = known, 255
    # The last colour is transparent and stands for what did not change.
    return colours.tobytes()


def _encode(frames: Iterable[Frame], frame_rate: float, output: list[str]) -> int:
    coming = iter(frames)
    first = next(coming, None)
    if first is None:
        raise SetupError("a film needs at least one frame")
    height, width, _ = first.shape
    pixels = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
    source = [*pixels, "-r", f"{frame_rate:g}", "-i", "-"]
    command = [_ffmpeg(), "-y", "-hide_banner", "-loglevel", "error", *source, *output]
    count = 0
    with (
        tempfile.TemporaryFile() as said,
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said
        ) as process,
    ):
        assert process.stdin is not None
        try:
            with contextlib.suppress(BrokenPipeError):  # ffmpeg has said why it ended
                for frame in itertools.chain([first], coming):
                    process.stdin.write(frame.tobytes())
                    count += 1
        except BaseException:
            process.kill()
            raise
        finally:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
        if process.wait() != 0:
            said.seek(0)
            lines = said.read().decode(errors="replace").strip().splitlines()
            reason = lines[-1] if lines else f"exit code {process.returncode}"
            raise SetupError(f"ffmpeg cannot write the film: {reason}")
    return count


def _ffmpeg() -> str:
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise SetupError(
            f"a film needs imageio-ffmpeg ({error}): pip install 'swarm-logistics-env[render]'"
        ) from error
    try:
        program: str = imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError as error:
        raise SetupError(f"a film needs ffmpeg: {error}") from error
    return program
