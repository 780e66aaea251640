"""How files of trials are read, or why they are refused, as recorded: columns, notes and runs."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

from swarm_logistics_env.core.errors import SwarmLogisticsError
from swarm_logistics_env.study.trials import read_trials
from tests.conftest import Check

HEAD = "robots,fault,faulty,P\n"
ROWS = "8,none,0,20\n8,none,0,22\n8,jam,1,14\n8,jam,1,15\n8,removed,1,17\n8,removed,1,18\n"
LIMIT = "robots,fault,faulty,time to finish,finished\n"
WIDE = "seed,none [boxes],jam 1 of 8 [boxes],removed 1 of 8 [boxes]\n1,20,14,17\n2,22,15,18\n"
LOG = "trial,robots,duration,time\n1,4,60,5\n1,4,60,9.5\n2,4,60,\n3,4,60,59\n3,4,60,60\n"
POGEMA: dict[str, Any] = {
    "metrics": {"CSR": 0.5, "steps": [1, 2]},
    "env_grid_search": {"num_agents": 8, "seed": 0},
    "algorithm": "RHCR",
}


def pogema(**metrics: Any) -> tuple[str, dict[str, Any]]:
    """Results of two planners with these metrics."""
    results = [{**POGEMA, "metrics": metrics}, {**POGEMA, "algorithm": "A", "metrics": metrics}]
    return json.dumps(results), {}


def pogema_later(metric: object) -> tuple[str, dict[str, Any]]:
    """Results of POGEMA, the second with this value of its metric."""
    return json.dumps([POGEMA, {**POGEMA, "metrics": {"CSR": metric}}]), {}


def marl_eval(**steps: Any) -> tuple[str, dict[str, Any]]:
    """Runs of two algorithms with these steps."""
    runs = {algorithm: {"seed_0": steps} for algorithm in ("ippo", "mappo")}
    return json.dumps({"rware": {"small": runs}}), {}


LATE = {"step_count": 9, "return": [3, 4]}
# By a name: a text, and how it is read.
TRIALS: dict[str, tuple[str, dict[str, Any]]] = {
    "plain": (HEAD + ROWS, {}),
    "sizes alone": ("N,delivered\n4,9\n4,10\n8,17\n8,16\n16,\n", {"skip_missing": True}),
    "no trials": (HEAD, {}),
    "nothing but blanks": ("\n , \n", {}),
    "a cell more": ("robots,P\n4,5\n4,5,6\n", {}),
    "two columns of a name": ("robots,P,P\n4,5,6\n4,5,7\n", {}),
    "a name misspelled": ("robots,fautl,P\n4,none,5\n4,jam,3\n", {}),
    "no performance": ("robots,fault,faulty\n4,none,0\n", {}),
    "faults without their number": ("robots,fault,P\n4,none,5\n4,jam,3\n4,removed,4\n", {}),
    "more faulty than there are": (HEAD + "2,none,0,5\n2,jam,3,1\n", {}),
    "all are faulty": (HEAD + "2,none,0,5\n2,jam,2,1\n", {}),
    "half a robot": (HEAD + "2,none,0,5\n2,jam,0.5,1\n", {}),
    "no robot": (HEAD + "0,none,0,5\n", {}),
    "less than nothing": (HEAD + "2,none,0,-5\n", {}),
    "infinite": (HEAD + "2,none,0,inf\n", {}),
    "a fault of nobody": (HEAD + "4,none,0,5\n4,jam,0,3\n", {}),
    "no fault of somebody": (HEAD + "4,none,1,5\n4,jam,1,3\n", {}),
    "no run without a fault": (HEAD + "4,jam,1,3\n4,jam,1,4\n", {}),
    "no run without robots": (HEAD + "4,none,0,5\n4,none,0,6\n4,jam,1,3\n4,jam,1,2\n", {}),
    "semicolons and commas": ("robots;P\n4;5,5\n8;9,25\n", {}),
    "semicolons and points": ("robots;P\n4;5.5\n8;9.25\n", {"decimal": "."}),
    "thousands": ('robots,P\n4,"1,250"\n8,"2,500.5"\n', {}),
    "thousands or decimals": ("robots;P\n4;1.250\n8;2.500\n", {}),
    "thousands it is": ("robots;P\n4;1.250\n8;2.500\n", {"thousands": "."}),
    "tabs": ("robots\tP\n4\t5\n8\t9\n", {}),
    "percent in words": ("robots,P in %,width\n4,50,1\n8,75,2\n", {}),
    "percent of two kinds": ("robots,P [%],width\n4,50 %,1\n8,75%,2\n", {}),
    "units in the second row": ("robots,P,slope\n-,[boxes],[m/s]\n4,5,1\n8,9,1\n", {}),
    "repetitions in the second row": (
        "policy,N=4,,N=8,\nname,run 1,run 2,run 1,run 2\na,5,6,9,8\nb,3,4,5,7\n",
        {},
    ),
    "a sum below": ("robots,P,seed\n4,5,1\n4,7,2\nSumme,12,\n", {}),
    "a note below": ("robots,P,seed\n4,5,1\n4,7,2\nrained on Tuesday,,\n", {}),
    "a column of notes": ("robots,P,remark\n4,5,fine\n4,7,\n8,9,cold\n", {}),
    "a column that is the same": ("robots,P,slope\n4,5,1\n4,7,1\n8,9,1\n", {}),
    "a parameter": ("robots,P,slope\n4,5,1\n4,7,1\n4,9,2\n4,8,2\n", {}),
    "a parameter and its reference": (
        "robots,P,slope\n4,5,1\n4,7,1\n4,9,2\n4,8,2\n",
        {"reference": {"slope": 2.0}},
    ),
    "a reference of nothing": (
        "robots,P,slope\n4,5,1\n4,7,1\n4,9,2\n4,8,2\n",
        {"reference": {"slope": 3.0}},
    ),
    "two parameters": ("robots,P,slope,load\n4,5,1,0\n4,7,1,0\n4,9,2,0\n4,8,1,3\n4,6,2,3\n", {}),
    "blocks by a name": (
        "robots,fault,m,P,day\n4,none,0,5,Mon\n4,jam,1,3,Mon\n4,none,0,6,Tue\n",
        {},
    ),
    "blocks by a number": ("robots,fault,m,P,seed\n4,none,0,5,1\n4,jam,1,3,1\n4,none,0,6,3\n", {}),
    "two trials of a block": ("robots,P,seed\n4,5,1\n4,7,1\n8,9,1\n8,8,2\n", {}),
    "half of the seeds": ("robots,P,seed\n4,5,1\n4,7,\n8,9,1\n8,8,2\n", {}),
    "policies": ("policy,robots,P\na,4,5\na,4,6\nb,4,9\nb,4,8\n", {}),
    "two tables": ("table,robots,P\nhall,4,5\nhall,8,9\nyard,4,6\nyard,8,7\n", {}),
    "contacts": ("robots,P,contacts_per_robot_minute\n4,5,0.5\n4,6,0.25\n8,9,1\n", {}),
    "onsets": (
        "robots,fault,m,onset,P,duration\n4,none,0,,5,60\n4,jam,1,0,3,60\n4,jam,1,30,4,60\n",
        {},
    ),
    "an onset after the end": (
        "robots,fault,m,onset,P\n4,none,0,,5\n4,jam,1,90,3\n",
        {"duration": 60.0},
    ),
    "an onset without an end": ("robots,fault,m,onset,P\n4,none,0,,5\n4,jam,1,9,3\n", {}),
    "two durations": ("robots,P,duration\n4,5,60\n4,6,60\n", {"duration": 50.0}),
    "a duration that is said twice": ("robots,P,duration\n4,5,60\n4,6,\n", {"duration": 60.0}),
    "times to finish": (
        LIMIT + "8,none,0,100,yes\n8,none,0,120,yes\n8,jam,1,300,no\n8,jam,1,250,yes\n",
        {},
    ),
    "times and work": ("robots,work,makespan [min]\n4,6,2\n8,6,1.5\n", {}),
    "a time that is no time": (LIMIT + "8,none,0,0,yes\n8,none,0,-1,yes\n", {}),
    "times that ended": ("robots,time to finish\n4,300\n4,250\n8,200\n8,\n", {"duration": 300.0}),
    "a log of deliveries": (LOG, {}),
    "a log that is too long": (LOG.replace(",60,", ",,"), {"duration": 30.0}),
    "a log without trials": ("robots,time\n4,5\n4,6\n", {}),
    "sum over robots": (
        "trial,robots,robot,P\n1,2,a,3\n1,2,b,4\n2,2,a,5\n2,2,b,\n",
        {"sum_over": "robot"},
    ),
    "sum over all robots": (
        "trial,robots,robot,P\n1,2,a,3\n1,2,b,4\n2,2,a,5\n2,2,b,0\n",
        {"sum_over": "robot"},
    ),
    "a column a fault": (WIDE, {}),
    "a column a fault, by hand": (WIDE, {"wide": "fault"}),
    "units that differ": ("seed,N=4 [boxes],N=8 [kg]\n1,5,9\n2,6,10\n", {}),
    "a size without and with a unit": ("seed,N=4,N=8 [boxes]\n1,5,9\n2,6,10\n", {}),
    "a column a policy": (WIDE, {"wide": "policy"}),
    "a column a size": ("seed,4 robots,8 robots,16 robots\n1,5,9,15\n2,6,10,16\n3,7,,\n", {}),
    "a column a width": ("robots,1 m,2 m\n4,5,6\n4,7,8\n", {"wide": "width"}),
    "commas in names and cells": ("N;width=1,5 m;width=2 m\n4;5,25;6,5\n4;5,5;7,5\n", {}),
    "commas and dates": (
        "day;width=1,5 m;width=2 m\n12.03.2026;5,25;6,5\n13.03.2026;5,5;7,5\n",
        {},
    ),
    "points between thousands": ("day;width=1,5 m;width=2 m\n1;1.205,5;6\n2;1.300;7\n", {}),
    "onsets in names": (
        "robots;fault;m;1,5;2,5\n4;none;0;5;6\n4;jam;1;3;2\n",
        {"wide": "onset", "decimal": ","},
    ),
    "several units": ("seed,N=4 (s),N=8 (min)\n1,5,9\n2,6,10\n", {}),
    "units in two words": ("seed,N=4 [s],N=8 [sec]\n1,5,9\n2,6,10\n", {}),
    "a limit and how long it lasted": (
        "robots,time to finish,finished,duration\n4,200,yes,\n4,,no,250\n8,150,yes,\n",
        {"duration": 300.0},
    ),
    "percent of robots": ("robots,fault,failed in %,P\n50,none,0,9\n50,jam,10,5\n", {}),
    "commas in names alone": ("N;width=1,5 m;width=2 m\n4;5.25;6\n4;5.5;7\n", {}),
    "commas that are said": ("N;1.5 m;2 m\n4;5;6\n4;5;7\n", {"wide": "width", "decimal": ","}),
    "a column a repetition": ("robots,run 1,run 2,run 3\n4,5,6,7\n8,9,10,\n", {}),
    "repetitions below names": (
        "hall,none,,jam 1 of 8,\n,run 1,run 2,run 1,run 2\nA,20,21,14,15\n",
        {},
    ),
    "names of columns": (
        "swarm,boxes\n4,5\n8,9\n",
        {"columns": {"robots": "swarm", "performance": "boxes"}},
    ),
    "a column that is not there": (HEAD + ROWS, {"columns": {"robots": "swarm"}}),
    "a number for a column": ("P\n5\n6\n", {"columns": {"robots": "8"}}),
    "a column that is ignored": (HEAD + ROWS, {"ignore": ["fault", "faulty"]}),
    "an unknown one is ignored": (HEAD + ROWS, {"ignore": ["colour"]}),
    "a cell that is replaced": (HEAD + ROWS, {"values": ["fault:jam=stuck"]}),
    "a cell that is not there": (HEAD + ROWS, {"values": ["fault:dead=stuck"]}),
    "no cell": (HEAD + ROWS, {"values": ["fault"]}),
    "words for numbers": (HEAD + "4,none,0,five\n4,jam,1,3\n", {}),
    "missing words": (HEAD + "4,none,0,n/a\n4,none,0,7\n4,jam,1,k.A.\n4,jam,1,3\n", {}),
    "missing words are left out": (
        HEAD + "4,none,0,n/a\n4,none,0,7\n4,jam,1,NaN\n4,jam,1,3\n",
        {"skip_missing": True},
    ),
    "all is missing": (HEAD + "4,none,0,n/a\n4,none,0,\n", {"skip_missing": True}),
    "German": (
        "Roboter;Ausfall;ausgefallen;geliefert\n8;kein;0;20,5\n8;Greifer;1;14\n8;entfernt;1;17\n",
        {},
    ),
    "French": (
        "robots;panne;en panne;livraisons\n8;aucune;0;20\n8;radio;1;14\n8;retiré;1;17\n",
        {},
    ),
    "Spanish": ("robots;fallo;averiados;entregas\n8;ninguno;0;20\n8;radio;1;14\n", {}),
    "upper case": ("ROBOTS,FAULT,FAULTY,P\n8,NONE,0,20\n8,Jam,1,14\n8,jam,1,15\n", {}),
    "rates": ("robots,throughput [1/min],duration\n4,0.5,60\n8,1,60\n", {}),
    "metrics of no step": pogema(CSR=0.5, by_step=[1.0], by_agent={"a": 1}),
    "metrics of a known name": pogema(speed=3, CSR=0.5, ISR=0.25),
    "metrics of no known name": pogema(speed=3, way=4),
    "a metric that is true": pogema_later(True),
    "a metric that is nan": pogema_later(float("nan")),
    "a metric that is a text": pogema_later("x" * 38),
    "a metric that is a long text": pogema_later("x" * 39),
    "a metric that is a table": pogema_later({"a": 1}),
    "the last evaluation": marl_eval(b=LATE, a={"step_count": 8, "return": [1]}),
    "an evaluation with its time": marl_eval(
        b={"step_count": 9, "elapsed_time": 7, "return": 2, "win": 1}, note="x"
    ),
    "an evaluation by reward": marl_eval(b={"step_count": 9, "win": 0.5, "reward": 6}),
    "an evaluation by its only metric": marl_eval(b={"step_count": 9, "win": 0.5}),
    "absolute metrics": marl_eval(b=LATE, absolute_metrics={"return": [5, 7]}),
    "no absolute metrics": marl_eval(b=LATE, absolute_metrics={}),
    "evaluations without steps": marl_eval(b={"return": 4}, c={"step_count": 1, "return": 2}),
    "a list of nothing": ("[]", {}),
    "a result and none": (json.dumps([POGEMA, {}]), {}),
    "too many names": (json.dumps({"a": {"b": {"c": {"d": {"e": {"return": 1}}}}}}), {}),
    "a monitor": (
        '#{"t_start": 1.0, "env_id": "Lane-v0"}\nr,l,t\n1.5,1,1\n2.5,2,2\n',
        {"columns": {"robots": "4"}},
    ),
    "a monitor of nothing": (
        '#{"t_start": 1.0}\nr,l,t,boxes\n1.5,1,1,1\n2.5,2,2,2\n',
        {"columns": {"robots": "4"}},
    ),
    "a monitor of deliveries": (
        '#{"t_start": 1.0, "env_id": null}\nr,l,t,width,delivered\n1.5,1,1,1,1\n2.5,2,2,2,2\n',
        {"columns": {"robots": "4"}},
    ),
    "half a monitor": ("#{\nrobots,P\n4,1\n8,2\n", {}),
    "no monitor but a remark": ("# in May\nrobots,P\n4,1\n8,2\n", {}),
    "an empty monitor": ("#{}\n#\nrobots,P\n4,1\n8,2\n", {}),
    "a value more below blank lines": ("\n# a\nrobots;P\n\n4;1;2\n", {}),
    "a sign that is not seen": ("robots,P\r\n4,1\r\n4,\u200b1\r\n", {}),
    "empty cells more and cells less": (
        "fault,P,m\nnone,1,0,,\nnone,2\n,,\njam,3,1,\n",
        {"columns": {"robots": "8"}},
    ),
    "rounded": ("robots,P\n4,0.3333333\n8,0.6666667\n", {}),
}


def test_trials_are_read_as_recorded(tmp_path: Path, check_recorded: Check) -> None:
    lines = []
    for name, (text, reading) in TRIALS.items():
        path = tmp_path / ("trials.json" if text[0] in "[{" else "trials.csv")
        path.write_bytes(text.encode())
        lines.append(f"# {name}")
        try:
            trials = read_trials(path, **reading)
        except SwarmLogisticsError as error:
            message = str(error).replace(str(tmp_path), "HERE")
            lines += f"{type(error).__name__}: {message}".splitlines()
            continue
        lines += [f"{column.name} is {column.use}: {column.values}" for column in trials.columns]
        lines += [*trials.notes, f"P is {trials.performance_name}"]
        if trials.references or trials.blocks:
            lines.append(f"references {trials.references}, blocks {trials.blocks}")
        for trial in trials.rows:
            values = dataclasses.asdict(trial).items()
            texts = (f"{key} {value}" for key, value in values if value not in (None, "", ()))
            lines.append(", ".join(texts))
    check_recorded("trials.txt", lines)
