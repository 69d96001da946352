"""pEchoVar: echoes, inversions, flips, conditions, circles."""

from itertools import pairwise

import pytest
from app_harness import Harness
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.apps.echo_var import Echo, EchoVar, Flip, find_cycle, parse_echo


@pytest.mark.parametrize(
    ("text", "echoes"),
    [
        ("A -> B", [Echo("A", "B")]),
        ("A->B", [Echo("A", "B")]),
        ("A !-> B", [Echo("A", "B", True)]),
        ("A -> B, C", [Echo("A", "B"), Echo("A", "C")]),
        ("A -> B !-> C", [Echo("A", "B"), Echo("B", "C", True)]),
    ],
)
def test_echo_lines(text, echoes):
    assert parse_echo(text) == echoes


@pytest.mark.parametrize("text", ["", "A", "A ->", "-> B", "A B -> C", "A, B -> C", "A -> B !"])
def test_bad_echo_lines_are_refused(text):
    with pytest.raises(ValueError, match="expected SOURCE -> TARGET"):
        parse_echo(text)


def test_values_are_posted_again_with_their_type_and_the_present_time():
    echo = Harness(EchoVar, "echo = A -> B\necho = A -> C").run(1)
    echo.post("A", 5).run(1)
    echo.run(1).post("A", 6).run(1)
    assert (echo.values("B"), echo.values("C")) == ([5.0, 6.0], [5.0, 6.0])
    assert echo.times("B") == [pytest.approx(1.25, abs=0.3), pytest.approx(3.25, abs=0.3)]
    raw = Harness(EchoVar, "echo = A -> B").post("A", b"\x00").run(1)
    assert raw.values("B") == [b"\x00"]


@pytest.mark.parametrize(
    ("value", "echoed"), [("true", "false"), ("FALSE", "TRUE"), ("maybe", "maybe"), (1.0, 1.0)]
)
def test_an_inverted_echo_swaps_true_and_false_only(value, echoed):
    assert Harness(EchoVar, "echo = A !-> B").post("A", value).run(1).values("B") == [echoed]


def test_echoes_can_be_chained_over_variables():
    assert Harness(EchoVar, "echo = A -> B\necho = B !-> C").post("A", "true").run(2).values("C") == ["false"]


def test_held_messages_are_released_when_the_conditions_hold():
    echo = Harness(EchoVar, "echo = A -> B\necho = X -> Y\ncondition = GO = true").run(1)
    for value in (1, 2):
        echo.post("A", value).post("X", -value).run(1)
    assert echo.values("B") == []
    echo.post("GO", "true").run(1)
    assert (echo.values("B"), echo.values("Y")) == ([2.0], [-2.0])


def test_without_hold_messages_they_are_dropped():
    echo = Harness(EchoVar, "echo = A -> B\ncondition = GO = true\nhold_messages = false").post("A", 1).run(1)
    assert echo.post("GO", "true").run(1).post("A", 2).run(1).values("B") == [2.0]


@pytest.mark.parametrize(("option", "values"), [("false", [1.0, 2.0]), ("true", [2.0])])
def test_echo_latest_only_thins_out_what_came_in_one_iteration(option, values):
    echo = Harness(EchoVar, f"echo = A -> B\necho_latest_only = {option}").run(1)
    assert echo.post("A", 1).post("A", 2).run(1).values("B") == values


FLIP = (
    "FLIP:1 = source_variable = REPORT\nFLIP:1 = dest_variable = OUT\nflip:1 = dest_separator = #\n"
    "FLIP:1 = component = x -> xpos\nFLIP:1 = y -> ypos\nFLIP:1 = filter = kind == Kayak\n"
)


@pytest.mark.parametrize(
    ("report", "out"),
    [
        ("y=2, x=1,kind=KAYAK", ["ypos=2#xpos=1"]),
        ("x=1", ["xpos=1"]),
        ("x=1,kind=ship", []),
        ("z=1", []),
        ("", []),
    ],
)
def test_a_flip_renames_fields_of_reports_that_pass_its_filters(report, out):
    assert Harness(EchoVar, FLIP).post("REPORT", report).run(1).values("OUT") == out


def test_separators_may_differ():
    flip = Flip("1")
    for line in ("source_separator = #", "a -> b", "c->d"):
        flip.configure(line)
    assert flip.apply("a=1#c=2#e=3") == "b=1,d=2"


@pytest.mark.parametrize("block", ["FLIP:1 = nonsense", "FLIP:1 = source_variable = A", "FLIP:1 = -> b"])
def test_an_incomplete_flip_is_a_configuration_warning(block):
    echo = Harness(EchoVar, block).run(1)
    assert echo.app.log.config_warnings


def test_echoes_in_a_circle_are_refused_with_their_way():
    echo = Harness(EchoVar, "echo = A -> B\necho = B -> C\necho = C -> A").post("A", 1).run(2)
    assert echo.values("B") == []
    assert any("A -> B -> C -> A" in text for text in echo.app.log.config_warnings)
    assert echo.app.log.run_warnings_total == 1


@given(st.lists(st.tuples(st.sampled_from("ABCDE"), st.sampled_from("ABCDE")), max_size=8))
def test_a_circle_is_found_exactly_if_there_is_one(edges):
    cycle = find_cycle(edges)
    reach = {name: {b for a, b in edges if a == name} for name in "ABCDE"}
    for _ in range(5):
        reach = {a: bs.union(*(reach[b] for b in bs)) for a, bs in reach.items()}
    assert bool(cycle) == any(a in bs for a, bs in reach.items())
    if cycle:
        assert cycle[0] == cycle[-1]
        assert all(pair in edges for pair in pairwise(cycle))
