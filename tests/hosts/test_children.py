"""Processes that a host starts, and how they are ended: those at work are waited for, the others are not."""

import sys
import textwrap
import time

import pytest

from pymoos_lite.core.clock import RealClock
from pymoos_lite.hosts.children import Children

MODULES = {
    "slow_to_end": """
        import sys, time
        from pymoos_lite.hosts.children import ENDING, READY
        print(f"{READY}1", flush=True)
        sys.stdin.read()
        for _ in range(8):  # in all longer than the silence that is borne
            time.sleep(0.25)
            print(ENDING, flush=True)
        print("all is written", flush=True)
    """,
    "stuck": """
        import time
        from pymoos_lite.hosts.children import READY
        print(f"{READY}1", flush=True)
        time.sleep(3600)
    """,
    "busy_to_end": """
        import threading, time
        from pymoos_lite.hosts.children import READY
        from pymoos_lite.hosts.remote import stop_with_stdin
        asked = threading.Event()
        stop_with_stdin(asked.set)
        print(f"{READY}1", flush=True)
        asked.wait()
        end = time.process_time() + 1.5
        while time.process_time() < end:
            pass
    """,
}


@pytest.fixture
def children(tmp_path, monkeypatch):
    """A function that starts the named modules; what is left of them is ended afterwards."""
    for name, text in MODULES.items():
        (tmp_path / f"{name}.py").write_text(textwrap.dedent(text))
    paths = [str(tmp_path), *filter(None, sys.path)]
    monkeypatch.setenv("PYTHONPATH", (";" if sys.platform == "win32" else ":").join(paths))
    said = []
    started = []

    def start(goodbye, *names):
        family = Children(RealClock(), said.append, goodbye)
        started.append(family)
        for name in names:
            family.spawn(name, name, {})
        for name in names:
            family.await_ready(name, 60.0)
        return family, said

    yield start
    for family in started:
        for name in family.names():
            family.kill(name)
        family.end(family.names())


def test_a_process_that_still_does_something_is_waited_for_beyond_the_time_of_silence(children):
    family, said = children(1.2, "slow_to_end")
    calls = []
    family.end(["slow_to_end"], lambda: calls.append(1))
    assert said == ["slow_to_end: all is written"]
    assert family.names() == []
    assert len(calls) > 5


def test_a_process_that_shows_no_sign_is_ended_and_the_others_are_not(children):
    family, said = children(1.2, "stuck", "slow_to_end")
    family.end(["stuck", "slow_to_end"])
    assert [text for text in said if "did not end" in text] == ["stuck did not end by itself within 1 s"]
    assert "slow_to_end: all is written" in said
    assert family.names() == []


def test_a_process_that_ends_tells_for_itself_that_it_is_at_work(children):
    family, said = children(60.0, "busy_to_end")
    signs = []
    family.end(["busy_to_end"], lambda: signs.append(family._signs["busy_to_end"]))
    assert len(set(signs)) > 1  # the request, and a sign at least
    assert said == []


def test_no_process_is_waited_for_longer_than_the_longest_goodbye(children, monkeypatch):
    monkeypatch.setattr("pymoos_lite.hosts.children.LONGEST_GOODBYE", 0.6)
    family, said = children(60.0, "slow_to_end")
    began = time.monotonic()
    family.end(["slow_to_end"])
    assert "slow_to_end did not end by itself within 1 s" in said
    assert time.monotonic() - began < 30.0
