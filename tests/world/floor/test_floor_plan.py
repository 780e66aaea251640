"""Floor plans: how they are read, what they refuse and where, and what follows from them."""

from __future__ import annotations

import codecs
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.core.errors import ScenarioError
from swarm_logistics_env.world.floor import plan_names
from swarm_logistics_env.world.floor.floor_plan import (
    DOCK,
    RACK,
    STORAGE,
    floor_title,
    merged_boxes,
)

SMALL = {"n_items": 2, "n_robots": 2}


def planned(text: str, **fields: Any) -> Scenario:
    return Scenario(floor=text, **SMALL | fields)


def test_the_first_line_is_the_side_of_the_highest_y() -> None:
    plan = planned("A:::\n....\n=###\n").plan
    assert plan is not None
    assert (plan.kind[2, 0], plan.kind[2, 1], plan.kind[0, 0]) == (DOCK, STORAGE, RACK)
    assert (plan.width, plan.height) == (2.0, 1.5)


def test_a_plan_says_of_each_cell_what_it_is_whose_dock_and_whether_robots_start_there() -> None:
    plan = planned("B:.#.\nA::##\nA.:.=").plan
    assert plan is not None
    assert plan.dock_names == ("A", "B")
    assert plan.dock.tolist() == [[0, -1, -1, -1, -1], [0, -1, -1, -1, -1], [1, -1, -1, -1, -1]]
    starts = [[0, 1, 1, 1, 0], [0, 1, 1, 0, 0], [0, 1, 1, 0, 0]]  # a way leads to them
    assert plan.start_cells.astype(int).tolist() == starts
    assert plan.start_area == pytest.approx(7 * 0.25)
    with_start = planned("A::\nA.+").plan
    assert with_start is not None
    assert with_start.start_cells.astype(int).tolist() == [[0, 0, 1], [0, 0, 0]]


def test_shipped_plans_are_named_in_order() -> None:
    assert plan_names() == sorted(plan_names())


@pytest.mark.parametrize("name", plan_names())
def test_a_shipped_plan_keeps_its_name_and_gives_the_sizes(name: str) -> None:
    scenario = Scenario(floor=name)
    assert scenario.floor == name
    sizes = {"large": (40.0, 20.0), "day": (16.0, 10.0)}
    size = (scenario.warehouse_width, scenario.warehouse_height)
    assert size == sizes.get(name, (10.0, 10.0))
    assert Scenario.from_json(scenario.to_json()) == scenario


def test_a_file_and_its_text_make_the_same_scenario(tmp_path: Path) -> None:
    path = tmp_path / "hall.txt"
    for encoding in ("utf-8", "utf-8-sig", "utf-16"):
        path.write_bytes("A:::  \r\nA::=\r\n \n".encode(encoding))
        assert planned(str(path)) == planned("A:::\nA::=") == planned("A:::/A::=")
    path.unlink()
    assert planned("A:::\nA::=").replace(n_items=1).floor == "A:::/A::="


def test_sizes_follow_from_the_plan_and_are_refused_otherwise() -> None:
    scenario = Scenario(warehouse_width=20.0).replace(floor="aisles")
    assert scenario.warehouse_width == 10.0
    assert scenario.replace(cell_size=1.0).warehouse_width == 20.0
    assert planned("A:::", cell_size=1).warehouse_width == 4.0
    assert scenario.replace(floor=None).floor is None
    for fields in ({"warehouse_width": 12.0}, {"delivery_width": 1.0}):
        with pytest.raises(ScenarioError, match="should be left out, as the plan makes it"):
            scenario.replace(**fields)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "aisels",
            "should be a shipped plan, a file, or rows of a plan; did you mean 'aisles'?",
        ),
        ("A::\n:?:", "line 2, column 2: '?' is no cell: should be one of # = . : + * or a letter"),
        ("A::\n::", "line 2 has 2 cells: should have as many as line 1, 3"),
        (":::\n:::", "the plan has no dock (a letter from A to Z)"),
        ("A..\n...", 'the plan has no storage (":")'),
        ("A::#:\n:::#.", "line 1, column 5: no way leads from this storage to a dock"),
        ("A::#B\n:::#.", "line 1, column 5: no way leads from this dock to storage"),
        ("A::#+\n:::#.", "line 1, column 5: no way leads from this start to a dock"),
        ("A=:\nA=:", "line 1, column 1: no way leads from this dock to storage"),
        ("A#::\n::.:", "line 1, column 1: the way from this dock to storage is narrower than a"),
        ("A:#A:\nA:###", "line 1, column 4: the way from this dock to storage is narrower than a"),
        ("A:::", "line 1, column 1: the way from this dock to storage is narrower than a robot"),
        ("A\n:\n:\n:", "line 1, column 1: the way from this dock to storage is narrower than a"),
        ("A:#:\nA:.:", "line 1, column 4: the way from this storage to a dock is narrower than a"),
        ("\n".join([":" * 1025] * 2), "a plan of 1025 x 2 cells: should be at most 1024 x 1024"),
        ("\n".join(["A:"] * 1025), "a plan of 2 x 1025 cells: should be at most 1024 x 1024"),
        ("A:\t:\nA:::", "line 1, column 3: '\\t' is no cell"),
        ("A:a:\nA:::", "line 1, column 3: 'a' is no cell"),
        ("####\n####", "the plan has no dock (a letter from A to Z)"),
        ("\n", "the plan is empty: should have at least one cell"),
        ("a" * 5_000, "should be a shipped plan, a file, or rows of a plan"),  # no path is so long
    ],
)
def test_an_error_names_line_and_column(text: str, message: str) -> None:
    narrow = {"cell_size": 0.2} if "narrower" in message else {}
    with pytest.raises(ScenarioError) as error:
        planned(text, **narrow)
    assert message in str(error.value)
    assert "Scenario.floor = " in str(error.value)


def test_cells_thinner_than_a_robot_are_refused() -> None:
    with pytest.raises(ScenarioError, match="should be at least a robot's radius"):
        Scenario(floor="aisles", cell_size=0.1)
    rows = "A:::::/A:::::"  # as wide as a robot
    ways = planned(rows, cell_size=0.125, n_robots=1, n_items=1).plan
    assert ways is not None
    assert ways.reachable.all()
    ways = planned("A:::/A:::/A:::", cell_size=0.2, n_robots=1, n_items=1).plan
    assert ways is not None
    assert ways.reachable.all()
    with pytest.raises(ScenarioError, match=r"Scenario.cell_size = 'wide': should be a number"):
        planned("aisles", cell_size="wide")
    for field in ("cell_size", "robot_radius"):
        with pytest.raises(ScenarioError, match=rf"Scenario.{field} = 0: should be at least 1e-09"):
            planned("aisles", **{field: 0})


@pytest.mark.parametrize(
    ("rows", "fields", "message"),
    [
        ("A::/A::", {"n_items": 60}, 'fit into the storage cells (":") of the plan: should be'),
        ("A::/A:+", {"n_robots": 6}, 'fit into the start cells ("+") of the plan: should be'),
        ("A::/A:.", {"n_robots": 9}, 'into the storage (":") and free floor (".") of the plan'),
    ],
)
def test_what_does_not_fit_into_the_cells_is_refused(
    rows: str, fields: dict[str, int], message: str
) -> None:
    with pytest.raises(ScenarioError, match=re.escape(message)):
        planned(rows, **fields)


def test_the_area_of_a_plan_is_that_of_its_storage_cells() -> None:
    plan = planned("A::.\nB:::\nBB::").plan
    assert plan is not None
    assert plan.storage_area == pytest.approx(7 * 0.25)


def test_a_plan_makes_a_delivery_strip_with_the_area_of_its_docks() -> None:
    assert planned("A::.\nB:::\nBB::").delivery_width == pytest.approx(4 * 0.5 / 3)


MOVING_AI = """type octile
height 4
width 8
map
@@@@@@@@
@.....T@
@.@@...@
@@@@@@@@
"""
LEAGUE = """type octile
height 3
width 5
map
S.E.@
..@E.
S.E..
"""


def test_maps_of_benchmarks_run_unedited(tmp_path: Path) -> None:
    path = tmp_path / "warehouse.map"
    path.write_text(MOVING_AI)
    assert planned(str(path)).floor == "########/#::AAA##/#:##AAA#/########"
    path.write_text(LEAGUE)
    scenario = planned(str(path))
    assert scenario.floor == "A.:.#/..#:./A.:.."
    world = Warehouse(scenario)
    world.reset(0)
    assert world.step(np.zeros((2, 4))).shape[0] == 2


@pytest.mark.parametrize(
    "content",
    [
        MOVING_AI.replace("\n", " \t\r\n").encode(),
        MOVING_AI.replace("map\n", "\nmap\n\n").encode() + b"  \n\n",
        MOVING_AI.replace("height 4\nwidth 8", "width 8\nheight 4").encode("utf-8-sig"),
        MOVING_AI.replace("type octile\nheight 4", "Height\t4\nTYPE octile").encode(),
        MOVING_AI.encode("utf-16"),
        codecs.BOM_UTF16_BE + MOVING_AI.encode("utf-16-be"),
        MOVING_AI.replace(".@@...@", "G@@..S@").encode(),
        MOVING_AI.replace(".@@...@", "E@@..E@").encode(),  # goods, and no work stations
    ],
)
def test_maps_are_read_as_they_are_found(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "warehouse.map"
    path.write_bytes(content)
    assert planned(str(path)).floor == "########/#::AAA##/#:##AAA#/########"


@pytest.mark.parametrize("sign", ["#", "x", "1", "t", "?", " ", "+", "A", ":"])
def test_a_sign_that_no_map_has_is_refused_by_line_and_column(sign: str) -> None:
    with pytest.raises(
        ScenarioError, match=r"line 6, column 3: .* is no cell: should be one of \. "
    ):
        planned(MOVING_AI.replace("@....", f"@.{sign}.."))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (MOVING_AI.replace("width 8", "width 9"), "head says 9 x 4 cells, its rows are 8 x 4"),
        (MOVING_AI.replace("height 4", "height 5"), "head says 8 x 5 cells, its rows are 8 x 4"),
        (MOVING_AI.replace("....T@", "...T@"), "line 6 has 7 cells: should have 8, as the map's"),
        (MOVING_AI.replace("height 4\n", ""), "line 3: 'map' is not of the head of a map"),
        (MOVING_AI.replace("height 4", "height four"), "line 2: 'height four' is not of the head"),
        (MOVING_AI.replace("height 4", "width 4"), "line 3: 'width 8' is not of the head of a map"),
        ("type octile\nheight 4\nwidth 8\n", 'has no line "map"'),
        (MOVING_AI.partition("@")[0], "head says 4 rows, it has 0"),
        (MOVING_AI.replace(".", "@"), "the map has no free cell"),
        # Where a map is as narrow as the dock, that is all of it.
        ("type octile\nheight 2\nwidth 4\nmap\n....\n....", 'the plan has no storage (":")'),
        ("type octile\nheight 2\nwidth 3\nmap\n...\n...", 'the plan has no storage (":")'),
    ],
)
def test_a_map_that_is_none_is_refused_by_line(text: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(message)):
        planned(text)


def test_of_several_parts_of_a_map_the_largest_is_the_warehouse() -> None:
    rows = "..@.....@.\n..@.....@."
    map_text = f"type octile\nheight 2\nwidth 10\nmap\n{rows}"
    assert planned(map_text).floor == "..#:AAAA#./..#:AAAA#."


@pytest.mark.parametrize(
    ("floor", "title"),
    [
        ("aisles", "aisles"), ("A:::/A.::", "plan of 4 x 2 cells"), ("A:", "plan of 2 x 1 cells"),
        ("A::\nA::\nA::\n", "plan of 3 x 3 cells"), ("my/halls/north.txt", "my/halls/north.txt"),
    ],
)  # fmt: skip
def test_a_table_names_a_floor_by_its_name_or_its_size(floor: str, title: str) -> None:
    assert floor_title(floor) == title


def test_the_largest_maps_of_cities_are_read() -> None:
    rows = ("." * 1024 + "\n") * 1024
    plan = planned(f"type octile\nheight 1024\nwidth 1024\nmap\n{rows}").plan
    assert plan is not None
    assert plan.kind.shape == (1024, 1024)


@given(data=st.data(), rows=st.integers(1, 9), columns=st.integers(1, 9))
def test_boxes_cover_the_solid_cells_once(data: st.DataObject, rows: int, columns: int) -> None:
    flags = st.lists(st.booleans(), min_size=rows * columns, max_size=rows * columns)
    is_solid = np.array(data.draw(flags)).reshape(rows, columns)
    covered = np.zeros(is_solid.shape, int)
    for left, bottom, right, top in merged_boxes(is_solid):
        covered[bottom:top, left:right] += 1
    assert (covered == is_solid).all()


def test_a_way_that_is_wider_than_half_a_robot_and_narrower_than_it_is_refused() -> None:
    with pytest.raises(ScenarioError, match="the way from this storage to a dock is narrower"):
        Scenario(floor="A:#:/A:.:", cell_size=0.2, n_robots=1, n_items=1)  # of 0.25 m
