"""Event lines, random values, macros and arithmetic of timer scripts."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.apps.timer_core import joined_events
from pymoos_lite.apps.timer_values import (
    EventLine,
    Span,
    calculate,
    expand_value,
    parse_corners,
    parse_event,
    parse_rand_pair,
    parse_randvar,
    point_inside,
)


@pytest.mark.parametrize(
    ("text", "event"),
    [
        ("var=A, val=1, time=5", EventLine("A", "1", Span(5, 5))),
        ('VAR=A,VAL="1",TIME=5:7,amt=3', EventLine("A", "1", Span(5, 7), True, 3)),
        ('var=A, val="x=1, y=2"', EventLine("A", "x=1, y=2", Span(0, 0), True)),
        ("var=A, val=pts={0,0:1,1}, time=2", EventLine("A", "pts={0,0:1,1}", Span(2, 2))),
        ("quit, time=9", EventLine("", "", Span(9, 9), quits=True)),
    ],
)
def test_event_lines(text, event):
    assert parse_event(text) == event


@pytest.mark.parametrize(
    "text",
    [
        "",
        "val=1",
        "var=A",
        "var=A, val=",
        "var=A B, val=1",
        "var=A, val=1, when=2",
        "var=A, val=x=1,y=2",
        "var=A,val=1,time=b",
        "var=A,val=1,time=3:2",
        "var=A,val=1,time=1:2:3",
        "var=A,val=1,amt=0",
        "var=A,val=1,amt=1.5",
        "var=A, val=1, time",
    ],
)
def test_bad_event_lines_are_refused_in_one_line(text):
    with pytest.raises(ValueError, match=r"^[^\n]+$"):
        parse_event(text)


NUMBERS = {"DBTIME": 12.5, "UTC": 1000.0, "UTCTIME": 1000.0, "COUNT": 3.0, "TCOUNT": 7.0}
TEXTS = {"NAV_X": "1.50", "VNAME": "abe", "ANGLE": "45", "SIDE": "port"}


@pytest.mark.parametrize(
    ("text", "quoted", "value"),
    [
        ("5", False, 5.0),
        ("5", True, "5"),
        ("true", False, "true"),
        ("1e3", False, "1e3"),
        ("$[DBTIME]", False, 12.5),
        ("$(COUNT)", False, 3.0),
        ("$[COUNT]", True, "3"),
        ("$[UTC]s $(DBTIME)", False, "1000.00s 12.50"),
        ("n=$[COUNT]/$[TCOUNT]", False, "n=3/7"),
        ("$[ANGLE]", False, 45.0),
        ("$(ANGLE)", True, "45"),
        ("side=$[SIDE]", False, "side=port"),
        ("$[VNAME]_$(VNAME)", False, "abe_$(VNAME)"),
        ("$[UNKNOWN]", False, "$[UNKNOWN]"),
        ("{$[ANGLE]+45}", False, 90.0),
        ("hdg={$(ANGLE) * 2}", False, "hdg=90"),
        ("{{2+3}*4}", False, 20.0),
        ("{10/4}", False, 2.5),
        ("{-5-3}", False, -8.0),
        ("{1/3}", False, 0.333333),
        ("{1/0}", False, "{1/0}"),
        ("{1+2", False, "{1+2"),
        ("pts={0,0:1,1}", False, "pts={0,0:1,1}"),
        ("{a+1} {1+1}", False, "{a+1} 2"),
    ],
)
def test_values(text, quoted, value):
    found = expand_value(text, quoted, NUMBERS, TEXTS, random.Random(1))
    assert (found, type(found)) == (value, type(value))


def test_at_most_eleven_sums_are_worked_out():
    assert calculate("{1+1}" * 12) == "2" * 11 + "{1+1}"


def test_random_digits_have_at_most_that_many_and_no_leading_zero():
    source = random.Random(3)
    found = [str(expand_value("a$(4)", False, {}, {}, source))[1:] for _ in range(300)]
    assert all(text == str(int(text)) and len(text) <= 4 for text in found)
    assert max(len(t) for t in found) == 4
    assert expand_value("$(21)", False, {}, {}, source) == "$(21)"


def test_a_range_is_drawn_uniformly_in_steps_of_a_ten_thousandth():
    source = random.Random(1)
    draws = [Span(5, 15).draw(source) for _ in range(2000)]
    assert min(draws) >= 5
    assert max(draws) <= 15
    assert sum(draws) / len(draws) == pytest.approx(10, abs=0.3)
    assert all(abs((d - 5) * 1000 - round((d - 5) * 1000)) < 1e-9 for d in draws)


def test_random_variables_snap_and_stay_within_their_limits():
    source = random.Random(1)
    snapped = parse_randvar("varname=A, min=0, max=10, key=at_reset, snap=2.5")
    assert {snapped.draw(source)[0] for _ in range(200)} == {"0", "2.5", "5", "7.5", "10"}
    normal = parse_randvar("varname=A,min=-1,max=1,key=at_post,type=gaussian,mu=0,sigma=5")
    draws = [float(normal.draw(source)[0]) for _ in range(200)]
    assert (min(draws), max(draws)) == (-1, 1)
    assert any(-1 < d < 1 for d in draws)


@pytest.mark.parametrize(
    "text",
    ["varname=A,min=0,max=1", "varname=A,min=0,max=1,key=never", "varname=A,min=2,max=1,key=at_post",
     "varname=A,min=0,max=1,key=at_post,type=normal", "varname=A,min=0,max=1,key=at_post,colour=red",
     "varname=A,min=x,max=1,key=at_post", "varname=A,min=0,max=1,key=at_post,type=poisson"],
)  # fmt: skip
def test_bad_random_variables_are_refused(text):
    with pytest.raises(ValueError, match=r"expected|needed|below"):
        parse_randvar(text)


def test_random_points_fill_a_polygon_evenly_even_a_concave_one():
    corners = parse_corners("pts={0,0:10,0:10,10:5,1:0,10}")
    source = random.Random(5)
    points = [point_inside(corners, source) for _ in range(2000)]
    assert all(y <= 10 - 1.8 * x + 1e-9 or y <= 1 + 1.8 * (x - 5) + 1e-9 for x, y in points)
    assert sum(x for x, _ in points) / len(points) == pytest.approx(5, abs=0.3)
    pair = parse_rand_pair('var1=X, var2=Y, key=at_post, type=poly, poly="pts={0,0:1,0:1,1}"')
    assert pair.names == ("X", "Y")
    x, y = (float(v) for v in pair.draw(source))
    assert 0 <= y <= x <= 1


@pytest.mark.parametrize("text", ["pts={0,0:1,1}", "pts={0,0:1,1:2,2}", "pts={0,0:1,x:2,0}", "radial"])
def test_polygons_without_area_or_with_bad_corners_are_refused(text):
    with pytest.raises(ValueError, match=r"corner"):
        parse_corners(text)


def test_event_numbers_are_fixed_at_configuration_copy_by_copy():
    lines = [
        parse_event("var=A, val=x, amt=2"),
        parse_event("var=B, val=ob_$[IDX], amt=2"),
        parse_event('var=C, val="c$$IDX"'),
    ]
    events = [(e.var, e.value) for e in joined_events(lines) for _ in range(e.amount)]
    assert events == [("A", "x"), ("A", "x"), ("B", "ob_002"), ("B", "ob_003"), ("C", "c004")]


@given(st.text(alphabet='var=l,tim":{}5 $[]()*/+-', max_size=60))
def test_no_text_raises_anything_but_a_value_error(text):
    for parse in (parse_event, parse_randvar, parse_rand_pair, parse_corners):
        try:
            parse(text)
        except ValueError as refusal:
            assert "\n" not in str(refusal)
    expand_value(text, False, NUMBERS, TEXTS, random.Random(0))
