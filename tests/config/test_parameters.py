"""Declared parameters: parsing, ranges, aliases, messages."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.config.parameters import Declaration, Parameter, ParameterError, describe


def pair(text):
    left, right = text.split(",")
    return float(left), float(right)


DECLARED = Declaration(
    (
        Parameter("speed", "number", 1.0, "m/s", "Cruise speed.", low=0.0, aliases=("spd",)),
        Parameter("radius", "number", 3.0, "m", low=0.0, open_low=True),
        Parameter("turn_rate", "number", 70.0, low=0.0, high=100.0, clip=True),
        Parameter("count", "integer", 2, low=0),
        Parameter("lead", "boolean", False),
        Parameter("order", "choice", "normal", choices=("normal", "reverse", "toggle")),
        Parameter("update_var", "variable", ""),
        Parameter("point", "custom", (0.0, 0.0), parse=pair),
        Parameter("flag", "text", repeated=True),
    ),
    ignored=("old_switch",),
)


def bind(*pairs):
    lines = [ConfigLine(key, value, number + 1) for number, (key, value) in enumerate(pairs)]
    return DECLARED.bind(lines, "BHV_Test", "a.bhv")


def test_values_come_typed_and_case_of_names_does_not_matter():
    bound = bind(
        ("SPD", "2.5"),
        ("Radius", '"4"'),
        ("count", "3"),
        ("LEAD", "yes"),
        ("order", "Reverse"),
        ("point", "1, 2"),
    )
    v = bound.values
    assert (v.speed, v.radius, v.count, v.lead, v.order, v.point) == (
        2.5,
        4.0,
        3,
        True,
        "reverse",
        (1.0, 2.0),
    )
    assert bound.problems == []
    assert bound.given == {"speed", "radius", "count", "lead", "order", "point"}


def test_repeated_parameters_collect_in_file_order_and_scalars_last_wins_with_a_warning():
    bound = bind(("flag", "A=1"), ("speed", "1"), ("flag", "B=2"), ("speed", "2"))
    assert bound.values.flag == ["A=1", "B=2"]
    assert bound.values.speed == 2.0
    assert [(p.line, p.severity) for p in bound.problems] == [(4, "warning")]


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("speed", "-1", "at least 0"),
        ("radius", "0", "above 0"),
        ("speed", "fast", "a number"),
        ("speed", "nan", "a number"),
        ("speed", "1e999", "a number"),
        ("count", "2.5", "a whole number"),
        ("lead", "maybe", "true or false"),
        ("order", "revers", "did you mean 'reverse'"),
        ("update_var", "A B", "without blanks"),
        ("point", "1;2", "point"),
    ],
)
def test_a_bad_value_keeps_the_default_and_says_what_would_be_right(key, value, says):
    bound = bind((key, value))
    (problem,) = bound.problems
    assert str(problem).startswith("a.bhv:1:")
    assert says in problem.text
    assert getattr(bound.values, key) == DECLARED.find(key).default


def test_an_unknown_name_gets_the_nearest_spelling_and_an_ignored_one_nothing():
    bound = bind(("sped", "1"), ("old_switch", "on"))
    (problem,) = bound.problems
    assert "did you mean 'spe" in problem.text or "did you mean 'spd'" in problem.text
    assert problem.severity == "warning"


def test_clipping_parameters_clip():
    assert bind(("turn_rate", "250")).values.turn_rate == 100.0


@given(st.text(max_size=40))
def test_no_text_makes_a_reader_raise_anything_but_its_own_error(text):
    for parameter in DECLARED:
        try:
            value = parameter.read(text)
        except ParameterError:
            continue
        if parameter.kind in ("number", "integer"):
            assert math.isfinite(value)


def test_a_later_declaration_replaces_an_earlier_one():
    both = DECLARED + Declaration((Parameter("speed", "number", 9.0),))
    assert both.defaults().speed == 9.0
    assert both.find("spd") is None


def test_a_name_declared_twice_is_a_programming_error():
    with pytest.raises(ValueError, match="declared twice"):
        Declaration((Parameter("a"), Parameter("b", aliases=("A",))))


def test_the_table_shows_name_default_unit_range_and_doc():
    text = describe(DECLARED)
    assert "speed = 1" in text
    assert "a number of at least 0, m/s" in text
    assert "Cruise speed. Also: spd." in text
