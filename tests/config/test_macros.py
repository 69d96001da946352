"""The template expander against the rules of nsplug (community.md 2)."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoos_lite.config.macros import Expansion, Macros, expand, parse_macro_lines, substitute


def run(text: str, macros: Macros | None = None, files: dict[str, str] | None = None, **options) -> Expansion:
    folder = files or {}
    return expand(text, "in", macros or {}, lambda n: (n, folder[n]) if n in folder else None, **options)


def lines(
    text: str, macros: Macros | None = None, files: dict[str, str] | None = None, **options
) -> list[str]:
    result = run(text, macros, files, **options)
    assert result.errors == (), result.errors
    return result.text.removesuffix("\n").split("\n")


@pytest.mark.parametrize(
    ("text", "expanded"),
    [
        ("$(V)", "abe"),
        ("%(V)", "ABE"),
        ("LOG_%(V)/$(V).alog", "LOG_ABE/abe.alog"),
        ("$(V=x)", "abe"),
        ("$(NONE=x)", "x"),
        ("%(NONE=x)", "X"),
        ("$(EMPTY=x)", ""),
        ("$(EMPTY:=x)", "x"),
        ("$(NONE:=x=y)", "x=y"),
        ("$(BARE)|$(BARE=x)|$(BARE:=x)", "||x"),
        ("$(NONE=$(V))", "abe"),
        ("$(V=$(NONE))", "abe"),
        ("$(NONE=f(x))", "f(x)"),
        ("$(POINTER)", "abe"),
        ("$($(NAME))", "abe"),
        ("${V} $[V] $() $(a b) $(V", "${V} $[V] $() $(a b) $(V"),
        ("a $ b % c ( d )", "a $ b % c ( d )"),
    ],
)
def test_macros_are_replaced(text, expanded):
    macros: Macros = {"V": "abe", "EMPTY": "", "BARE": None, "POINTER": "$(V)", "NAME": "V"}
    assert lines(text, macros) == [expanded]


def test_macro_names_are_case_sensitive():
    assert substitute("$(v)", {"V": "abe"}) == ("$(v)", ("$(v)",))


def test_a_line_with_an_undefined_macro_stays_whole_with_a_warning():
    result = run("a $(A) $(B)\n", {"A": "1"})
    assert result.text == "a $(A) $(B)\n\n"
    (problem,) = result.problems
    assert (problem.where, problem.severity) == ("in:1", "warning")
    assert "$(B)" in problem.text
    assert result.undefined == (problem,)


def test_lenient_expands_what_it_can():
    result = run("a $(A) $(B)", {"A": "1"}, lenient=True)
    assert result.text == "a 1 $(B)\n"
    assert len(result.undefined) == 1


def test_strict_makes_an_undefined_macro_an_error_but_not_in_a_comment():
    assert len(run("x\n $(B)", strict=True).errors) == 1
    assert run("  // $(B)", strict=True).problems == ()
    assert run("// $(A) $(B)", {"A": "1"}).text == "// $(A) $(B)\n"
    assert run("// $(A) $(B)", {"A": "1"}, lenient=True).text == "// 1 $(B)\n"


def test_a_definition_that_never_ends_counts_as_undefined():
    result = run("$(A)", {"A": "$(B)", "B": "$(A)"})
    assert result.text == "$(A)\n"
    assert "never ends" in result.problems[0].text


def test_definitions_that_double_at_every_step_are_bounded():
    macros: Macros = {f"M{i}": f"$(M{i + 1})$(M{i + 1})" for i in range(60)}
    result = run("$(M0)", macros)
    assert len(result.text) < 100
    assert len(result.undefined) == 1


def test_define_collapses_blanks_and_accepts_the_dollar_form():
    result = run("\t#define A one   two\n#define $(B) 3\n#define C\n$(A)|$(B)|$(C)|")
    assert result.text == "one two|3||\n"
    assert result.macros == {"A": "one two", "B": "3", "C": None}


def test_a_defined_value_is_expanded_when_used_not_when_defined():
    assert lines("#define A $(B)\n#define B 1\n$(A)\n#define B 2\n$(A)") == ["1", "2"]


def test_a_redefinition_warns_and_wins_also_over_the_command_line():
    result = run("#define A 2\n$(A)", {"A": "1"})
    assert result.text == "2\n"
    assert [p.where for p in result.problems] == ["in:1"]


@pytest.mark.parametrize(
    ("condition", "true"),
    [
        ("#ifdef A", True),
        ("#ifdef NONE", False),
        ("#ifdef EMPTY", False),
        ("#ifdef BARE", True),
        ("#ifdef A 1", True),
        ("#ifdef A 2", False),
        ("#ifdef A ALSO", True),
        ("#ifdef A B", False),
        ("#ifdef TEXT two words", True),
        ("#ifdef TEXT  two   words", True),
        ("#ifdef NONE || B 2", True),
        ("#ifdef NONE || B 3", False),
        ("#ifdef A && B", True),
        ("#ifdef A 1 && B 2", True),
        ("#ifdef A && B 3", False),
        ("#ifdef EMPTY && A", True),
        ("#ifdef EMPTY || NONE", False),
        ("#ifdef NONE foo && A", False),
        ("#ifdef A $(A)", True),
        ("#ifdef $(POINTER) 1", True),
        ("#ifndef NONE", True),
        ("#ifndef NONE OTHER", True),
        ("#ifndef A", False),
        ("#ifndef NONE A", False),
        ("#ifndef EMPTY", True),
        ("#ifndef BARE", False),
        ("#ifndef", False),
        ("  \t#ifdef\tA", True),
    ],
)
def test_conditions(condition, true):
    macros: Macros = {
        "A": "1",
        "B": "2",
        "ALSO": "1",
        "EMPTY": "",
        "BARE": None,
        "TEXT": "two words",
        "POINTER": "A",
    }
    assert lines(f"{condition}\nyes\n#else\nno\n#endif", macros) == ["yes" if true else "no"]


def test_the_first_true_branch_wins():
    text = "#ifdef M 1\none\n#elseifdef M 2\ntwo\n#elseifdef M\nany\n#else\nnone\n#endif"
    assert lines(text, {"M": "1"}) == ["one"]
    assert lines(text, {"M": "2"}) == ["two"]
    assert lines(text, {"M": "3"}) == ["any"]
    assert lines(text) == ["none"]


def test_conditions_nest_and_a_false_branch_does_nothing():
    text = (
        "#ifdef NONE\n#define X 1\n#include missing\n$(UNDEFINED)\n#ifdef A\nin\n#else\nalso in\n#endif\n"
        "#else\nout\n#ifndef X\nno X\n#endif\n#endif"
    )
    result = run(text, {"A": "1"}, strict=True)
    assert result.problems == ()
    assert result.text == "out\nno X\n"


@pytest.mark.parametrize(
    ("text", "where", "words"),
    [
        ("a\n#else", "in:2", "dangling #else"),
        ("#endif", "in:1", "dangling #endif"),
        ("#elseifdef A", "in:1", "dangling #elseifdef"),
        ("#ifndef A\n#elseifdef B\n#endif", "in:2", "dangling #elseifdef"),
        ("#ifdef A\n#else\n#else\n#endif", "in:3", "dangling #else"),
        ("#ifdef A\n#else\n#elseifdef B\n#endif", "in:3", "dangling #elseifdef"),
        ("x\n#ifdef A\ny", "in:2", "no #endif"),
        ("#define", "in:1", "#define NAME"),
        ("#include nowhere.moos", "in:1", "nowhere.moos"),
        ("#include", "in:1", "FILE"),
        ("#include self", "self:1", "includes itself"),
        ("#include open", "open:1", "no #endif"),
    ],
)
def test_a_mistake_is_one_error_with_file_and_line(text, where, words):
    files = {"self": "#include self", "open": "#ifdef A\nx"}
    (problem,) = run(text, files=files).errors
    assert problem.where == where
    assert words in problem.text


def test_mixing_or_and_and_is_false_with_a_warning_and_an_error_under_strict():
    text = "#ifdef A || A && A\nyes\n#endif\nend"
    result = run(text, {"A": "1"})
    assert result.text == "end\n"
    assert len(result.problems) == 1
    assert len(run(text, {"A": "1"}, strict=True).errors) == 1


def test_an_include_is_expanded_in_place_and_its_definitions_leak_out():
    files = {"plug": "in $(A)\n#define B 2\n"}
    assert lines("before\n#include $(NAME)\nafter $(B)", {"A": "1", "NAME": "plug"}, files) == [
        "before",
        "in 1",
        "after 2",
    ]


@pytest.mark.parametrize("form", ["<tag><two>", "<tag> two", "<tag> <two>", "  <tag>\t<two>"])
def test_a_tagged_include_takes_only_its_part(form):
    files = {"plugs": f"zero\n<tag><one>\n1\n{form}\n2\n#ifdef A\n$(A)\n#else\nnot\n#endif\n<tag> three\n3\n"}
    assert lines("#include plugs <two>", {"A": "a"}, files) == ["2", "a"]
    assert lines('#include "plugs" <one>', {"A": "a"}, files) == ["1"]
    assert lines("#include plugs", {"A": "a"}, files) == ["zero", "1", "2", "a", "3"]


def test_one_part_of_a_file_may_include_another_part():
    files = {"plugs": "<tag> a\n#include plugs <b>\n<tag> b\nb\n"}
    assert lines("#include plugs <a>", files=files) == ["b"]


def test_an_unknown_tag_gives_nothing_and_a_warning():
    result = run("#include plugs <x>", files={"plugs": "<tag> y\n1"})
    assert result.text == ""
    assert [p.severity for p in result.problems] == ["warning"]


def test_the_top_file_can_be_restricted_to_a_tag():
    assert lines("a\n<tag> x\nb\n<tag> y\nc", tag="y") == ["c"]


def test_other_lines_that_start_with_a_hash_are_ordinary_text():
    assert lines("# note\n#pragma x") == ["# note", "#pragma x"]


def test_includes_that_multiply_are_bounded():
    files = {f"f{i}": f"#include f{i + 1}\n#include f{i + 1}\n" for i in range(30)}
    files["f30"] = "x" * 1_000_000
    result = run("#include f0", files=files)
    assert any("grows beyond" in p.text for p in result.errors)


def test_includes_that_never_end_are_bounded_even_without_a_loop():
    result = expand("#include 0", "in", {}, lambda n: (n, f"#include {int(n) + 1}"))
    assert any("nested more than" in p.text for p in result.errors)


def test_an_empty_input_is_a_warning():
    result = run("")
    assert (result.text, result.errors, len(result.problems)) == ("", (), 1)


def test_macro_files_use_what_is_known_so_far():
    macros, problems = parse_macro_lines('# c\n// c\n\nA=1\nB = "x $(A)$(Z)"\nbad line\n', "f", {"Z": "9"})
    assert macros == {"Z": "9", "A": "1", "B": "x 19"}
    assert [str(p) for p in problems] == ["f:6: error: expected NAME=VALUE, found: bad line"]


PIECES = st.sampled_from(
    ["$(", "%(", ")", "A", "B", "=", ":=", "#ifdef ", "#ifndef ", "#else", "#elseifdef ", "#endif",
     "#define ", "#include ", "inc", "<tag>", "<", ">", "||", "&&", "\n", "\n", " ", '"', "//"]
)  # fmt: skip
TEXTS = st.lists(PIECES, max_size=40).map("".join)


@settings(max_examples=300)
@given(
    TEXTS,
    TEXTS,
    st.dictionaries(st.sampled_from("AB"), st.one_of(st.none(), TEXTS)),
    st.booleans(),
    st.booleans(),
)
def test_no_text_makes_the_expander_raise_or_hang(text, included, macros, strict, lenient):
    result = run(text, macros, {"inc": included}, strict=strict, lenient=lenient)
    for problem in result.problems:
        assert problem.where.startswith(("in", "inc"))
    if (
        not strict
        and not result.problems
        and "#" not in text + included
        and "(" not in text
        and "<tag>" not in text
    ):
        assert result.text == (text + "\n" if text else "")


@given(
    st.lists(st.sampled_from(["a", "$(A)", "%(B)", "$(C=d)", "$(A:=x)", " "]), max_size=10),
    st.text(alphabet="xyz-_.", max_size=4),
    st.text(alphabet="xyz-_.", max_size=4),
)
def test_expansion_is_replacement_piece_by_piece(pieces, a, b):
    replaced = {"$(A)": a, "%(B)": b.upper(), "$(C=d)": "d", "$(A:=x)": a or "x"}
    expected = "".join(replaced.get(p, p) for p in pieces)
    assert substitute("".join(pieces), {"A": a, "B": b}) == (expected, ())


@given(TEXTS, st.dictionaries(st.sampled_from("AB"), st.text(alphabet="xyz ", max_size=5)))
def test_expanded_text_without_problems_has_no_known_macro_left(text, macros):
    result = run(text, macros, {"inc": "x"})
    if not result.problems:
        assert "$(A)" not in result.text or "A" not in macros
