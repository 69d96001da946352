"""The contact ledger (helm.md 11.2)."""

from __future__ import annotations

import pytest

from ivp_helm.contacts import Contact, HelmContacts
from pymoos_lite.geometry.geodesy import Geodesy


def report(name: str = "ben", time: float = 100.0, **more: object) -> str:
    values = {
        "NAME": name,
        "TYPE": "kayak",
        "TIME": time,
        "X": 10,
        "Y": 20,
        "SPD": 2,
        "HDG": 90,
        "GROUP": "red",
        **more,
    }
    return ",".join(f"{key}={value}" for key, value in values.items() if value is not None)


def seen(
    ledger: HelmContacts, now: float = 100.0, referred: frozenset[str] = frozenset()
) -> dict[str, Contact]:
    ledger.refresh(now, referred)
    return ledger.snapshot


def test_a_report_becomes_a_contact_in_the_next_snapshot():
    ledger = HelmContacts("alpha")
    ledger.take(report(), 100.5)
    assert ledger.snapshot == {}
    ben = seen(ledger, 101.0)["ben"]
    assert (ben.x, ben.y, ben.speed, ben.heading, ben.time, ben.heard_at) == (10, 20, 2, 90, 100, 100.5)
    assert (ben.report.group, ben.type, ben.length) == ("red", "kayak", 3.0)


def test_own_reports_are_not_contacts():
    ledger = HelmContacts("alpha")
    assert ledger.take(report("alpha"), 100.0) is None
    assert seen(ledger) == {}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"NAME": None}, "Missing vname"),
        ({"TIME": None}, "Missing timestamp"),
        ({"X": None}, "no datum"),
        ({"TYPE": "uuv"}, "Missing depth"),
    ],
)
def test_incomplete_reports_are_refused_with_the_reason(changes, words):
    more = {"LAT": 43, "LON": -70} if "X" in changes else {}
    with pytest.raises(ValueError, match=words):
        HelmContacts("alpha").take(
            report(**{**more, **changes}) if "NAME" not in changes else report(name=None), 100.0
        )


def test_text_that_is_no_report_is_refused():
    with pytest.raises(ValueError):
        HelmContacts("alpha").take("hello", 100.0)


def test_missing_coordinates_are_found_from_latitude_and_longitude():
    geodesy = Geodesy(43.0, -70.0)
    ledger = HelmContacts("alpha", geodesy=geodesy)
    ledger.take(report(X=None, Y=None, LAT=43.001, LON=-70.001), 100.0)
    ben = seen(ledger)["ben"]
    assert (ben.x, ben.y) == pytest.approx(geodesy.to_local(43.001, -70.001))


def test_types_are_normalised_and_unknown_ones_are_ships():
    ledger = HelmContacts("alpha")
    ledger.take(report(TYPE="UUV", DEP=5), 100.0)
    assert (seen(ledger)["ben"].type, seen(ledger)["ben"].report.depth) == ("auv", 5.0)
    ledger.take(report(TYPE="whale"), 100.0)
    assert (seen(ledger)["ben"].type, seen(ledger)["ben"].length) == ("ship", 12.0)


def test_stale_contacts_are_dropped_later_if_somebody_refers_to_them():
    ledger = HelmContacts("alpha", max_age=45.0)
    ledger.take(report("ben"), 100.0)
    ledger.take(report("cal"), 100.0)
    assert set(seen(ledger, 145.0, frozenset({"cal"}))) == {"ben", "cal"}
    assert set(seen(ledger, 145.1, frozenset({"cal"}))) == {"cal"}
    assert set(seen(ledger, 190.1, frozenset({"cal"}))) == set()


def test_positions_are_as_last_reported_unless_extrapolation_is_asked_for():
    still, moving = HelmContacts("alpha"), HelmContacts("alpha", extrapolate=10.0)
    for ledger in (still, moving):
        ledger.take(report(), 100.0)
    assert seen(still, 105.0)["ben"].x == 10
    assert seen(moving, 105.0)["ben"].x == pytest.approx(20.0)
    assert seen(moving, 130.0)["ben"].x == pytest.approx(30.0), "for at most ten seconds"


def test_course_over_ground_comes_from_successive_reports():
    ledger = HelmContacts("alpha")
    ledger.take(report(), 100.0)
    ledger.take(report(X=10, Y=25, time=101.0), 101.0)
    assert seen(ledger, 101.0)["ben"].cog == 0.0


def test_the_summary_counts_contacts_and_reports():
    ledger = HelmContacts("alpha")
    for name in ("cal", "ben", "cal"):
        ledger.take(report(name), 100.0)
    assert ledger.summary() == "now:2, reps:3, who:ben,cal"
