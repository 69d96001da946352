"""From a fleet file to running communities in lockstep."""

import hashlib
import shutil
from pathlib import Path

import pytest

from pymoos_lite.config.fleet_file import parse_fleet
from pymoos_lite.hosts.fleet import (
    add_fleet,
    deploy_in_lockstep,
    find_fleet,
    is_fleet,
    load_fleet,
    plan_fleet,
)
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.hosts.mission import MissionError
from pymoos_lite.records.node_report import NodeReport

DATA = Path(__file__).parent.parent / "data" / "fleet"


def planned(out, vehicles=None, seed=None, **options):
    return plan_fleet(load_fleet(DATA / "fleet.yaml", vehicles, seed), DATA, out, **options)


def sailed(out, seconds, vehicles=None, seed=None):
    plan = planned(out, vehicles, seed)
    assert plan.problems == ()
    host = Lockstep(plan.fleet.seed, out)
    add_fleet(host, plan)
    deploy_in_lockstep(host, plan)
    host.run(seconds)
    assert host.failures == []
    return host


def test_templates_are_expanded_with_the_macros_of_each_community(tmp_path):
    plan = planned(tmp_path)
    assert plan.problems == ()
    assert [m.name for m in plan.members] == ["shoreside", "abe", "ben", "cal"]
    assert [m.plan.community for m in plan.members] == ["shoreside", "abe", "ben", "cal"]
    assert [m.plan.port for m in plan.members] == [9000, 9001, 9002, 9003]
    text = (tmp_path / "targ_ben.moos").read_text()
    start = plan.fleet.vehicles[1].start.to_text()
    assert f"start_pos = {start}" in text
    assert "drift_x = 0\n" in text
    assert "input = route = localhost:9202" in text
    assert "try_shore_host = pshare_route=localhost:9200" in text
    assert "$(" not in text


def test_every_vehicle_hears_every_other_and_obeys_the_deployment(tmp_path):
    host = sailed(tmp_path, 30.0)
    for name in ("abe", "ben", "cal"):
        database = host.communities[name].database
        assert database.value("DEPLOY") == "true"
        assert database.value("MOOS_MANUAL_OVERRIDE") == "false"
        assert NodeReport.parse(database.value("NODE_REPORT")).name != name
    reports = [NodeReport.parse(host.communities["abe"].database.value("NODE_REPORT"))]
    assert reports[0].time > host.clock.now() - 2.0
    assert host.communities["shoreside"].database.value("UFSB_NODE_COUNT") == 3.0
    abe = host.communities["abe"].database
    assert abe.value("NAV_X") == pytest.approx(planned(tmp_path).fleet.vehicles[0].start.x + 15.0, abs=0.5)


def test_a_message_travels_from_vehicle_to_vehicle_through_the_shoreside(tmp_path):
    host = sailed(tmp_path, 10.0)
    text = "src_node=abe,dest_node=cal,var_name=GREETING,string_val=ahoy"
    host.poke(10.0, "NODE_MESSAGE_LOCAL", text, "abe")
    host.run(5.0)
    assert host.communities["cal"].database.value("GREETING") == "ahoy"
    assert host.communities["ben"].database.value("GREETING") is None
    assert host.communities["cal"].database.get("GREETING").aux == "abe"


def logs(folder):
    """Every file the run wrote."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_the_same_seed_gives_the_same_logs_whatever_ran_before(tmp_path):
    found = []
    for i, other in enumerate((1, 5)):
        sailed(tmp_path / f"other{i}", 7.0, vehicles=other, seed=99).stop()
        sailed(tmp_path / f"run{i}", 40.0).stop()
        found.append(logs(tmp_path / f"run{i}"))
    assert found[0] == found[1]
    assert len([name for name in found[0] if name.endswith(".alog")]) == 4
    sailed(tmp_path / "third", 40.0, seed=6).stop()
    assert logs(tmp_path / "third") != found[0]


def test_a_vessels_logs_are_the_same_however_many_others_sail_out_of_its_reach(tmp_path):
    wide = (
        (DATA / "fleet.yaml").read_text().replace("x: [0, 100], y: [-100, 0]", "x: [0, 90000], y: [0, 90000]")
    )
    text = wide.replace("separation: 20", "separation: 9000")
    found = []
    for vehicles in (2, 6):
        fleet = parse_fleet(text, "fleet.yaml", vehicles)
        out = tmp_path / str(vehicles)
        plan = plan_fleet(fleet, DATA, out)
        assert plan.problems == ()
        host = Lockstep(fleet.seed, out, stagger=True)
        add_fleet(host, plan)
        deploy_in_lockstep(host, plan)
        host.run(40.0)
        assert host.communities["shoreside"].database.value("UFSB_NODE_COUNT") == float(vehicles)
        host.stop()
        found.append({name: digest for name, digest in logs(out).items() if name.endswith(".alog")})
    few, many = found
    for vessel in ("ABE", "BEN"):
        name = f"LOG_{vessel}/LOG_{vessel}.alog"
        assert few[name] == many[name]


def test_commands_go_to_all_or_to_some(tmp_path):
    plan = planned(tmp_path)
    assert ("RETURN_ALL", "true") in plan.posts("return")
    assert plan.posts("pause", ["ben", "CAL"]) == [
        ("MOOS_MANUAL_OVERRIDE_BEN", "true"),
        ("MOOS_MANUAL_OVERRIDE_CAL", "true"),
    ]
    with pytest.raises(MissionError, match="did you mean 'deploy'"):
        plan.posts("deply")
    with pytest.raises(MissionError, match="no vehicle 'dan'"):
        plan.posts("deploy", ["dan"])


def test_settings_go_into_every_mission_and_a_useless_one_is_refused(tmp_path):
    plan = planned(tmp_path, settings={"pNodeReporter.vessel_type": "heron", "comms_range": "7"})
    assert any(line.value == "heron" for app in plan.members[1].plan.apps for line in app.lines)
    with pytest.raises(MissionError, match="no mission of the fleet"):
        planned(tmp_path, settings={"no_such_line": "1"})


def edited(tmp_path, name, old, new):
    folder = tmp_path / "mission"
    shutil.copytree(DATA, folder)
    path = folder / name
    path.write_text(path.read_text().replace(old, new))
    return plan_fleet(load_fleet(folder / "fleet.yaml"), folder, tmp_path / "out")


@pytest.mark.parametrize(
    ("name", "old", "new", "expected"),
    [
        (
            "fleet.yaml",
            "moos: meta_vehicle.moos",
            "moos: nothing.moos",
            "there is no template 'nothing.moos'",
        ),
        ("fleet.yaml", "count: 3", "count: three", "expected a number, found 'three'"),
        (
            "meta_vehicle.moos",
            "Community    = $(VNAME)",
            "Community = boat",
            "Community is 'boat', but the fleet file",
        ),
        ("meta_vehicle.moos", "$(VNAME)", "$(VNME)", "undefined macro $(VNME)"),
        ("meta_vehicle.moos", "vessel_type", "vesel_type", "did you mean 'vessel_type'"),
        ("meta_shoreside.moos", "#", "#", None),
    ],
)
def test_problems_point_to_the_file_they_are_in(tmp_path, name, old, new, expected):
    plan = edited(tmp_path, name, old, new)
    texts = [str(p) for p in plan.problems]
    if expected is None:
        assert texts == []
    else:
        assert any(expected in text for text in texts), texts


def test_a_behaviour_file_is_found_by_its_customary_name_wherever_it_was_written(tmp_path):
    folder = tmp_path / "mission"
    shutil.copytree(DATA, folder)
    (folder / "meta.bhv").write_text("// $(VNAME)\n")
    fleet_text = (folder / "fleet.yaml").read_text().replace("count: 3", "count: 2\n  bhv: meta.bhv")
    (folder / "fleet.yaml").write_text(fleet_text)
    moos = folder / "meta_vehicle.moos"
    moos.write_text(moos.read_text() + "ProcessConfig = pHelmIvP\n{\n  behaviors = targ_$(VNAME).bhv\n}\n")
    moos.write_text(moos.read_text().replace("Run = pLogger", "Run = pLogger\n  Run = pHelmIvP"))
    plan = plan_fleet(load_fleet(folder / "fleet.yaml"), folder, tmp_path / "out")
    helm = next(app for app in plan.members[1].plan.apps if app.name == "pHelmIvP")
    assert [Path(line.value) for line in helm.lines] == [tmp_path / "out" / "targ_abe.bhv"]
    assert (tmp_path / "out" / "targ_abe.bhv").read_text().startswith("// abe")


def test_fleets_are_found_by_file_folder_or_not_at_all(tmp_path):
    assert is_fleet(str(DATA))
    assert is_fleet("somewhere/my_fleet.yaml")
    assert not is_fleet(str(DATA / "meta_vehicle.moos"))
    assert not is_fleet(str(tmp_path))
    assert find_fleet(str(DATA)) == DATA / "fleet.yaml"
    with pytest.raises(MissionError, match="no such fleet file"):
        find_fleet(str(tmp_path / "none.yaml"))
