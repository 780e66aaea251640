"""Kernels of the live view are compiled before its address is known."""

from __future__ import annotations

import subprocess
import sys

import pytest

COLD = """
import asyncio, json, sys
import aiohttp
from swarm_logistics_env import FAILURE_MODES, Scenario
from swarm_logistics_env.compiler import fast_kernels
from swarm_logistics_env.views.watch import Session
from swarm_logistics_env.views.watch.server import WatchServer

def compiled():
    return {str(one): len(one.overloads) for one in fast_kernels._all_kernels}

async def use():
    policies = sys.argv[1:]
    server = WatchServer(Session(Scenario(restock=True), *policies, speed=64.0), 0)
    await server.start()
    before = compiled()
    playing = asyncio.create_task(server.play())
    async with aiohttp.ClientSession() as client:
        async with client.ws_connect(server.address + "live") as page:
            orders = [{"do": "select", "robot": 3}, {"do": "widen", "width": 1.5}]
            modes = [mode for mode in FAILURE_MODES if mode != "cell_fades"]
            for robot, mode in enumerate(modes):
                orders += [{"do": "choose", "mode": mode}, {"do": "toggle", "robot": robot}]
            orders += [{"do": "select", "robot": 3}, {"do": "repair"}, {"do": "step"}]
            orders += [{"do": "show"}, {"do": "resize", "n_robots": 7}, {"do": "next"}]
            for order in orders:
                await page.send_str(json.dumps(order))
                message = {}
                while message.get("time", 0.0) < 1.0 and order["do"] == "toggle":
                    message = await page.receive_json(timeout=600)
                    assert "problem" not in message, message
            while message.get("seed") != 3:
                message = await page.receive_json(timeout=600)
            while message.get("time", 0.0) < 5.0:
                message = await page.receive_json(timeout=600)
        async with client.get(server.address + "recording.html") as answer:
            assert answer.status == 200
    playing.cancel()
    await asyncio.gather(playing, return_exceptions=True)
    after = compiled()
    print({name: n for name, n in after.items() if n != before[name]})

asyncio.run(use())
"""


@pytest.mark.daily
@pytest.mark.parametrize("names", [["ppo-delivery"], ["central", "homing"]])
def test_nothing_is_compiled_once_the_address_is_known(names: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", COLD, *names], capture_output=True, text=True, check=False
    )
    assert done.stdout == "{}\n", done.stderr
