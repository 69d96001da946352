"""Presets of fleet files: laid over the file, in order, with every problem told."""

import pytest

from pymoos_lite.config.fleet_file import parse_fleet

TEXT = """
fleet: test
seed: 1
macros: {RANGE: 100, COLOR: red}
vehicles:
  count: 2
  moos: v.moos
  start: {area: {x: [0, 100], y: [0, 100]}, separation: 5}
presets:
  far: {macros: {RANGE: 900}}
  many:
    vehicles: {count: 4, names: [tic, tac]}
  both: {seed: 7, macros: {RANGE: 5}}
"""


def fleet(*presets, **more):
    return parse_fleet(TEXT, "f.yaml", presets=presets, **more)


def test_without_a_preset_the_file_is_as_it_stands():
    assert fleet().problems == ()
    assert [v.macros["RANGE"] for v in fleet().vehicles] == ["100", "100"]


def test_a_preset_replaces_what_it_names_and_leaves_the_rest():
    found = fleet("far")
    assert found.vehicles[0].macros == {"RANGE": "900", "COLOR": "red"}
    found = fleet("many")
    assert found.vehicle_names() == ["tic", "tac", "abe", "ben"]
    assert found.vehicles[0].moos == "v.moos"


def test_the_later_preset_wins():
    assert fleet("far", "both").vehicles[0].macros["RANGE"] == "5"
    assert fleet("both", "far").vehicles[0].macros["RANGE"] == "900"
    assert fleet("both", "far").seed == 7


def test_macros_from_outside_win_over_all():
    found = fleet("far", macros={"RANGE": "1", "NEW": "x"})
    assert found.vehicles[1].macros == {"RANGE": "1", "COLOR": "red", "NEW": "x"}


def test_an_unknown_preset_is_an_error_with_the_nearest_name():
    (problem,) = fleet("fat").problems
    assert "there is no preset 'fat'" in str(problem)
    assert "far" in str(problem)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("  far: {macros: {RANGE: 900}}", "  far: 3", "preset far: expected"),
        ("  far: {macros: {RANGE: 900}}", "  far: {colour: red}", "has no 'colour'"),
    ],
)
def test_a_faulty_preset_is_told_with_its_line(old, new, complaint):
    (problem,) = parse_fleet(TEXT.replace(old, new), "f.yaml", presets=["far"]).problems
    assert complaint in str(problem)
    assert problem.line == 10


def test_presets_that_are_no_table_are_an_error():
    text = TEXT[: TEXT.index("presets:")] + "presets: [a, b]\n"
    assert any("expected a table of presets" in str(p) for p in parse_fleet(text, "f.yaml").problems)
