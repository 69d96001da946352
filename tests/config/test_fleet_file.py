"""fleet.yaml: shoreside, vehicles, start poses, macros, and everything that can be wrong with it."""

from itertools import combinations
from math import hypot

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoos_lite.config.fleet_file import DEFAULT_COMMANDS, parse_fleet
from pymoos_lite.config.start_poses import Area, NoRoom, Pose, draw_poses

WHOLE = """\
fleet: berta
warp: 4
seed: 11
datum: {lat: 43.8253, lon: -70.3304}
macros: {COMMS_RANGE: 500, LABEL: 007}
deploy_after: 12
network: {latency: 0.1, loss: 0.05}
ports: {database: 9500}
shoreside:
  name: base
  moos: meta_shoreside.moos
  macros: {ROLE: shore, COMMS_RANGE: 300}
vehicles:
  count: 3
  moos: meta_vehicle.moos
  bhv: meta_vehicle.bhv
  colors: [red, blue]
  start: {area: {x: [0, 100], y: [-100, 0]}, separation: 20, heading: [0, 90]}
  macros: {SPEED: 1.4, LOITER_X: [10, 20, 30]}
  each:
    - {name: zed, color: pink, start: {x: 1, y: -2, heading: 180}, macros: {SPEED: 2}}
    - name: mia
      bhv: special.bhv
commands:
  deploy: {DEPLOY: true, MOOS_MANUAL_OVERRIDE: false}
  cheer: {SAY: hello, LEVEL: 3, CODE: '3'}
"""
SMALL = "vehicles: {count: 2, moos: m.moos, start: {area: {x: [0, 9], y: [0, 9]}, separation: 2}}\n"


def problems_of(text):
    return [str(p) for p in parse_fleet(text, "f.yaml").problems]


def test_everything_in_a_fleet_file_arrives():
    fleet = parse_fleet(WHOLE, "f.yaml")
    assert fleet.problems == ()
    assert (fleet.name, fleet.warp, fleet.seed, fleet.datum) == ("berta", 4.0, 11, (43.8253, -70.3304))
    assert (fleet.network.latency, fleet.network.loss, fleet.network.jitter) == (0.1, 0.05, None)
    assert (fleet.database_port, fleet.share_port, fleet.deploy_after) == (9500, None, 12.0)
    assert fleet.shoreside.name == "base"
    assert fleet.shoreside.macros == {"COMMS_RANGE": "300", "LABEL": "007", "ROLE": "shore"}
    zed, mia, third = fleet.vehicles
    assert (zed.name, zed.color, zed.start) == ("zed", "pink", Pose(1.0, -2.0, 180.0))
    assert zed.macros == {"COMMS_RANGE": "500", "LABEL": "007", "SPEED": "2", "LOITER_X": "10"}
    assert (mia.name, mia.bhv, mia.moos, mia.color) == ("mia", "special.bhv", "meta_vehicle.moos", "blue")
    assert mia.macros["LOITER_X"] == "20"
    assert (third.name, third.color, third.macros["SPEED"], third.bhv) == (
        "abe",
        "red",
        "1.4",
        "meta_vehicle.bhv",
    )
    assert fleet.commands["deploy"] == {"DEPLOY": "true", "MOOS_MANUAL_OVERRIDE": "false"}
    assert fleet.commands["cheer"] == {"SAY": "hello", "LEVEL": 3.0, "CODE": "3"}
    assert fleet.commands["return"] == DEFAULT_COMMANDS["return"]


def test_a_plain_list_of_vehicles_will_do():
    entry = "  - {name: %s, moos: %s.moos, start: {x: %d, y: 0}}\n"
    text = "vehicles:\n" + entry % ("abe", "a", 0) + entry % ("ben", "b", 9)
    fleet = parse_fleet(text, "f.yaml")
    assert fleet.problems == ()
    assert [v.moos for v in fleet.vehicles] == ["a.moos", "b.moos"]
    assert fleet.shoreside is None


@pytest.mark.parametrize("count", [1, 2, 5, 30])
def test_the_number_of_vehicles_can_be_asked_for(count):
    text = "vehicles: {count: 2, moos: m.moos, start: {area: {x: [0, 900], y: [0, 900]}}}\n"
    fleet = parse_fleet(text, "f.yaml", vehicles=count)
    assert fleet.problems == ()
    names = fleet.vehicle_names()
    assert len(set(names)) == len(names) == count
    assert names[:2] == ["abe", "ben"][:count]
    longer = parse_fleet(text, "f.yaml", vehicles=count + 3)
    assert longer.vehicles[:count] == fleet.vehicles


def test_the_seed_decides_where_vehicles_start():
    one, same, other = (parse_fleet(SMALL, "f.yaml", seed=seed) for seed in (1, 1, 2))
    starts = [[v.start for v in fleet.vehicles] for fleet in (one, same, other)]
    assert starts[0] == starts[1] != starts[2]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("vehicles: {count: 2, moos: m, start: {x: 1}, count: 3}\n", "1: error: 'count' was already given"),
        (SMALL + "warp: on\n", "2: error: warp: expected a number, found 'on'"),
        (SMALL + "warp: 0\n", "2: error: warp: must be above 0"),
        (SMALL + "warp: 500\n", "out of range: give at least 0 and at most 400"),
        (SMALL + "sead: 3\n", "2: error: a fleet file has no 'sead'; did you mean 'seed'?"),
        (SMALL + "datum: {lat: 43}\n", "2: error: datum: lon is missing"),
        (SMALL + "network: {loss: 2}\n", "2: error: loss: 2 is out of range"),
        (SMALL + "ports: {database: 0}\n", "2: error: database: 0 is out of range"),
        (SMALL + "macros: {A: yes}\n", "2: error: macro A: put 'yes' in quotes"),
        (SMALL + "macros: {9A: 1}\n", "2: error: macro '9A'"),
        (SMALL + "shoreside: {name: no, moos: m}\n", "2: error: name: 'no' means true or false in YAML"),
        (SMALL + "shoreside: {name: base}\n", "2: error: shoreside: moos is missing"),
        (SMALL + "shoreside: {name: ABE, moos: m}\n", "two communities are named 'abe'"),
        (SMALL + "commands: {go: {DEPLOY: on}}\n", "2: error: DEPLOY: write true or false, or put 'on' in quotes"),
        ("vehicles: {count: 2}\n", "1: error: vehicle abe: moos is missing"),
        ("vehicles: {count: 2, moos: m}\n", "1: error: start: where do the vehicles start?"),
        ("vehicles: {moos: m}\n", "1: error: vehicles: there is none"),
        ("warp: 2\n", "error: vehicles: there is none"),
        ("vehicles: {count: 2, moos: m, start: {area: {x: [5, 5], y: [0, 9]}}}\n", "area: expected x: [LOW, HIGH]"),
        (SMALL.replace("count: 2", "count: 99"), "no room for 99 vessels"),
        (SMALL.replace("moos: m.moos", "moos: m, macros: {A: [1]}"), "macro A: 1 values for 2 vehicles"),
        (SMALL.replace("moos: m.moos", "moos: m, each: [{}, {}, {}]"), "1: error: count: 2, but 3 vehicles are listed"),
        ("vehicles: [{name: 'two words', moos: m, start: {x: 0, y: 0}}]\n", "is no name for a community"),
        ("vehicles: [{name: a, moos: m, start: {x: 0}}]\n", "start: y is missing"),
        ("vehicles: 7\n", "vehicles: expected 'name: value' lines"),
        ("- 1\n", "a fleet file: expected 'name: value' lines"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_line(text, expected):
    assert any(expected in problem for problem in problems_of(text)), problems_of(text)
    assert all(problem.startswith("f.yaml") for problem in problems_of(text))


@settings(max_examples=100, deadline=None)
@given(st.text(alphabet=st.sampled_from("vehicls:-[]{}, \n0123starounmf"), max_size=120))
def test_any_text_is_a_fleet_or_has_problems(text):
    fleet = parse_fleet(text, "f.yaml")
    assert fleet.vehicles or fleet.problems


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 12), st.integers(0, 10_000), st.floats(0, 60))
def test_drawn_poses_keep_their_distance_and_their_area(count, seed, separation):
    import random

    area = Area(((0.0, 0.0), (300.0, 0.0), (150.0, 300.0)))
    taken = [Pose(150.0, 100.0)]
    try:
        poses = draw_poses(count, area, separation, (0.0, 359.0), 1.0, taken, random.Random(seed))
    except NoRoom:
        assert count * separation**2 > 10_000  # a fair share of the area
        return
    assert len(poses) == count
    for a, b in combinations([*taken, *poses], 2):
        assert hypot(a.x - b.x, a.y - b.y) >= separation
    for pose in poses:
        assert area.contains(pose.x, pose.y)
        assert 0.0 <= pose.heading < 360.0


def test_the_start_area_grows_with_fleets_larger_than_it_has_room_for():
    start = "start: {area: [[0, 0], [90, 0], [0, 90]], separation: 9, room_for: 4}"
    text = f"vehicles: {{count: 2, moos: m.moos, {start}}}\n"
    small, full, large = (parse_fleet(text, "f.yaml", vehicles=count) for count in (2, 4, 64))
    for fleet in (small, full, large):
        assert fleet.problems == ()
        starts = [(v.start.x, v.start.y) for v in fleet.vehicles]
        assert all(hypot(a[0] - b[0], a[1] - b[1]) >= 9.0 for a, b in combinations(starts, 2))
    assert full.vehicles[:2] == small.vehicles
    # Sixteen times as many have four times the length, about the same middle.
    grown = Area(((0.0, 0.0), (90.0, 0.0), (0.0, 90.0))).grown(4.0)
    assert grown.corners == ((-135.0, -135.0), (225.0, -135.0), (-135.0, 225.0))
    assert all(grown.contains(v.start.x, v.start.y) for v in large.vehicles)
    assert max(v.start.x for v in large.vehicles) > 90.0
    crowded = parse_fleet(text.replace(", room_for: 4", ""), "f.yaml", vehicles=64)
    assert any("no room for 64 vessels" in p.text for p in crowded.problems)


def test_a_pose_reads_as_the_simulator_wants_it():
    assert Pose(10.5, -20.0, 180.0, 0.5).to_text() == "x=10.5,y=-20,heading=180,speed=0.5"
