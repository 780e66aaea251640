"""`watch`, and films of `run`."""

from __future__ import annotations

import http.client
import os
import re
import signal
import socket
import subprocess
import sys
import webbrowser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.compiler.numba_fence import QUIET
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.views.watch import server
from swarm_logistics_env.world.rendering import renderer
from swarm_logistics_env.world.rendering.palette import RGB, film_colours
from tests.views.cli.conftest import Command


@pytest.mark.parametrize(
    "words",
    [
        "film.mp4 --policy swarm-dt --policy random-walk",
        "film.gif --fault FM4:2 --twin --set floor=aisles",
    ],
)
def test_film_is_written(
    words: str, folder: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    plans: list[bool] = []

    def noted(has_plan: bool) -> list[RGB]:
        plans.append(has_plan)
        return film_colours(has_plan)

    monkeypatch.setattr(renderer, "film_colours", noted)
    printed = command(f"run --film {words} --until 1 --set n_robots=4")
    (film,) = folder.iterdir()
    size = film.stat().st_size
    # At 25 a second: 1 s at four times real time, the first frame, and 2 s of the last one.
    assert printed == f"{film.name}: 58 frames, 2.3 s, {size / 1e6:.2f} MB\n"
    assert size > 1000
    assert plans == ([True] if film.suffix == ".gif" else [])  # a floor plan takes further colours
    content = film.read_bytes()
    assert content[:8].endswith(b"ftyp") == (film.suffix == ".mp4")
    if film.suffix == ".gif":
        width, height = np.frombuffer(content, "<u2", count=2, offset=6)
        assert width > 1.5 * height  # two runs side by side


SCRIPT = """
import signal, sys
# Also where the gate itself was started to ignore it, as by nohup.
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.modules["pygame"] = None
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.compiler.numba_fence import QUIET
sys.exit(app.run(["watch", "--port", "0", "--set", "n_robots=5"]))
"""


@pytest.mark.unmeasured
def test_page_is_served_until_ctrl_c_without_pygame() -> None:
    started = subprocess.Popen(
        [sys.executable, "-u", "-c", SCRIPT],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONWARNINGS": "error", QUIET: "1"},
    )
    assert started.stdout
    address = re.search(r"http://127\.0\.0\.1:(\d+)(/\S+/) in a browser", started.stdout.readline())
    assert address
    connection = http.client.HTTPConnection("127.0.0.1", int(address[1]), timeout=600)
    connection.request("GET", f"{address[2]}page.js")
    answer = connection.getresponse()
    assert answer.status == 200
    assert answer.read()
    with socket.create_connection(("127.0.0.1", int(address[1]))):  # must not keep it from ending
        started.send_signal(signal.SIGINT)
        _, errors = started.communicate(timeout=600)
    connection.close()
    assert (started.returncode, errors) == (0, "")


@pytest.mark.parametrize(
    ("words", "at_terminal", "screen", "opens"),
    [
        ("watch", True, ":0", True),
        ("watch --show-fault", False, ":0", False),
        ("watch", True, "", False),
        ("watch --no-open", True, ":0", False),
    ],
)
def test_the_browser_opens_at_a_terminal_with_a_screen(
    words: str, at_terminal: bool, screen: str, opens: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    served: list[Any] = []
    monkeypatch.setattr(server, "serve", lambda *arguments, show: served.append((*arguments, show)))
    monkeypatch.setattr("sys.stdout.isatty", lambda: at_terminal)
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("DISPLAY", screen)
    assert app.run(words.split()) == 0
    ((session, port, _, show),) = served
    assert (session.policy, port) == ("ppo-delivery", 8765)
    if "--show-fault" in words:
        assert session.note == (
            "two robots of 25 deliver nothing from the start (FM4); beside them the same swarm "
            "without faults"
        )
        assert (session.seed, session.speed, session.state.failed.sum()) == (2, 32.0, 2)
    else:
        assert (session.note, session.seed, session.speed) == ("", 0, 8.0)
    assert show is (webbrowser.open if opens else None)


@pytest.mark.parametrize("words", ["--set n_robots=5", "--show-fault"])
def test_replay_is_written_without_a_server(words: str, command: Command) -> None:
    printed = command(f"watch {words} --save run.html --until 3")
    page = Path("run.html").read_text(encoding="utf-8")
    assert printed == f"run.html: 3 s, {len(page) / 1e6:.2f} MB\n"
    assert "script-src 'sha256-" in page
    assert "http://" not in page
    assert "src=" not in page.replace("'none'; script-src", "")
