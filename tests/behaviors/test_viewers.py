"""The behaviours that only draw (behaviors.md C27)."""

from __future__ import annotations

import pytest

from ivp_helm.testing import HelmRig
from pymoos_lite.geometry.specs import parse_point, parse_seglist, parse_seglr
from pymoos_lite.records.view import RangePulse


def one(kind, turn_model="", **parameters):
    rig = HelmRig([(kind, {"name": "b", "condition": "HIDE!=1", **parameters})], turn_model=turn_model)
    rig.own(10.0, 20.0, 0.0, 1.0)
    rig.mail("HIDE", 0)
    return rig


def test_the_line_of_the_heading_asked_for_is_the_longer_the_faster():
    rig = one("BHV_HSLine", time_on_leg=10)
    lengths = []
    for speed in (2.0, 1.0, 4.0):
        rig.mail("DESIRED_HEADING", 90)
        rig.mail("DESIRED_SPEED", speed)
        rig.iterate()
        start, end = parse_seglist(str(rig.posted("VIEW_SEGLIST")[-1])).points
        assert start == (10.0, 20.0)
        assert end[1] == 20.0
        lengths.append(end[0] - start[0])
    assert lengths == pytest.approx([20.0, 5.0, 40.0])


@pytest.mark.parametrize(("percent", "end"), [(0, (10, 20)), (50, (30, 40)), (100, (50, 60))])
def test_a_part_of_the_way_to_the_point_is_drawn(percent, end):
    rig = one("BHV_BearingLine", bearing_point="50,60", line_pct=percent)
    rig.iterate()
    assert parse_seglist(str(rig.posted("VIEW_SEGLIST")[-1])).points == ((10, 20), end)
    point = parse_point(str(rig.posted("VIEW_POINT")[-1]))
    assert (point.x, point.y) == (50, 60)


def test_the_turn_path_ends_in_a_ray_along_the_heading_asked_for():
    rig = one("BHV_PModelView", "alg=dubins # radius=10 # spoke_degs=30", vertex_size=5)
    rig.mail("DESIRED_HEADING", 90)
    rig.iterate()
    path = parse_seglr(str(rig.posted("VIEW_SEGLR")[-1]))
    assert path.ray == 90.0
    assert len(path.points) == 4
    assert path.points[-1] == pytest.approx((20.0, 30.0), abs=0.1)
    assert path.attributes.vertex_size == 5.0


def test_each_range_report_is_a_ring():
    rig = one("BHV_RangePulse")
    rig.iterate()
    assert rig.posted("VIEW_RANGE_PULSE") == []
    rig.mail("RANGE_REPORTalpha", "range=40")
    rig.iterate()
    pulse = RangePulse.parse(str(rig.posted("VIEW_RANGE_PULSE")[0]))
    assert (pulse.x, pulse.y, pulse.radius) == (10.0, 20.0, 25.0)


@pytest.mark.parametrize(
    ("kind", "variable", "more"),
    [
        ("BHV_HSLine", "VIEW_SEGLIST", {}),
        ("BHV_BearingLine", "VIEW_POINT", {"bearing_point": "5,5"}),
        ("BHV_PModelView", "VIEW_SEGLR", {}),
    ],
)
def test_idle_erases_the_drawing(kind, variable, more):
    rig = one(kind, **more)
    rig.mail("DESIRED_HEADING", 90)
    rig.mail("DESIRED_SPEED", 1)
    rig.iterate()
    assert "active=false" not in str(rig.posted(variable)[-1])
    rig.mail("HIDE", 1)
    rig.iterate()
    assert "active=false" in str(rig.posted(variable)[-1])
