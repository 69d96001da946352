"""The `.moos` reader: every rule of community.md 1 that a mission author can notice."""

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.config.mission import MissionFile, print_mission
from pymoos_lite.config.moos_file import cut_comment, parse_mission
from pymoos_lite.config.problems import ConfigurationError


def lines_of(mission: MissionFile, app: str) -> list[tuple[str, str]]:
    block = mission.block(app)
    assert block is not None
    return [(line.key, line.value) for line in block.lines]


def block_of(body: str) -> MissionFile:
    return parse_mission("ProcessConfig = pApp\n{\n" + body + "\n}\n", "m.moos")


def test_a_mission_reads_into_globals_and_blocks_in_file_order():
    mission = parse_mission(
        "// a comment\nServerHost = localhost\n ServerPort=9001 // trailing\n\n"
        "ProcessConfig = pLogger\n\n{\n  File = LOG_%(VNAME)\n  Log = A @ 0 NOSYNC\n  Log = B @ 1\n}\n"
        "Community = abe\n",
        "abe.moos",
    )
    assert mission.problems == ()
    assert [(g.key, g.value, g.line) for g in mission.globals] == [
        ("ServerHost", "localhost", 2),
        ("ServerPort", "9001", 3),
        ("Community", "abe", 12),
    ]
    assert lines_of(mission, "pLogger") == [
        ("File", "LOG_%(VNAME)"),
        ("Log", "A @ 0 NOSYNC"),
        ("Log", "B @ 1"),
    ]
    block = mission.block("pLogger")
    assert block is not None
    assert [line.value for line in block.all("log")] == ["A @ 0 NOSYNC", "B @ 1"]
    assert block.all("Log")[1].line == 10


@pytest.mark.parametrize(
    ("line", "kept"),
    [
        ("a = b // c", "a = b "),
        ('a = "x // y" // z', 'a = "x // y" '),
        ('a = "http://h" + "b//c"', 'a = "http://h" + "b//c"'),
        ('a = 5" // inches', 'a = 5" '),
        ("//", ""),
        ('say = "a" "b//" // c', 'say = "a" "b//" '),
    ],
)
def test_a_comment_starts_at_two_slashes_outside_closed_quotes(line, kept):
    assert cut_comment(line) == kept


def test_the_value_is_everything_after_the_first_equals_sign_with_its_quotes_and_blanks():
    mission = block_of('event = var=FOO, val="hello  world", time=1')
    assert lines_of(mission, "pApp") == [("event", 'var=FOO, val="hello  world", time=1')]


def test_keys_app_names_and_the_word_processconfig_compare_in_any_case():
    mission = parse_mission("SERVERPORT = 9007\nprocessCONFIG =  pApp\n{\nAPPTICK = 4\n}\n")
    assert mission.integer("ServerPort") == 9007
    block = mission.block("PAPP")
    assert block is not None
    last = block.last("AppTick")
    assert last is not None
    assert last.value == "4"


def test_a_hash_is_no_comment():
    assert lines_of(block_of("# foo = bar"), "pApp") == [("# foo", "bar")]


def test_a_trailing_backslash_is_literal_and_lines_are_not_joined():
    assert lines_of(block_of("a = b \\\nc = d"), "pApp") == [("a", "b \\"), ("c", "d")]


def test_carriage_returns_and_a_byte_order_mark_disappear():
    mission = parse_mission("\ufeffCommunity = abe\r\nProcessConfig = pApp\r\n{\r\na = b\r\n}\r\n")
    assert mission.text("Community") == "abe"
    assert lines_of(mission, "pApp") == [("a", "b")]
    assert mission.problems == ()


def test_a_line_without_value_or_equals_sign_is_dropped_with_a_warning_unless_it_holds_a_bracket():
    mission = block_of("empty =\nno equals here\nlist = [\n[2x1]{1,2}\n= value")
    assert lines_of(mission, "pApp") == [("list", "["), ("[2x1]{1,2}", "")]
    assert [(p.where, p.severity) for p in mission.problems] == [
        ("m.moos:3", "warning"),
        ("m.moos:4", "warning"),
        ("m.moos:7", "warning"),
    ]


def test_lines_of_any_length_are_read():
    mission = block_of("points = " + "1," * 50_000 + "2")
    assert len(lines_of(mission, "pApp")[0][1]) == 100_001


@pytest.mark.parametrize(
    ("text", "where", "words"),
    [
        ("ProcessConfig = pA\n{\na = b\n\nProcessConfig = pB\n{\n}\n", "m.moos:1", "no closing '}'"),
        ("ProcessConfig = pA\n{\na = b\n", "m.moos:1", "no closing '}'"),
        ("ProcessConfig = pA {\na = b\n}\n", "m.moos:1", "line of its own"),
        ("ProcessConfig = pA\n{ a = b }\n", "m.moos:2", "line of their own"),
        ("ProcessConfig = pA\n{\n{\n}\n", "m.moos:3", "'{' inside the block of pA"),
        ("ProcessConfig = pA\na = b\n}\n", "m.moos:2", "expected '{'"),
        ("ProcessConfig =\n{\n}\n", "m.moos:1", "names no app"),
        ("define: NAME\n", "m.moos:1", "define: NAME = VALUE"),
        ("MOOSTimeWarp = 0\n", "m.moos:1", "above 0"),
        ("\nMOOSTimeWarp = 401\n", "m.moos:2", "at most 400"),
        ("ServerPort = 9000x\n", "m.moos:1", "whole number"),
        ("ServerPort = 65536\n", "m.moos:1", "65535"),
        ("LatOrigin = north\n", "m.moos:1", "a number"),
        ("TERM_REPORTING = maybe\n", "m.moos:1", "true or false"),
    ],
)
def test_a_mistake_is_one_error_with_file_and_line(text, where, words):
    (problem,) = parse_mission(text, "m.moos").errors
    assert problem.where == where
    assert words in problem.text


@pytest.mark.parametrize(
    ("text", "where", "words"),
    [
        ("Comunity = abe\n", "m.moos:1", "did you mean 'Community'"),
        ("}\n", "m.moos:1", "ignored"),
        ("{\n", "m.moos:1", "ignored"),
        ("ProcessConfig = pA\n{ a = b\n}\n", "m.moos:2", "text after '{'"),
        ("ProcessConfig = pA\n{\n} a = b\n", "m.moos:3", "text after '}'"),
        ("ProcessConfig = pA\n{\n}\nProcessConfig = pa\n{\n}\n", "m.moos:4", "second block"),
        ("ProcessConfig = pA\n{\nCommunity = abe\n}\n", "m.moos:3", "outside blocks"),
        ("Community = a\nCommunity = b\n", "m.moos:2", "line 1"),
        ("X = ${NOBODY_HAS_THIS}\n", "m.moos:1", "${NOBODY_HAS_THIS}"),
        ("#include plug.moos\n", "m.moos:1", "nsplug"),
    ],
)
def test_an_oddity_that_the_reference_swallows_is_one_warning(text, where, words):
    (problem,) = parse_mission(text, "m.moos").problems
    assert problem.severity == "warning"
    assert problem.where == where
    assert words in problem.text


def test_after_a_mistake_reading_goes_on_so_that_all_are_reported():
    mission = parse_mission("ServerPort = x\nProcessConfig = pA\n{\na = 1\nProcessConfig = pB\n{\nb = 2\n}\n")
    assert len(mission.errors) == 2
    assert lines_of(mission, "pA") == [("a", "1")]
    assert lines_of(mission, "pB") == [("b", "2")]


def test_a_block_parameter_never_shadows_a_global():
    mission = parse_mission("ProcessConfig = pA\n{\nCommunity = wrong\n}\nCommunity = right\n")
    assert mission.text("Community") == "right"
    assert mission.problems == ()


def test_globals_lose_blanks_and_the_first_pair_of_quotes():
    assert parse_mission('Community = "test comm"\n').text("community") == "testcomm"
    assert parse_mission("Server Port = 90 01\n").integer("ServerPort") == 9001


def test_the_first_global_and_the_first_block_count_and_the_last_scalar_of_a_block():
    mission = parse_mission("A = 1\nA = 2\nProcessConfig=p\n{\nx=1\nx=2\n}\nProcessConfig=p\n{\nx=3\n}\n")
    assert mission.text("A") == "1"
    block = mission.block("p")
    assert block is not None
    last = block.last("X")
    assert last is not None
    assert last.value == "2"


@pytest.mark.parametrize(
    ("text", "value"), [(".5", 0.5), ("+5", 5.0), ("-1e3", -1000.0), ("5.", 5.0), ('"7"', 7.0)]
)
def test_numbers_are_read_strictly_but_without_the_gaps_of_the_reference(text, value):
    assert parse_mission(f"N = {text}\n").number("N") == value


@pytest.mark.parametrize("text", ["1x", "e5", "1.2.3", "nan", "inf", "0x10", "-", "--1"])
def test_a_bad_number_is_refused_with_its_place(text):
    with pytest.raises(ConfigurationError, match=r"m\.moos:1: N = .*a number"):
        parse_mission(f"N = {text}\n", "m.moos").number("N")


@pytest.mark.parametrize(
    ("text", "value"),
    [("TRUE", True), ("on", True), ("Yes", True), ("1", True), ("off", False), ("0", False)],
)
def test_flags_know_the_words_of_both_worlds(text, value):
    assert parse_mission(f"F = {text}\n").flag("F") is value


def test_absent_globals_give_the_defaults_of_the_reference():
    mission = parse_mission("")
    assert (mission.time_warp(), mission.port(), mission.text("Community")) == (1.0, 9000, None)


def test_a_variable_is_replaced_everywhere_even_above_its_definition():
    mission = parse_mission(
        "A = ${NAME}_${HOME_PORT}\nProcessConfig = ${APP}\n{\nx = ${NAME}\n}\n"
        "define: NAME = a b // comment\ndefine:APP=pApp\n",
        environment={"HOME_PORT": "cape", "NAME": "hidden"},
    )
    assert mission.text("A") == "ab_cape"
    assert lines_of(mission, "pApp") == [("x", "ab")]
    assert mission.problems == ()


def test_variables_are_not_expanded_twice_and_other_macro_forms_stay():
    mission = parse_mission("define: A = ${B}\ndefine: B = b\nX = ${A} $(A) $[A] %(A)\n")
    assert mission.globals[0].value == "${B} $(A) $[A] %(A)"


def test_an_unresolved_variable_is_reported_once():
    mission = parse_mission("A = ${X}\nB = ${X}${X}\n")
    assert [p.where for p in mission.problems] == ["mission.moos:1"]
    assert mission.text("B") == "${X}${X}"


PLAIN = st.text(
    alphabet=string.ascii_letters + string.digits + "_-.:,@ #\"'{}[]$()%", min_size=1, max_size=20
)
KEYS = st.text(alphabet=string.ascii_letters + "_: ", min_size=1, max_size=12).map(str.strip).filter(bool)
NAMES = st.text(alphabet=string.ascii_letters + "_", min_size=1, max_size=8)


@given(
    st.lists(st.tuples(KEYS, PLAIN.map(str.strip).filter(bool)), max_size=4),
    st.lists(
        st.tuples(NAMES, st.lists(st.tuples(KEYS, PLAIN.map(str.strip).filter(bool)), max_size=4)), max_size=3
    ),
)
def test_what_is_printed_reads_back_the_same(globals_, blocks):
    rows = [f"{k} = {v}" for k, v in globals_]
    for app, lines in blocks:
        rows += [f"ProcessConfig = {app}", "{", *(f"{k} = {v}" for k, v in lines), "}"]
    first = parse_mission("\n".join(rows))
    second = parse_mission(print_mission(first))
    assert [(g.key, g.value) for g in second.globals] == [(g.key, g.value) for g in first.globals]
    assert [(b.app, [(e.key, e.value) for e in b.lines]) for b in second.blocks] == [
        (b.app, [(e.key, e.value) for e in b.lines]) for b in first.blocks
    ]
    assert [b.app for b in first.blocks] == [app for app, _ in blocks]


FRAGMENTS = st.sampled_from(
    [
        "ProcessConfig",
        "=",
        "{",
        "}",
        "\n",
        "\r",
        "//",
        '"',
        "define:",
        "${",
        "$",
        "A",
        " ",
        "\t",
        "[",
        "]",
        "\0",
        "é",
    ]
)


@given(st.one_of(st.text(max_size=200), st.lists(FRAGMENTS, max_size=80).map("".join)))
def test_no_text_makes_the_reader_raise_and_every_kept_line_has_its_place(text):
    mission = parse_mission(text, "f", {"A": "x\ny"})
    count = text.count("\n") + 1
    for line in (*mission.globals, *(e for b in mission.blocks for e in b.lines)):
        assert 1 <= line.line <= count
        assert "\n" not in line.key + line.value
    for problem in mission.problems:
        assert problem.where.startswith("f:")
        assert "\n" not in problem.text
