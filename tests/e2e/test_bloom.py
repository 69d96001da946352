"""The bloom mission: the field experiment's storyline on a shortened run, and that it runs as people type it.

Blooms are full-sized at once and come quickly, the storm is fast, deb is silent early: everything that two
hours hold happens within fifteen minutes.
"""

import itertools
import re
import subprocess
import sys
from math import hypot
from statistics import fmean

import pytest

from missions.bloom.zones import XRAY, YANKEE
from pymoos_lite.geometry.specs import parse_polygon
from pymoos_lite.hosts.fleet import add_fleet, deploy_in_lockstep, find_fleet, load_fleet, plan_fleet
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.tools.cli import main
from pymoos_lite.tools.mission import deeper_problems

ZONES = [parse_polygon(zone) for zone in (XRAY, YANKEE)]
GROWN = [zone.grown_by_factor(0.05) for zone in ZONES]
OUTAGE = (640, 760)
DURATION = 900
MACROS = {
    "BLOOM_GROWTH": "fixed",
    "STORM_TRACK": "storm_track = time=160, x=-114.9, y=-300.1, course=154",
    "LOGGING": "off",
    "VIEWS": "false",
}
SETTINGS = {
    "uFldBloomStormSim.storm_speed": "3",
    "uFldBloomStormSim.time_between_bloom_attempts": "20",
    "pBloomStormCtrl.time_since_last_migration_thresh": "150",
}
WATCHED = (
    "NAV_X", "NAV_Y", "OPTION", "MODE", "OWN_ATTENTION", "CONTACTS_LIST", "STORM_DETECTED", "DEPLOY",
    "NUMBER_OF_SAMPLED_BLOOMS", "EXPLORE_LIST", "EXPLOIT_LIST", "MIGRATE_LIST", "OPINION_BYTES",
)  # fmt: skip


def load(out, vehicles=None, settings=None, **macros):
    path = find_fleet("bloom")
    fleet = load_fleet(path, vehicles, 1, ["field"], {**MACROS, **macros})
    plan = plan_fleet(fleet, path.resolve().parent, out, warp=1.0, settings=settings or SETTINGS)
    assert plan.problems == ()
    return plan


class Story:
    """What was seen, once a second, of every vessel and of the shoreside."""

    def __init__(self, out, duration, **macros):
        plan = load(out, **macros)
        self.host = Lockstep(1, None, stagger=True)
        add_fleet(self.host, plan)
        deploy_in_lockstep(self.host, plan)
        self.names = plan.fleet.vehicle_names()
        self.seen = {name: [] for name in self.names}
        self.reported = []
        for _second in range(duration):
            self.host.run(1.0)
            for name in self.names:
                database = self.host.communities[name].database
                self.seen[name].append({variable: database.value(variable) for variable in WATCHED})
        self.shore = self.host.communities["shoreside"].database
        assert self.host.failures == []

    def series(self, name, variable):
        return [entry[variable] for entry in self.seen[name]]

    def migrated_at(self, name):
        """The second in which a vessel first chose to migrate."""
        return self.series(name, "OPTION").index("MIGRATE")

    def places(self, second):
        return {n: (self.seen[n][second]["NAV_X"], self.seen[n][second]["NAV_Y"]) for n in self.names}


@pytest.fixture(scope="module")
def story(tmp_path_factory):
    return Story(
        tmp_path_factory.mktemp("bloom"),
        DURATION,
        OUTAGE_BEGIN=f"{OUTAGE[0]}",
        OUTAGE_END=f"{OUTAGE[1]}",
        REDEPLOY_AT=f"{OUTAGE[1] + 30}",
    )


def others(story):
    return [name for name in story.names if name != "deb"]


@pytest.mark.slow
def test_all_eight_start_in_xray_and_begin_to_explore(story):
    assert len(story.names) == 8
    known = next(s for s in itertools.count() if all(None not in place for place in story.places(s).values()))
    assert known <= 2  # nobody has sailed anywhere yet
    assert all(ZONES[0].contains(*place) for place in story.places(known).values())
    assert {story.series(name, "OPTION")[40] for name in story.names} == {"EXPLORE"}


@pytest.mark.slow
def test_blooms_are_found_and_sampled(story):
    assert sum(int(story.series(name, "NUMBER_OF_SAMPLED_BLOOMS")[-1]) for name in story.names) >= 3
    counts = [int(story.shore.value(f"{what}_BLOOMS_COMPLETED")) for what in ("SAMPLED", "DETECTED")]
    assert counts[0] >= 1
    assert sum(counts) >= 3


@pytest.mark.slow
def test_coalitions_form_and_change_many_times(story):
    changes = 0
    for name in story.names:
        options = [option for option in story.series(name, "OPTION") if option]
        changes += sum(a != b and "MIGRATE" not in (a, b) for a, b in itertools.pairwise(options))
    assert changes >= 25
    before = [{story.series(name, "OPTION")[second] for name in story.names} for second in range(260, 380)]
    assert sum(options == {"EXPLORE", "EXPLOIT"} for options in before) > 60


@pytest.mark.slow
def test_abe_finds_the_storm_and_all_follow_within_a_minute_into_yankee(story):
    assert "true" in story.series("abe", "STORM_DETECTED")
    assert all("true" not in story.series(name, "STORM_DETECTED") for name in story.names if name != "abe")
    first = story.migrated_at("abe")
    assert all(first <= story.migrated_at(name) <= first + 60 for name in story.names)
    ends = story.places(DURATION - 1)
    assert all(GROWN[1].contains(*ends[name]) for name in others(story))


@pytest.mark.slow
def test_attention_is_high_during_and_after_migrations_only(story):
    # The reluctance to migrate right after the start is as strong an opinion as the wish to, until it has faded.
    start, first = 150, story.migrated_at("abe")
    for name in others(story):
        attention = story.series(name, "OWN_ATTENTION")
        assert max(attention[start + 10 : first]) < 0.7
        assert max(attention[first : first + 120]) > 1.8
        assert fmean(attention[first + 60 : first + 300]) > 1.8


@pytest.mark.slow
def test_while_deb_is_silent_the_seven_carry_on_without_it(story):
    begin, end = OUTAGE
    assert story.series("deb", "DEPLOY")[begin + 40] == "false"
    assert story.series("deb", "CONTACTS_LIST")[begin + 50] == ""
    sent = story.series("deb", "OPINION_BYTES")
    assert sent[begin + 40] == sent[end]
    for name in others(story):
        for variable in ("EXPLORE_LIST", "EXPLOIT_LIST", "MIGRATE_LIST"):
            assert not any("deb" in (names or "") for names in story.series(name, variable)[begin + 5 : end])
        assert not any("deb" in names for names in story.series(name, "CONTACTS_LIST")[begin + 50 : end])
        sent = story.series(name, "OPINION_BYTES")
        assert sent[end] - sent[begin] > 50.0 * (end - begin - 5)


@pytest.mark.slow
def test_afterwards_deb_is_taken_back(story):
    assert story.series("deb", "DEPLOY")[-1] == "true"
    assert story.series("deb", "CONTACTS_LIST")[-1] != ""
    lists = [
        str(story.series(name, variable)[-1])
        for name in others(story)
        for variable in ("EXPLORE_LIST", "EXPLOIT_LIST", "MIGRATE_LIST")
    ]
    assert any("deb" in names for names in lists)


@pytest.mark.slow
def test_nobody_hears_everybody_all_the_time(story):
    for name in story.names:
        degrees = [
            len([n for n in (text or "").split(",") if n]) for text in story.series(name, "CONTACTS_LIST")
        ]
        assert min(degrees[60:]) < 7
        assert max(degrees) > 0


@pytest.mark.slow
def test_no_two_vessels_collide(story):
    assert story.shore.value("COLLISION_TOTAL") == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(("encoding", "rate"), [("i8", 3.0), ("i16", 6.0), ("f32", 12.0)])
def test_compact_opinions_cost_the_same_few_bytes_in_any_fleet_and_are_heard(tmp_path, encoding, rate):
    for vehicles in (2, 4):
        host = Lockstep(1, None, stagger=True)
        plan = load(tmp_path / str(vehicles), vehicles, ENCODING=encoding)
        add_fleet(host, plan)
        deploy_in_lockstep(host, plan)
        host.run(40.0)
        for name in plan.fleet.vehicle_names():
            app = host.communities[name].app("pOpinionManager")
            assert app.engine.bytes_per_second(host.clock.now()) == pytest.approx(rate, rel=0.11)
            contacts = {n for n in host.communities[name].database.value("CONTACTS_LIST").split(",") if n}
            assert {neighbour.name for neighbour in app.engine.neighbours} == contacts
        assert host.failures == []


@pytest.mark.slow
def test_static_samplers_wait_for_the_first_bloom_each_at_a_place_of_its_own(tmp_path):
    plan = load(
        tmp_path,
        6,
        {"uFldBloomStormSim.probability_of_new_bloom": "0"},
        METHOD="static",
        OPTIONS="static.opt",
    )
    host = Lockstep(1, None, stagger=True)
    add_fleet(host, plan)
    deploy_in_lockstep(host, plan)
    host.run(330.0)
    middle = ZONES[0].area_centroid
    samplers = plan.fleet.vehicle_names()[0::2]
    places = []
    for name in samplers:
        database = host.communities[name].database
        assert database.value("MODE") == "ACTIVE:EXPLOITING"
        places.append((database.value("NAV_X"), database.value("NAV_Y")))
    assert len(places) == 3
    assert all(10.0 < hypot(x - middle[0], y - middle[1]) < 40.0 for x, y in places)
    assert all(hypot(x - u, y - v) > 25.0 for (x, y), (u, v) in itertools.combinations(places, 2))


def digest(out, method, seconds=45.0):
    """Everything every community holds after a short run."""
    path = find_fleet("bloom")
    plan = plan_fleet(
        load_fleet(path, 2, 3, ["paper", "quiet", method]), path.resolve().parent, out, warp=1.0
    )
    host = Lockstep(3, None, stagger=True)
    add_fleet(host, plan)
    deploy_in_lockstep(host, plan)
    host.run(seconds)
    assert host.failures == []
    return {
        (name, record.name): home.database.value(record.name)
        for name, home in host.communities.items()
        for record in home.database.records()
        if record.name != "PLOGGER_CMD"  # names the folder of this run
    }


@pytest.mark.slow
def test_equal_seeds_give_equal_runs_to_the_last_value(tmp_path):
    first = digest(tmp_path / "a", "gcid")
    digest(tmp_path / "b", "greedy")
    assert digest(tmp_path / "c", "gcid") == first


@pytest.mark.slow
def test_the_blooms_do_not_depend_on_how_coalitions_form(tmp_path):
    circles = [digest(tmp_path / m, m, 150.0)["shoreside", "VIEW_CIRCLE"] for m in ("gcid", "static")]
    assert circles[0].split(",label")[0] == circles[1].split(",label")[0]


@pytest.mark.slow
def test_static_coalitions_stay_whatever_the_opinions(tmp_path):
    found = digest(tmp_path, "static", 60.0)
    assert (found["abe", "OPTION"], found["ben", "OPTION"]) == ("EXPLOIT", "EXPLORE")
    assert found["abe", "OPTION2"] == "EXPLORE"
    assert found["abe", "MODE"] == "ACTIVE:EXPLOITING"


def test_it_runs_as_people_type_it(tmp_path):
    words = ["sim", "bloom", "--preset", "field", "--seed", "1", "--vehicles", "2", "--duration", "30"]
    run = subprocess.run(
        [sys.executable, "-m", "pymoos_lite.tools.cli", *words, "--log-dir", str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    assert "bloom: 2 vehicles, 30 mission seconds" in run.stdout
    (sent,) = re.findall(r"^each vessel sends, bytes per second: (.*)$", run.stdout, re.MULTILINE)
    rates = {name: int(rate) for name, rate in re.findall(r"([A-Z_]+) (\d+)", sent)}
    assert rates["NODE_REPORT"] > rates["NODE_MESSAGE"] > 0
    (log,) = tmp_path.glob("LOG_ABE*/*.alog")
    assert "OWN_OPINION_STATE" in log.read_text()


@pytest.mark.parametrize(
    "preset", ["paper", "field", "later", "gcid", "static", "greedy", "as_configured", "as_built", "quiet"]
)
def test_every_preset_is_free_of_problems(tmp_path, preset):
    path = find_fleet("bloom")
    plan = plan_fleet(load_fleet(path, 1, 1, [preset]), path.resolve().parent, tmp_path, warp=1.0)
    assert plan.problems == ()
    assert [problem for member in plan.members for problem in deeper_problems(member.plan)] == []


def test_zones_are_those_of_the_paper():
    assert [zone.area for zone in ZONES] == pytest.approx([107020.54, 106776.50])
    assert [
        hypot(b[0] - a[0], b[1] - a[1]) for a, b in zip(ZONES[0].points, ZONES[0].points[1:], strict=False)
    ] == (pytest.approx([300.0, 350.0, 319.5], abs=0.1))


def test_check_prints_which_behaviours_each_option_activates(capsys):
    assert main(["check", "bloom", "--vehicles", "3"]) == 0
    text = capsys.readouterr().out
    assert "pOpinionManager of abe, ben, cal" in text
    rows = {line.split()[0]: line.split()[2:5] for line in text.splitlines() if len(line.split()) >= 5}
    assert rows["behaviour"] == ["explore", "exploit", "migrate"]
    assert rows["voronoi_cover"] == ["1", "0", "0"]
    assert [cell[0] for cell in rows["travel_to_sample"]] == ["0", "1", "0"]
    assert [cell[0] for cell in rows["migrating"]] == ["0", "0", "1"]
    assert rows["recover"] == ["1", "1", "1"]
    assert "warning" not in text.replace("0 warnings", "")


@pytest.mark.slow
def test_in_real_time_over_udp_vessels_hear_each_other_and_choose(tmp_path):
    words = [
        "launch",
        "bloom",
        "--preset",
        "field",
        "--vehicles",
        "2",
        "--warp",
        "3",
        "--duration",
        "60",
        "--plain",
    ]
    run = subprocess.run(
        [sys.executable, "-m", "pymoos_lite.tools.cli", *words, "--macro", "COMMS_RANGE=1000", "--seed", "1",
         "--log-dir", str(tmp_path)],
        capture_output=True, text=True, timeout=300, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr
    for own, other in (("abe", "ben"), ("ben", "abe")):
        (log,) = tmp_path.rglob(f"LOG_{own.upper()}*.alog")
        entries = [line.split(None, 3) for line in log.read_text().splitlines() if not line.startswith("%")]
        said = {name: [e[3].strip() for e in entries if len(e) == 4 and e[1] == name] for name in WATCHED}
        assert "EXPLORE" in said["OPTION"]
        assert any(other in names for names in said["EXPLORE_LIST"])
        assert any(other in names for names in said["CONTACTS_LIST"])
