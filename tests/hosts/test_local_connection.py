"""The quick way into the database, against the slow one: whatever is posted, both do the same."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.core.clock import VirtualClock
from pymoos_lite.core.database import Database
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection


class Town:
    """A database with two posting clients and a reader; `quick` uses their connections, else `publish`."""

    def __init__(self, quick):
        self.quick = quick
        self.clock = VirtualClock(100.0)
        self.database = Database("alpha", 100.0)
        self.clients = {name: LocalConnection(self.database, name, self.clock) for name in ("one", "two")}
        self.reader = LocalConnection(self.database, "reader", self.clock)

    def do(self, step):
        kind, client, name, value = step
        connection = self.clients[client]
        if kind == "post":
            self.post(connection, client, Message(name, value, self.clock.now(), client, "", "alpha"))
        elif kind == "numbers" and self.quick:
            connection.publish_numbers([(name, 1.0), ("Y", 2.0)], self.clock.now(), client)
        elif kind == "numbers":
            for each, number in ((name, 1.0), ("Y", 2.0)):
                self.post(connection, client, Message(each, number, self.clock.now(), client, "", "alpha"))
        elif kind == "register":
            self.reader.register(name, "*", value if isinstance(value, float) else 0.0, ())
        elif kind == "unregister":
            self.reader.unregister(name)
        elif kind == "clear":
            self.database.clear(self.clock.now())
        elif kind == "leave":
            connection.close()
        else:
            self.clock.advance_to(self.clock.now() + 1.0)
            self.database.tick(self.clock.now())

    def post(self, connection, client, message):
        if self.quick:
            connection.publish(message)
        elif connection.connected:
            refusal = self.database.publish(client, message, self.clock.now())
            if refusal is not None:
                connection.notices.append(str(refusal))

    def state(self):
        return (
            [tuple(m) for m in self.reader.mail],
            [(r.name, r.message, r.writes) for r in self.database.records()],
            {name: self.database.published_by(name) for name in self.clients},
            {name: list(connection.notices) for name, connection in self.clients.items()},
            self.database.statistics,
        )


steps = st.tuples(
    st.sampled_from(("post", "post", "numbers", "register", "unregister", "clear", "leave", "wait")),
    st.sampled_from(("one", "two")),
    st.sampled_from(("X", "Y", "Z")),
    st.sampled_from((1.5, 0.0, "text", b"bytes")),
)


@given(st.lists(steps, max_size=40))
def test_a_door_does_what_publish_does(story):
    quick, slow = Town(True), Town(False)
    for step in story:
        quick.do(step)
        slow.do(step)
        assert quick.state() == slow.state()


def test_accepted_posts_are_counted_across_a_clear():
    town = Town(True)
    before = town.database.statistics.accepted
    for _ in range(3):
        town.do(("post", "one", "X", 1.5))
    town.do(("clear", "one", "X", 0.0))
    town.do(("post", "one", "X", "text"))
    assert town.database.statistics.accepted == before + 4


def test_numbers_are_posted_as_floats_and_a_text_among_them_is_an_error():
    town = Town(True)
    town.clients["one"].publish_numbers([("X", 3)], 100.0, "one")
    assert town.database.get("X") == Message("X", 3.0, 100.0, "one", "", "alpha")
    with pytest.raises(ValueError, match="could not convert"):
        town.clients["one"].publish_numbers([("X", "deep")], 100.0, "one")


def test_whoever_has_left_posts_nothing():
    town = Town(True)
    town.do(("post", "one", "X", 1.5))
    town.clients["one"].close()
    assert not town.clients["one"].publish(Message("X", 2.5, 101.0, "one", "", "alpha"))
    town.clients["one"].publish_numbers([("X", 3.5)], 101.0, "one")
    assert town.database.value("X") == 1.5
