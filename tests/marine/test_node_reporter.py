"""The node reporter: what goes into a report, when it goes out, and the cores behind it."""

from __future__ import annotations

import json
import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marine_harness import Sea, warnings_of

from pymoos_lite.core.message import Message
from pymoos_lite.geometry.geodesy import Geodesy
from pymoos_lite.marine.helm_status import HelmStatus
from pymoos_lite.marine.node_reporter import NodeReporter
from pymoos_lite.marine.ownship_state import OwnshipState, default_length
from pymoos_lite.marine.platform_report import PlatformReport, parse_platform_input
from pymoos_lite.marine.riders import RiderSet, parse_rider
from pymoos_lite.records.node_report import NodeReport

KAYAK = "AppTick = 2\nplatform_type = kayak\nplatform_color = yellow\n"


def sea_with(config: str = "", origin: bool = True) -> tuple[Sea, NodeReporter]:
    sea = Sea(origin)
    return sea, sea.add(NodeReporter, "pNodeReporter", KAYAK + config)


def sail(sea: Sea, x: float = 10.0, y: float = -20.0, heading: float = 180.0, speed: float = 1.5) -> None:
    for name, value in (("X", x), ("Y", y), ("HEADING", heading), ("SPEED", speed), ("DEPTH", 0.0)):
        sea.post(f"NAV_{name}", value)


def report_of(sea: Sea, name: str = "NODE_REPORT_LOCAL") -> NodeReport:
    return NodeReport.parse(sea.last(name))


def test_a_report_has_the_documented_fields_in_the_documented_order() -> None:
    sea, _ = sea_with(
        "platform_group = red\nplatform_vsource = gps\nplatform_beam = 1\nplatform_aspect = crew=4"
    )
    sail(sea)
    sea.post("NAV_LAT", 43.825)
    sea.post("NAV_LONG", -70.33)
    sea.post("IVPHELM_STATE", "DRIVE")
    sea.post("IVPHELM_SUMMARY", "iter=1,ofnum=2,modes=MODE@ACTIVE:LOITERING,halt_msg=none")
    sea.post("IVPHELM_ALLSTOP", "clear")
    sea.post("AUX_MODE", "towing")
    sea.post("LOAD_WARNING", "app=pHelmIvP,maxgap=1.8,node=abe")
    sea.post("NAV_ALTITUDE", 12)
    sea.post("THRUST_MODE_REVERSE", "true")
    sea.post("NAV_TRANSP", 0.5)
    sea.post("NAV_TRAJECTORY", "1,2,3")
    sea.run(1.2)
    text = sea.heard("NODE_REPORT_LOCAL")[0]
    now = report_of(sea, "NODE_REPORT_LOCAL_FIRST").time
    assert now is not None
    assert text == (
        "NAME=abe,X=10,Y=-20,SPD=1.5,HDG=180,DEP=0,LAT=43.825,LON=-70.33,TYPE=kayak,COLOR=yellow,GROUP=red,"
        "VSOURCE=gps,MODE=MODE@ACTIVE:LOITERING,MODE_AUX=towing,ALLSTOP=clear,LOAD_WARNING=pHelmIvP:1.8,"
        f"ALTITUDE=12,THRUST_MODE_REVERSE=true,YAW=-1.5707963,TIME={f'{now:.2f}'.rstrip('0').rstrip('.')},"
        "TRANSPARENCY=0.5,LENGTH=4,BEAM=1,TRAJECTORY={1,2,3},crew=4"
    )
    second = report_of(sea)
    assert second.index == len(sea.heard("NODE_REPORT_LOCAL")) - 1
    assert second.load_warning == ""


def test_reports_go_out_at_every_iteration_and_the_gap_is_posted() -> None:
    sea, _ = sea_with()
    sail(sea)
    sea.run(10.0)
    assert len(sea.heard("NODE_REPORT_LOCAL")) == pytest.approx(20, abs=1)
    assert len(sea.heard("NODE_REPORT_LOCAL_FIRST")) == 1
    assert sea.last("PNR_POST_GAP") == pytest.approx(0.5)


def test_global_reports_have_latitude_and_longitude_only() -> None:
    sea, _ = sea_with("coord_policy_global = true")
    sail(sea)
    sea.run(1.0)
    report = report_of(sea)
    assert report.x is None
    assert report.lat == pytest.approx(43.82512, abs=1e-4)


def test_a_global_report_without_datum_or_latitude_is_withheld_with_a_warning() -> None:
    sea, app = sea_with("coord_policy_global = true", origin=False)
    sail(sea)
    sea.run(1.0)
    assert not sea.heard("NODE_REPORT_LOCAL")
    assert any("coord_policy_global" in text for text in warnings_of(app))


def test_terse_reports_leave_out_depth_yaw_and_latitude() -> None:
    sea, _ = sea_with("terse_reports = true")
    sail(sea)
    sea.post("NAV_LAT", 43.0)
    sea.post("NAV_LONG", -70.0)
    sea.run(1.0)
    report = report_of(sea)
    assert (report.depth, report.yaw, report.lat) == (None, None, None)
    assert report.x == 10.0


def test_json_replaces_the_report_or_goes_to_a_variable_of_its_own() -> None:
    sea, _ = sea_with("json_report = true")
    sail(sea)
    sea.run(1.0)
    assert json.loads(sea.last("NODE_REPORT_LOCAL"))["X"] == 10
    sea, _ = sea_with("json_report = NODE_JSON")
    sail(sea)
    sea.run(1.0)
    assert json.loads(sea.last("NODE_JSON"))["NAME"] == "abe"
    assert sea.last("NODE_REPORT_LOCAL").startswith("NAME=abe,")


def test_without_navigation_there_is_no_report_and_after_the_grace_period_a_warning() -> None:
    sea, app = sea_with("nav_grace_period = 5")
    sea.run(4.0)
    assert not warnings_of(app)
    sea.run(4.0)
    assert warnings_of(app) == ["Waiting for NAV_X/Y or NAV_LAT/LONG"]
    assert not sea.heard("NODE_REPORT_LOCAL")
    sail(sea)
    sea.run(1.0)
    assert not warnings_of(app)
    assert sea.heard("NODE_REPORT_LOCAL")


def test_the_mode_field_follows_the_helm_and_its_silence() -> None:
    sea, _ = sea_with("nohelm_threshold = 3")
    sail(sea)
    sea.run(1.0)
    assert report_of(sea).mode == "NOHELM-EVER"
    assert report_of(sea).allstop == "unknown"
    sea.post("IVPHELM_STATE", "PARK")
    sea.run(1.0)
    assert report_of(sea).mode == "PARK"
    sea.run(5.0)
    assert report_of(sea).mode == "NOHELM-5"


def test_helm_status_keeps_modes_that_later_summaries_leave_out() -> None:
    helm = HelmStatus(silent_after=5.0)
    helm.hear_state("DRIVE", 1.0)
    assert helm.mode(1.0) == "DRIVE"
    helm.hear_summary("iter=1,modes=MODE@ACTIVE#X@Q,halted=false", 1.0)
    helm.hear_summary("iter=2,solve_time=0.1", 2.0)
    assert helm.mode(2.0) == "MODE@ACTIVE#X@Q"
    helm.hear_summary("modes=none", 2.0)
    assert helm.mode(2.0) == "DRIVE"
    helm.hear_state("MALCONFIG", 3.0)
    assert helm.mode(3.0) == "MALCONFIG"
    assert helm.allstop == "n/a"
    assert helm.mode(9.5) == "NOHELM-6"


def test_blackouts_space_the_reports_out_every_time() -> None:
    sea, _ = sea_with("blackout_interval = 4\nblackout_variance = 1")
    sail(sea)
    sea.run(60.0)
    gaps = sea.heard("PNR_POST_GAP")
    assert len(gaps) > 10
    assert all(3.0 <= gap <= 5.6 for gap in gaps)
    assert len(set(gaps)) > 1


def test_extrapolation_leaves_out_reports_that_receivers_can_guess() -> None:
    sea, _ = sea_with("extrap_enabled = true")
    for step in range(40):
        sail(sea, x=0.0, y=-0.75 * step, heading=180.0, speed=1.5)
        sea.run(0.5)
    predictable = len(sea.heard("NODE_REPORT_LOCAL"))
    assert 4 <= predictable <= 6  # only the longest gap of 5 s calls for them
    assert sea.last("PNR_EXTRAP_HDG_GAP") == 0.0
    sail(sea, x=5.0, y=-30.0, heading=170.0)
    sea.run(0.6)
    assert len(sea.heard("NODE_REPORT_LOCAL")) > predictable
    assert report_of(sea).heading == 170.0
    assert max(sea.heard("PNR_EXTRAP_HDG_GAP")[-3:]) == pytest.approx(10.0)


def test_a_second_navigation_is_reported_under_its_own_name() -> None:
    sea, _ = sea_with("alt_nav_prefix = NAV_GT\nalt_nav_group = truth")
    sail(sea)
    for name, value in (("X", 11), ("Y", -21), ("HEADING", 90), ("SPEED", 1)):
        sea.post(f"NAV_GT_{name}", value)
    sea.run(1.0)
    names = {NodeReport.parse(text).name: NodeReport.parse(text) for text in sea.heard("NODE_REPORT_LOCAL")}
    assert names["abe_GT"].x == 11.0
    assert names["abe_GT"].group == "truth"
    assert names["abe"].x == 10.0
    sea.run(6.0)
    sea.forget()
    sea.run(2.0)
    assert {NodeReport.parse(text).name for text in sea.heard("NODE_REPORT_LOCAL")} == {"abe"}


def test_colour_group_and_pause_can_be_changed_by_mail() -> None:
    sea, _ = sea_with("allow_color_change = true")
    sail(sea)
    sea.post("NODE_COLOR_CHANGE", "green")
    sea.post("NODE_GROUP_UPDATE", "blue")
    sea.run(1.0)
    assert (report_of(sea).color, report_of(sea).group) == ("green", "blue")
    sea.post("PNR_PAUSE", "true")
    sea.run(1.0)
    sea.forget()
    sea.run(2.0)
    assert not sea.heard("NODE_REPORT_LOCAL")


def test_course_over_ground_comes_from_successive_positions() -> None:
    sea, _ = sea_with("report_cog = true\nhdg_error = 5")
    for step in range(6):
        sail(sea, x=2.0 * step, y=2.0 * step, heading=358.0)
        sea.run(0.5)
    assert report_of(sea).cog == pytest.approx(45.0)
    assert report_of(sea).heading == pytest.approx(3.0)


def test_the_mission_hash_is_posted_with_the_extent_of_the_voyage() -> None:
    sea, _ = sea_with()
    sea.post("MISSION_HASH", "mhash=241103-0834K-FOXY-WEED,utc=1.00")
    for x in (0.0, 0.5, 1.5, 1.6, 100.0, 101.0, 103.0):
        sail(sea, x=x, y=0.0)
        sea.run(1.0)
    assert sea.heard("PNR_MHASH") == [
        f"mhash=241103-0834K-FOXY-WEED,ext={extent}" for extent in ("1.5", "100", "103")
    ]


def test_platform_variables_are_reported_when_they_changed_and_their_gap_has_passed() -> None:
    sea, _ = sea_with("plat_report_input = BATTERY,gap=2,alias=BATT")
    for value in (12.5, 12.4, 12.3, 12.3, 12.3):
        sea.post("BATTERY", value)
        sea.run(1.0)
    texts = sea.heard("PLATFORM_REPORT_LOCAL")
    assert [text.rpartition("=")[2] for text in texts] == ["12.5", "12.3"]
    assert texts[0].startswith("platform=abe,utc_time=")
    assert ",BATT=12.5" in texts[0]


def test_riders_travel_by_their_policies() -> None:
    riders = RiderSet(
        [
            parse_rider(f"var={name}, policy={policy}, prec=1")
            for name, policy in (("A", "always"), ("U", "updated"), ("UN", "updated+10"), ("N", "10"))
        ]
    )
    assert riders.take(0.0) == []
    for name in ("A", "U", "UN", "N"):
        riders.hear(name, 1.26)
    assert [field for field, _ in riders.take(1.0)] == ["A", "U", "UN", "N"]
    riders.hear("N", 2.0)
    assert [field for field, _ in riders.take(2.0)] == ["A"]
    riders.hear("U", 3.0)
    assert riders.take(3.0) == [("A", "1.3"), ("U", "3")]
    # Mail must not restart the clock of an interval.
    for now in range(4, 12):
        riders.hear("N", float(now))
        due = riders.take(float(now))
    assert due == [("A", "1.3"), ("UN", "1.3"), ("N", "11")]


def test_a_rider_with_commas_is_braced_and_reads_back_as_a_property() -> None:
    sea, _ = sea_with("rider = var=CARGO, rfld=LOAD")
    sail(sea)
    sea.post("CARGO", "sand,gravel")
    sea.run(1.0)
    assert ",LOAD={sand,gravel}" in sea.last("NODE_REPORT_LOCAL")
    assert report_of(sea).property("LOAD") == "{sand,gravel}"


@pytest.mark.parametrize(
    "text",
    [
        "policy=always",
        "var=X",
        "var=A, rfld=SPD",
        "var=A, prec=11",
        "var=A, prec=x",
        "var=A, policy=often",
        "var=A, foo=1",
        "var=A, rfld=a b",
        "var=A, policy=-3",
    ],
)
def test_a_faulty_rider_is_refused(text: str) -> None:
    with pytest.raises(ValueError):
        parse_rider(text)


def test_one_rider_per_variable_the_last_one_wins() -> None:
    sea, app = sea_with("rider = var=CARGO, rfld=ONE\nrider = var=CARGO, rfld=TWO")
    assert any("CARGO" in text for text in app.log.config_warnings)
    sail(sea)
    sea.post("CARGO", 3)
    sea.run(1.0)
    assert sea.last("NODE_REPORT_LOCAL").endswith(",TWO=3")


@pytest.mark.parametrize("text", ["", "A B", "A,gap=x", "A,foo=1", "A,gap=-1"])
def test_a_faulty_platform_input_is_refused(text: str) -> None:
    with pytest.raises(ValueError):
        parse_platform_input(text)


def test_an_unchanged_platform_variable_is_not_due() -> None:
    report = PlatformReport([parse_platform_input("A")])
    assert report.take("abe", 1.0) == ""
    report.hear("A", "x,y")
    assert report.take("abe", 1.0) == "platform=abe,utc_time=1.00000,A={x,y}"
    report.hear("A", "x,y")
    assert report.take("abe", 2.0) == ""


def test_cross_fill_policies_fill_what_they_say() -> None:
    geodesy = Geodesy(43.8253, -70.3304)
    nav = OwnshipState()
    nav.hear("X", 100.0, 1.0)
    nav.hear("Y", 50.0, 1.0)
    lat, lon = geodesy.to_latlon(100.0, 50.0)
    assert nav.position("literal", geodesy) == (100.0, 50.0, None, None)
    assert nav.position("global", geodesy) == (100.0, 50.0, None, None)
    assert nav.position("local", geodesy) == nav.position("fill-empty", geodesy) == (100.0, 50.0, lat, lon)
    far = geodesy.to_latlon(300.0, 0.0)
    nav.hear("LAT", far[0], 2.0)
    nav.hear("LONG", far[1], 2.0)
    assert nav.position("fill-empty", geodesy) == (100.0, 50.0, *far)
    assert nav.position("global", geodesy)[0] == pytest.approx(300.0)
    assert nav.position("global-terse", geodesy)[0] == pytest.approx(300.0)
    assert nav.position("use-latest", geodesy)[0] == pytest.approx(300.0)
    nav.hear("X", 100.0, 3.0)
    assert nav.position("use-latest", geodesy) == (100.0, 50.0, lat, lon)
    assert nav.position("local", None) == (100.0, 50.0, *far)


def test_a_position_beyond_the_projection_is_left_as_heard() -> None:
    nav = OwnshipState()
    nav.hear("X", 1e11, 1.0)
    nav.hear("Y", 1e11, 1.0)
    assert nav.position("local", Geodesy(43.8253, -70.3304)) == (1e11, 1e11, None, None)


def test_lengths_go_by_type() -> None:
    expected = {
        "kayak": 4,
        "UUV": 4,
        "skywalker": 2,
        "crayx": 3,
        "heron": 3,
        "usv": 6,
        "ship": 8,
        "longship": 15,
    }
    assert {kind: default_length(kind) for kind in expected} == expected
    assert default_length("zeppelin") is None
    sea = Sea()
    app = sea.add(NodeReporter, "pNodeReporter", "platform_type = zeppelin")
    assert any("platform_length" in text for text in app.log.config_warnings)


def test_policy_names_may_be_written_with_underscores() -> None:
    _, app = sea_with("cross_fill_policy = use_latest")
    assert app.config.cross_fill_policy == "use-latest"
    _, app = sea_with("cross_fill_policy = sometimes")
    assert app.config.cross_fill_policy == "literal"
    assert any("fill-empty" in text for text in app.log.config_warnings)


@settings(max_examples=60, deadline=None)
@given(
    st.randoms(use_true_random=False),
    st.lists(st.one_of(st.floats(), st.text(max_size=30), st.binary(max_size=4)), max_size=12),
)
def test_no_mail_whatever_makes_the_reporter_fall_over(
    rng: random.Random, values: list[float | str | bytes]
) -> None:
    sea, app = sea_with(
        "rider = var=NAV_X, rfld=R\nplat_report_input = LOAD_WARNING\nalt_nav_prefix = ALT\nextrap_enabled = true\n"
        "report_cog = true\ncross_fill_policy = use-latest\njson_report = J"
    )
    names = sorted(app._handlers)
    sail(sea)
    for value in values:
        app.on_mail([Message(rng.choice(names), value, sea.now, "tester")])
        sea.run(0.5)
    sea.run(1.0)
    for text in sea.heard("NODE_REPORT_LOCAL"):
        NodeReport.parse(text)
    for text in sea.heard("J"):
        json.loads(text)
    assert all(isinstance(line, str) for line in app.report())
    assert math.isfinite(app._extent)
