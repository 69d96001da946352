"""The community database, against sentences of community.md 6 and a slow twin."""

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from pymoos_lite.core.database import Database
from pymoos_lite.core.message import Message
from pymoos_lite.core.refusals import NameClashError


def message(name, value, time=0.0, source="pub"):
    return Message(name, value, time, source)


@pytest.fixture
def db():
    database = Database("alpha", 0.0)
    database.connect("pub", 0.0)
    return database


def named(mailbox, *names):
    return [(m.name, m.value) for m in mailbox if m.name in names]


def test_a_late_subscriber_hears_the_last_value(db):
    db.publish("pub", message("NAV_X", 1.0), 1.0)
    db.publish("pub", message("NAV_X", 12.5, 2.0), 2.0)
    mail = db.connect("helm", 3.0)
    db.register("helm", "NAV_X", 3.0)
    assert mail == [Message("NAV_X", 12.5, 2.0, "pub", "", "alpha")]


def test_registering_again_replays_the_current_value(db):
    db.publish("pub", message("X", "a"), 1.0)
    mail = db.connect("helm", 1.0)
    db.register("helm", "X", 1.0)
    db.register("helm", "X", 2.0)
    assert named(mail, "X") == [("X", "a"), ("X", "a")]


def test_every_post_arrives_in_order_and_own_posts_too(db):
    mailbox = db.connect("helm", 0.0)
    db.register("helm", "*", 0.0, omit=("DB_*",))
    for i in range(50):
        db.publish("pub" if i % 2 else "helm", message(f"V{i % 3}", float(i)), float(i))
    assert [m.value for m in mailbox] == [float(i) for i in range(50)]


def test_the_first_write_fixes_the_type_and_a_wrong_one_is_refused_visibly(db):
    mailbox = db.connect("scope", 0.0)
    db.register("scope", "*", 0.0)
    assert db.publish("pub", message("X", 1.0), 1.0) is None
    refusal = db.publish("pub", message("X", "one"), 2.0)
    assert refusal is not None
    assert "pub wrote a string to X, which holds a double" in str(refusal)
    assert db.value("X") == 1.0
    assert db.statistics.refused == 1
    assert ("DB_EVENT", "refused=X,client=pub,holds=double,written=string") in named(mailbox, "DB_EVENT")


def test_registration_alone_does_not_fix_a_type(db):
    db.register("pub", "X", 0.0)
    assert db.publish("pub", message("X", "text"), 1.0) is None


def test_a_second_client_of_one_name_is_refused_and_the_first_unaffected(db):
    mailbox = db.connect("helm", 0.0)
    db.register("helm", "X", 0.0)
    with pytest.raises(NameClashError, match=r'A client of this name \("helm"\) already exists'):
        db.connect("helm", 1.0)
    db.publish("pub", message("X", 1.0), 2.0)
    assert named(mailbox, "X") == [("X", 1.0)]


def test_a_disconnected_client_loses_subscriptions_but_its_values_remain(db):
    mailbox = db.connect("helm", 0.0)
    db.register("helm", "X", 0.0)
    db.publish("helm", message("MODE", "ACTIVE", source="helm"), 1.0)
    db.disconnect("helm", 2.0)
    db.publish("pub", message("X", 1.0), 3.0)
    assert named(mailbox, "X") == []
    assert db.value("MODE") == "ACTIVE"
    assert named(db.connect("helm", 4.0), "X") == []


def test_a_throttled_subscription_hears_the_last_value_late_rather_than_never(db):
    mailbox = db.connect("helm", 0.0)
    db.register("helm", "X", 0.0, interval=2.0)
    for t in (1.0, 1.5, 2.0):
        db.publish("pub", message("X", t, t), t)
    assert named(mailbox, "X") == [("X", 1.0)]
    assert db.next_deadline() <= 3.0
    db.tick(3.0)
    assert named(mailbox, "X") == [("X", 1.0), ("X", 2.0)]


def test_a_wildcard_filters_by_source_for_every_message(db):
    db.connect("gps", 0.0)
    mailbox = db.connect("log", 0.0)
    db.register("log", "NAV_*", 0.0, source_pattern="g*")
    db.publish("gps", message("NAV_X", 1.0, source="gps"), 1.0)
    db.publish("pub", message("NAV_X", 2.0, source="pub"), 2.0)
    db.publish("gps", message("NAV_X", 3.0, source="gps"), 3.0)
    assert named(mailbox, "NAV_X") == [("NAV_X", 1.0), ("NAV_X", 3.0)]


def test_overlapping_subscriptions_deliver_once(db):
    mailbox = db.connect("log", 0.0)
    db.register("log", "NAV_X", 0.0)
    db.register("log", "NAV_*", 0.0)
    db.register("log", "*", 0.0, omit=("DB_*",))
    db.publish("pub", message("NAV_X", 1.0), 1.0)
    assert named(mailbox, "NAV_X") == [("NAV_X", 1.0)]


def test_unregistering_a_wildcard_stops_new_variables_too(db):
    mailbox = db.connect("log", 0.0)
    db.register("log", "NAV_*", 0.0)
    db.unregister("log", "NAV_*")
    db.unregister("log", "NEVER_ASKED")
    db.publish("pub", message("NAV_X", 1.0), 1.0)
    assert named(mailbox, "NAV_X") == []


def test_the_database_says_who_is_connected_and_what_time_it_is(db):
    mailbox = db.connect("scope", 10.0)
    db.register("scope", "DB_*", 10.0)
    db.tick(10.0)
    seen = dict(named(mailbox, "DB_TIME", "DB_UPTIME", "DB_CLIENTS", "DB_EVENT", "DB_RWSUMMARY"))
    assert seen["DB_TIME"] == 10.0
    assert seen["DB_UPTIME"] == 10.0
    assert seen["DB_CLIENTS"] == "scope,pub,"
    assert seen["DB_EVENT"] == "connected=scope"
    assert seen["DB_RWSUMMARY"].startswith("pub=&,scope=")
    db.publish("pub", message("LONG", "y" * 40), 11.0)
    db.tick(12.0)
    table = db.value("DB_VARSUMMARY")
    row = next(line for line in table.split("\n") if line.startswith("LONG"))
    assert row.endswith("S " + "y" * 22 + "...")
    assert db.next_deadline() == 14.0


def test_summaries_nobody_asked_for_are_not_made(db):
    db.tick(5.0)
    assert db.value("DB_VARSUMMARY") is None
    assert db.value("DB_TIME") is None


def test_clear_forgets_values_and_types_but_keeps_subscriptions(db):
    mailbox = db.connect("helm", 0.0)
    db.register("helm", "X", 0.0)
    db.publish("pub", message("X", 1.0), 1.0)
    db.clear(2.0)
    assert db.get("X") is None
    assert db.publish("pub", message("X", "now text"), 3.0) is None
    assert named(mailbox, "X") == [("X", 1.0), ("X", "now text")]


@pytest.mark.parametrize(("pattern", "interval"), [("", 0.0), ("X", -1.0), ("X", float("nan"))])
def test_a_bad_registration_is_an_error(db, pattern, interval):
    with pytest.raises(ValueError, match="registration"):
        db.register("pub", pattern, 0.0, interval=interval)


class DatabaseMachine(RuleBasedStateMachine):
    """Unthrottled delivery against the obvious rule: whoever matches gets the post."""

    CLIENTS = ("a", "b", "c")
    VARIABLES = ("X", "XY", "Z")
    PATTERNS = ("X", "X*", "?", "*", "XY")

    def __init__(self):
        super().__init__()
        self.now = 0.0
        self.db = Database("m", 0.0)
        self.mailboxes = {}
        self.expected = {}
        self.wishes = {}
        self.values = {}

    @rule(client=st.sampled_from(CLIENTS))
    def connect_or_disconnect(self, client):
        if client in self.mailboxes:
            self.db.disconnect(client, self.now)
            del self.mailboxes[client], self.expected[client], self.wishes[client]
        else:
            self.mailboxes[client] = self.db.connect(client, self.now)
            self.expected[client] = []
            self.wishes[client] = set()

    @precondition(lambda self: self.mailboxes)
    @rule(data=st.data(), pattern=st.sampled_from(PATTERNS), source=st.sampled_from(["*", "a", "?"]))
    def register(self, data, pattern, source):
        client = data.draw(st.sampled_from(sorted(self.mailboxes)))
        self.db.register(client, pattern, self.now, source_pattern=source)
        self.wishes[client].add((pattern, source))
        for name, (value, writer) in self.values.items():
            if self._wants((pattern, source), name, writer):
                self.expected[client].append((name, value))

    @precondition(lambda self: self.mailboxes)
    @rule(data=st.data(), pattern=st.sampled_from(PATTERNS))
    def unregister(self, data, pattern):
        client = data.draw(st.sampled_from(sorted(self.mailboxes)))
        self.db.unregister(client, pattern)
        self.wishes[client] = {w for w in self.wishes[client] if w[0] != pattern}

    @rule(name=st.sampled_from(VARIABLES), value=st.floats(-5, 5), writer=st.sampled_from(CLIENTS))
    def publish(self, name, value, writer):
        self.now += 1.0
        self.db.publish(writer, Message(name, value, self.now, writer), self.now)
        self.values[name] = (value, writer)
        for client, wishes in self.wishes.items():
            if any(self._wants(w, name, writer) for w in wishes):
                self.expected[client].append((name, value))

    @staticmethod
    def _wants(wish, name, writer):
        pattern, source = wish
        variable = {
            "X": name == "X",
            "X*": name[0] == "X",
            "?": len(name) == 1,
            "*": True,
            "XY": name == "XY",
        }
        return variable[pattern] and (source in ("*", "?") or source == writer)

    @invariant()
    def mail_is_what_the_obvious_rule_says(self):
        for client, mailbox in self.mailboxes.items():
            mine = [(m.name, m.value) for m in mailbox if not m.name.startswith("DB_")]
            # The order of replayed values among each other is not promised, that of posts is.
            assert sorted(mine) == sorted(self.expected[client])


TestDatabaseMachine = DatabaseMachine.TestCase
TestDatabaseMachine.settings = settings(max_examples=60, stateful_step_count=30, deadline=None)


def test_variables_are_bounded_and_one_too_many_is_refused_visibly():
    db = Database("alpha", 0.0, max_variables=10)
    mailbox = db.connect("flood", 0.0)
    db.register("flood", "DB_EVENT", 0.0)
    refusals = [db.publish("flood", message(f"V{i}", 1.0, source="flood"), 1.0) for i in range(100)]
    assert sum(r is not None for r in refusals) >= 90
    assert "has 10 variables already" in str(refusals[-1])
    assert db.publish("flood", message("V0", 2.0), 2.0) is None
    assert len([v for _, v in named(mailbox, "DB_EVENT") if "limit=10" in v]) == 1
    with pytest.raises(ValueError, match="10 variables already"):
        db.register("flood", "ANOTHER", 3.0)
    assert len(list(db.records())) <= 12


@pytest.mark.parametrize(("value", "time"), [(1, 0.0), (None, 0.0), (1.0, 1)])
def test_a_value_or_time_of_a_foreign_type_is_a_programming_error(db, value, time):
    with pytest.raises(TypeError, match="a value is float, str or bytes"):
        db.publish("pub", Message("FRESH", value, time, "pub"), 0.0)


def test_a_client_that_comes_back_is_again_a_publisher_of_what_it_posts():
    db = Database("alpha", 0.0)
    for now in (1.0, 2.0):
        db.connect("gps", now)
        db.publish("gps", message("NAV_X", now, source="gps"), now)
        db.publish("gps", message("NAV_X", now, source="gps"), now)
        assert db.published_by("gps") == ("NAV_X",)
        db.disconnect("gps", now)
