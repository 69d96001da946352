"""VIEW_GRID and VIEW_GRID_DELTA (marine_apps.md 13)."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.grid import MAX_CELLS, ConvexGrid, GridDelta

SQUARE = Polygon.of([(0, 0), (0, 20), (20, 20), (20, 0)])
TEXT = "pts={0,0:0,20:20,20:20,0},cell_size=10,cell_vars=x:0:y:5,cell_min=x:0,cell_max=x:10,label=psg"


def test_a_configuration_makes_a_grid_at_its_initial_values() -> None:
    grid = ConvexGrid.parse(TEXT)
    assert grid.cells == ((0, 0), (0, 10), (10, 0), (10, 10))
    assert [grid.value(i, "y") for i in range(4)] == [5.0] * 4
    assert grid.label == "psg"
    assert grid.to_text() == TEXT


def test_a_position_falls_into_one_cell_or_none() -> None:
    grid = ConvexGrid.parse(TEXT)
    assert [grid.cell_at(1, 1), grid.cell_at(1, 11), grid.cell_at(11, 1), grid.cell_at(19.9, 19.9)] == [
        0,
        1,
        2,
        3,
    ]
    assert grid.cell_at(-1, 5) is None
    assert grid.cell_at(25, 5) is None


def test_only_cells_that_touch_the_region_exist() -> None:
    triangle = ConvexGrid.create(Polygon.of([(0, 0), (0, 30), (30, 0)]), 10)
    assert len(triangle.cells) == 9 - 1
    assert triangle.cell_at(25, 25) is None


def test_deltas_add_up_within_the_limits_and_unknown_ones_are_ignored() -> None:
    grid = ConvexGrid.parse(TEXT)
    delta = GridDelta.parse("psg@1,x,4:1,x,3:2,x,99:2,y,-8:77,x,1:0,z,1")
    grid = grid.changed(delta.changes)
    assert [grid.value(i) for i in range(4)] == [0.0, 7.0, 10.0, 0.0]
    assert grid.value(2, "y") == -3.0
    assert grid.to_text() == (
        "pts={0,0:0,20:20,20:20,0},cell_size=10,cell_vars=x:0:y:5,cell_min=x:0,cell_max=x:10,"
        "cell=1:x:7,cell=2:x:10:y:-3,label=psg"
    )
    with pytest.raises(KeyError):
        grid.value(0, "z")


@given(
    st.lists(st.tuples(st.integers(0, 5), st.sampled_from("xy"), st.integers(-99, 99).map(lambda i: i / 4)))
)
def test_grids_and_deltas_read_back_from_their_text(changes: list[tuple[int, str, float]]) -> None:
    delta = GridDelta("psg", tuple(changes))
    assert GridDelta.parse(delta.to_text()) == delta
    grid = ConvexGrid.parse(TEXT).changed(delta.changes)
    assert ConvexGrid.parse(grid.to_text()) == grid


@pytest.mark.parametrize(
    "text",
    [
        "",
        "cell_size=5",
        "pts={0,0:0,20:20,20:20,0}",
        "pts={0,0:0,20:20,20:20,0},cell_size=0",
        "pts={0,0:0,20:20,20:20,0},cell_size=0.001",
        "pts={0,0:10,0:5,2:5,10},cell_size=5",
        TEXT + ",cell=9:x:1",
        TEXT + ",cell=0:x",
        TEXT.replace("x:0:y:5", "x:0:y"),
    ],
)
def test_what_is_no_grid_is_refused(text: str) -> None:
    with pytest.raises(RecordError):
        ConvexGrid.parse(text)


def test_a_grid_is_never_larger_than_the_limit() -> None:
    grid = ConvexGrid.create(SQUARE, 1, attributes=Attributes("a"))
    assert len(grid.cells) == 400 <= MAX_CELLS
    with pytest.raises(RecordError, match="more than"):
        ConvexGrid.create(SQUARE, 0.01)


@pytest.mark.parametrize(
    "text", ["", "psg", "@1,x,2", "psg@1,x", "psg@a,x,2", "psg@1,x,b", "psg@-1,x,2", "psg@1,,2"]
)
def test_what_is_no_delta_is_refused(text: str) -> None:
    with pytest.raises(RecordError):
        GridDelta.parse(text)


@given(st.text(alphabet="pts={}0,1:cell_sizvarx@ ", max_size=60) | st.text(max_size=40))
def test_hostile_text_gives_a_grid_or_a_record_error(text: str) -> None:
    for parse in (ConvexGrid.parse, GridDelta.parse):
        for candidate in (text, TEXT + "," + text, "psg@" + text):
            with suppress(RecordError):
                assert parse(candidate).to_text()
