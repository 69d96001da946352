"""The lockstep host: virtual time, order, several communities."""

import pytest

from pymoos_lite.app import App, AppContext
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep


class Walker(App):
    """Posts a random walk and follows its neighbour."""

    DEFAULT_TICK = 5.0

    def on_connect(self):
        self.place = 0.0
        self.register("PLACE", source="*")

    def on_mail(self, mail):
        self.place += 0.1 * sum(m.value for m in mail)

    def iterate(self):
        self.place += self.random.gauss(0, 1)
        self.notify("PLACE", self.place)


def history(seed, communities):
    host = Lockstep(seed)
    mail = {}
    for name in communities:
        home = host.add_community(name)
        mail[name] = LocalConnection(home.database, "watcher", host.clock)
        mail[name].register("*", "*", 0.0, ())
        for app in ("one", "two"):
            connection = LocalConnection(home.database, app, host.clock)
            host.add_app(home, Walker, AppContext(app, name, host.clock, connection, seed=seed))
    host.run(60.0)
    return {name: connection.take_mail() for name, connection in mail.items()}


def test_equal_seeds_give_equal_messages_whoever_else_runs():
    alone = history(3, ["abe"])
    crowd = history(3, ["zed", "abe", "bob"])
    assert alone["abe"] == crowd["abe"]
    assert len(alone["abe"]) > 600
    assert history(4, ["abe"])["abe"] != alone["abe"]


def test_running_in_pieces_is_the_same_as_running_at_once():
    whole, pieces = Lockstep(), Lockstep()
    found = []
    for host, steps in ((whole, [10.0]), (pieces, [0.3, 1.7, 0.05, 7.95])):
        home = host.add_community("a")
        connection = LocalConnection(home.database, "one", host.clock)
        host.add_app(home, Walker, AppContext("one", "a", host.clock, connection, seed=1))
        for step in steps:
            host.run(step)
        found.append(home.database.get("PLACE"))
    assert found[0] == found[1]
    assert whole.elapsed == pytest.approx(pieces.elapsed)


def test_a_poke_arrives_at_its_time_in_the_community_it_is_meant_for():
    host = Lockstep()
    for name in ("abe", "bob"):
        home = host.add_community(name)
        connection = LocalConnection(home.database, "one", host.clock)
        host.add_app(home, Walker, AppContext("one", name, host.clock, connection))
    host.poke(2.5, "DEPLOY", "true", "bob")
    host.run(2.4)
    assert host.communities["bob"].database.get("DEPLOY") is None
    host.run(1.0)
    message = host.communities["bob"].database.get("DEPLOY")
    assert message.value == "true"
    assert message.time - host.clock.start == pytest.approx(2.5)
    assert host.communities["abe"].database.get("DEPLOY") is None


def test_two_communities_of_one_name_are_refused():
    host = Lockstep()
    host.add_community("abe")
    with pytest.raises(ValueError, match="two communities named 'abe'"):
        host.add_community("abe")
