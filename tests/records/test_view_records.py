"""VIEW_* records: what the stock behaviours post, what viewers read, and nothing but RecordError."""

import json
import math
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import Circle, Point, SegList
from pymoos_lite.geometry.specs import point_text, seglist_text
from pymoos_lite.records import view
from pymoos_lite.records.csp import RecordError

STOCK = json.loads((Path(__file__).parent.parent / "data" / "views" / "stock_views.json").read_text("utf-8"))

number = st.integers(-(10**6), 10**6).map(lambda i: i / 100)
positive = st.integers(1, 10**6).map(lambda i: i / 100)
attributes = st.builds(
    Attributes,
    label=st.text(alphabet="abc_0 ", max_size=6).map(str.strip),
    active=st.booleans(),
    edge_color=st.sampled_from(["", "red", "gray50"]),
    time=st.none() | positive,
    duration=st.none() | positive,
)
color = st.sampled_from(["", "red", "invisible"])
some = st.none() | number
small_records = st.one_of(
    st.builds(view.RangePulse, number, number, positive, some, some, attributes=attributes),
    st.builds(
        view.CommsPulse, number, number, number, number, positive, some, st.just("msg"), attributes=attributes
    ),
    st.builds(
        view.Marker, number, number, some, some, st.just("gateway"), color, color, attributes=attributes
    ),
    st.builds(view.Vector, number, number, number, number, attributes=attributes),
    st.builds(view.Arrow, number, number, number, number, number, number, number, attributes=attributes),
    st.builds(view.TextBox, number, number, st.integers(6, 40).map(float), color, attributes=attributes),
    st.builds(view.Wedge, number, number, number, number, st.just(1.0), st.just(2.5), attributes=attributes),
    st.builds(view.Oval, number, number, number, number, positive, some, attributes=attributes),
)


@pytest.mark.parametrize("text", STOCK["VIEW_POINT"])
def test_every_measured_point_prints_back_letter_by_letter(text: str) -> None:
    point = view.parse_view("VIEW_POINT", text)
    assert isinstance(point, Point)
    assert point_text(point, show_active="active=true" in text) == text


@pytest.mark.parametrize("text", STOCK["VIEW_SEGLIST"])
def test_every_measured_seglist_prints_back_letter_by_letter(text: str) -> None:
    shape = view.parse_view("VIEW_SEGLIST", text)
    assert isinstance(shape, SegList)
    assert seglist_text(shape, 3) == text


@pytest.mark.parametrize("text", STOCK["VIEW_POLYGON"])
def test_every_measured_polygon_prints_back_or_is_a_circle_of_its_radius(text: str) -> None:
    polygon = view.parse_view("VIEW_POLYGON", text)
    assert isinstance(polygon, Polygon)
    if not text.startswith("radial::"):
        assert seglist_text(polygon, 5) == text
    elif polygon.points:
        assert len(polygon) == 32
        stated = float(text.partition("radius=")[2].partition(",")[0])
        assert max(math.dist(polygon.center, p) for p in polygon.points) == pytest.approx(stated)
        assert polygon.label == text.partition("label=")[2].partition(",")[0]
    else:
        assert not polygon.attributes.active


def test_the_documented_pulses_and_markers_are_read() -> None:
    pulse = view.parse_view(
        "VIEW_RANGE_PULSE",
        "x=-40,y=-150,label=one,radius=40,duration=10,fill=0.25,fill_color=green,time=100,edge_size=1",
    )
    assert isinstance(pulse, view.RangePulse)
    assert (pulse.radius, pulse.fill, pulse.attributes.fill_color, pulse.label) == (40, 0.25, "green", "one")
    assert [pulse.radius_at(t) for t in (99.0, 100.0, 105.0, 110.0, 110.1)] == [None, 0.0, 20.0, 40.0, None]
    beam = view.parse_view(
        "VIEW_COMMS_PULSE", "label=abe2ben,sx=4,sy=2,tx=44,ty=55,beam_width=10,duration=5,pulse_type=msg"
    )
    assert isinstance(beam, view.CommsPulse)
    assert (beam.tx, beam.ty, beam.pulse_type, beam.attributes.duration) == (44, 55, "msg", 5)
    marker = view.parse_view("VIEW_MARKER", "type=efield,x=100,y=20,label=alpha,COLOR=red,width=4.5")
    assert isinstance(marker, view.Marker)
    assert (marker.type, marker.primary_color, marker.width) == ("efield", "red", 4.5)


def test_circles_are_read_with_either_name_of_the_radius() -> None:
    for key in ("radius", "rad"):
        circle = view.parse_view("VIEW_CIRCLE", f"x=1,y=2,{key}=3.5,label=c,duration=3")
        assert circle == Circle(1, 2, 3.5, Attributes("c", duration=3))
    assert view.view_text(Circle(1, 2, 3.5, Attributes("c"))) == "x=1,y=2,radius=3.5,label=c"


@given(small_records)
def test_every_small_record_reads_back_from_its_text(record: view.Drawable) -> None:
    variable = record.VARIABLE  # type: ignore[union-attr]
    assert view.parse_view(variable, view.view_text(record)) == record


@pytest.mark.parametrize("variable", view.VIEW_VARIABLES)
def test_an_erase_message_needs_nothing_but_its_label(variable: str) -> None:
    text = "active=false,label=foo"
    if variable == "VIEW_POINT":
        text = "x=0,y=0," + text
    record = view.parse_view(variable, text)
    assert record.label == "foo"
    assert not record.attributes.active


@pytest.mark.parametrize("variable", view.VIEW_VARIABLES)
def test_an_active_record_without_its_place_is_refused(variable: str) -> None:
    with pytest.raises(RecordError, match=variable):
        view.parse_view(variable, "label=foo")


@pytest.mark.parametrize(
    ("variable", "text", "reason"),
    [
        ("VIEW_RANGE_PULSE", "x=1,y=2,radius=-3", "radius must be at least 0"),
        ("VIEW_CIRCLE", "x=1,y=2,radius=-3", "radius must be at least 0"),
        ("VIEW_WEDGE", "x=1,y=2,lang=0,rang=9,range_min=5,range_max=4", "less than range_max"),
        ("VIEW_OVAL", "x1=1,y1=2,x2=3,y2=4,rad=0", "rad must be greater than 0"),
        ("VIEW_VECTOR", "x=1,y=2,mag=fast,ang=4", "mag must be a number"),
        ("VIEW_NOTHING", "x=1", "no drawing"),
    ],
)
def test_records_out_of_range_are_refused_with_the_reason(variable: str, text: str, reason: str) -> None:
    with pytest.raises(RecordError, match=reason):
        view.parse_view(variable, text)


def test_non_convex_polygons_are_drawn_all_the_same() -> None:
    polygon = view.parse_view("VIEW_POLYGON", "pts={0,0:10,0:5,2:5,10},label=dent")
    assert isinstance(polygon, Polygon)
    assert view.view_text(polygon) == "pts={0,0:10,0:5,2:5,10},label=dent"
    assert view.view_text(polygon.with_attributes(label=""), 0) == "pts={0,0:10,0:5,2:5,10}"


@given(
    st.sampled_from(view.VIEW_VARIABLES),
    st.text(alphabet="xypts={}0,1:.-radius ", max_size=60) | st.text(max_size=60),
)
def test_hostile_text_gives_a_drawing_or_a_record_error(variable: str, text: str) -> None:
    for candidate in (text, "x=1,y=2," + text, "active=false," + text):
        with suppress(RecordError):
            record = view.parse_view(variable, candidate)
            assert isinstance(view.view_text(record), str)
