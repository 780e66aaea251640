"""What commands print and what they refuse, word by word, as recorded."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from swarm_logistics_env.views.cli import app
from tests.conftest import Check

SMALL = (
    "--set n_robots=4 --set n_items=6 --set warehouse_width=4 --set warehouse_height=4 "
    "--set delivery_width=1 --set duration=30"
)
PAIRED = "robots,fault,faulty,onset,P,seed\n" + "".join(
    f"{robots},{fault},{faulty},{onset},{p + seed * p % 5},{seed}\n"
    for robots, fault, faulty, onset, p in [
        (8, "none", 0, 0, 20), (8, "jam", 1, 0, 12), (8, "jam", 2, 0, 5), (8, "removed", 1, 0, 18),
        (8, "removed", 2, 0, 15), (16, "none", 0, 0, 36), (8, "jam", 1, 60, 16),
    ]
    for seed in range(1, 9)
)  # fmt: skip
TWO = "controller,robots,throughput [1/min]\n" + "".join(
    f"{name},{robots},{factor * robots * (1 + 0.1 * (trial % 4)):.4g}\n"
    for name, factor in (("ours", 0.6), ("theirs", 0.4))
    for robots in (5, 10, 20)
    for trial in range(6)
)
# Ever more runs collapse with the number of robots; a seed is one of them or not at each size.
EDGE = "robots,P,seed\n" + "".join(
    f"{robots},{1 + seed % 2 if seed < share else 2 * robots + seed % 5},{seed}\n"
    for robots, share in ((10, 0), (20, 0), (40, 3), (60, 10), (80, 19))
    for seed in range(20)
)
# Three controllers, whose order turns with the fault; one of them delivers nothing under it.
TURNS = "controller,robots,fault,faulty,P,arena\n" + "".join(
    f"{name},{robots},{fault},{faulty},{max(p + wall - 2, 0)},{'abcdef'[wall]}\n"
    for name, values in (("ours", (30, 9, 2)), ("plain", (20, 18, 17)), ("none", (24, 22, 0)))
    for (robots, fault, faulty), p in zip(((9, "none", 0), (9, "deaf", 2), (4, "none", 0)), values)
    for wall in range(6)
)
TIMES = "robots,width,time,finished,trial\n" + "".join(
    f"{robots},{width},{min(scale * (90 + 7 * trial) / robots, 60):.3g},"
    f"{'yes' if scale * (90 + 7 * trial) / robots < 60 else 'no'},{trial}\n"
    for robots, width, scale in ((3, 1, 1.0), (6, 1, 1.1), (6, 2, 0.7), (2, 1, 1.2))
    for trial in range(1, 11)
)
GERMAN = "robots;Störung;faulty;P\n10;none;0;12,5\n10;none;0;13,5\n10;Funk;1;3,25\n"
WIDE = "robots,run 1,run 2,run 3\n5,10,11,9\n10,22,20,n/a\n20,30,31,35\n"
BOT = "def make():\n    return None\n\n\nclass Bad:\n    reset = None\n"
FILES = {
    "paired.csv": PAIRED, "two.csv": TWO, "german.csv": GERMAN, "wide.csv": WIDE, "bot.py": BOT,
    "edge.csv": EDGE, "turns.csv": TURNS, "times.csv": TIMES, "empty.csv": "",
    "words.csv": "robots,P\nfour,ten\n", "no_p.csv": "robots,speed\n1,2\n",
    "half.csv": "robots,fault,P\n5,none,9\n5,,8\n", "world.toml": "n_robots = 3\nn_items = 0\n",
    "broken.toml": "n_robots = \n",
    "study.toml": (
        'name = "mine"\nseeds = 4\npolicies = ["homing"]\nscenario = {n_robots = 5, n_items = 9}\n'
        'faults = [{modes = ["FM1", "FM4+FM3"], robots = [1, 2], onsets = [0.0, 60.0]}]\n'
        "sizes = [{values = [5, 8]}]\nparameters = [{name = \"max_speed\", values = [0.5, 0.4]}]\n"
    ),
    "odd.toml": 'seeds = 0\npolicies = ["homing"]\nfault = []\n',
}  # fmt: skip
PRINTED = (
    "list policies", "list trainings", "list faults", "list studies", "list scenario",
    "list scenario --preset day --set n_robots=3",
    "list scenario --preset dotbots --json",
    f"run --policy swarm-dt {SMALL} --seed 3",
    f"run --policy homing-stock {SMALL} --seed 3 --fault FM4:1@5+10 --fault FM1:1",
    "run --policy homing --preset orders --set duration=60 --set n_robots=6",
    "run --policy homing --preset day --set duration=90 --set n_robots=6",
    "study plan study.toml", "study plan study.toml --policy swarm-dt --seeds 3 --first-seed 7",
    "study plan resilience",
    "judge paired.csv --check", "judge two.csv --check", "judge wide.csv --check --skip-missing",
    "judge german.csv --check --decimal , --column fault=Störung",
    "judge paired.csv", "judge two.csv --out two", "study report two --full",
    "judge wide.csv --skip-missing --out wide", "study report results/judged/paired --full",
    "judge edge.csv --out edge --full", "judge turns.csv --column seed=arena --out turns --full",
    "judge times.csv --reference width=1 --column time_to_finish=time --full",
    "export homing --to contract --out homing.json",
    f"attack homing {SMALL} --budget 10 --fresh 10 --processes 1 --mode FM1 --mode FM4",
)  # fmt: skip
REFUSED = (
    "run --seed two", "run --seed -1", "run --set n_robots=0",
    "run --set max_speed=fast", "run --set speed_mix=[1,2]",
    "run --preset papr", "run --scenario world.toml", "run --scenario broken.toml",
    "run --fault FM1:0", "run --fault FM1:26", "run --fault FM1:1@-5", "run --fault FM1:1@5+0",
    "run --fault FM1:1:driving", "run --fault removed:1@5+9", "run --fault dead:x",
    "run --policy bot.py:make --trust-code",
    "run --policy bot.py:nobody --trust-code", "run --policy bot.py:make", "run --policy x.zip",
    "run --frame", "run --normalize x.pkl", "run --film x.txt",
    "run --set restock=maybe", "run --set floor=nowhere.txt",
    "run --bodies ice", "run --set orders=1", "run --set battery=2", "run --set request_docks=all",
    "study plan odd.toml", "study plan study.toml --seeds 0", "study plan nothing.toml",
    "study run study.toml --shard 3/2", "study run study.toml --engine cloud",
    "study report bot.py",
    "judge empty.csv", "judge words.csv", "judge no_p.csv", "judge half.csv", "judge none.csv",
    "judge paired.csv --column P", "judge paired.csv --column what=P",
    "judge paired.csv --ignore nothing", "judge paired.csv --value P:1=2",
    "judge paired.csv --reference x=1", "judge paired.csv --duration inf", "judge times.csv",
    "judge paired.csv --sum-over trial", "judge paired.csv homing", "judge paired.csv --seeds 3",
    "judge homing --check", "judge homing --seeds 0", "judge homing --minutes -1",
    "judge homing --performance speed", "judge paired.csv --decimal ;",
    "judge wide.csv --wide robots", "judge paired.csv --setup x",
    "attack nobody", "attack homing --mode FM9", "attack homing --robots 99",
    "export homing --to pdf",
    "export central --to c", "train papr", "train small --seed x", "watch --speed 3",
    "watch --port 99999999", "record --episodes 0", "record --policy nobody",
)  # fmt: skip


def test_output_is_as_recorded(
    folder: Path, check_recorded: Check, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, text in FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
    lines = []
    for words in (*PRINTED, *REFUSED):
        code = app.run(words.split())
        printed = capsys.readouterr()
        out = re.sub(r"\d+ times real time.*", "", printed.out)
        # Typer's own words change with its version.
        refusal = re.sub("(Invalid value for '[^']+'): .* Help", r"\1. Help", printed.err)
        texts = (out, refusal) if words in REFUSED else (out,)
        lines += [f"$ {words}: {code}", *"".join(texts).replace(str(folder), "HERE").splitlines()]
    check_recorded("output.txt", lines)
