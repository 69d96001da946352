"""behaviors.md B4: relative states of two vessels and the contact flags that follow from them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.geometry.angles import project_point
from pymoos_lite.geometry.encounter import (
    EVENTS,
    BearingLine,
    ContactTag,
    EncounterHistory,
    RelativeState,
)
from pymoos_lite.geometry.specs import SpecError

f = st.integers(-50, 50).map(float)
h = st.integers(0, 359).map(float)
v = st.integers(0, 8).map(lambda i: i / 2)
states = st.builds(RelativeState, f, f, h, v, f, f, h, v)


def sail(
    osx: float, osh: float, osv: float, cn: tuple[float, float, float, float], steps: int
) -> list[RelativeState]:
    """Own ship from (osx, 0) and a contact (x, y, heading, speed), one state a second."""
    found = []
    for t in range(steps):
        own = project_point(osh, osv * t, osx, 0.0)
        other = project_point(cn[2], cn[3] * t, cn[0], cn[1])
        found.append(RelativeState(*own, osh, osv, *other, cn[2], cn[3]))
    return found


def events_of(track: list[RelativeState]) -> list[set[str]]:
    history = EncounterHistory()
    out = []
    for state in track:
        history.add(state)
        out.append(set(history.events()))
    return out


@given(states)
def test_what_own_ship_is_to_the_contact_the_contact_is_to_own_ship_seen_from_there(
    s: RelativeState,
) -> None:
    other = RelativeState(s.cnx, s.cny, s.cnh, s.cnv, s.osx, s.osy, s.osh, s.osv)
    assert s.range == other.range
    assert s.os_cn_rel_bng == other.cn_os_rel_bng
    assert s.roc == pytest.approx(other.roc, abs=1e-9)
    assert s.cpa == pytest.approx(other.cpa, abs=1e-9)
    for name in ("fore", "aft", "port", "star"):
        assert getattr(s, f"os_{name}_of_cn") == getattr(other, f"cn_{name}_of_os")
    for name in ("passes_{}", "passes_{}_port", "passes_{}_star"):
        assert getattr(s, "os_" + name.format("cn")) == getattr(other, "cn_" + name.format("os"))
    for name in ("crosses_{}_bow", "crosses_{}_stern", "crosses_{}_bow_dist"):
        assert getattr(s, "os_" + name.format("cn")) == getattr(other, "cn_" + name.format("os"))


def test_a_crossing_from_starboard_in_numbers() -> None:
    s = RelativeState(0, 0, 0, 2, 50, 50, 270, 2)
    assert (s.os_cn_rel_bng, s.cn_os_rel_bng) == (45.0, 315.0)
    assert s.range == pytest.approx(70.7107, abs=1e-4)
    assert s.roc == pytest.approx(2.828, abs=1e-3)
    assert s.cn_spd_in_os_pos == pytest.approx(1.4142, abs=1e-4)
    assert s.bng_rate == pytest.approx(0.0, abs=1e-12)
    assert s.cpa == pytest.approx(0.0, abs=1e-9)
    assert s.cn_fore_of_os
    assert s.cn_star_of_os
    assert s.os_port_of_cn


def test_range_tags_without_at_are_due_always_and_with_at_once() -> None:
    track = sail(0, 0, 0, (0, 40, 180, 5), 14)
    tags = [ContactTag.parse(t) for t in ("<20", ">20", "@<20", "@>20")]
    history = EncounterHistory()
    due = []
    for state in track:
        history.add(state)
        due.append([str(tag) for tag in history.due_tags(tags)])
    assert due[0] == [">20"]
    assert due[4] == ["<20", ">20", "@<20"]
    assert due[5] == ["<20"]
    assert due[12] == ["<20", ">20", "@>20"]
    assert due[13] == [">20"]


def test_the_closest_point_is_reported_once_when_the_range_opens_again() -> None:
    found = events_of(sail(0, 0, 0, (10, 40, 180, 5), 20))
    assert [t for t, events in enumerate(found) if "cpa" in events] == [9]


def test_the_closest_point_is_found_however_slowly_the_range_opens() -> None:
    slow = sail(0, 0, 0, (10, 0.5, 180, 0.01), 900)
    found = [t for t, events in enumerate(events_of(slow)) if "cpa" in events]
    assert len(found) == 1
    assert slow[found[0]].range == pytest.approx(10.1, abs=0.01)


def test_no_closest_point_before_the_history_is_deep_enough() -> None:
    assert not any("cpa" in events for events in events_of(sail(0, 0, 0, (10, 10, 180, 5), 12)))


def test_overtaking_to_port_is_passing_and_reported_from_both_sides() -> None:
    found = events_of(sail(-10, 0, 4, (0, 30, 0, 1), 16))
    passed = {t: events for t, events in enumerate(found) if events & {"os_passed_cn", "cn_passed_os"}}
    assert set().union(*passed.values()) >= {
        "os_passed_cn",
        "os_passed_cn_port",
        "cn_passed_os",
        "cn_passed_os_star",
    }
    assert "os_passed_cn_star" not in set().union(*found)


def test_crossing_ahead_is_told_from_crossing_astern() -> None:
    ahead = set().union(*events_of(sail(-20, 90, 4, (0, -30, 0, 1), 12)))
    assert {"os_crossed_cn", "os_crossed_cn_bow"} <= ahead
    assert "os_crossed_cn_stern" not in ahead
    astern = set().union(*events_of(sail(-20, 90, 4, (0, 30, 0, 1), 12)))
    assert {"os_crossed_cn", "os_crossed_cn_stern"} <= astern


@given(st.lists(states, min_size=1, max_size=9))
def test_events_are_always_known_names_and_none_on_the_first_look(track: list[RelativeState]) -> None:
    found = events_of(track)
    assert found[0] == set()
    assert set().union(*found) <= set(EVENTS)


def test_a_cleared_history_starts_anew() -> None:
    history = EncounterHistory()
    assert not history.due(ContactTag.parse("<99"))
    for state in sail(0, 0, 0, (0, 40, 180, 5), 4):
        history.add(state)
    history.clear()
    assert (history.now, history.before) == (None, None)
    assert not history.due(ContactTag.parse("<99"))


@pytest.mark.parametrize("text", ["<30", ">30", "@<30.5", "@>7", *(f"@{event}" for event in EVENTS)])
def test_tags_read_back_from_their_text(text: str) -> None:
    assert str(ContactTag.parse(text)) == text


@pytest.mark.parametrize("text", ["", "30", "<", "<-3", "@", "@lunch", "<x"])
def test_unknown_tags_are_refused(text: str) -> None:
    with pytest.raises(SpecError, match="contact flag tag"):
        ContactTag.parse(text)


def test_the_bearing_line_takes_the_first_colour_not_below_the_value() -> None:
    line = BearingLine.parse("white:0, green:0.65, yellow:0.8, red:1.0")
    assert [line.color(r, 99.0) for r in (0.0, 0.3, 0.7, 0.9, 1.0, 1.1)] == [
        "white",
        "green",
        "yellow",
        "red",
        "red",
        "blank",
    ]
    assert BearingLine.parse("red:30,white:100,info:range").color(1.0, 50.0) == "white"
    for text in ("red", "red:x", "info:speed", ":3"):
        with pytest.raises(SpecError):
            BearingLine.parse(text)
