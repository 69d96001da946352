"""Cookies: proof that a stranger receives at the address it gives, at no cost to whoever asks.

A cookie is a time and a MAC over that time, the connection and the address, made with a secret that lives
and dies with its maker: nothing is kept for a stranger. What is kept, for as long as a cookie is good,
is which connections were opened with one, so that a recorded request opens none a second time.
"""

from __future__ import annotations

import hmac
from collections import OrderedDict
from collections.abc import Hashable
from struct import Struct

from pymoos_lite.core.frames import COOKIE_BYTES, Fault, FrameError

LIFE = 10.0
"""Wall seconds for which a cookie is good."""

_TIME = Struct(">Q")
_STAMPS = (1 << 64) - 1


class Cookies:
    """Makes, checks and cancels cookies; times are wall seconds.

    Args:
        secret: unpredictable bytes.
        most_spent: how many opened connections to remember at most.
    """

    def __init__(self, secret: bytes, most_spent: int) -> None:
        self._secret = secret
        self._most_spent = most_spent
        self._spent: OrderedDict[bytes, float] = OrderedDict()  # connection -> when it may be forgotten

    def __len__(self) -> int:
        """Connections remembered."""
        return len(self._spent)

    def make(self, connection: bytes, address: Hashable, wall: float) -> bytes:
        """A cookie for `connection` from `address`."""
        return self._bake(int(wall * 1000) & _STAMPS, connection, address)

    def check(self, cookie: bytes, connection: bytes, address: Hashable, wall: float) -> None:
        """Accept a cookie that was made for this connection and address, recently, and is not spent.

        Raises:
            FrameError: `BAD_COOKIE` or, if the connection has been and gone, `REPLAYED`.
        """
        (stamp,) = _TIME.unpack_from(cookie)
        genuine = hmac.compare_digest(cookie, self._bake(stamp, connection, address))
        if not genuine or not -1.0 <= wall - stamp / 1000 <= LIFE:
            raise FrameError(Fault.BAD_COOKIE)
        while self._spent and next(iter(self._spent.values())) <= wall:
            self._spent.popitem(last=False)
        if connection in self._spent:
            raise FrameError(Fault.REPLAYED)

    @property
    def crowded(self) -> bool:
        """Whether so many connections were opened of late that no more can be remembered."""
        return len(self._spent) >= self._most_spent

    def spend(self, connection: bytes, wall: float) -> None:
        """The connection is open; its cookie opens nothing else."""
        self._spent[connection] = wall + LIFE + 1.0

    def _bake(self, stamp: int, connection: bytes, address: Hashable) -> bytes:
        made = _TIME.pack(stamp)
        text = made + connection + repr(address).encode("utf-8", "replace")
        return made + hmac.digest(self._secret, text, "sha256")[: COOKIE_BYTES - len(made)]
