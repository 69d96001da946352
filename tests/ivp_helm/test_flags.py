from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ivp_helm.flags import Flag, parse_flag, split_macros, typed_value


@pytest.mark.parametrize(
    ("text", "variable", "value"),
    [
        ("RETURN=true", "RETURN", "true"),
        ("RETURN = false", "RETURN", "false"),
        ("N = 5", "N", 5.0),
        ("N = -0.5", "N", -0.5),
        ('N = "5"', "N", "5"),
        ("SUMMARY=speed=2,time=7", "SUMMARY", "speed=2,time=7"),
        ('J = {"a": 1}', "J", '{"a": 1}'),
    ],
)
def test_a_flag_is_a_variable_and_all_that_follows_the_first_equals_sign(text, variable, value):
    flag = parse_flag(text)
    assert (flag.variable, flag.value) == (variable, value)
    assert (flag.tag, flag.destination, flag.condition) == ("", "", None)


def test_tag_destination_and_condition_are_told_apart():
    flag = parse_flag("@<20 #all+ NEAR = $[CONTACT] [if] DEPLOY = true")
    assert flag.tag == "@<20"
    assert flag.destination == "all+"
    assert flag.variable == "NEAR"
    assert flag.condition is not None
    assert flag.condition.text == "DEPLOY = true"


@pytest.mark.parametrize("text", ["", "X", "=5", "X=", "two words = 5", "X = 1 [if] (((", "#nobody X = 1"])
def test_text_that_is_no_flag_is_refused_with_a_reason(text):
    with pytest.raises(ValueError) as caught:
        parse_flag(text)
    assert str(caught.value)


VALUES = {"SPEED": 2.0, "OSX": 1.23456, "OWNSHIP": "alpha", "HASH": "123456"}


def expand(text: str):
    return parse_flag(f"V = {text}").expand(VALUES.get)


def test_one_macro_that_is_a_number_posts_a_number_and_anything_else_text():
    assert expand("$[SPEED]") == 2.0
    assert expand("$(SPEED)") == 2.0
    assert expand("v=$[SPEED]") == "v=2"
    assert expand("$[SPEED]$[SPEED]") == "22"
    assert expand("$[OWNSHIP]") == "alpha"
    assert expand("$[HASH]") == "123456"


def test_numbers_inside_text_have_three_decimals_without_trailing_zeros():
    assert expand("x=$[OSX],v=$(SPEED)") == "x=1.235,v=2"
    assert expand("$[OSX]") == 1.235


def test_an_unknown_macro_stays_as_it_was_written():
    assert expand("$[NOPE]") == "$[NOPE]"
    assert expand("a$(NOPE)b$[SPEED]") == "a$(NOPE)b2"
    assert expand("$[speed]") == "$[speed]"  # case matters


def test_an_undecorated_value_keeps_its_type():
    assert parse_flag("N = 5").expand(VALUES.get) == 5.0
    assert parse_flag('N = "5"').expand(VALUES.get) == "5"


def test_typed_values_follow_the_rule_for_initial_values():
    assert typed_value("+5") == 5.0
    assert typed_value("1e5") == "1e5"
    assert typed_value("0x10") == "0x10"
    assert typed_value("true") == "true"
    assert typed_value('"7"') == "7"


NAME = st.from_regex(r"[A-Z][A-Z0-9_]{0,8}", fullmatch=True)
VALUE = st.one_of(
    st.floats(-1e6, 1e6).map(lambda x: round(x, 4)),
    st.from_regex(r"[a-z$\[\](),:. ]{1,20}", fullmatch=True)
    .map(str.strip)
    .filter(lambda t: t and not t.lower().startswith("[if]") and "[if]" not in t),
)


@given(
    NAME,
    VALUE,
    st.sampled_from(["", "@<20", ">5", "@cpa"]),
    st.sampled_from(["", "all", "all+", "group", "group+"]),
    st.sampled_from(["", "A = 1", "(A = 1) and (B = two)"]),
)
def test_parsing_what_a_flag_prints_gives_the_flag_again(name, value, tag, destination, condition):
    text = " ".join(filter(None, [tag, f"#{destination}" if destination else "", f"{name}={value}"]))
    flag = parse_flag(f"{text} [if] {condition}" if condition else text)
    again = parse_flag(str(flag))
    assert again == flag


@given(st.text(max_size=60))
def test_no_text_makes_the_parser_raise_anything_but_its_own_error(text):
    try:
        flag = parse_flag(text)
    except ValueError:
        return
    assert isinstance(flag, Flag)
    assert isinstance(flag.expand(lambda name: None), float | str)


@given(st.text(alphabet="ab$[]()X ", max_size=40))
def test_cutting_at_macros_loses_nothing(text):
    parts = split_macros(text)
    if parts is None:
        return
    assert "".join(p if isinstance(p, str) else p.text for p in parts) == text


@given(st.text(alphabet="ab $[](X)=,", max_size=60))
def test_macros_expand_as_a_slow_scan_would(text):
    """The twin: look for each opening, take the shortest name that has no bracket in it."""
    values = {"X": "<x>", "a": 7.0, "ab": "<ab>"}

    def slow(text: str) -> str:
        out = ""
        i = 0
        while i < len(text):
            for opening, closing in (("$[", "]"), ("$(", ")")):
                if text.startswith(opening, i):
                    j = i + 2
                    while j < len(text) and text[j] not in (opening[1] + closing + "$"):
                        j += 1
                    if j < len(text) and text[j] == closing and j > i + 2:
                        value = values.get(text[i + 2 : j])
                        shown = "7" if value == 7.0 else value
                        out += text[i : j + 1] if value is None else str(shown)
                        i = j + 1
                        break
            else:
                out += text[i]
                i += 1
        return out

    parts = split_macros(text)
    flag = Flag("V", text, parts=parts)
    found = flag.expand(values.get)
    assert found == (7.0 if slow(text) == "7" and parts and len(parts) == 1 else slow(text))
