"""The `.bhv` reader: what it takes, what it refuses and where it says so (helm.md 1)."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm.behavior_file import (
    BehaviorFile,
    Initialization,
    cut_comment,
    logical_lines,
    print_behavior_file,
    read_behavior_file,
)


def read(text: str) -> BehaviorFile:
    return read_behavior_file(text, "x.bhv")


def complaints(text: str) -> list[str]:
    return [str(p) for p in read(text).problems]


def test_a_backslash_joins_lines_and_the_first_line_number_counts():
    text = "Behavior = BHV_X\n{\n  points = 0,0:\\\n5,5\n  speed = 2\n}\n"
    block = read(text).blocks[0]
    assert [(line.key, line.value, line.line) for line in block.lines] == [
        ("points", "0,0:5,5", 3),
        ("speed", "2", 5),
    ]


def test_a_comment_that_ends_in_a_backslash_swallows_the_next_line():
    assert read("// hello \\\ninitialize A = 1\ninitialize B = 2\n").initializations == (
        Initialization("B", 2.0, line=3),
    )


def test_carriage_returns_do_not_stick_to_values():
    content = read("initialize A = true\r\nBehavior = BHV_X\r\n{\r\n  name = b\r\n}\r\n")
    assert content.initializations[0].value == "true"
    assert content.blocks[0].kind == "BHV_X"
    assert content.blocks[0].name == "b"


def test_initial_values_are_typed_and_lists_respect_quotes_and_braces():
    content = read('initialize A=false, B = 3, C="7", D={1,2}\ninitialize_ E = x\nINITIALIZE_\tF = 1\n')
    assert [(i.variable, i.value, i.deferred) for i in content.initializations] == [
        ("A", "false", False),
        ("B", 3.0, False),
        ("C", "7", False),
        ("D", "{1,2}", False),
        ("E", "x", True),
        ("F", 1.0, True),
    ]


@pytest.mark.parametrize("line", ["initialize X", "initialize X =", "initialize = 1", "initialize A B = 1"])
def test_a_faulty_initial_value_is_a_problem_with_its_line(line):
    assert complaints(f"\n{line}\n") == [
        f"x.bhv:2: error: initialize: '{line.removeprefix('initialize ')}' is not VARIABLE = VALUE"
    ]


def test_keywords_come_in_any_case_and_after_any_white_space():
    content = read("Initialize\tX=1\nSET\tMODE = A {\n  X = 1\n}\nbehavior=BHV_Y\n{\n}\n")
    assert content.initializations[0].variable == "X"
    assert content.modes[0].value == "A"
    assert content.blocks[0].kind == "BHV_Y"
    assert not content.problems


def test_the_brace_may_stand_on_the_header_or_below_it_after_blank_lines():
    content = read("Behavior = BHV_X {\n a = 1\n}\nBehavior = BHV_Y\n\n// note\n\n{\n b = 2\n}\n")
    assert [block.kind for block in content.blocks] == ["BHV_X", "BHV_Y"]
    assert not content.problems


def test_a_block_without_header_is_skipped():
    content = read("//Behavior = BHV_X\n{\n  name = off\n  nonsense\n}\n\nBehavior = BHV_Y\n{\n}\n")
    assert [block.kind for block in content.blocks] == ["BHV_Y"]
    assert not content.problems


def test_text_right_after_a_skipped_block_is_refused_but_a_keyword_is_fine():
    assert complaints("{\n a = 1\n}\njunk\n") == [
        "x.bhv:4: error: 'junk' after a block without header: expected a blank line"
    ]
    assert complaints("{\n a = 1\n}\ninitialize A = 1\n") == []


def test_an_open_brace_inside_a_skipped_block_is_refused():
    assert complaints("{\n {\n}\n\n") == ["x.bhv:2: error: unexpected '{' in a block without header"]


def test_parameter_names_are_lower_case_and_values_begin_after_the_first_equals_sign():
    block = read(
        "Behavior = BHV_X\n{\n\tPwt=20\n  EndFlag = SUMMARY=speed=$[SPEED],time=5 \n  flag\n}\n"
    ).blocks[0]
    assert [(line.key, line.value) for line in block.lines] == [
        ("pwt", "20"),
        ("endflag", "SUMMARY=speed=$[SPEED],time=5"),
        ("flag", ""),
    ]


def test_a_brace_that_ends_a_value_belongs_to_it_and_one_too_many_ends_the_block():
    content = read("Behavior = BHV_X\n{\n  points = pts={0,0:5,5}\n  name = foo }\n")
    assert [line.value for line in content.blocks[0].lines] == ["pts={0,0:5,5}", "foo"]
    assert not content.problems


def test_comments_are_cut_anywhere_but_inside_quotes():
    assert cut_comment("a = 1 // two") == ("a = 1", False)
    assert cut_comment('a = "http://x" // two') == ('a = "http://x"', True)
    assert cut_comment('a = "never closed // two') == ('a = "never closed', False)
    warnings = read('initialize URL = "http://x"\n').problems
    assert [p.severity for p in warnings] == ["warning"]


def test_a_hash_line_is_refused_and_nsplug_words_say_what_to_do():
    assert "run nsplug on this file first" in complaints("#include plug_x.bhv\n")[0]
    assert "'#' starts no comment here" in complaints("# hello\n")[0]


def test_unknown_text_names_the_nearest_keyword():
    assert "did you mean 'initialize'?" in complaints("initialise A = 1\n")[0]
    assert "did you mean 'Behavior'?" in complaints("Behaviour = BHV_X\n")[0]


def test_blocks_on_one_line_are_diagnosed():
    assert "on one line" in complaints("set MODE = A { X = 1 } B\n")[0]
    assert "on one line" in complaints("Behavior = BHV_X { name = a }\n")[0]


def test_a_block_that_is_never_closed_is_reported_at_its_header():
    assert complaints("Behavior = BHV_X\n{\n name = a\n") == [
        "x.bhv:1: error: Behavior = BHV_X: its block is not closed at the end of the file"
    ]
    assert complaints("set MODE = A {\n X = 1\n") == [
        "x.bhv:1: error: set MODE = A: its block is not closed at the end of the file"
    ]
    assert (
        "not closed before line 4"
        in complaints("Behavior = BHV_X\n{\n name = a\nBehavior = BHV_Y\n{\n}\n")[0]
    )


def test_a_header_without_block_is_reported():
    assert complaints("Behavior = BHV_X\n\ninitialize A = 1\n") == [
        "x.bhv:1: error: Behavior = BHV_X: expected '{' after it"
    ]


def test_the_else_value_stands_behind_the_brace_or_on_the_next_line():
    modes = read("set M = A {\n X = 1\n} B\nset M = C {\n X = 2\n}\nD\nset M = E {\n X = 3\n}\n\n").modes
    assert [(m.value, m.else_value) for m in modes] == [("A", "B"), ("C", "D"), ("E", "")]


def test_two_words_as_else_value_are_refused():
    assert "expected one word" in complaints("set M = A {\n X = 1\n} B C\n")[0]


def test_a_mode_block_at_the_very_end_of_the_file_is_kept():
    assert len(read("set M = A {\n X = 1\n}").modes) == 1


def test_a_mode_line_that_begins_with_condition_gets_a_hint():
    assert "without 'condition ='" in complaints("set M = A {\n condition = X = Y\n}\n")[0]


def test_a_double_equals_at_the_top_of_a_mode_line_is_refused_and_fine_inside():
    assert "single '='" in complaints("set M = A {\n X == 1\n}\n")[0]
    assert complaints("set M = A {\n (X == 1) or (Y == 2)\n}\n") == []


def test_all_problems_of_a_file_are_reported_at_once_with_their_lines():
    text = "initialize\n\nnonsense\nset M = A {\n ((X = 1\n}\nBehavior = BHV_X\n{\n a = 1\n"
    assert [p.line for p in read(text).problems] == [1, 3, 5, 7]


def test_a_file_without_anything_is_fine():
    assert read("") == BehaviorFile("x.bhv")
    assert read("\n// nothing\n\t\n").problems == ()


WORD = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,6}", fullmatch=True)
VALUE = st.from_regex(r"[A-Za-z0-9.,:=\-]{1,12}", fullmatch=True).filter(lambda t: t.strip("="))
PARAMETERS = st.lists(st.tuples(WORD, VALUE), max_size=4)


@given(
    st.lists(st.tuples(WORD, WORD, st.booleans()), max_size=3),
    st.lists(
        st.tuples(WORD, WORD, st.lists(st.tuples(WORD, WORD), max_size=2), st.sampled_from(["", "else1"])),
        max_size=3,
    ),
    st.lists(st.tuples(WORD, PARAMETERS), max_size=3),
)
@settings(max_examples=60)
def test_reading_what_was_printed_gives_the_same_file(inits, modes, blocks):
    reserved = ("and", "or")
    text = "".join(f"initialize{'_' if later else ''} {name} = {value}\n" for name, value, later in inits)
    for name, value, conditions, otherwise in modes:
        conditions = [
            (a, b) for a, b in conditions if a.lower() not in reserved and b.lower() not in reserved
        ]
        body = "".join(f"{a} = {b}\n" for a, b in conditions)
        text += f"set {name} = {value} {{\n{body}}} {otherwise}\n\n"
    for kind, parameters in blocks:
        body = "".join(
            f"{key} = {value}\n" for key, value in parameters if not key.lower().startswith("behavior")
        )
        text += f"Behavior = {kind}\n{{\n{body}}}\n"
    first = read(text)
    assert not first.problems
    second = read(print_behavior_file(first))
    assert not second.problems
    assert [(i.variable, i.value, i.deferred) for i in second.initializations] == [
        (i.variable, i.value, i.deferred) for i in first.initializations
    ]
    assert second.modes == first.modes
    assert [(b.kind, [(x.key, x.value) for x in b.lines]) for b in second.blocks] == [
        (b.kind, [(x.key, x.value) for x in b.lines]) for b in first.blocks
    ]


PIECES = st.sampled_from(
    [
        "{",
        "}",
        "\n",
        "\\\n",
        "set ",
        "Behavior = ",
        "initialize ",
        "A = 1",
        "//",
        '"',
        "(",
        ")",
        " and ",
        "!",
        "$(",
        "x",
    ]
)


@given(st.one_of(st.text(max_size=200), st.lists(PIECES, max_size=40).map("".join)))
def test_no_text_makes_the_reader_raise(text):
    content = read(text)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").count("\n") + 1
    assert all(1 <= p.line <= lines for p in content.problems)


@given(st.lists(st.sampled_from(["a", "b\\", "\\", "", "// c\\"]), max_size=8))
def test_joined_lines_hold_everything_but_the_backslashes(lines):
    text = "\n".join(lines)
    joined = "".join(token.text for token in logical_lines(text))
    assert joined == "".join(line.removesuffix("\\") for line in lines)
