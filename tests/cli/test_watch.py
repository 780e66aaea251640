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

import pytest

from swarm_logistics_env.cli import app
from swarm_logistics_env.watch import server


@pytest.mark.parametrize(
    "arguments",
    [
        ["--film", "film.mp4", "--policy", "swarm-dt", "--policy", "random-walk"],
        ["--film", "film.gif", "--fault", "FM4:2", "--twin"],
    ],
)
def test_film_is_written(
    arguments: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert app.run(["run", *arguments, "--until", "1", "--set", "n_robots=4"]) == 0
    printed = capsys.readouterr()
    assert re.fullmatch(rf"{arguments[1]}: \d+ frames, [\d.]+ s, [\d.]+ MB\n", printed.out)
    assert printed.err == ""
    [film] = tmp_path.iterdir()
    assert film.stat().st_size > 1000
    assert film.read_bytes()[:8].endswith(b"ftyp") == (film.suffix == ".mp4")


def test_port_in_use_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert app.run(["watch", "--port", str(port)]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert f"port = {port}: is in use" in printed.err


def test_page_is_served_until_ctrl_c_without_pygame(tmp_path: Path) -> None:
    script = (
        # Also where the gate itself was started to ignore it, as by nohup.
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import sys; sys.modules['pygame'] = None\n"
        "from swarm_logistics_env.cli import app\n"
        "sys.exit(app.run(['watch', '--port', '0', '--set', 'n_robots=5']))"
    )
    started = subprocess.Popen(
        [sys.executable, "-u", "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONWARNINGS": "error", "XDG_STATE_HOME": str(tmp_path)},
    )
    assert started.stdout
    found = re.search(r"http://127\.0\.0\.1:(\d+)(/\S+/) in a browser", started.stdout.readline())
    assert found
    connection = http.client.HTTPConnection("127.0.0.1", int(found[1]), timeout=30)
    connection.request("GET", f"{found[2]}page.js")
    answer = connection.getresponse()
    assert answer.status == 200
    assert answer.read()
    # The connection stays open: it must not keep the command from ending.
    started.send_signal(signal.SIGINT)
    _, errors = started.communicate(timeout=60)
    connection.close()
    assert started.returncode == 0
    assert errors == ""


@pytest.mark.parametrize(
    ("arguments", "at_terminal", "screen", "opens"),
    [
        ([], True, ":0", True),
        ([], False, ":0", False),
        ([], True, "", False),
        (["--no-open"], True, ":0", False),
    ],
)
def test_the_browser_opens_at_a_terminal_with_a_screen(
    arguments: list[str],
    at_terminal: bool,
    screen: str,
    opens: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    served: list[Any] = []
    monkeypatch.setattr(server, "serve", lambda *given: served.append(given))
    monkeypatch.setattr("sys.stdout.isatty", lambda: at_terminal)
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("DISPLAY", screen)
    assert app.run(["watch", *arguments]) == 0
    ((session, port, _, host, show),) = served
    assert (session.policy, port, host) == ("ppo-delivery", 8765, "127.0.0.1")
    assert (show is webbrowser.open) == opens
    assert show is None or opens


@pytest.mark.parametrize(
    ("host", "lines"), [("0.0.0.0", 1), ("lab.example", 1), ("::1", 0), ("localhost", 0)]
)
def test_a_host_that_others_reach_is_warned_of_in_a_line(
    host: str, lines: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(server, "serve", lambda *_: None)
    assert app.run(["watch", "--host", host]) == 0
    told = capsys.readouterr().err.splitlines()
    assert len(told) == lines
    assert all(f"--host {host}" in line for line in told)


def test_replay_is_written_without_a_server(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "run.html"
    arguments = ["--set", "n_robots=5", "--save", str(file), "--until", "3"]
    assert app.run(["watch", *arguments]) == 0
    assert ": 3 s, " in capsys.readouterr().out
    page = file.read_text(encoding="utf-8")
    assert "script-src 'sha256-" in page
    assert "http://" not in page
    assert "src=" not in page.replace("'none'; script-src", "")
