"""The own Voronoi cell in a convex region."""

import json
from math import hypot
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.voronoi import MERGE_DISTANCE, cut, merged, voronoi_cell

CASES = [json.loads(p.read_text()) for p in sorted((Path(__file__).parents[1] / "data/bloom").glob("*.json"))]
CELLS = [case for case in CASES if case["kind"] == "voronoi_cell"]
XRAY = Polygon(((-321.4, -204.8), (-50.3, -76.3), (99.6, -392.6), (-192.9, -521.1)))

inside = st.tuples(st.floats(-321.0, 99.0), st.floats(-521.0, -77.0)).filter(lambda p: XRAY.contains(*p))


@pytest.mark.parametrize("case", CELLS, ids=[c["id"] for c in CELLS])
def test_cells_are_the_stored_ones(case):
    region = Polygon(tuple(map(tuple, case["region"])))
    assert region.area == pytest.approx(case["region_area"], abs=case["tolerance"])
    places = {name: tuple(map(float, at)) for name, at in case["positions"].items()}
    for name, own in places.items():
        others = [p for n, p in places.items() if n != name and region.contains(*p)]
        cell = voronoi_cell(region, own, others)
        expected = case["expected"][name]
        if expected is None:
            assert cell is None
            continue
        assert cell is not None
        assert cell.area == pytest.approx(expected["area"], abs=case["tolerance"])
        assert cell.area_centroid == pytest.approx(expected["centroid"], abs=case["tolerance"])
        assert len(cell) == expected["n_vertices"]


@given(st.lists(inside, min_size=1, max_size=9, unique=True))
def test_the_cells_of_all_vessels_inside_tile_the_region(places):
    assume(all(hypot(a[0] - b[0], a[1] - b[1]) > 0.1 for a in places for b in places if a is not b))
    cells = [voronoi_cell(XRAY, p, [q for q in places if q is not p], merge=0.0) for p in places]
    assert all(cell is not None for cell in cells)
    assert sum(cell.area for cell in cells) == pytest.approx(XRAY.area, rel=1e-6)


@given(st.lists(inside, min_size=2, max_size=6, unique=True), inside)
def test_a_place_is_in_the_cell_of_the_vessel_nearest_to_it(places, spot):
    ranges = sorted((hypot(p[0] - spot[0], p[1] - spot[1]), p) for p in places)
    assume(ranges[1][0] - ranges[0][0] > 0.5)
    nearest = ranges[0][1]
    assume(all(hypot(p[0] - nearest[0], p[1] - nearest[1]) > 1.0 for p in places if p != nearest))
    cell = voronoi_cell(XRAY, nearest, [p for p in places if p != nearest], merge=0.0)
    assert cell is not None
    assert cell.contains(*spot)


def test_outside_the_region_there_is_no_cell():
    assert voronoi_cell(XRAY, (0.0, 0.0), [(-100.0, -300.0)]) is None


def test_another_vessel_at_the_same_place_takes_nothing():
    cell = voronoi_cell(XRAY, (-100.0, -300.0), [(-100.0, -300.0)])
    assert cell is not None
    assert cell.area == pytest.approx(XRAY.area)


def test_vertices_nearer_than_the_merge_distance_become_one():
    points = [(0.0, 0.0), (10.0, 0.0), (10.0, 0.4), (10.0, 10.0), (0.0, 10.0), (0.0, 0.3)]
    assert merged(points, MERGE_DISTANCE) == [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]


def test_merging_never_leaves_fewer_than_three_vertices():
    tiny = [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5)]
    assert merged(tiny, MERGE_DISTANCE) == tiny


def test_cutting_everything_away_leaves_nothing():
    assert cut([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], 1.0, 0.0, -5.0) == []
