from __future__ import annotations

import http.client
import os
import re
import signal
import socket
import subprocess
import sys

import pytest

from swarm_logistics_env.cli import app


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["watch", "--policy", "swarm-td"], "did you mean 'swarm-dt'?"),
        (["watch", "--fault", "FM9"], "no failure mode 'FM9'"),
        (["watch", "--fault", "FM1:99"], "at most n_robots = 25"),
        (["watch", "--set", "n_robot=40"], "did you mean 'n_robots'?"),
        (["watch", "--speed", "3"], "speed = 3: should be one of"),
        (["watch", "--port", "99999"], "--port"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    arguments: list[str],
    words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert app.run(arguments) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert words in printed.err
    assert len(printed.err.splitlines()) == 1


def test_port_in_use_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert app.run(["watch", "--port", str(port)]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert f"port = {port}: is in use" in printed.err


def test_page_is_served_until_ctrl_c_without_pygame() -> None:
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
        env={**os.environ, "PYTHONWARNINGS": "error"},
    )
    assert started.stdout
    found = re.search(r"http://127\.0\.0\.1:(\d+)(/\S+/) in a browser", started.stdout.readline())
    assert found
    connection = http.client.HTTPConnection("127.0.0.1", int(found[1]), timeout=30)
    connection.request("GET", f"{found[2]}moving?after=0")
    answer = connection.getresponse()
    assert answer.status == 200
    assert answer.read()
    # The connection stays open: it must not keep the command from ending.
    started.send_signal(signal.SIGINT)
    _, errors = started.communicate(timeout=60)
    connection.close()
    assert started.returncode == 0
    assert errors == ""
