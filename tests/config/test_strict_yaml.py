"""YAML without surprises: lines, duplicates, words that YAML would turn into something else."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoos_lite.config.problems import Problem
from pymoos_lite.config.strict_yaml import MAX_DEPTH, Listing, Reader, Scalar, Table, read_yaml


def read(text):
    problems: list[Problem] = []
    tree = read_yaml(text, "f.yaml", problems)
    return tree, [str(p) for p in problems]


def reader(text):
    problems: list[Problem] = []
    return Reader(read_yaml(text, "f.yaml", problems), "f.yaml", "a test", problems), problems


def test_values_stay_as_written_and_know_their_line():
    tree, problems = read("a: 010\nb:\n  - 'x'\n  - y\n")
    assert isinstance(tree, Table)
    assert problems == []
    assert (tree.items["a"].text, tree.items["a"].line) == ("010", 1)
    assert isinstance(tree.items["b"], Listing)
    first, second = tree.items["b"].items
    assert (first.text, first.plain, second.plain, second.line) == ("x", False, True, 4)


def test_a_key_given_twice_is_an_error_with_both_lines():
    _, problems = read("a: 1\nb: 2\na: 3\n")
    assert problems == ["f.yaml:3: error: 'a' was already given at line 1"]


def test_a_key_that_yaml_takes_for_true_or_false_is_an_error():
    _, problems = read("on: 1\nx: 0\ny: 1\n'no': 2\n")
    assert problems == ["f.yaml:1: error: key 'on' means true or false in YAML: put it in quotes"]


@pytest.mark.parametrize("word", ["no", "on", "Yes", "off", "true", "2024-05-01"])
def test_a_text_that_yaml_takes_for_something_else_is_an_error(word):
    table, problems = reader(f"name: {word}\n")
    assert table.text("name", "fallback") == "fallback"
    assert problems[0].line == 1
    assert "put it in quotes" in problems[0].text
    table, problems = reader(f"name: '{word}'\n")
    assert table.text("name") == word
    assert problems == []


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("010", "octal"),
        ("[1]", "list"),
        *((text, "number") for text in ("1_000", "12:30", "0x10", ".inf", "ten")),
    ],
)
def test_only_plain_decimal_numbers_are_numbers(text, part):
    table, problems = reader(f"n: {text}\n")
    assert table.number("n", 7.0) == 7.0
    assert part in problems[0].text


def test_numbers_have_ranges_and_whole_numbers_are_whole():
    table, problems = reader("a: 5\nb: -1\nc: 2.5\nd: 0\n")
    assert table.integer("a", 0, low=1, high=9) == 5
    assert table.number("b", 3.0, low=0.0) == 3.0
    assert table.integer("c", 4) == 4
    assert table.number("d", 3.0) == 0.0
    assert [p.line for p in problems] == [2, 3]


@pytest.mark.parametrize(
    ("text", "value"), [("true", True), ("False", False), ("on", None), ("1", None), ("'yes'", None)]
)
def test_a_switch_is_true_or_false_and_nothing_else(text, value):
    table, problems = reader(f"s: {text}\n")
    assert table.flag("s", False) is (value or False)
    assert bool(problems) == (value is None)


def test_keys_that_nobody_asked_for_are_errors_with_the_nearest_known_one():
    table, problems = reader("counts: 3\nzzz: 1\n")
    table.integer("count", 0)
    table.done()
    assert "did you mean 'count'" in problems[0].text
    assert problems[1].text.endswith("known are count")


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("a: [1, 2\n", "not YAML"),
        ("a: b: c\n", "not YAML"),
        ("\tx: 1\n", "not YAML"),
        ("? [1, 2]\n: 3\n", "a key must be a word"),
        ("base: &b {x: 1}\nother:\n  <<: *b\n", "'<<'"),
        ("", "empty"),
        ("# nothing\n", "empty"),
        ("[" * (MAX_DEPTH + 5) + "]" * (MAX_DEPTH + 5), "nested too deeply"),
        ("!!python/object/apply:os.system ['true']\n", None),
    ],
)
def test_what_cannot_be_read_is_one_problem(text, part):
    tree, problems = read(text)
    if part is None:  # a tag is only a tag: nothing is ever constructed from it
        assert isinstance(tree, Listing)
        return
    assert len(problems) == 1
    assert part in problems[0]


def test_aliases_that_multiply_without_end_are_refused():
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    tree, problems = read("\n".join(lines))
    assert tree is None
    assert "too many values" in problems[0]


@settings(max_examples=150, deadline=None)
@given(st.text(alphabet=st.sampled_from("ab:-[]{},&*!|>'\"#%@ \n\t0"), max_size=60))
def test_any_text_is_read_or_refused(text):
    tree, problems = read(text)
    assert isinstance(tree, Scalar | Listing | Table) or problems
