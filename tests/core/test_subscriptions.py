"""Wildcards and throttled routes."""

import itertools
import re

from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.core.message import Message
from pymoos_lite.core.subscriptions import Route, Subscription, matches

NAMES = st.text(alphabet="AB_*?.", max_size=8)


@given(pattern=NAMES, name=st.text(alphabet="AB_.", max_size=8))
def test_wildcards_match_as_the_equivalent_regular_expression(pattern, name):
    expression = "".join({"*": ".*", "?": "."}.get(c, re.escape(c)) for c in pattern)
    assert matches(pattern, name) == (re.fullmatch(expression, name) is not None)


def test_a_hostile_pattern_is_matched_in_reasonable_steps():
    assert not matches("*A" * 500 + "B", "A" * 5000)


@given(
    interval=st.floats(0.1, 5.0),
    gaps=st.lists(st.floats(0.0, 3.0), min_size=1, max_size=30),
)
def test_a_throttled_route_keeps_its_interval_and_always_delivers_the_last_value(interval, gaps):
    mailbox: list[Message] = []
    route = Route(mailbox, [Subscription("X", interval=interval)])
    now = 1000.0
    arrivals: list[float] = []

    def note(before):
        arrivals.extend([now] * (len(mailbox) - before))

    for index, gap in enumerate(gaps):
        target = now + gap
        while route.deadline() <= target:
            now = max(now, route.deadline())
            before = len(mailbox)
            route.release(now)
            note(before)
        now = target
        before = len(mailbox)
        route.offer(Message("X", float(index), now, "src"), now)
        note(before)
    now = max(now, min(route.deadline(), now + 10 * interval))
    before = len(mailbox)
    route.release(now)
    note(before)
    assert mailbox[-1].value == float(len(gaps) - 1)
    assert [m.value for m in mailbox] == sorted(m.value for m in mailbox)
    assert all(b - a >= interval - 1e-9 for a, b in itertools.pairwise(arrivals))
