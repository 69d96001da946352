from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from ivp_helm.behavior_file import read_behavior_file
from ivp_helm.info_buffer import InfoBuffer
from ivp_helm.modes import ModeSet

HIERARCHY = """
set MODE = ACTIVE {
  DEPLOY = true
} INACTIVE
set MODE = A1 {
  MODE = ACTIVE
  GO1 = true
}
set MODE = A2 {
  MODE = ACTIVE
}
set MODE = A1X {
  MODE = ACTIVE:A1
  DEEP = true
}
set MODEX = Q1 {
  Q = 1
} Q2
"""


def modes_of(text: str) -> ModeSet:
    content = read_behavior_file(text)
    assert not content.problems
    return ModeSet(content.modes)


def evaluate(modes: ModeSet, **values) -> dict[str, str]:
    buffer = InfoBuffer()
    buffer.update(values)
    return modes.evaluate(buffer)


def test_the_first_child_that_matches_wins():
    modes = modes_of(HIERARCHY)
    assert evaluate(modes, DEPLOY="true")["MODE"] == "ACTIVE:A2"
    assert evaluate(modes, DEPLOY="true", GO1="true")["MODE"] == "ACTIVE:A1"


def test_submodes_nest_in_one_pass():
    assert evaluate(modes_of(HIERARCHY), DEPLOY="true", GO1="true", DEEP="true")["MODE"] == "ACTIVE:A1:A1X"


def test_the_else_value_needs_only_the_parent_mode():
    modes = modes_of(
        "set MODE = ACTIVE {\n DEPLOY = true\n} INACTIVE\nset MODE = B {\n MODE = ACTIVE\n X = 1\n} C\n"
    )
    assert evaluate(modes, DEPLOY="false") == {"MODE": "INACTIVE"}
    assert evaluate(modes, DEPLOY="true") == {"MODE": "ACTIVE:C"}
    assert evaluate(modes, DEPLOY="true", X=1.0) == {"MODE": "ACTIVE:B"}


def test_without_else_value_the_old_value_stays_in_the_buffer_but_not_in_the_summary():
    modes = modes_of("set MODE = ON {\n GO = true\n}\n")
    buffer = InfoBuffer()
    buffer.set("GO", "true")
    modes.evaluate(buffer)
    assert modes.summary() == "MODE@ON"
    buffer.set("GO", "false")
    assert modes.evaluate(buffer) == {}
    assert buffer.value("MODE") == "ON"
    assert modes.summary() == "none"


def test_several_mode_variables_are_independent_and_the_summary_is_sorted():
    modes = modes_of(HIERARCHY)
    assert evaluate(modes, DEPLOY="true", Q=1.0) == {"MODE": "ACTIVE:A2", "MODEX": "Q1"}
    assert modes.summary() == "MODE@ACTIVE:A2#MODEX@Q1"


def test_the_description_is_the_one_that_stock_tools_parse():
    text = HIERARCHY.replace("  DEEP = true\n", "")
    assert (
        modes_of(text).describe()
        == "MODE#---,ACTIVE#---,INACTIVE#ACTIVE,A1#ACTIVE,A2#A1,A1X#MODEX#---,Q1#---,Q2"
    )


def test_a_mode_block_prints_as_it_was_read():
    content = read_behavior_file(HIERARCHY)
    again = read_behavior_file("\n".join(str(entry) for entry in content.modes))
    assert again.modes == content.modes
    assert not again.problems


WORDS = st.sampled_from(["A", "B", "C", "A:B", "A:C"])
ENTRY = st.tuples(
    st.sampled_from(["M", "N"]),
    st.sampled_from(["A", "B", "C"]),
    st.lists(st.tuples(st.sampled_from(["M", "N", "X", "Y"]), WORDS), max_size=3),
    st.sampled_from(["", "A", "D"]),
)


@given(st.lists(ENTRY, max_size=6), st.dictionaries(st.sampled_from(["M", "N", "X", "Y"]), WORDS))
def test_evaluation_agrees_with_the_rule_written_out_naively(entries, start):
    text = ""
    for variable, value, conditions, otherwise in entries:
        body = "".join(f"  {name} = {word}\n" for name, word in conditions)
        text += f"set {variable} = {value} {{\n{body}}} {otherwise}\n\n"
    modes = modes_of(text)
    buffer = InfoBuffer()
    buffer.update(start)
    found = modes.evaluate(buffer)

    world = dict(start)
    result = {}
    for variable, value, conditions, otherwise in entries:
        parents = [word for name, word in conditions if name == variable]
        if all(world.get(name) == word for name, word in conditions):
            chosen = value
        elif all(world.get(variable) == word for word in parents):
            chosen = otherwise
        else:
            chosen = ""
        if chosen:
            result[variable] = world[variable] = f"{parents[0]}:{chosen}" if parents else chosen
    assert found == result
    assert {name: buffer.value(name) for name in world} == world
