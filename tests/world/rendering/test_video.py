from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.world.rendering import renderer as video

Frame = NDArray[np.uint8]


def frames(n: int = 6) -> Iterator[Frame]:
    for nth in range(n):
        frame = np.full((48, 64, 3), 255, np.uint8)
        frame[8:40, 8 * nth : 8 * nth + 8] = (213, 94, 0)
        yield frame


def read(path: Path) -> NDArray[np.int64]:
    """The frames of a film: (T, 48, 64, 3)."""
    command = [video._ffmpeg(), "-loglevel", "error", "-i", str(path)]
    command += ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.uint8).reshape(-1, 48, 64, 3).astype(int)


@pytest.mark.parametrize(("suffix", "tolerance"), [("mp4", 40), ("GIF", 4)])
def test_film_holds_the_frames_and_the_same_frames_give_the_same_bytes(
    suffix: str, tolerance: int, tmp_path: Path
) -> None:
    path, other = (tmp_path / f"{name}.{suffix}" for name in ("film", "other"))
    path.write_text("what was there")
    for each in (path, other):
        assert video.write_film(each, frames(), 10.0) == 6
    assert path.read_bytes() == other.read_bytes()
    shown = read(path)
    for nth, frame in enumerate(frames()):
        # MP4 has half the resolution for colours, so they are blurred where two of them meet.
        inner = slice(12, 36), slice(8 * nth + 2, 8 * nth + 6)
        assert np.abs(shown[nth][inner] - frame[inner]).max() <= tolerance
        assert np.abs(shown[nth][:, 56:] - 255).max() <= tolerance
    assert len(shown) == 6
    assert {item.name for item in tmp_path.iterdir()} == {path.name, other.name}


@pytest.mark.parametrize("suffix", ["mp4", "gif"])
def test_film_that_breaks_off_leaves_what_was_there(suffix: str, tmp_path: Path) -> None:
    def stopping() -> Iterator[Frame]:
        yield from frames(3)
        raise LookupError

    path = tmp_path / f"film.{suffix}"
    path.write_text("what was there")
    with pytest.raises(LookupError):
        video.write_film(path, stopping(), 10.0)
    with pytest.raises(SetupError, match="at least one frame"):
        video.write_film(path, iter(()), 10.0)
    if suffix == "mp4":  # whose halved colours want even sides
        with pytest.raises(SetupError, match="ffmpeg cannot write the film "):
            video.write_film(path, (np.zeros((5, 5, 3), np.uint8) for _ in range(2000)), 10.0)
    assert path.read_text() == "what was there"
    assert list(tmp_path.iterdir()) == [path]


def test_what_cannot_be_written_is_refused_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(SetupError, match=r"film\.avi: should end in \.mp4 or \.gif"):
        video.check_film(tmp_path / "film.avi")
    with pytest.raises(SetupError, match=r"nowhere.film\.mp4: should be a file in a folder"):
        video.check_film(tmp_path / "nowhere" / "film.mp4")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(SetupError, match=r"pip install .*\[render\]"):
        video.check_film(tmp_path / "film.mp4")
