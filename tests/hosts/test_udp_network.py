"""The network that apps get in real time, over loopback."""

import select

import pytest

from pymoos_lite.hosts.ports import LOOPBACK
from pymoos_lite.hosts.udp import UdpNetwork


@pytest.fixture
def network():
    opened = []
    network = UdpNetwork(LOOPBACK, opened.append, opened.remove)
    network.all = opened
    yield network
    for port in list(opened):
        port.close()


def wait(port):
    assert select.select([port], [], [], 10.0)[0]


def test_what_is_sent_arrives_with_its_senders_address(network):
    one, other = network.open(), network.open()
    assert not other.has_data
    assert one.send(b"hello", other.address)
    wait(other)
    assert other.has_data
    assert other.receive() == [(b"hello", one.address)]
    assert other.receive() == []


def test_a_port_in_use_is_refused_and_free_again_when_closed(network):
    first = network.open()
    with pytest.raises(OSError, match=r"in use|Address"):
        network.open(first.address[1])
    first.close()
    first.close()
    assert network.all == []
    assert network.open(first.address[1]).address == first.address


def test_sending_what_cannot_leave_says_so(network):
    port = network.open()
    assert not port.send(bytes(70_000), port.address)
    port.close()
    assert not port.send(b"x", (LOOPBACK, 9))
    assert not port.has_data


def test_a_closed_port_at_the_other_end_does_not_disturb(network):
    one, gone = network.open(), network.open()
    gone.close()
    for _ in range(3):
        one.send(b"x", gone.address)
    assert one.receive() == []
    other = network.open()
    other.send(b"still here", one.address)
    wait(one)
    assert one.receive() == [(b"still here", other.address)]


def test_names_are_resolved_and_loopback_is_no_address_to_give(network):
    assert network.resolve("localhost") == LOOPBACK
    with pytest.raises(OSError, match="not known"):
        network.resolve("no-such-host.invalid")
    assert all(not address.startswith("127.") for _, address in network.addresses())
