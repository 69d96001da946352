"""The contact manager's core: filters, alerts, retirement, posts."""

from __future__ import annotations

import csv
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoos_lite.geometry.geodesy import Geodesy
from pymoos_lite.marine.contact_alerts import Alert, apply_request, expand, flag_post
from pymoos_lite.marine.contact_filter import ContactFilter
from pymoos_lite.marine.contact_manager_core import ContactManagerCore, ContactManagerParameters, Post
from pymoos_lite.marine.contact_requests import RangeRequests

DATA = Path(__file__).parent.parent / "data" / "contacts"
GEODESY = Geodesy(43.8253, -70.3304)
ALERT = "id=avd_, on_flag=CONTACT_INFO=name=$[VNAME] # contact=$[VNAME],alert_range=60, cpa_range=75"


def manager(**changes: Any) -> ContactManagerCore:
    core = ContactManagerCore("abe", GEODESY, ContactManagerParameters(**changes))
    core.own_x = core.own_y = 0.0
    core.own_heading, core.own_speed = 0.0, 1.0
    return core


def report(
    name: str,
    x: float,
    y: float,
    heading: float = 180.0,
    speed: float = 1.0,
    time: float = 0.0,
    more: str = "",
) -> str:
    return f"NAME={name},X={x},Y={y},SPD={speed},HDG={heading},TIME={time},TYPE=kayak{more}"


def posts_of(posts: list[Post], variable: str) -> list[float | str]:
    return [value for name, value in posts if name == variable]


def test_the_recorded_head_on_meeting_raises_and_drops_its_alert_at_the_recorded_times() -> None:
    with open(DATA / "ac_headon.csv", newline="") as file:
        rows = [{key: float(value) for key, value in row.items() if value} for row in csv.DictReader(file)]
    for own, other, on_at, off_at in (("abe", "ben", 59.77, 112.42), ("ben", "abe", 60.02, 112.69)):
        core = ContactManagerCore(
            own, GEODESY, ContactManagerParameters(decay=(30.0, 60.0), contact_max_age=35.0)
        )
        core.request_alert(ALERT)
        on, off = [], []
        for before, row in pairwise(rows):
            now = row["t"]
            # The report is one row old, as it was on its way through shore in the recording.
            pose = (
                before[f"{other}_x"],
                before[f"{other}_y"],
                before[f"{other}_heading"],
                before[f"{other}_speed"],
            )
            core.receive(report(other, *pose, time=before["t"]), now)
            core.own_x, core.own_y = row[f"{own}_x"], row[f"{own}_y"]
            core.own_heading, core.own_speed = row[f"{own}_heading"], row[f"{own}_speed"]
            posts = core.step(now)
            if posts_of(posts, "CONTACT_INFO"):
                on.append(now)
                assert posts_of(posts, "CONTACT_INFO") == [f"name={other} # contact={other}"]
            if posts_of(posts, "CONTACTS_ALERTED") == [""] and on:
                off.append(now)
        assert on == [pytest.approx(on_at, abs=1.0)]
        assert off == [pytest.approx(off_at, abs=1.0)]


def test_between_the_ranges_only_a_projected_close_pass_is_alerted() -> None:
    for heading, alerted in ((180.0, True), (90.0, False)):
        core = manager()
        core.request_alert(ALERT)
        core.receive(report("ben", 0.0, 70.0, heading=heading, speed=5.0), 0.0)
        posts = core.step(0.0)
        assert bool(posts_of(posts, "CONTACT_INFO")) == alerted
    core = manager()
    core.request_alert(ALERT)
    core.receive(report("ben", 0.0, 55.0, heading=0.0, speed=5.0), 0.0)
    assert posts_of(core.step(0.0), "CONTACTS_ALERTED") == ["(ben,avd_)"]


def test_flags_fire_on_the_edges_only_even_for_ids_with_capitals() -> None:
    core = manager()
    core.request_alert("id=AVOID_Me,on_flag=ON=$[VNAME],off_flag=OFF=$[VNAME]#OUT=%[VNAME],alert_range=50")
    fired: list[Post] = []
    for step, y in enumerate((80.0, 40.0, 40.0, 40.0, 80.0, 80.0, 30.0)):
        core.receive(report("Ben", 0.0, y, time=float(step)), float(step))
        fired += [post for post in core.step(float(step)) if post[0] in ("ON", "OFF", "OUT")]
    assert fired == [("ON", "Ben"), ("OFF", "Ben"), ("OUT", "ben"), ("ON", "Ben")]


def test_posts_go_out_only_when_they_change() -> None:
    core = manager(recap_interval=2.0, post_closest_range=True, post_closest_relbng=True)
    core.receive(report("ben", 30.0, 40.0), 0.0)
    first = core.step(0.0)
    assert posts_of(first, "CONTACTS_LIST") == ["ben"]
    assert posts_of(first, "CONTACT_CLOSEST") == ["ben"]
    assert posts_of(first, "CONTACT_CLOSEST_RANGE") == [50.0]
    assert posts_of(first, "CONTACT_CLOSEST_RELBNG") == [36.0]
    assert posts_of(first, "CONTACTS_RECAP") == ["vname=ben,range=50.00,age=0.00"]
    assert core.step(0.0) == []
    core.receive(report("cal", 10.0, 0.0, speed=0.0), 1.0)
    second = core.step(2.0)
    assert posts_of(second, "CONTACTS_LIST") == ["ben,cal"]
    assert posts_of(second, "CONTACT_CLOSEST") == ["cal"]
    recap = posts_of(second, "CONTACTS_RECAP")[0]
    assert isinstance(recap, str)
    assert recap.split(" # ")[1] == "vname=cal,range=10.00,age=1.00"


def test_nothing_is_said_before_ownship_knows_its_own_position() -> None:
    core = ContactManagerCore("abe", GEODESY, ContactManagerParameters())
    core.receive(report("ben", 1.0, 1.0), 0.0)
    assert core.step(0.0) == []


def test_ownship_is_not_a_contact_of_itself_in_any_case() -> None:
    core = manager()
    core.receive(report("ABE", 1.0, 1.0), 0.0)
    assert posts_of(core.step(0.0), "CONTACTS_LIST") == [""]


def test_contacts_retire_by_age_and_by_distance_and_tell_whom_they_alerted() -> None:
    core = manager(
        contact_max_age=10.0, reject_range=100.0, retire_flags=("GONE=$[VNAME]",), max_retired_history=2
    )
    core.request_alert("id=a,on_flag=ON=$[VNAME],off_flag=OFF=$[VNAME],alert_range=500")
    core.receive(report("ben", 50.0, 0.0, speed=0.0), 0.0)
    core.receive(report("cal", 60.0, 0.0, speed=0.0), 0.0)
    core.receive(report("far", 101.0, 0.0, speed=0.0), 0.0)
    assert posts_of(core.step(0.0), "CONTACTS_LIST") == ["ben,cal"]
    core.receive(report("cal", 104.0, 0.0, speed=0.0, time=5.0), 5.0)
    core.receive(report("ben", 50.0, 0.0, speed=0.0, time=5.0), 5.0)
    assert posts_of(core.step(5.0), "CONTACTS_LIST") == []
    core.receive(report("cal", 106.0, 0.0, speed=0.0, time=6.0), 6.0)
    posts = core.step(6.0)
    assert posts_of(posts, "CONTACTS_RETIRED") == ["cal"]
    assert posts_of(posts, "OFF") == posts_of(posts, "GONE") == ["cal"]
    posts = core.step(15.5)
    assert posts_of(posts, "CONTACTS_RETIRED") == ["ben,cal"]
    assert posts_of(posts, "CONTACTS_LIST") == [""]


def test_too_many_contacts_cost_the_oldest_first_and_then_the_farthest() -> None:
    core = manager(max_contacts=2, contact_max_age=20.0)
    core.receive(report("old", 5.0, 0.0, speed=0.0), 0.0)
    core.receive(report("near", 10.0, 0.0, speed=0.0, time=11.0), 11.0)
    core.receive(report("mid", 20.0, 0.0, speed=0.0, time=11.0), 11.0)
    assert posts_of(core.step(11.0), "CONTACTS_LIST") == ["mid,near"]
    core.receive(report("far", 30.0, 0.0, speed=0.0, time=11.0), 11.0)
    assert posts_of(core.step(11.0), "CONTACTS_RETIRED") == ["far,old"]
    for number in range(2):
        core.receive(report(f"n{number}", 1.0, 0.0), 12.0)
    with pytest.raises(ValueError, match="more than 4 contacts"):
        core.receive(report("n9", 1.0, 0.0), 12.0)


def test_alerts_can_wait_for_the_helm_and_be_switched_off_and_on() -> None:
    core = manager(hold_alerts_for_helm=True)
    core.request_alert(ALERT)
    core.receive(report("ben", 10.0, 0.0), 0.0)
    assert posts_of(core.step(0.0), "CONTACT_INFO") == []
    core.helm_drives = True
    assert len(posts_of(core.step(1.0), "CONTACT_INFO")) == 1
    core.request_alert("id=avd_,action=disable")
    assert posts_of(core.step(2.0), "CONTACTS_ALERTED") == [""]
    core.request_alert("id=avd_,action=enable")
    assert len(posts_of(core.step(3.0), "CONTACT_INFO")) == 1


def test_early_warnings_come_before_the_alert_and_cease_when_the_range_opens() -> None:
    core = manager(
        early_warning_time=20.0,
        early_warning_flags=("WARN=$[CONTACT] at $[RNG_EXT] roc $[ROC]",),
        cease_warning_flags=("CEASE=$[CONTACT]",),
    )
    core.request_alert("id=a,on_flag=ON=1,alert_range=50")
    seen: list[Post] = []
    for step, y in enumerate((120.0, 85.0, 80.0, 88.0, 90.0)):
        core.receive(report("ben", 0.0, y, speed=1.0, time=float(step)), float(step))
        seen += [post for post in core.step(float(step)) if post[0] in ("WARN", "CEASE")]
    assert seen == [("WARN", "ben at 85 roc 2"), ("CEASE", "ben")]


def test_verbose_alerts_tell_ranges_and_the_closest_point() -> None:
    core = manager(alert_verbose=True)
    core.request_alert("id=avdcol_,on_flag=ON=1,alert_range=80,cpa_range=85")
    core.receive(report("ben", 0.0, 84.5, speed=1.0), 0.0)
    assert posts_of(core.step(0.0), "ALERT_VERBOSE") == [
        "new_contact=ben",
        "contact=ben,alert_id=avdcol_,off-->alerted,alert_range=80,alert_range_cpa=85,range_actual=84.5,range_cpa=0",
    ]
    core.receive(report("ben", 0.0, 200.0, speed=1.0, time=1.0), 1.0)
    assert posts_of(core.step(1.0), "ALERT_VERBOSE") == [
        "contact=ben,alert_id=avdcol_,alerted-->off,alert_range=80,alert_range_cpa=85,range_actual=200"
    ]


def test_ranges_are_extrapolated_between_reports() -> None:
    core = manager(decay=(10.0, 20.0), post_all_ranges=True)
    core.receive(report("ben", 0.0, 100.0, heading=180.0, speed=2.0, time=0.0), 0.0)
    core.receive(report("cal", 0.0, 30.0, heading=0.0, speed=0.0, time=0.0), 0.0)
    assert posts_of(core.step(5.0), "CONTACT_RANGES") == ["30,90"]
    assert posts_of(core.step(30.0), "CONTACT_RANGES") == ["30,70"]


# --- filters ---------------------------------------------------------------------------------


def built(*entries: tuple[str, str]) -> ContactFilter:
    result = ContactFilter()
    for key, value in entries:
        result = result.with_entry(key, value)
    return result


@pytest.mark.parametrize(
    ("entries", "passes"),
    [
        ([], True),
        ([("match_name", "cal, BEN")], True),
        ([("match_name", "cal")], False),
        ([("ignore_name", "ben")], False),
        ([("ignore_type", "kayak")], False),
        ([("match_type", "kayak")], True),
        ([("ignore_group", "blue")], False),  # no group, and strict
        ([("ignore_group", "blue"), ("strict_ignore", "false")], True),
        ([("match_group", "blue")], False),
        ([("ignore_region", "pts={0,0:20,0:20,20:0,20}")], False),
        ([("match_region", "pts={0,0:20,0:20,20:0,20}")], True),
        ([("match_region", "pts={50,50:70,50:70,70:50,70}")], False),
    ],
)
def test_filters_compare_in_any_case(entries: list[tuple[str, str]], passes: bool) -> None:
    assert built(*entries).passes("Ben", "", "KAYAK", 10.0, 10.0) == passes


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("ignore_colour", "red"),
        ("strict_ignore", "maybe"),
        ("match_region", "pts={0,0:1,1}"),
        ("match_region", "nonsense"),
        ("ignore_name", "cal"),
    ],
)
def test_a_faulty_filter_is_refused(key: str, value: str) -> None:
    with pytest.raises(ValueError):
        built(("match_name", "cal")).with_entry(key, value)


def test_a_report_with_latitude_only_is_filtered_at_its_place_on_the_local_grid() -> None:
    core = manager(filter=built(("ignore_region", "pts={-5,-5:5,-5:5,5:-5,5}")))
    lat, lon = GEODESY.to_latlon(200.0, 100.0)
    core.receive(f"NAME=ben,LAT={lat:.8f},LON={lon:.8f},SPD=1,HDG=0,TIME=0", 0.0)
    assert posts_of(core.step(0.0), "CONTACTS_LIST") == ["ben"]


def test_a_contact_that_enters_an_ignored_region_is_retired() -> None:
    core = manager(filter=built(("ignore_region", "pts={-5,-5:5,-5:5,5:-5,5}")))
    core.receive(report("ben", 50.0, 0.0), 0.0)
    core.step(0.0)
    core.receive(report("ben", 0.0, 0.0, time=1.0), 1.0)
    assert posts_of(core.step(1.0), "CONTACTS_RETIRED") == ["ben"]


# --- alerts ----------------------------------------------------------------------------------


def test_ranges_of_an_alert_stay_in_order() -> None:
    alerts: dict[str, Alert] = {}
    alert = apply_request("id=a,alert_range=50", alerts)
    assert (alert.alert_range, alert.cpa_range) == (50.0, 50.0)
    alert = apply_request("id=a,cpa_range=30", alerts)
    assert (alert.alert_range, alert.cpa_range) == (30.0, 30.0)
    alert = apply_request("id=a,alert_range=40,on_flag=A=1", alerts)
    assert (alert.alert_range, alert.cpa_range) == (40.0, 40.0)
    assert alert.is_usable
    assert not apply_request("id=b,on_flag=A=1", alerts).is_usable


def test_lines_of_one_id_merge_and_flags_that_differ_in_blanks_count_once() -> None:
    alerts: dict[str, Alert] = {}
    apply_request("id=a,on_flag=CONTACT_INFO=name=$[VNAME]#contact=$[VNAME]", alerts)
    alert = apply_request(
        "id=a,onflag=CONTACT_INFO=name=$[VNAME] # contact=$[VNAME],off_flag=A=1 # B=2", alerts
    )
    assert len(alert.on_flags) == 1
    assert alert.off_flags == ("A=1", "B=2")
    legacy = apply_request('var=CONTACT_INFO, val="name=$[VNAME],x=1", alert_range=9', alerts)
    assert legacy.id == "no_id"
    assert legacy.on_flags == ("CONTACT_INFO=name=$[VNAME],x=1",)


@pytest.mark.parametrize(
    "text",
    [
        "id=a,alert_range=-1",
        "id=a,alert_range=near",
        "id=a,on_flag=nothing",
        "id=a,colour=red",
        "banana",
        "id=zz,action=disable",
        "id=a,action=explode",
        "id=a," + "x" * 5000,
    ],
)
def test_a_faulty_alert_request_changes_nothing(text: str) -> None:
    alerts: dict[str, Alert] = {}
    with pytest.raises(ValueError):
        apply_request(text, alerts)
    assert alerts == {}


def test_flags_are_numbers_or_texts_and_macros_work_in_both_halves() -> None:
    macros = {"VNAME": "Ben", "X": "4.5"}
    assert flag_post("SEEN_$[VNAME]=$[X]", macros) == ("SEEN_Ben", 4.5)
    assert flag_post('SEEN="$(X)"', macros) == ("SEEN", "4.5")
    assert flag_post("SEEN=%[VNAME] $[WHAT]", macros) == ("SEEN", "ben $[WHAT]")
    assert expand("a%(VNAME)b%[NO]", macros) == "abenb%[NO]"


def test_every_documented_macro_expands() -> None:
    core = manager()
    names = ("X", "Y", "LAT", "LON", "SPD", "HDG", "DEP", "VNAME", "VTYPE", "GROUP", "UTIME", "UTC")
    text = "|".join(f"$[{name}]" for name in names)
    core.request_alert(f'id=a,on_flag=TOLD="{text}",alert_range=500')
    core.receive(report("ben", 1.0, 2.0, more=",GROUP=red,DEP=3"), 7.0)
    told = posts_of(core.step(7.0), "TOLD")[0]
    assert isinstance(told, str)
    parts = told.split("|")
    assert parts[:2] == ["1", "2"]
    assert parts[2].startswith("43.825")
    assert parts[4:] == ["1", "180", "3", "ben", "kayak", "red", "0.00", "7.00"]


# --- requests --------------------------------------------------------------------------------


def test_a_range_request_is_answered_when_its_answer_changes() -> None:
    core = manager()
    core.requests.ask("var=NEAR, range=50", 0.0)
    core.requests.ask("var=NEAR_RED, range=50, group=RED, type=kayak", 0.0)
    core.receive(report("ben", 10.0, 0.0, speed=0.0, more=",GROUP=red"), 0.0)
    core.receive(report("cal", 20.0, 0.0, speed=0.0), 0.0)
    posts = core.step(0.0)
    assert posts_of(posts, "NEAR") == ["ben,cal"]
    assert posts_of(posts, "NEAR_RED") == ["ben"]
    assert posts_of(core.step(1.0), "NEAR") == []
    core.requests.ask("var=NEAR, range=50, refresh=true", 1.0)
    assert posts_of(core.step(1.0), "NEAR") == ["ben,cal"]
    core.receive(report("cal", 60.0, 0.0, speed=0.0, time=2.0), 2.0)
    assert posts_of(core.step(2.0), "NEAR") == ["ben"]


def test_range_requests_are_bounded_and_old_ones_make_room() -> None:
    requests = RangeRequests(timeout=10.0, maxsize=2)
    requests.ask("var=A, range=1", 0.0)
    requests.ask("var=B, range=1", 5.0)
    with pytest.raises(ValueError, match="already"):
        requests.ask("var=C, range=1", 9.0)
    requests.ask("var=C, range=1", 11.0)
    assert [variable for variable, _ in requests.step(lambda *_: "x", 11.0)] == ["B", "C"]
    for bad in ("range=3", "var=A B, range=3", "var=A", "var=A, range=x", "nonsense"):
        with pytest.raises(ValueError):
            requests.ask(bad, 20.0)


# --- robustness ------------------------------------------------------------------------------

REPORTS = st.one_of(
    st.text(max_size=60),
    st.builds(
        lambda name, x, y, speed, kind: f"NAME={name},X={x},Y={y},SPD={speed},HDG=10,TIME=1,TYPE={kind}",
        st.sampled_from(["ben", "cal", "abe", "x#y", "a,b"]),
        st.floats(),
        st.floats(-100, 100),
        st.floats(),
        st.sampled_from(["kayak", "uuv", "", "🚤"]),
    ),
)


@settings(max_examples=200, deadline=None)
@given(st.lists(REPORTS, max_size=10), st.lists(st.text(max_size=40), max_size=3))
def test_no_report_or_request_whatever_makes_the_manager_fall_over(
    reports: list[str], requests: list[str]
) -> None:
    core = manager(early_warning_time=10.0, alert_verbose=True, post_all_ranges=True, max_contacts=2)
    core.request_alert(ALERT)
    refused = 0
    for number, text in enumerate(reports):
        try:
            core.receive(text, float(number))
        except ValueError:
            refused += 1
        for variable, value in core.step(float(number)):
            assert variable
            assert isinstance(value, str | float)
    for text in requests:
        for take in (core.request_alert, lambda told: core.requests.ask(told, 0.0)):
            try:
                take(text)
            except ValueError:
                refused += 1
    assert len(core.tracked) <= 2
    assert refused <= len(reports) + 2 * len(requests)
