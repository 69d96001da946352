"""A share's outage: silence both ways for a while, counted, and everything back afterwards."""

import pytest
from fleet_fixture import Fleet

from pymoos_lite.field.share import parse_outage


def test_during_an_outage_nothing_comes_or_goes_and_afterwards_all_does():
    fleet = Fleet()
    shore = fleet.shore()
    abe = fleet.vehicle("abe", 9201, share=(("outage", "20:30"),))
    fleet.run(19.0)
    before = len(shore.values("REPORT"))
    assert before > 10
    fleet.run(2.0)
    quiet = len(shore.values("REPORT"))
    fleet.post("shoreside", "DEPLOY_ALL", "true")
    fleet.run(8.5)
    assert len(shore.values("REPORT")) == quiet
    assert abe.values("DEPLOY") == []
    fleet.run(20.0)
    assert len(shore.values("REPORT")) > quiet + 10
    fleet.post("shoreside", "DEPLOY_ALL", "now")
    fleet.run(2.0)
    assert abe.values("DEPLOY")[-1] == "now"
    drops = fleet.get("abe", "pShare").drops
    assert drops.silenced > 10


@pytest.mark.parametrize("text", ["", "5", "7:5", "a:b", "-1:5", "5:5"])
def test_an_outage_has_a_beginning_and_an_end(text):
    with pytest.raises(ValueError, match="BEGIN:END"):
        parse_outage(text)
