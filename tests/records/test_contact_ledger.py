"""The contact ledger: which reports are usable, what is filled in, where contacts are by now."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.geometry.geodesy import Geodesy
from pymoos_lite.records.contact_ledger import (
    ContactLedger,
    Extrapolation,
    ExtrapolationMode,
    parse_decay,
    parse_extrapolation,
)
from pymoos_lite.records.node_report import NodeReport

GEODESY = Geodesy(43.8253, -70.3304)


def said(text: str) -> NodeReport:
    return NodeReport.parse(text)


def heard(text: str, now: float = 100.0, ledger: ContactLedger | None = None) -> ContactLedger:
    ledger = ContactLedger(GEODESY) if ledger is None else ledger
    ledger.receive(said(text), now)
    return ledger


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("X=1,Y=2,SPD=1,HDG=2,TIME=5", "Missing vname."),
        ("NAME=ben,X=1,Y=2,SPD=1,HDG=2", "Missing timestamp."),
        ("NAME=ben,SPD=1,HDG=2,TIME=5", "Missing both x/y and lat/lon."),
        ("NAME=ben,X=1,SPD=1,HDG=2,TIME=5", "Missing both x/y and lat/lon."),
        ("NAME=ben,X=1,Y=2,TYPE=uuv,TIME=5", "Missing depth"),
        ("NAME=ben,X=1e,Y=2,TIME=5", "Missing both"),
        ("NAME=ben,X=1000000000000,Y=2,TIME=5", "beyond belief"),
        ("NAME=ben,X=1,Y=2,SPD=1000000,TIME=5", "beyond belief"),
        ("NAME=ben,LAT=1000,LON=2,TIME=5", "outside"),
    ],
)
def test_an_unusable_report_is_refused_with_its_reason(text: str, complaint: str) -> None:
    ledger = ContactLedger(GEODESY)
    with pytest.raises(ValueError, match=complaint):
        ledger.receive(said(text), 1.0)
    assert len(ledger) == 0


def test_a_missing_position_pair_is_computed_from_the_other() -> None:
    lat, lon = GEODESY.to_latlon(100.0, -50.0)
    contact = heard(f"NAME=ben,LAT={lat:.9f},LON={lon:.9f},SPD=1,HDG=2,TIME=5").get("ben")
    assert contact is not None
    assert contact.x == pytest.approx(100.0, abs=1e-3)
    assert contact.y == pytest.approx(-50.0, abs=1e-3)
    ledger = heard("NAME=cal,X=100,Y=-50,SPD=1,HDG=2,TIME=5")
    contact = ledger.get("cal")
    assert contact is not None
    whole = ledger.complete(contact)
    assert whole.lat == pytest.approx(lat)
    assert whole.lon == pytest.approx(lon)
    assert (whole.x, whole.cog, whole.type, whole.length) == (100.0, 2.0, "ship", 12.0)


def test_without_a_datum_a_global_report_is_refused_and_a_local_one_taken() -> None:
    ledger = ContactLedger(None)
    with pytest.raises(ValueError, match="no datum"):
        ledger.receive(said("NAME=ben,LAT=43,LON=-70,TIME=5"), 1.0)
    contact = ledger.receive(said("NAME=ben,X=1,Y=2,TIME=5"), 1.0)
    assert ledger.complete(contact).lat is None


@pytest.mark.parametrize(
    ("told", "kind", "length"),
    [
        ("TYPE=UUV,DEP=3", "auv", 3.0),
        ("TYPE=Kayak", "kayak", 3.0),
        ("TYPE=zeppelin", "ship", 12.0),
        ("", "ship", 12.0),
        ("TYPE=glider,DEP=0", "glider", 2.0),
        ("TYPE=bcrayx", "bcrayx", 1.5),
        ("TYPE=wamv,LENGTH=0", "wamv", 6.0),
        ("TYPE=heron,LENGTH=1.3", "heron", 1.3),
        ("TYPE=mokai", "mokai", None),
    ],
)
def test_types_are_put_right_and_lengths_follow_them(told: str, kind: str, length: float | None) -> None:
    contact = heard(f"NAME=ben,X=1,Y=2,TIME=5,{told}").get("ben")
    assert contact is not None
    assert (contact.type, contact.length) == (kind, length)


def test_course_over_ground_comes_from_the_track_unless_it_is_told() -> None:
    ledger = heard("NAME=ben,X=0,Y=0,HDG=77,TIME=5")
    assert [c.cog for c in ledger] == [77.0]
    heard("NAME=ben,X=10,Y=10,HDG=77,TIME=6", ledger=ledger)
    assert [c.cog for c in ledger] == [pytest.approx(45.0)]
    heard("NAME=ben,X=10,Y=10,HDG=78,TIME=7", ledger=ledger)
    assert [c.cog for c in ledger] == [78.0]
    heard("NAME=ben,X=20,Y=10,HDG=78,COG=91,TIME=8", ledger=ledger)
    assert [c.cog for c in ledger] == [91.0]


def test_age_counts_from_receipt_and_stale_contacts_can_be_dropped() -> None:
    ledger = heard("NAME=ben,X=0,Y=0,TIME=5", now=100.0)
    heard("NAME=cal,X=0,Y=0,TIME=500", now=120.0, ledger=ledger)
    assert [c.age(130.0) for c in ledger] == [30.0, 10.0]
    assert ledger.drop_older_than(20.0, 130.0) == ["ben"]
    assert ledger.names() == ["cal"]


def test_a_full_ledger_lets_go_of_whoever_was_not_heard_for_longest() -> None:
    ledger = ContactLedger(None, capacity=3)
    for number in range(3):
        ledger.receive(said(f"NAME=v{number},X=0,Y=0,TIME=5"), float(number))
    ledger.receive(said("NAME=v0,X=0,Y=0,TIME=5"), 10.0)
    ledger.receive(said("NAME=new,X=0,Y=0,TIME=5"), 11.0)
    assert ledger.names() == ["new", "v0", "v2"]


def test_trails_are_kept_when_asked_for() -> None:
    ledger = ContactLedger(None, history=2)
    for x in range(4):
        ledger.receive(said(f"NAME=ben,X={x},Y=0,TIME={x}"), float(x))
    assert ledger.trail("ben") == [(2.0, 0.0), (3.0, 0.0)]
    ledger.drop("ben")
    assert ledger.trail("ben") == []


def test_extrapolation_runs_slows_and_rests() -> None:
    policy = parse_extrapolation("mode=hdg,thresh=0.1,decay=10:20")
    contact = heard("NAME=ben,X=0,Y=0,SPD=2,HDG=90,COG=0,TIME=50").get("ben")
    assert contact is not None
    assert contact.position(55.0, policy)[0] == pytest.approx(10.0)
    assert contact.position(65.0, policy)[0] == pytest.approx(2 * (10 + 5 - 25 / 20))
    assert contact.position(70.0, policy)[0] == pytest.approx(30.0)
    assert contact.position(7000.0, policy)[0] == pytest.approx(30.0)
    assert contact.position(49.95, policy) == (0.0, 0.0)
    assert contact.position(40.0, policy) == (0.0, 0.0)
    assert contact.position(55.0, parse_extrapolation("mode=cog"))[1] == pytest.approx(10.0)
    assert contact.position(55.0, parse_extrapolation("mode=off")) == (0.0, 0.0)
    assert contact.position(55.0, Extrapolation(ExtrapolationMode.HEADING, thresh=3.0)) == (0.0, 0.0)
    assert contact.position(1050.0, parse_extrapolation("mode=hdg,decay=off"))[0] == pytest.approx(2000.0)


@given(
    st.floats(0, 100),
    st.floats(0, 100),
    st.floats(-20, 20),
    st.lists(st.floats(0, 300), min_size=2, max_size=9),
)
def test_decaying_speed_never_grows_and_never_reverses(
    start: float, span: float, speed: float, times: list[float]
) -> None:
    policy = Extrapolation(ExtrapolationMode.HEADING, 0.0, start, start + span)
    times = sorted(times)
    runs = [policy.distance(speed, t) for t in times]
    for (t0, d0), (t1, d1) in zip(
        zip(times, runs, strict=True), list(zip(times, runs, strict=True))[1:], strict=False
    ):
        assert -1e-9 <= (d1 - d0) * math.copysign(1.0, speed) <= abs(speed) * (t1 - t0) + 1e-9


@pytest.mark.parametrize("text", ["mode=warp", "thresh=x", "decay=5", "decay=9:3", "decay=-1:3", "speed=3"])
def test_a_faulty_extrapolation_policy_is_refused(text: str) -> None:
    with pytest.raises(ValueError):
        parse_extrapolation(text)


def test_a_decay_has_a_start_and_an_end() -> None:
    assert parse_decay("15,30") == (15.0, 30.0)
    with pytest.raises(ValueError):
        Extrapolation(decay_start=9.0, decay_end=3.0)


def test_one_report_heard_by_several_is_each_one_s_own_contact() -> None:
    report = said("NAME=ben,X=10,Y=0,SPD=1,HDG=90,TIME=5")
    ledger = heard("NAME=ben,X=0,Y=0,SPD=1,HDG=90,TIME=4")
    ledger.receive(said("NAME=ben,X=0,Y=-5,SPD=1,HDG=90,TIME=4.5"), 100.0)
    moved, fresh = ledger.receive(report, 101.0), ContactLedger(GEODESY).receive(report, 102.0)
    assert (moved.heard_at, fresh.heard_at) == (101.0, 102.0)
    assert moved.cog == pytest.approx(63.4349, abs=1e-3), "from where it was before to where it is"
    assert fresh.cog == 90.0, "nobody knows where it was before"
    assert moved.report is fresh.report is report


def test_a_report_without_a_place_is_placed_by_the_datum_of_who_hears_it() -> None:
    report = said("NAME=ben,LAT=43.8253,LON=-70.3304,SPD=1,HDG=90,TIME=5")
    for datum, y in ((GEODESY, 0.0), (Geodesy(43.8244, -70.3304), 100.0)):
        contact = ContactLedger(datum).receive(report, 100.0)
        assert (contact.x, contact.y) == pytest.approx((0.0, y), abs=2.0)
    with pytest.raises(ValueError, match="no datum"):
        ContactLedger(None).receive(report, 100.0)


def test_a_report_that_is_of_no_use_is_refused_as_often_as_it_is_heard() -> None:
    report = said("NAME=ben,X=1,Y=2,TYPE=uuv,TIME=5")
    for _ in range(2):
        with pytest.raises(ValueError, match="Missing depth"):
            heard("NAME=eve,X=1,Y=2,TIME=5").receive(report, 100.0)


def test_what_is_kept_of_reports_stays_bounded() -> None:
    from pymoos_lite.records import contact_ledger

    ledger = ContactLedger(GEODESY)
    for number in range(3000):
        ledger.receive(said(f"NAME=ben,X={number},Y=0,SPD=1,HDG=90,TIME=5"), 100.0)
    contact = ledger.get("ben")
    assert contact is not None
    assert contact.x == 2999.0
    assert 0 < len(contact_ledger._kept) <= 1024
