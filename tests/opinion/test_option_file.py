"""Option files: grammar, defaults, checks, and one clear error each."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opinion_engine.option_file import Condition, OptionFileError, parse_options, read_options

BLOCK = """social_option
{
  name = {name}
  option_output = OPTION={upper}
  social_mode = custom
  input = {upper}_INPUT
  input_function_type = none
{extra}}
"""


def block(name, extra=""):
    return BLOCK.replace("{name}", name).replace("{upper}", name.upper()).replace("{extra}", extra)


def parse(*texts):
    return parse_options([(text, f"f{i}.opt") for i, text in enumerate(texts)])


MISSION = """
social_option
{
               name = Explore
   active_condition = deploy=true
              input = explore_input
      option_output = option=EXPLORE   // a remark
        social_mode = custom
  resistance_weight = 0.25
   INTRA_agent_same_option_coupling = 0.05            // alpha
  intra_agent_inter_option_coupling = exploit = -0.01 // beta, one line per other option
   inter_agent_same_option_coupling = -0.05           // gamma
  inter_agent_inter_option_coupling = EXPLOIT = 0.01  // delta, one line per other option
   input_function_type = none: whatever
   input_max = 100
   input_min = -100
  input_gain = 1.0
}
""" + block("exploit", "  active_condition = always\n")


def test_a_mission_file_reads_as_written():
    options = parse(MISSION)
    assert options.names == ("explore", "exploit")
    explore, exploit = options.options
    assert explore.outputs == (("OPTION", "EXPLORE"),)
    assert explore.conditions == (Condition("DEPLOY", "true"),)
    assert explore.input_variable == "EXPLORE_INPUT"
    assert (explore.resistance, explore.alpha, explore.gamma) == (0.25, 0.05, -0.05)
    assert explore.beta == (("exploit", -0.01),)
    assert explore.delta == (("exploit", 0.01),)
    assert (exploit.resistance, exploit.alpha, exploit.gamma) == (10.0, 1.0, 0.0)
    assert (exploit.input_min, exploit.input_max, exploit.input_gain) == (0.0, 100.0, 1.0)
    assert exploit.conditions == ()
    assert options.warnings == ()
    couplings = options.couplings()
    assert couplings.own.tolist() == [[0.05, -0.01], [0.0, 1.0]]
    assert couplings.heard.tolist() == [[-0.05, 0.01], [0.0, 0.0]]


def test_the_reference_forces_alpha_and_drops_a_delta_without_beta():
    text = block(
        "a", "intra_agent_same_option_coupling=0.2\ninter_agent_inter_option_coupling=b=3\n"
    ) + block("b")
    options = parse(text)
    assert options.couplings().heard[0, 1] == 3.0
    assert options.reference_couplings().own[0, 0] == 1.0
    assert options.reference_couplings().heard[0, 1] == 0.0
    assert options.reference_couplings(alpha_as_configured=True).own[0, 0] == 0.2


def test_options_of_several_files_append_and_may_refer_to_each_other():
    text = block("a", "intra_agent_inter_option_coupling = b = -1\n")
    assert parse(text, block("b")).names == ("a", "b")


def test_inputs_map_from_the_configured_range():
    option = parse(block("a", "input_gain=40\ninput_min=-100\n")).options[0]
    assert [option.utility(raw) for raw in (99.5, -10, 400)] == pytest.approx([39.8, -4, 40], abs=1e-12)
    assert parse(block("a")).options[0].utility(0.0) == -1.0  # the default range is 0..100


FAULTS = [
    ("", 0, "no social_option block"),
    ("// only a comment\n", 0, "no social_option block"),
    ("{\n}", 1, "'{' without"),
    ("}", 1, "'}' without"),
    ("name = a", 1, "outside a social_option block"),
    ("social_options\n{\n}", 1, "did you mean 'social_option'"),
    ("social_option\nname = a", 2, "expected '{'"),
    ("social_option\n{\nname = a\nsocial_option\n", 4, "not closed before the next"),
    ("social_option\n{\nname = a\n", 1, "never closed"),
    ("social_option\n", 1, "never closed"),
    (block("a", "resistence_weight = 1\n"), 8, "did you mean 'resistance_weight'"),
    (block("a", "resistance_weight =\n"), 8, "has no value"),
    (block("a", "resistance_weight = /4\n"), 8, "has no value"),
    (block("a", "resistance_weight\n"), 8, "expected 'parameter = value'"),
    (block("a", "resistance_weight = heavy\n"), 8, "not a number"),
    (block("a", "resistance_weight = nan\n"), 8, "not a number"),
    (block("a", "resistance_weight = -1\n"), 8, "more than 0"),
    (block("a", "resistance_weight = 0\n"), 8, "more than 0"),
    (block("a", "input_gain = 0\n"), 8, "more than 0"),
    (block("a", "intra_agent_same_option_coupling = -1\n"), 8, "0 or more"),
    (block("a", "intra_agent_inter_option_coupling = -1\n"), 8, "expected 'other_option = number'"),
    (block("a", "intra_agent_inter_option_coupling = a = -1\n"), 8, "with itself"),
    (block("a", "intra_agent_inter_option_coupling = b = x\n"), 8, "not a number"),
    (block("alpha", "inter_agent_inter_option_coupling = alpa = 1\n"), 1, "did you mean 'alpha'"),
    (block("a", "input_max = -5\n"), 8, "not above input_min"),
    (block("a", "input_function_type = linear\n"), 8, "linear"),
    (block("a", "input_function_type = quadratc\n"), 8, "did you mean 'quadratic'"),
    (block("a", "social_mode = normal\n"), 8, "expected one of custom"),
    (block("a", "randomly_perturb_params = perhaps\n"), 8, "true or false"),
    (block("a", "option_output = OPTION\n"), 8, "VARIABLE=value"),
    (block("a", "active_condition = DEPLOY\n"), 8, "'always'"),
    (block("a", "name = two words\n"), 8, "one word"),
    (block("a") + block("A"), 9, "already defined"),
    ("social_option\n{\nname = a\n}\n", 1, "option 'a' has no option_output"),
    ("".join(block(f"o{i}") for i in range(65)), 513, "more than 64 options"),
]


@pytest.mark.parametrize(
    ("text", "line", "reason"), FAULTS, ids=[f"{i}-{f[2]}" for i, f in enumerate(FAULTS)]
)
def test_a_faulty_file_is_refused_with_its_line_and_reason(text, line, reason):
    with pytest.raises(OptionFileError) as caught:
        parse(text)
    message = str(caught.value)
    assert reason in message
    assert "\n" not in message
    assert message.startswith(f"f0.opt:{line}: " if line else "f0.opt: ")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(OptionFileError, match=re.escape("nowhere.opt: cannot open")):
        read_options([tmp_path / "nowhere.opt"])


def test_files_are_read_from_disk(tmp_path):
    path = tmp_path / "fleet.opt"
    path.write_text(MISSION)
    assert read_options([path]) == parse_options([(MISSION, str(path))])


@pytest.mark.parametrize(
    ("mode", "lines", "broken"),
    [
        ("cooperative", "inter_agent_same_option_coupling = 1\n", False),
        ("cooperative", "inter_agent_same_option_coupling = -1\n", True),
        ("competitive", "inter_agent_same_option_coupling = -1\n", False),
        ("competitive", "inter_agent_same_option_coupling = 1\n", True),
        ("oblivious", "", False),
        ("oblivious", "inter_agent_same_option_coupling = 1\n", True),
        ("custom", "inter_agent_same_option_coupling = 1\n", False),
    ],
)
def test_social_mode_asserts_something_about_the_couplings(mode, lines, broken):
    options = parse(block("a", lines).replace("social_mode = custom", f"social_mode = {mode}"))
    assert bool(options.warnings) == broken
    assert all(w.severity == "warning" and mode in w.text for w in options.warnings)


def test_a_scalar_given_twice_takes_the_last_and_warns():
    options = parse(block("a", "resistance_weight = 1\nresistance_weight = 2\n"))
    assert options.options[0].resistance == 2.0
    assert "line 8" in str(options.warnings[0])


def test_conditions_compare_strings_exactly_and_booleans_in_any_case():
    assert Condition("X", "true").holds("TRUE")
    assert not Condition("X", "true").holds(None)
    assert Condition("X", "Abc").holds("Abc")
    assert not Condition("X", "Abc").holds("abc")


def test_perturbation_touches_only_the_options_that_ask_and_repeats_from_its_seed():
    extra = "intra_agent_inter_option_coupling = b = -1\ninter_agent_same_option_coupling = 0.5\n"
    options = parse(
        block("a", extra + "randomly_perturb_params = true\n") + block("b", extra.replace("= b", "= a"))
    )
    shaken = options.perturbed("7:abe")
    assert shaken == options.perturbed("7:abe")
    assert shaken != options.perturbed("7:ben")
    assert shaken.options[1] == options.options[1]
    first = shaken.options[0]
    assert first.alpha != 1.0
    assert first.gamma != 0.5
    assert dict(first.beta)["b"] != -1.0
    assert abs(first.alpha - 1.0) < 0.6


@settings(deadline=None)
@given(st.text(alphabet="social_option{}=/ \nname=abc01.-", max_size=200))
def test_no_text_crashes_the_reader(text):
    fault = ""
    try:
        parse(text)
    except OptionFileError as error:
        fault = str(error)
    assert "\n" not in fault
