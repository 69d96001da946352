"""The condition language of helm.md 2, checked sentence by sentence and against a slow evaluator."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoos_lite.config.conditions import (
    Condition,
    ConditionError,
    Joined,
    Not,
    Reference,
    Relation,
    fields_match,
    parse_condition,
    with_deltas,
)


def holds(text: str, **values: float | str | bytes) -> bool:
    return parse_condition(text).holds(values.get)


@pytest.mark.parametrize(
    ("text", "tree"),
    [
        ("DEPLOY = true", Relation("DEPLOY", "=", "true")),
        ("MODE==LOITERING", Relation("MODE", "==", "LOITERING")),
        (" (NAV_DEPTH < 2) ", Relation("NAV_DEPTH", "<", "2")),
        ('A = "5"', Relation("A", "=", "5", quoted=True)),
        ('A = ""', Relation("A", "=", "", quoted=True)),
        ("A != hello there", Relation("A", "!=", "hello there")),
        ("A >= $(B)", Relation("A", ">=", Reference("B"))),
        ("!(A = b)", Not(Relation("A", "=", "b"))),
        ("! ((A = b))", Not(Relation("A", "=", "b"))),
        ("(A=1)and(B=2)", Joined("and", Relation("A", "=", "1"), Relation("B", "=", "2"))),
        ("(A=1) Or !(B=2)", Joined("or", Relation("A", "=", "1"), Not(Relation("B", "=", "2")))),
        (
            "((A = b) or (C < 3)) and !(D = e)",
            Joined(
                "and",
                Joined("or", Relation("A", "=", "b"), Relation("C", "<", "3")),
                Not(Relation("D", "=", "e")),
            ),
        ),
    ],
)
def test_what_the_grammar_accepts(text, tree):
    condition = parse_condition(text)
    assert condition.root == tree
    assert condition.text == text.strip()
    assert condition.warnings == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("()", "empty"),
        ("A", "expected VAR = VALUE"),
        ("A =", "value is missing"),
        ("= b", "variable name is missing"),
        ("and = b", "variable name is missing"),
        ("A B = c", "blank inside"),
        ("A = b = c", "chained"),
        ("A => 3", "no operator '=>'"),
        ("A = or", "no value"),
        ("A=1 or B=2", "parentheses"),
        ("A=1 and (B=2)", "parentheses"),
        ("(A=1) and B=2", "parentheses"),
        ("(A=1) and (B=2) and (C=3)", "exactly two"),
        ("(A=1) (B=2)", "'and' or 'or'"),
        ("(A=1) xor (B=2)", "'and' or 'or'"),
        ("(A=1) and", "'and' or 'or'"),
        ("(A=1", "never closed"),
        ("A=1)", "never opened"),
        ("(A=1))", "'and' or 'or'"),
        ("!A=1", "'!' must stand before a parenthesis"),
        ("!(A=1) = b", "'and' or 'or'"),
        ('"A" = b', "expected VAR = VALUE"),
        ('A = b"c', "may not contain"),
        ('A = "b=c"', "chained"),
        ("(" * 60 + "A=1" + ")" * 60, "nested"),
        ("(" * 100_000, "never closed"),
    ],
)
def test_what_the_grammar_refuses_and_why(text, words):
    with pytest.raises(ConditionError) as refusal:
        parse_condition(text)
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 250


def test_a_bare_joiner_inside_a_text_is_accepted_with_a_warning():
    condition = parse_condition("A = x or y")
    assert condition.root == Relation("A", "=", "x or y")
    assert len(condition.warnings) == 1


def test_legacy_commas_are_equals_signs_only_when_asked_for():
    assert parse_condition("DEPLOY,true", legacy_commas=True) == parse_condition("DEPLOY = true")
    with pytest.raises(ConditionError):
        parse_condition("DEPLOY,true")


@pytest.mark.parametrize("op", ["=", "==", "!=", "<", "<=", ">", ">="])
@pytest.mark.parametrize("right", ["1", "abc", '"abc"', "$(B)"])
def test_a_variable_never_received_makes_every_comparison_false(op, right):
    assert not holds(f"A {op} {right}", B=1.0)
    assert holds(f"!(A {op} {right})", B=1.0)
    assert not holds(f"B {op} $(A)", B=1.0)


@pytest.mark.parametrize(
    ("text", "value", "result"),
    [
        ("A = true", "true", True),
        ("A = true", "TRUE", False),
        ("A != true", "TRUE", True),
        ("A = true", '"true"', True),
        ("A < b", "a", True),
        ("A >= b", "a", False),
        ("A = 5", 5.0, True),
        ("A == 5", 5.0, True),
        ("A != 5", 5.0, False),
        ("A <= 5.5", 5.5, True),
        ("A = 5", "5.0", True),
        ("A = 5", " 5 ", True),
        ("A > 4", "5", True),
        ("A = 5", "five", False),
        ("A != 5", "five", False),
        ("A < 5", "five", False),
        ('A = "5"', 5.0, True),
        ('A = "5"', "5", True),
        ('A = "5"', "5.0", False),
        ("A = five", 5.0, False),
        ("A != five", 5.0, False),
        ("A = 1e3", 1000.0, False),
        ("A = 1e3", "1e3", True),
        ("A = x", b"x", False),
        ("A != 1", b"x", False),
        ("MODE == ACTIVE", "ACTIVE:SURVEYING", True),
        ("MODE == SURVEYING", "ACTIVE:SURVEYING", True),
        ("MODE == ACTIVE:SURVEYING", "ACTIVE", True),
        ("MODE == A:C", "A:B:C", False),
        ("MODE == A:B:C", "A:B:C", True),
        ("MODE == B:C:D", "A:B:C:D", True),
        ("MODE = ACTIVE", "ACTIVE:SURVEYING", False),
        ("MODE != STATION-KEEPING", "ACTIVE:STATION-KEEPING", True),
    ],
)
def test_comparisons(text, value, result):
    assert parse_condition(text).holds(lambda _: value) is result


@pytest.mark.parametrize(
    ("a", "b", "op", "result"),
    [
        (1.0, 1.0, "=", True),
        (1.0, "1", "=", True),
        ("2", 1.0, ">", True),
        (1.0, "x", "!=", False),
        ("x", "y", "!=", True),
        ("A:B", "B", "==", True),
        ("A:B", "B", "=", False),
    ],
)
def test_two_variables_compare_by_their_latest_values(a, b, op, result):
    assert holds(f"A {op} $(B)", A=a, B=b) is result


def test_the_latest_value_counts_whatever_type_came_before():
    condition = parse_condition("N = 1")
    assert not condition.holds({"N": "abc"}.get)
    assert condition.holds({"N": 1.0}.get)


def test_fields_match_is_a_contiguous_part_of_the_longer():
    assert fields_match("A : B", "A:B")
    assert fields_match("B", "A:B:C")
    assert not fields_match("AB", "A:B")
    assert fields_match("", "")


def test_variables_come_in_order_of_appearance_each_once():
    condition = parse_condition("((B = 1) or (A < $(C))) and !(B = 2)")
    assert condition.variables() == ("B", "A", "C")


def test_a_delta_is_the_age_of_a_time_stamp_and_registers_for_it():
    condition = parse_condition("PING_DELTA > 5")
    assert condition.registrations() == ("PING_DELTA", "PING")
    assert condition.holds(with_deltas({"PING": 100.0}.get, 106.0))
    assert not condition.holds(with_deltas({"PING": "102"}.get, 106.0))
    assert not condition.holds(with_deltas({"PING": 100.0, "PING_DELTA": 1.0}.get, 106.0))
    assert not condition.holds(with_deltas({}.get, 106.0))
    assert not condition.holds(with_deltas({"PING": "soon"}.get, 106.0))


# --- against a slow evaluator that works on our own description of the tree -----------------------

NAMES = st.sampled_from(["A", "B", "MODE", "NAV_X"])
NUMBERS = st.sampled_from(["0", "1", "-1", "1.50", "+2", ".5", "3."])
WORDS = st.sampled_from(["true", "x", "ACTIVE", "ACTIVE:SURVEY", "SURVEY", "a b", "1e3", "1", "A:B:C", "B:C"])
OPS = st.sampled_from(["=", "==", "!=", "<", "<=", ">", ">="])
LITERALS = st.one_of(
    NUMBERS.map(lambda t: ("bare", t)),
    WORDS.map(lambda t: ("bare", t)),
    st.one_of(NUMBERS, WORDS).map(lambda t: ("quoted", t)),
    NAMES.map(lambda t: ("var", t)),
)
LEAVES = st.tuples(st.just("rel"), NAMES, OPS, LITERALS)
TREES = st.recursive(
    LEAVES,
    lambda sub: st.one_of(
        st.tuples(st.just("not"), sub), st.tuples(st.sampled_from(["and", "or"]), sub, sub)
    ),
    max_leaves=6,
)
VALUES = st.one_of(
    st.none(),
    st.sampled_from([0.0, 1.0, -1.0, 1.5, 2.0, 0.5, 3.0]),
    WORDS,
    NUMBERS,
    WORDS.map(lambda w: f'"{w}"'),
)
BLANKS = st.sampled_from(["", " ", "  "])


def write(tree, draw) -> str:
    """One of the many spellings of a tree."""
    blank = lambda: draw(BLANKS)  # noqa: E731
    if tree[0] == "rel":
        _, name, op, (kind, text) = tree
        right = {"bare": text, "quoted": f'"{text}"', "var": f"$({text})"}[kind]
        spelled = f"{name}{blank()}{op}{blank()}{right}"
    elif tree[0] == "not":
        spelled = f"!{blank()}({blank()}{write(tree[1], draw)}{blank()})"
    else:
        word = draw(st.sampled_from([tree[0], tree[0].upper()]))
        spelled = f"({write(tree[1], draw)}){blank()}{word}{blank()}({write(tree[2], draw)})"
    return f"({blank()}{spelled}{blank()})" if draw(st.booleans()) else spelled


def numeric(value) -> float | None:
    if isinstance(value, float):
        return value
    text = value.strip()
    digits = text[1:] if text[:1] in ("+", "-") else text
    if digits.count(".") > 1 or not digits.replace(".", "") or not digits.replace(".", "").isdecimal():
        return None
    return float(text)


def part_of(short: list[str], long: list[str]) -> bool:
    return any(long[i : i + len(short)] == short for i in range(len(long)))


def slow(tree, values) -> bool:
    """helm.md 2.2 written as a table walk."""
    if tree[0] == "not":
        return not slow(tree[1], values)
    if tree[0] == "and":
        return slow(tree[1], values) and slow(tree[2], values)
    if tree[0] == "or":
        return slow(tree[1], values) or slow(tree[2], values)
    _, name, op, (kind, text) = tree
    left = values.get(name)
    right = values.get(text) if kind == "var" else text
    if left is None or right is None:
        return False
    left = left[1:-1] if isinstance(left, str) and left[:1] == '"' else left
    right = right[1:-1] if isinstance(right, str) and right[:1] == '"' else right
    right_is_number = isinstance(right, float) or (kind == "bare" and numeric(right) is not None)
    if isinstance(left, str) and not right_is_number:
        if op == "==":
            a, b = [f.strip() for f in left.split(":")], [f.strip() for f in right.split(":")]
            return part_of(a, b) or part_of(b, a)
    else:
        left, right = numeric(left), numeric(right)
        if left is None or right is None:
            return False
    order = (left > right) - (left < right)
    return {
        "=": order == 0, "==": order == 0, "!=": order != 0, "<": order < 0,
        "<=": order <= 0, ">": order > 0, ">=": order >= 0,
    }[op]  # fmt: skip


@settings(max_examples=400)
@given(st.data(), TREES, st.dictionaries(st.sampled_from(["A", "B", "MODE", "NAV_X"]), VALUES))
def test_every_spelling_of_a_tree_evaluates_like_the_slow_evaluator(data, tree, values):
    condition = parse_condition(write(tree, data.draw))
    assert condition.holds(values.get) is slow(tree, values)


@given(st.data(), TREES)
def test_what_is_printed_parses_to_the_same_tree(data, tree):
    condition = parse_condition(write(tree, data.draw))
    again = parse_condition(str(condition))
    assert again == condition
    assert str(again) == str(condition)
    assert Condition(condition.root) == condition
    assert hash(again) == hash(condition)


@given(
    st.one_of(
        st.text(max_size=60),
        st.lists(
            st.sampled_from(["(", ")", "!", "=", "<", ">", '"', "A", "and", "or", " ", "$(", "1", ","]),
            max_size=30,
        ).map("".join),
    ),
    st.booleans(),
)
def test_no_text_raises_anything_but_a_condition_error(text, commas):
    try:
        condition = parse_condition(text, legacy_commas=commas)
    except ConditionError:
        return
    condition.holds({"A": 1.0}.get)
    assert parse_condition(str(condition)) == condition
