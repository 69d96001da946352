"""Faults with real processes and sockets: who dies, who notices, what is lost (nothing)."""

import json
import os
import signal
import subprocess
import sys

import pytest

from pymoos_lite.hosts.remote import DATABASE, REFUSED_STATUS

pytestmark = pytest.mark.slow


def kill(fleet, name):
    os.kill(fleet.host.pid(name), getattr(signal, "SIGKILL", signal.SIGTERM))


def test_apps_survive_a_database_that_is_killed_and_restarted_and_no_post_is_lost(fleet):
    f = fleet("pCounter", restart=True)
    f.client.register("COUNT_pCounter")
    f.client.register("ECHO")
    f.wait_for(lambda: len(f.values("COUNT_pCounter")) > 20, "counting")
    kill(f, DATABASE)
    f.wait_for(lambda: "MOOSDB was started again" in f.said, "restart of the database")
    reached = f.values("COUNT_pCounter")[-1]
    f.wait_for(lambda: f.values("COUNT_pCounter")[-1] > reached + 20, "counting on")
    # Registrations of the app are made again by themselves.
    f.client.notify("ORDER", "are you there")
    f.wait_for(lambda: "are you there" in f.values("ECHO"), "an answer")
    # What was posted while there was no database arrives afterwards. The new database may deliver the
    # value that is current when the watcher registers before older posts are through, so: sorted.
    counts = sorted(set(f.values("COUNT_pCounter")))
    after = [c for c in counts if c > reached]
    assert after == [after[0] + i for i in range(len(after))]


def test_an_app_that_is_killed_is_said_and_started_again_and_others_do_not_notice(fleet):
    f = fleet("pCounter", "pCounter ~ pOther", restart=True)
    f.client.register("COUNT_*")
    f.wait_for(lambda: f.values("COUNT_pCounter") and f.values("COUNT_pOther"), "both counting")
    kill(f, "pCounter")
    f.wait_for(lambda: "pCounter was started again" in f.said, "the restart")
    assert any(s.startswith("pCounter (alpha) failed in its process: was ended") for s in f.said)
    reached = len(f.mail)
    f.wait_for(
        lambda: 1.0 in [m.value for m in f.mail[reached:] if m.name == "COUNT_pCounter"], "a new count"
    )
    others = f.values("COUNT_pOther")
    assert others == [others[0] + i for i in range(len(others))]


def test_an_app_that_raises_says_its_last_words(fleet):
    f = fleet("pCounter", "pCounter ~ pOther")
    f.client.register("COUNT_*")
    f.wait_for(lambda: f.values("COUNT_pCounter") and f.values("COUNT_pOther"), "both counting")
    f.client.notify("ORDER", "fall")
    f.wait_for(lambda: len(f.host.failures) == 2, "both failing")
    assert any("RuntimeError: told to fall" in s and "plugins.py:" in s for s in f.said)
    f.wait_for(lambda: not f.host.alive(), "the end of both")


def test_a_second_app_of_one_name_is_refused_and_exits_with_an_error(fleet, mission):
    f = fleet("pCounter")
    f.client.register("COUNT_pCounter")
    f.wait_for(lambda: len(f.values("COUNT_pCounter")) > 5, "counting")
    order = {
        "mission": str(mission("pCounter")),
        "settings": {},
        "app": "pCounter",
        "host": f.host.address[0],
        "port": f.host.address[1],
        "warp": 1.0,
        "key": None,
        "log_dir": None,
        "seed": None,
        "patience": 0.0,
        "share_bind": "127.0.0.1",
    }
    second = subprocess.Popen(
        [sys.executable, "-m", "pymoos_lite.hosts.remote"],
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    second.stdin.write(json.dumps(order) + "\n")
    second.stdin.flush()
    f.wait_for(lambda: second.poll() is not None, "the refusal")
    said = second.stderr.read()
    second.stdin.close()
    second.stderr.close()
    assert second.returncode == REFUSED_STATUS
    assert 'A client of this name ("pCounter") already exists' in said
    reached = f.values("COUNT_pCounter")[-1]
    f.wait_for(lambda: f.values("COUNT_pCounter")[-1] > reached + 10, "the first counting on")


def test_a_subscriber_that_stops_reading_hinders_nobody(fleet):
    f = fleet("pCounter", "pSleeper")
    f.client.register("COUNT_pCounter")
    f.client.register("ASLEEP")
    f.wait_for(lambda: f.values("ASLEEP"), "falling asleep")
    reached = f.values("COUNT_pCounter")[-1] if f.values("COUNT_pCounter") else 0.0
    f.wait_for(lambda: (f.values("COUNT_pCounter") or [0.0])[-1] > reached + 200, "counting on")
    counts = f.values("COUNT_pCounter")
    assert counts == [counts[0] + i for i in range(len(counts))]


def test_a_community_with_a_key_takes_only_clients_that_have_it(fleet):
    from pymoos_lite.hosts.ports import RemoteClient

    f = fleet("pCounter", key="between us")
    f.client.register("COUNT_pCounter")
    f.wait_for(lambda: len(f.values("COUNT_pCounter")) > 5, "counting")
    stranger = RemoteClient("stranger", *f.host.address, "a guess")
    try:
        seen = len(f.values("COUNT_pCounter"))
        while len(f.values("COUNT_pCounter")) < seen + 50:
            stranger.poll(0.01)
            f.wait_for(lambda: True, "a turn")
            f.host.turn(0.01)
            f.mail += f.client.poll(0.01)
        assert not stranger.connected
    finally:
        stranger.close(0.0)
