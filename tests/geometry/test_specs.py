"""behaviors.md A4 and A5: every way shapes are written, in and out."""

import math
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import Point, SegList, Seglr
from pymoos_lite.geometry.specs import (
    SpecError,
    erase_point_text,
    erase_seglist_text,
    parse_point,
    parse_polygon,
    parse_seglist,
    parse_seglr,
    point_text,
    seglist_text,
    seglr_text,
)

one_decimal = st.integers(-(10**7), 10**7).map(lambda i: i / 10)
two_decimals = st.integers(-(10**7), 10**7).map(lambda i: i / 100)
word = st.text(alphabet="abcXYZ019_ '@:.-", max_size=10).map(str.strip)
color = st.sampled_from(["", "red", "dodger_blue", "gray50", "invisible", "0.5:0.25:1"])
size = st.none() | st.integers(0, 100).map(lambda i: i / 10)
attributes = st.builds(
    Attributes,
    label=word,
    msg=word,
    source=word,
    vsource=word,
    id=word,
    active=st.booleans(),
    label_color=color,
    edge_color=color,
    vertex_color=color,
    fill_color=color,
    time=st.none() | two_decimals,
    duration=st.none() | st.just(-1.0) | st.integers(0, 9999).map(lambda i: i / 100),
    vertex_size=size,
    edge_size=size,
    fill_transparency=st.none() | st.integers(0, 100).map(lambda i: i / 100),
)
vertices = st.lists(st.tuples(one_decimal, one_decimal), min_size=1, max_size=8).map(tuple)


@st.composite
def seglists(draw: st.DrawFn) -> SegList:
    points = draw(vertices)
    zs = draw(st.just(()) | st.tuples(*[st.none() | one_decimal for _ in points]))
    props = draw(st.just(()) | st.tuples(*[st.sampled_from(["", "a", "b c"]) for _ in points]))
    zs = zs if any(z is not None for z in zs) else ()
    props = props if any(props) else ()
    return SegList(points, zs, props, draw(st.sampled_from(["", "lane"])), draw(attributes))


# ------------------------------------------------------------------------------------------------ points


@pytest.mark.parametrize(
    "text",
    ["5,6", " 5 , 6 ", "5:6", "x=5,y=6", "y=6, X=5", "x=4,shiftx=1,y=8,shifty=-2", "x=5,y=6,heading=90"],
)
def test_every_way_to_write_a_point_gives_the_same_point(text: str) -> None:
    assert parse_point(text) == Point(5.0, 6.0)


def test_points_may_have_depth_transparency_and_attributes() -> None:
    assert parse_point("5,6,7:label,foo:msg,hello") == Point(5, 6, 7, attributes=Attributes("foo", "hello"))
    point = parse_point("x=1,y=2,z=3,shiftz=1,trans=1.5,label=a,vertex_size=4,duration=-3,nonsense=7")
    assert point == Point(1, 2, 4, 1.0, Attributes("a", vertex_size=4, duration=-1))


@pytest.mark.parametrize(
    "text", ["", "5", "x=5", "x=5,y=", "x=1e3,y=2", "5,six", "1,2,3,4", "5,6:foo", "x=5,7"]
)
def test_text_without_two_coordinates_is_no_point(text: str) -> None:
    with pytest.raises(SpecError):
        parse_point(text)


@given(st.builds(Point, two_decimals, two_decimals, st.none() | two_decimals, attributes=attributes))
def test_any_point_reads_back_from_its_text(point: Point) -> None:
    assert parse_point(point_text(point)) == point
    assert parse_point(point_text(point, show_active=True)) == point


def test_the_stock_texts_of_points_are_exact() -> None:
    nextpt = Attributes("alpha's nextpt", label_color="aqua", vertex_color="yellow", vertex_size=5)
    assert point_text(Point(60, -40, attributes=nextpt), show_active=True) == (
        "x=60,y=-40,active=true,label=alpha's nextpt,label_color=aqua,vertex_color=yellow,vertex_size=5"
    )
    assert erase_point_text("alpha's trackpt") == "x=0,y=0,active=false,label=alpha's trackpt"
    assert point_text(Point(22.7699, -27.591)) == "x=22.77,y=-27.59"


# --------------------------------------------------------------------------------- seglists and polygons


@pytest.mark.parametrize(
    "text",
    [
        "pts={0,0:200,-150:100,100},label=foo",
        "label=foo,pts={ 0,0 : 200,-150 : 100,100 }",
        "pts={x=0,y=0:x=200,y=-150:y=100,x=100},label=foo,unknown=1",
        "0,0:200,-150:100,100:label,foo",
        "pts:0,0:200,-150:100,100:label,foo",
        "label,foo:points:0,0:200,-150:100,100".replace("label,foo:points:", "points:label,foo:"),
    ],
)
def test_every_way_to_write_vertices_gives_the_same_list(text: str) -> None:
    expected = SegList.of([(0, 0), (200, -150), (100, 100)], label="foo")
    assert parse_seglist(text) == expected
    polygon = parse_polygon(text)
    assert (polygon.points, polygon.label) == (expected.points, "foo")


def test_vertices_may_have_depths_and_properties() -> None:
    shape = parse_seglist("pts={0,0,5,home:1,1,dock:2,2,7:3,3},tags=a")
    assert shape.zs == (5.0, None, 7.0, None)
    assert shape.properties == ("home", "dock", "", "")
    assert seglist_text(shape) == "pts={0,0,5,home:1,1,dock:2,2,7:3,3},tags=a"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "label=foo",
        "pts={}",
        "pts={0,0:1}",
        "pts={0,0:1,a}",
        "pts=0,0:1,1",
        "pts={0,0:1,1",
        "0,0:foo,bar",
        "0,0:1,1:foo",
        "hello",
        "pts={1,2,3,4,5}",
        "pts={0,0},oops",
    ],
)
def test_what_is_no_list_of_vertices_is_refused(text: str) -> None:
    for parse in (parse_seglist, parse_polygon):
        with pytest.raises(SpecError):
            parse(text)


@given(seglists())
def test_any_seglist_reads_back_from_its_text(shape: SegList) -> None:
    assert parse_seglist(seglist_text(shape)) == shape


@given(seglists())
def test_any_polygon_reads_back_from_its_text(shape: SegList) -> None:
    polygon = Polygon(shape.points, shape.zs, shape.properties, shape.tags, shape.attributes)
    assert parse_polygon(seglist_text(polygon), convex=False) == polygon


def test_polygons_must_be_convex_unless_told_otherwise() -> None:
    text = "pts={0,0:10,0:5,2:5,10}"
    with pytest.raises(SpecError, match="not convex"):
        parse_polygon(text)
    assert len(parse_polygon(text, convex=False)) == 4


def test_erase_messages_need_no_vertices_and_carry_dummies_when_sent() -> None:
    assert erase_seglist_text("foo") == "pts={0,0:9,0:0,9},active=false,label=foo"
    assert erase_seglist_text("foo", duration=0) == "pts={0,0:9,0:0,9},active=false,label=foo,duration=0"
    for parse in (parse_seglist, parse_polygon):
        erased = parse("label=foo,active=false")
        assert (erased.points, erased.label, erased.attributes.active) == ((), "foo", False)
    assert seglist_text(parse_seglist("active=false")) == "active=false"


# --------------------------------------------------------------------------------------- described shapes


@pytest.mark.parametrize(
    "text",
    [
        "format=radial,x=40,y=-50,radius=25,pts=8,snap=1",
        "radial:: x=40, y=-50, radius=25, pts=8, snap=1",
        "radial: 40,-50,25,8,1",
        "format=radial, x=30, shiftx=10, y=-50, radius=25, pts=8, snap=1",
    ],
)
def test_the_radial_example_of_the_specification(text: str) -> None:
    assert seglist_text(parse_polygon(text)) == (
        "pts={50,-27:63,-40:63,-60:50,-73:30,-73:17,-60:17,-40:30,-27}"
    )


def test_described_shapes_take_attributes_but_no_unknown_fields() -> None:
    polygon = parse_polygon("radial:: x=0,y=0,radius=5,pts=6,label=a:b,edge_color=red")
    assert (polygon.label, polygon.attributes.edge_color) == ("a:b", "red")
    with pytest.raises(SpecError, match="radial has no field 'radios'"):
        parse_polygon("format=radial,x=0,y=0,radios=5,pts=6")
    with pytest.raises(SpecError, match="unknown format 'circle'"):
        parse_polygon("format=circle,x=0,y=0")


@pytest.mark.parametrize(
    "text",
    [
        "format=radial,x=0,y=0,radius=0,pts=8",
        "format=radial,x=0,y=0,radius=5,pts=2",
        "format=radial,x=0,y=0,radius=5,pts=2.5",
        "format=radial,x=0,y=0,radius=5",
        "format=radial,x=0,y=0,radius=5,pts=99999999",
        "format=ellipse,x=0,y=0,major=9,minor=4,pts=3",
        "format=ellipse,x=0,y=0,major=0,minor=4,pts=8",
        "format=wedge,x=0,y=0,lang=0,rang=270,range=10,pts=8",
        "format=pylon,x1=0,y1=0,x2=10,y2=0,axis_pad=2",
        "radial: 1,2,3,8,1,foo,7,8,9,10,11",
    ],
)
def test_descriptions_out_of_range_are_refused(text: str) -> None:
    with pytest.raises(SpecError):
        parse_polygon(text)


def test_ellipses_run_counter_clockwise_from_the_far_end_of_the_major_axis() -> None:
    polygon = parse_polygon("format=ellipse,x=10,y=20,major=40,minor=20,pts=4,degs=90,snap_value=0.1")
    assert polygon.points == ((10, 0), (20, 20), (10, 40), (0, 20))
    assert parse_polygon("ellipse:x=0,y=0,major=40,minor=20,pts=12,rads=0.3").is_convex


def test_a_wedge_has_its_apex_first_and_its_arc_clockwise() -> None:
    polygon = parse_polygon("format=wedge,x=0,y=0,lang=315,rang=45,range=10,pts=2,snap=0.01")
    assert polygon.points == ((0, 0), (-7.07, 7.07), (0, 10), (7.07, 7.07))


def test_a_range_wedge_goes_out_clockwise_and_comes_back() -> None:
    polygon = parse_polygon(
        "format=rangewedge,x=0,y=0,lang=0,rang=90,range_min=5,range_max=10,pts=1,snap=0.1"
    )
    assert polygon.points == ((0, 10), (10, 0), (5, 0), (0, 5))


@pytest.mark.parametrize("prefix", ["format=pylon,", "pylon:"])
def test_a_pylon_is_a_padded_rectangle_in_both_spellings(prefix: str) -> None:
    polygon = parse_polygon(prefix + "x1=0,y1=0,x2=10,y2=0,axis_pad=2,perp_pad=3")
    assert polygon.points == ((-2, 3), (-2, -3), (12, -3), (12, 3))


def test_ovals_and_rectangles_are_convex_around_their_middle() -> None:
    oval = parse_polygon("format=oval,x1=0,y1=0,x2=10,y2=0,rad=5")
    assert oval.bounds == pytest.approx((-5, -5, 15, 5))
    box = parse_polygon("format=rect,x=5,y=5,width=10,height=4,degs=90")
    assert box.bounds == pytest.approx((3, 0, 7, 10))


def test_lawnmower_rows_run_north_and_south_from_the_nearest_corner() -> None:
    shape = parse_seglist("format=lawnmower,label=foo,x=0,y=0,width=40,height=20,lane_width=20,rows=ns")
    assert seglist_text(shape) == "pts={-20,10:-20,-10:0,-10:0,10:20,10:20,-10},label=foo"
    other = parse_seglist(
        "format=lawnmower,x=0,y=0,width=40,height=20,lane_width=20,rows=north-south,startx=50,starty=-50"
    )
    assert seglist_text(other) == "pts={20,-10:20,10:0,10:0,-10:-20,-10:-20,10}"


def test_lawnmower_rows_run_east_and_west_by_default() -> None:
    shape = parse_seglist("lawnmower:x=0,y=0,width=20,height=40,swath=20,startx=-50,starty=50")
    assert seglist_text(shape) == "pts={-10,20:10,20:10,0:-10,0:-10,-20:10,-20}"


def test_negative_lawnmower_angles_are_accepted() -> None:
    turned = parse_seglist("format=lawnmower,x=0,y=0,width=40,height=20,swath=20,rows=ns,degs=-90")
    same = parse_seglist("format=lawnmower,x=0,y=0,width=40,height=20,swath=20,rows=ns,degs=270")
    assert turned == same
    assert turned.bounds == pytest.approx((-10, -20, 10, 20), abs=1e-4)


def test_a_zigzag_swings_first_to_the_left_of_its_axis() -> None:
    text = "startx=0,starty=0,angle=0,length=50,period=40,amplitude=5"
    for shape in (parse_seglist("zigzag:" + text), parse_seglist("format=zigzag," + text)):
        assert seglist_text(shape) == "pts={0,0:-5,10:5,30}"
    longer = parse_seglist("format=zigzag,startx=0,starty=0,angle=90,length=51,period=40,amplitude=5")
    assert longer.points == ((0, 0), (10, 5), (30, -5), (50, 5))


def test_a_bowtie_starts_in_the_quadrant_of_its_start_point() -> None:
    text = "format=bowtie,x=0,y=0,height=20,wid1=10,wid2=4,wid3=10"
    assert parse_seglist(text).points[0] == (-5, 10)
    assert parse_seglist(text + ",startx=9,starty=-9").points[0] == (5, -10)


def test_patterns_cannot_be_made_endless() -> None:
    for text in (
        "format=lawnmower,x=0,y=0,width=1000,height=1000,swath=0.001",
        "format=zigzag,startx=0,starty=0,angle=0,length=100000,period=0.001,amplitude=1",
        "0,0:" * 30_000 + "1,1",
        "pts={" + "0,0:" * 30_000 + "1,1}",
    ):
        with pytest.raises(SpecError, match="more than"):
            parse_seglist(text)


# ------------------------------------------------------------------------------------------------ seglr


def test_a_seglr_is_a_list_and_a_ray() -> None:
    text = "pts={0,0:1.5,2},ray=45,label=foo,ray_len=20,head_size=1,cpa=3.2,cpax=4,cpay=5"
    seglr = parse_seglr(text)
    assert (seglr.points, seglr.ray, seglr.label, seglr.cpa) == (((0, 0), (1.5, 2)), 45, "foo", 3.2)
    assert seglr_text(seglr) == text
    with pytest.raises(SpecError, match="no ray"):
        parse_seglr("pts={0,0:1,1}")


@given(
    st.builds(
        Seglr,
        vertices,
        st.integers(0, 3599).map(lambda i: i / 10),
        one_decimal,
        one_decimal,
        st.none() | one_decimal,
        st.none() | one_decimal,
        st.none() | one_decimal,
        attributes,
    )
)
def test_any_seglr_reads_back_from_its_text(seglr: Seglr) -> None:
    assert parse_seglr(seglr_text(seglr)) == seglr


# ------------------------------------------------------------------------------------------ hostile text


@given(
    st.text(alphabet="pts={}0,1:.- ", max_size=60)
    | st.text(alphabet="format=radialwedgexyptszoom,=:123. ", max_size=60)
    | st.text(max_size=60)
)
def test_hostile_text_gives_a_shape_or_a_spec_error(text: str) -> None:
    for prefix in ("", "format=", "radial:", "zigzag:", "pts={0,0},"):
        for parse in (parse_point, parse_seglist, parse_polygon, parse_seglr):
            with suppress(SpecError):
                shape = parse(prefix + text)
                places = getattr(shape, "points", None) or [
                    (getattr(shape, "x", 0.0), getattr(shape, "y", 0.0))
                ]
                assert all(math.isfinite(x) and math.isfinite(y) for x, y in places)


@given(
    st.sampled_from(["radial", "ellipse", "wedge", "rangewedge", "pylon", "oval", "rect"]),
    st.lists(st.floats(-1e3, 1e3).map(lambda v: f"{v:.3f}") | st.integers(0, 12).map(str), max_size=8),
)
def test_any_numbers_describe_a_finite_convex_polygon_or_none(name: str, numbers: list[str]) -> None:
    try:
        polygon = parse_polygon(f"{name}:" + ",".join(numbers))
    except SpecError:
        return
    assert polygon.is_convex
    assert all(math.isfinite(v) for point in polygon.points for v in point)
