"""uOptionMarker: circles in the colour of the option a vessel favours."""

import pytest

from opinion_engine.marker import Looks, OptionMarker, Seen, option_circle
from pymoos_lite.app import AppContext
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.records.view import parse_circle

LOOKS = Looks({"explore": "green", "migrate": "red"}, radius=7.0, edge_size=2.0, saturated=2.0)


def test_the_colour_is_that_of_the_leading_option_and_fades_to_gray():
    full = option_circle("abe", Seen(1.0, 2.0, {"explore": -4.0, "migrate": 4.0}), LOOKS)
    assert (full.x, full.y, full.radius) == (1.0, 2.0, 7.0)
    assert full.attributes.label == "abe's opt_circ"
    assert full.attributes.edge_color == "1:0:0"
    half = option_circle("abe", Seen(1.0, 2.0, {"explore": -1.0, "migrate": 1.0}), LOOKS)
    assert half.attributes.edge_color == "0.75:0.25:0.25"


@pytest.mark.parametrize(
    "seen",
    [Seen(), Seen(1.0, 2.0), Seen(None, 2.0, {"a": 1.0}), Seen(1.0, 2.0, {"a": 0.0}), Seen(1.0, 2.0, {})],
)
def test_nothing_is_drawn_without_position_opinion_or_leader(seen):
    assert option_circle("abe", seen, LOOKS) is None


class Shore:
    def __init__(self, **settings):
        self.host = Lockstep()
        home = self.host.add_community("abe")
        self.watch = LocalConnection(home.database, "watch", self.host.clock)
        self.watch.register("VIEW_CIRCLE", "*", 0.0, ())
        lines = [ConfigLine(k, v, 1) for k, v in settings.items()] + [
            ConfigLine("color_set", "explore:green", 2)
        ]
        context = AppContext(
            "uOptionMarker", "abe", self.host.clock,
            LocalConnection(home.database, "uOptionMarker", self.host.clock), lines,
        )  # fmt: skip
        runner = self.host.add_app(home, OptionMarker, context)
        self.app = runner.app

    def post(self, name, value):
        self.watch.publish(Message(name, value, self.host.clock.now(), "watch", "", "abe"))

    def run(self, seconds):
        self.host.run(seconds)
        return [parse_circle(m.value) for m in self.watch.take_mail()]


def test_own_and_other_vessels_get_circles_that_vanish_when_opinions_grow_stale():
    shore = Shore(radius="9")
    shore.post("NAV_X", 10.0)
    shore.post("NAV_Y", 20.0)
    shore.post("OWN_OPINION_STATE", "abe:leader:explore=5.0:migrate=-5.0")
    shore.post("NODE_REPORT", "NAME=ben,X=1,Y=2,SPD=0,HDG=0,TYPE=kayak,TIME=1")
    shore.post("OPINION_MESSAGE", "ben:leader:explore=0.5:migrate=-0.5")
    drawn = {c.attributes.label: c for c in shore.run(1.0)}
    assert set(drawn) == {"abe's opt_circ", "ben's opt_circ"}
    assert (drawn["abe's opt_circ"].x, drawn["abe's opt_circ"].radius) == (10.0, 9.0)
    later = shore.run(4.0)
    assert {c.attributes.label for c in later if not c.attributes.active} == set(drawn)
    assert "ben" in "\n".join(shore.app.report())


def test_stale_circles_stay_if_asked():
    shore = Shore(post_circ_with_stale_opinion="true")
    shore.post("NODE_REPORT", "NAME=ben,X=1,Y=2,SPD=0,HDG=0,TYPE=kayak,TIME=1")
    shore.post("OPINION_MESSAGE", "ben:leader:explore=0.5:migrate=-0.5")
    assert len(shore.run(1.0)) == 1
    assert shore.run(10.0) == []


def test_damaged_mail_is_a_run_warning():
    shore = Shore()
    shore.post("NODE_REPORT", "nonsense")
    shore.post("OPINION_MESSAGE", "nonsense")
    assert shore.run(1.0) == []
    assert shore.app.log.run_warnings_total == 2
    assert not shore.host.failures
