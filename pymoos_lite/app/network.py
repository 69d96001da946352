"""Datagrams to other communities, as an app sees them.

The host hands every app a `Network`. In real time it is UDP, in lockstep a simulated network in
the same process; the app opens ports, sends, and is told of what came in `App.on_datagrams`. A
datagram may be lost, late, doubled or out of order, whichever network it is.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

Address = tuple[str, int]
"""Numeric host and port."""


class Bundle(NamedTuple):
    """Something that a network inside one process hands over by reference instead of as bytes.

    `size` is what it would take as bytes and `parts` in how many datagrams, so that loss and
    bandwidth are those of the bytes that were never made.
    """

    content: object
    size: int
    parts: int = 1


Payload = bytes | Bundle
Datagrams = list[tuple[Payload, Address]]


class DatagramPort(Protocol):
    """One open port."""

    @property
    def address(self) -> Address:
        """Where it is open."""
        ...

    @property
    def has_data(self) -> bool:
        """Whether `receive` has something."""
        ...

    def send(self, data: Payload, to: Address) -> bool:
        """Send; False if it certainly did not leave (no route, too large, buffer full)."""
        ...

    def receive(self) -> Datagrams:
        """What has come since the last call, each with its sender's address; never waits."""
        ...

    def close(self) -> None: ...


class Network(Protocol):
    """What a host can do for an app that talks to other communities."""

    by_reference: bool
    """Whether `send` takes a `Bundle`."""

    def open(self, port: int = 0, group: str = "") -> DatagramPort:
        """Open a port on all interfaces (0: any free one), or join multicast `group` at `port`.

        Raises:
            OSError: the port is in use, or the group cannot be joined.
        """
        ...

    def resolve(self, host: str) -> str:
        """The numeric address of a host name.

        Raises:
            OSError: no such host.
        """
        ...

    def addresses(self) -> list[tuple[str, str]]:
        """Interfaces of this machine and their numeric addresses, loopback left out."""
        ...
