"""UDP for apps: the network that the real-time hosts hand out.

Sockets never block. The host is told of every socket that opens or closes, so that it can wait on it.
"""

from __future__ import annotations

import contextlib
import select
import socket
import struct
from collections.abc import Callable

from pymoos_lite.app.network import Address, Bundle, Datagrams, Payload
from pymoos_lite.hosts.ports import is_loopback, resolve

ANY = "0.0.0.0"
_LARGEST_DATAGRAM = 65535
_BATCH = 256
_RECEIVE_BUFFER = 2 << 20
_SEND_BUFFER = 256 << 10


class UdpPort:
    """A UDP socket of one app; see `pymoos_lite.app.network.DatagramPort`."""

    def __init__(self, sock: socket.socket, closed: Callable[[UdpPort], None]) -> None:
        self._socket = sock
        self._closed = closed
        self.address: Address = sock.getsockname()[:2]

    def fileno(self) -> int:
        return self._socket.fileno()

    @property
    def has_data(self) -> bool:
        try:
            return bool(select.select([self._socket], [], [], 0.0)[0])
        except (OSError, ValueError):
            return False

    def send(self, data: Payload, to: Address) -> bool:
        assert not isinstance(data, Bundle)
        try:
            self._socket.sendto(data, to)
        except OSError:
            return False
        return True

    def receive(self) -> Datagrams:
        taken: Datagrams = []
        recvfrom = self._socket.recvfrom
        while len(taken) < _BATCH:
            try:
                data, sender = recvfrom(_LARGEST_DATAGRAM)
            except (ConnectionRefusedError, ConnectionResetError):
                continue  # some earlier datagram of ours met a closed port
            except OSError:
                break
            taken.append((data, sender[:2]))
        return taken

    def close(self) -> None:
        if self._socket.fileno() >= 0:
            self._closed(self)
            self._socket.close()


class UdpNetwork:
    """Opens UDP ports; see `pymoos_lite.app.network.Network`.

    `bind` is the address to listen on: all interfaces, as the reference does, or loopback for
    communities that are all on this machine. `opened` and `closed` hear of every port.
    """

    by_reference = False

    def __init__(
        self,
        bind: str = ANY,
        opened: Callable[[UdpPort], None] = lambda port: None,
        closed: Callable[[UdpPort], None] = lambda port: None,
    ) -> None:
        self._bind = bind
        self._opened = opened
        self._closed = closed

    def open(self, port: int = 0, group: str = "") -> UdpPort:
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.setblocking(False)
            for option, size in ((socket.SO_RCVBUF, _RECEIVE_BUFFER), (socket.SO_SNDBUF, _SEND_BUFFER)):
                with contextlib.suppress(OSError):  # the system's own size will do
                    sock.setsockopt(socket.SOL_SOCKET, option, size)
            # Sending to a channel works from every port, whether it listens to one or not.
            sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 1)
            sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
            if group:
                self._join(sock, group, port)
            else:
                if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):
                    sock.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
                sock.bind((self._bind, port))
        except OSError:
            sock.close()
            raise
        opened = UdpPort(sock, self._closed)
        self._opened(opened)
        return opened

    def _join(self, sock: socket.socket, group: str, port: int) -> None:
        # Several communities on one machine listen to one channel.
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if hasattr(socket, "SO_REUSEPORT"):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        sock.bind(("", port))
        interface = self._bind if is_loopback(self._bind) else ANY
        if is_loopback(self._bind):
            sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
        member = struct.pack("4s4s", socket.inet_aton(group), socket.inet_aton(interface))
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)

    def resolve(self, host: str) -> str:
        return resolve(host, 0)[1][0]

    def addresses(self) -> list[tuple[str, str]]:
        found: dict[str, str] = {}
        for name, address in (*_interface_addresses(), *_route_address(), *_named_addresses()):
            if not is_loopback(address):
                found.setdefault(address, name)
        return [(name, address) for address, name in found.items()]


def _interface_addresses() -> list[tuple[str, str]]:
    """Every interface and its IPv4 address, where the system can be asked."""
    try:
        import fcntl
    except ImportError:
        return []
    request = 0x8915  # SIOCGIFADDR, Linux; other systems refuse it and the ways below remain
    found = []
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as sock:
        for _, name in socket.if_nameindex():
            with contextlib.suppress(OSError):
                answer = fcntl.ioctl(sock.fileno(), request, struct.pack("256s", name.encode()[:15]))
                found.append((name, socket.inet_ntoa(answer[20:24])))
    return found


def _route_address() -> list[tuple[str, str]]:
    """The address that traffic to the outside would have; nothing is sent."""
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as sock:
        try:
            sock.connect(("192.0.2.1", 9))
            return [("default", sock.getsockname()[0])]
        except OSError:
            return []


def _named_addresses() -> list[tuple[str, str]]:
    """The addresses that this machine's own name stands for."""
    try:
        return [("name", address) for address in socket.gethostbyname_ex(socket.gethostname())[2]]
    except OSError:
        return []
