"""Sessions over virtual networks: who is let in, and who is told to wait."""

from __future__ import annotations

import pytest
from wires import Town

from pymoos_lite.core.client_session import (
    ClientLimits,
    Refused,
    State,
    Warned,
)
from pymoos_lite.core.frames import (
    RefusalCode,
)
from pymoos_lite.core.server_session import ServerLimits


def test_a_second_client_of_one_name_is_refused_and_the_first_unaffected() -> None:
    town = Town()
    first = town.add("app")
    town.run(town.settled)
    second = town.add("app", "other")
    town.run(lambda: second.state is not State.CONNECTING)
    assert second.state is State.REFUSED
    (event,) = town.events["other"]
    assert event == Refused(RefusalCode.NAME_CLASH, 'A client of this name ("app") already exists')
    assert not second.post("X", 1.0, 1.0)
    town.run_for(10.0)
    assert first.connected
    assert len(town.events["app"]) == 1


def test_a_name_used_inside_the_databases_process_is_refused_as_well() -> None:
    town = Town()
    town.database.connect("app", 0.0)
    app = town.add("app")
    town.run(lambda: app.state is State.REFUSED, 5.0)
    assert town.database.clients() == ["app"], "the first one keeps its place"
    assert town.server is not None
    assert town.server.statistics.admitted == 0


def test_with_patience_a_successor_waits_until_its_killed_predecessor_is_missed() -> None:
    town = Town(client_limits=ClientLimits(clash_patience=8.0))
    town.add("app")
    town.run(town.settled)
    del town.clients["app"]
    town.add("app", "successor")
    town.run(town.all_connected, 8.0)
    assert town.now > 4.0


def test_a_name_that_is_no_text_is_refused_on_the_spot() -> None:
    with pytest.raises(ValueError, match="must be text"):
        Town().add("\ud800")


@pytest.mark.parametrize("name", ["", "x" * 129, "new\nline"])
def test_an_unacceptable_name_is_refused_with_what_would_be_right(name: str) -> None:
    town = Town()
    town.add(name, "app")
    town.run(lambda: town.clients["app"].state is State.REFUSED, 5.0)
    (event,) = town.events["app"]
    assert isinstance(event, Refused)
    assert event.code is RefusalCode.BAD_NAME
    assert "1 to 128 printable characters" in event.reason


def test_a_full_community_makes_newcomers_wait_and_says_so() -> None:
    town = Town(limits=ServerLimits(clients=2))
    for name in "ab":
        town.add(name)
    town.run(town.settled)
    town.add("c")
    town.run_for(3.0)
    assert not town.clients["c"].connected
    assert town.events["c"] == [Warned("the community has 2 clients, no more are admitted now; waiting")]
    del town.clients["a"]
    town.run(town.all_connected, 10.0)
