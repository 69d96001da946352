"""The database's network counters in words."""

from pymoos_lite.core.frames import Fault
from pymoos_lite.core.server_session import ServerStatistics
from pymoos_lite.hosts.network_report import PERIOD, NetworkReport


def test_drops_and_refusals_are_told_once_and_stay_in_the_variable():
    report, statistics = NetworkReport(), ServerStatistics()
    variable, news = report.look(statistics, 0.0)
    assert variable.startswith("admitted=0,")
    assert news is None
    assert report.look(statistics, PERIOD) == (None, None)
    statistics.dropped[Fault.MALFORMED] += 7
    statistics.dropped[Fault.BAD_SEAL] += 2
    statistics.slow += 1
    statistics.refused += 1
    variable, news = report.look(statistics, 2 * PERIOD)
    assert variable.endswith("dropped=9,dropped_malformed=7,dropped_bad_seal=2")
    assert "9 unacceptable datagrams dropped (all: malformed 7, bad seal 2)" in news
    assert "1 clients disconnected because they did not read" in news
    assert "1 connections refused" in news
    statistics.datagrams += 1000
    assert report.look(statistics, 3 * PERIOD) == (None, None)


def test_the_counters_are_looked_at_only_now_and_then():
    report, statistics = NetworkReport(), ServerStatistics()
    report.look(statistics, 0.0)
    statistics.dropped[Fault.MALFORMED] += 1
    assert report.look(statistics, 0.5 * PERIOD) == (None, None)
    assert report.look(statistics, PERIOD)[1] is not None
