"""The contact manager as an app: configuration, mail, posts."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marine_harness import Sea, warnings_of

from pymoos_lite.core.message import Message
from pymoos_lite.marine.contact_manager import BasicContactManager, ContactManager
from pymoos_lite.records.view import parse_circle

ALERT = "alert = id=avd, on_flag=CONTACT_INFO=name=$[VNAME] # contact=$[VNAME],alert_range=60, cpa_range=75"


def sea_with(config: str = "", cls: type[ContactManager] = ContactManager) -> tuple[Sea, ContactManager]:
    sea = Sea()
    app = sea.add(cls, "pContactMgrV20", f"AppTick = 2\n{config}")
    sea.run(0.1)  # of posts made before an app is connected it hears the last one only
    for name, value in (("NAV_X", 0), ("NAV_Y", 0), ("NAV_HEADING", 90), ("NAV_SPEED", 1)):
        sea.post(name, value)
    return sea, app


def report(sea: Sea, name: str, x: float, y: float, more: str = "") -> None:
    sea.post("NODE_REPORT", f"NAME={name},X={x},Y={y},SPD=0,HDG=0,TIME={sea.now},TYPE=kayak{more}")


def test_a_contact_that_comes_near_is_listed_alerted_and_recapped() -> None:
    sea, app = sea_with(ALERT)
    report(sea, "ben", 30.0, 40.0)
    sea.run(2.2)
    assert sea.last("CONTACTS_LIST") == "ben"
    assert sea.heard("CONTACT_INFO") == ["name=ben # contact=ben"]
    assert sea.last("CONTACTS_ALERTED") == "(ben,avd)"
    assert sea.last("CONTACTS_COUNT") == 1.0
    assert sea.last("CONTACTS_RECAP").startswith("vname=ben,range=50.00,age=")
    assert "ben" in "\n".join(app.report())


def test_alert_requests_by_mail_merge_with_the_configured_ones() -> None:
    sea, app = sea_with(ALERT)
    sea.post("BCM_ALERT_REQUEST", "id=avd,on_flag=EXTRA=$[VNAME]")
    sea.post("BCM_ALERT_REQUEST", "id=far,on_flag=FAR=$[VNAME],alert_range=500")
    report(sea, "ben", 30.0, 40.0)
    sea.run(1.2)
    assert sea.last("EXTRA") == "ben"
    assert sea.last("FAR") == "ben"
    sea.post("BCM_ALERT_REQUEST", "id=far,alert_range=never")
    sea.run(1.2)
    assert any("never" in text for text in warnings_of(app))


def test_range_requests_are_answered_in_their_own_variable() -> None:
    sea, app = sea_with()
    sea.post("BCM_REPORT_REQUEST", "var=CLOSE_ONES, range=60")
    report(sea, "ben", 30.0, 40.0)
    sea.run(1.2)
    assert sea.last("CLOSE_ONES") == "ben"
    sea.post("BCM_REPORT_REQUEST", "range=60")
    sea.run(1.2)
    assert warnings_of(app)


def test_alerts_wait_for_a_driving_helm_when_told_to() -> None:
    sea, _ = sea_with(f"{ALERT}\nhold_alerts_for_helm = true")
    report(sea, "ben", 30.0, 40.0)
    sea.post("IVPHELM_STATE", "PARK")
    sea.run(1.2)
    assert not sea.heard("CONTACT_INFO")
    sea.post("IVPHELM_STATE", "DRIVE")
    sea.run(1.2)
    assert sea.heard("CONTACT_INFO")


def test_behaviours_of_a_contact_can_be_disabled_enabled_and_expunged() -> None:
    sea, app = sea_with(
        "disable_var = NO\nenable_var = YES\nexpunge_var = GONE\n"
        "able_flag = ALL=$[ALL_DISABLED]\n"
        "disable_flag = LAST=$[RECENT_DISABLED] $[TOTAL_DISABLED]\n"
        "enable_flag = BACK=$[RECENT_ENABLED]"
    )
    for name, value in (("NO", "ben"), ("NO", "contact=cal"), ("YES", "ben"), ("GONE", "vsource=ais")):
        sea.post(name, value)
        sea.run(0.6)
    assert sea.heard("BHV_ABLE_FILTER") == [
        "contact=ben,action=disable",
        "contact=cal,action=disable",
        "contact=ben,action=enable",
        "vsource=ais,action=expunge",
    ]
    assert sea.heard("ALL") == ["ben", "ben,cal", "cal"]
    assert sea.heard("LAST") == ["ben 1", "cal 2"]
    assert sea.heard("BACK") == ["ben"]
    sea.post("NO", "colour=red")
    sea.run(0.6)
    assert warnings_of(app)


def test_the_widest_alert_range_is_drawn_on_request() -> None:
    sea, _ = sea_with(f"{ALERT}\nalert_range_color = green")
    sea.run(1.2)
    assert not sea.heard("VIEW_CIRCLE")
    sea.post("BCM_DISPLAY_RADII", "true")
    sea.run(1.2)
    circle = parse_circle(sea.last("VIEW_CIRCLE"))
    assert (circle.radius, circle.label, circle.attributes.duration) == (75.0, "alert_abe", 3.0)


@pytest.mark.parametrize(
    ("line", "word"),
    [
        ("reject_range = far", "off"),
        ("decay = 30,10", "start"),
        ("match_region = pts={0,0:1,1}", "match_region"),
        ("alert = id=a,alert_range=-3", "alert_range"),
        ("contact_max_age = 0", "contact_max_age"),
        ("retire_flag = nothing", "retire_flag"),
        ("ignore_nmae = x", "ignore_name"),
    ],
)
def test_faulty_configuration_is_a_warning_that_says_what_would_be_right(line: str, word: str) -> None:
    _, app = sea_with(line)
    assert any(word in text for text in app.log.config_warnings)


def test_a_word_both_matched_and_ignored_is_a_warning() -> None:
    sea, app = sea_with("ignore_name = ben\nmatch_name = ben, cal")
    assert any("both" in text for text in app.log.config_warnings)
    report(sea, "cal", 1.0, 1.0)
    report(sea, "dan", 1.0, 1.0)
    sea.run(1.2)
    assert sea.last("CONTACTS_LIST") == "cal,dan"  # the later entry, match, was refused


def test_limits_can_be_switched_off() -> None:
    sea, app = sea_with("reject_range = off\nrecap_interval = off\nmax_retired_history = 99")
    report(sea, "ben", 90_000.0, 0.0)
    sea.run(2.2)
    assert sea.last("CONTACTS_LIST") == "ben"
    assert not sea.heard("CONTACTS_RECAP")
    assert app.core.parameters.max_retired_history == 50


def test_the_old_contact_manager_gives_alerts_a_range_and_tells_who_is_not_alerted() -> None:
    sea, app = sea_with("alert = id=a,on_flag=SEEN=$[VNAME]", BasicContactManager)
    report(sea, "ben", 900.0, 0.0)
    report(sea, "cal", 1500.0, 0.0)
    sea.run(1.2)
    assert sea.heard("SEEN") == ["ben"]
    assert sea.last("CONTACTS_UNALERTED") == "cal"
    assert app.core.parameters.contact_max_age == 600.0


@settings(max_examples=50, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(
                [
                    "NODE_REPORT",
                    "NAV_X",
                    "NAV_HEADING",
                    "BCM_ALERT_REQUEST",
                    "BCM_REPORT_REQUEST",
                    "BCM_DISPLAY_RADII",
                    "NO",
                ]
            ),
            st.one_of(
                st.floats(),
                st.text(max_size=30),
                st.binary(max_size=4),
                st.sampled_from(
                    [
                        "NAME=b,X=1,Y=1,TIME=1",
                        "id=a,on_flag=$[VNAME]=1,alert_range=1e9",
                        "var=A,range=5",
                        "contact=x",
                    ]
                ),
            ),
        ),
        max_size=10,
    )
)
def test_no_mail_whatever_makes_the_contact_manager_fall_over(
    mail: list[tuple[str, float | str | bytes]],
) -> None:
    sea, app = sea_with(f"{ALERT}\ndisable_var = NO\nearly_warning_time = 5\nalert_verbose = true")
    for name, value in mail:
        app.on_mail([Message(name, value, sea.now, "tester")])
        sea.run(0.6)
    sea.run(1.0)
    assert all(isinstance(line, str) for line in app.report())


def test_navigation_that_is_no_number_is_a_warning_and_changes_nothing() -> None:
    sea = Sea()
    manager = sea.add(ContactManager, "pContactMgrV20")
    sea.run(1.0)
    for number, value in enumerate((12.5, 1e300)):
        sea.post("NAV_X", value)
        sea.run(1.0)
        assert manager.core.own_x == 12.5
        assert any("NAV_X needs a finite number" in text for text in manager.log.run_warnings) is (
            number == 1
        )
