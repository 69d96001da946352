"""Study files: what they say, and every mistake with its line."""

from math import isfinite

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.config.formulas import FormulaError, parse_formula
from pymoos_lite.config.study_file import Measure, parse_study

TEXT = """
study: test
mission: bloom
seeds: {first: 5, count: 2}
grid:
  vehicles: [4, 8]
  method: [gcid, static]
  RANGE: [160]
measure:
  a: sum X
  b: shoreside Y or 0
derive:
  c: a / (b + 1)
compare:
  - {column: c, factor: method, pairs: [[gcid, static]], within: [vehicles]}
"""


def study(text=TEXT):
    return parse_study(text, "s.yaml")


def test_rows_are_numbered_by_point_and_then_by_seed():
    found = study()
    assert found.problems == ()
    assert found.row_count == 8
    rows = list(found.rows())
    assert [row.number for row in rows] == list(range(1, 9))
    assert [row.seed for row in rows] == [5, 6] * 4
    assert rows[2].factors == (("vehicles", "4"), ("method", "static"), ("RANGE", "160"))
    assert found.row(8).value("vehicles") == "8"


def test_a_study_that_is_stopped_early_has_run_whole_seeds():
    found = study()
    assert found.in_order(range(1, 9)) == [1, 3, 5, 7, 2, 4, 6, 8]
    assert found.in_order([8, 2, 5]) == [5, 2, 8]
    assert found.in_order([]) == []
    with pytest.raises(KeyError):
        found.row(9)


def test_several_grids_follow_each_other():
    found = study(
        TEXT.replace(
            "grid:\n  vehicles: [4, 8]\n  method: [gcid, static]\n  RANGE: [160]\n",
            "grid:\n  - {method: [gcid, static], vehicles: [4]}\n  - {RANGE: [1, 2, 3]}\n",
        )
    )
    assert found.problems == ()
    assert found.row_count == 10
    assert found.factors == ("method", "vehicles", "RANGE")
    assert found.row(10).value("RANGE") == "3"
    assert found.row(10).value("method") == ""


def test_measures_name_a_place_a_variable_and_perhaps_a_default():
    assert study().measures == (Measure("a", "sum", "X"), Measure("b", "shoreside", "Y", 0.0))


@pytest.mark.parametrize(
    ("old", "new", "line", "complaint"),
    [
        ("mission: bloom", "", 2, "mission is missing"),
        ("  a: sum X", "  a: sum", 10, "expected PLACE VARIABLE"),
        ("  a: sum X", "  seed: sum X", 10, "'seed' cannot be a column"),
        ("  a: sum X", "  a: network bites", 10, "did you mean 'bytes'"),
        ("c: a / (b + 1)", "c: a / (b + x)", 13, "no column 'x'"),
        ("c: a / (b + 1)", "c: a ** 2", 13, "numbers, names"),
        ("column: c", "column: d", 15, "no column 'd'"),
        ("factor: method", "factor: methods", 15, "did you mean 'method'"),
        ("[[gcid, static]]", "[[gcid, other]]", 15, "expected two of gcid, static"),
        ("vehicles: [4, 8]", "vehicles: [4, four]", 6, "whole numbers above 0"),
        ("vehicles: [4, 8]", "vehicles: [4, 4]", 6, "different values"),
        ("seeds: {first: 5, count: 2}", "seeds: [1, 1]", 4, "given twice"),
        ("seeds: {first: 5, count: 2}", "seed: 3", 4, "no 'seed'"),
        ("RANGE: [160]", "RANGE: [on]", 8, "put 'on' in quotes"),
    ],
)
def test_mistakes_are_told_with_file_and_line(old, new, line, complaint):
    assert old in TEXT
    problems = study(TEXT.replace(old, new)).problems
    assert any(complaint in p.text and p.line == line for p in problems), [str(p) for p in problems]


def test_too_many_rows_are_refused():
    text = TEXT.replace("count: 2", "count: 1000000")
    assert any("rows are more than" in p.text for p in study(text).problems)


@given(st.text(max_size=200))
def test_no_text_makes_the_reader_raise(text):
    found = parse_study(text, "s.yaml")
    assert found.problems, "no such text names a mission and what to measure"
    assert all(problem.file == "s.yaml" for problem in found.problems)


def test_formulas_compute_as_arithmetic_does():
    formula = parse_formula("100 * a / (a + b) - -2")
    assert formula.names == ("a", "b")
    assert formula.value({"a": 1.0, "b": 3.0}) == 27.0
    assert formula.value({"a": 1.0}) is None
    assert formula.value({"a": 1.0, "b": None}) is None
    assert formula.value({"a": 1.0, "b": -1.0}) is None
    assert parse_formula("1e300 * 1e300").value({}) is None


@pytest.mark.parametrize(
    "text",
    ["", "a b", "a ** 2", "f(a)", "a.b", "a if b else c", "'x'", "True", "a; b", "__import__('os')", "[a]"],
)
def test_a_formula_is_arithmetic_and_nothing_else(text):
    with pytest.raises(FormulaError):
        parse_formula(text)


@given(st.text(max_size=60))
def test_no_text_makes_a_formula_raise_anything_else(text):
    try:
        formula = parse_formula(text)
    except FormulaError as error:
        assert str(error)
        return
    value = formula.value(dict.fromkeys(formula.names, 2.0))
    assert value is None or isfinite(value)
