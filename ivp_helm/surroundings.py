"""What a helm lends to its behaviours: the domain, the information buffer, own ship, contacts, chance.

One object, shared by all behaviours of a helm and refreshed by it before each iteration; a test makes one
by hand. Angles are degrees clockwise from north, x east, y north, metres, seconds, metres down.
"""

from __future__ import annotations

from collections.abc import Mapping
from random import Random
from typing import TYPE_CHECKING, NamedTuple

from ivp_helm.info_buffer import InfoBuffer
from pymoos_lite.geometry.angles import angle360
from pymoos_lite.geometry.geodesy import Geodesy
from pymoos_lite.records.contact_ledger import Contact

if TYPE_CHECKING:
    from ivp_helm.ivp import Domain
    from ivp_helm.platform_model import Platform


class Ownship(NamedTuple):
    """Own ship's state in this iteration: metres, degrees in [0, 360), m/s, metres down."""

    x: float
    y: float
    heading: float
    speed: float
    depth: float = 0.0


class MissingOwnship(Exception):
    """Own ship's position or heading was never received: a behaviour that needs it cannot decide."""


class Surroundings:
    """See the module. `contacts` maps a vessel's name (exact spelling) to what the ledger knows of it.

    `platform` has own ship's turn model (``platform.model``) and turn rate; `geodesy` is the mission's local
    grid, where there is one.
    """

    def __init__(
        self,
        domain: Domain,
        buffer: InfoBuffer | None = None,
        community: str = "ownship",
        own: Ownship | None = None,
        contacts: Mapping[str, Contact] | None = None,
        platform: Platform | None = None,
        random: Random | None = None,
        comms_policy: str = "open",
        geodesy: Geodesy | None = None,
    ) -> None:
        self.domain = domain
        self._has_depth = "depth" in domain
        self.buffer = InfoBuffer() if buffer is None else buffer
        self.community = community
        self.own = own
        self.contacts: Mapping[str, Contact] = {} if contacts is None else contacts
        self.platform = _new_platform() if platform is None else platform
        self.random = Random(0) if random is None else random
        self.comms_policy = comms_policy
        self.geodesy = geodesy
        self.retellings = 0
        """How often everything was to be told anew: who keeps silent about what has not changed looks here."""

    @property
    def now(self) -> float:
        """Mission time of this iteration, seconds."""
        return self.buffer.now

    def refresh_own(self) -> None:
        """Read NAV_* from the buffer (helm.md 11.1): `own` is None while position or heading is unknown."""
        number = self.buffer.number
        x, y, heading = number("NAV_X"), number("NAV_Y"), number("NAV_HEADING")
        if x is None or y is None or heading is None:
            self.own = None
            return
        depth = number("NAV_DEPTH") if self._has_depth else None
        self.own = Ownship(x, y, angle360(heading), number("NAV_SPEED") or 0.0, depth or 0.0)

    def missing_own(self) -> str:
        """What is missing when `own` is None, in the reference's words."""
        if self.buffer.number("NAV_X") is None or self.buffer.number("NAV_Y") is None:
            return "No ownship X/Y info in info_buffer."
        return "No ownship heading info in info_buffer."


def _new_platform() -> Platform:
    from ivp_helm.platform_model import Platform  # it needs Ownship from here

    return Platform()
