"""Ownship's navigation as it arrives, and how one position pair is filled from the other.

Used by the node reporter, for its own navigation and for the alternative one (marine_apps.md 3.3, 3.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pymoos_lite.geometry.geodesy import Geodesy, GeodesyError

CROSS_FILL_POLICIES = ("literal", "fill-empty", "use-latest", "global", "global-terse", "local")

NAV_NUMBERS = {
    "X": "x",
    "Y": "y",
    "LAT": "lat",
    "LONG": "lon",
    "SPEED": "speed",
    "HEADING": "heading",
    "DEPTH": "depth",
    "ALTITUDE": "altitude",
    "TRANSP": "transparency",
}
"""Attribute by what follows the prefix in the name of a navigation variable."""
STAMPS = {"x": "xy_at", "y": "xy_at", "lat": "latlon_at", "lon": "latlon_at"}
"""Attribute of the time of a position's last update."""
NAV_SUFFIXES = (*NAV_NUMBERS, "YAW", "TRAJECTORY")
"""What follows the prefix in the names of navigation variables."""


@dataclass(slots=True)
class OwnshipState:
    """The latest value of each navigation variable; None while it was never heard.

    Metres, m/s, degrees. `xy_at`, `latlon_at` and `heard_at` are the times of the last update of each pair
    and of anything at all.
    """

    x: float | None = None
    y: float | None = None
    lat: float | None = None
    lon: float | None = None
    speed: float | None = None
    heading: float | None = None
    depth: float | None = None
    altitude: float | None = None
    transparency: float | None = None
    trajectory: str = ""
    xy_at: float = -math.inf
    latlon_at: float = -math.inf
    heard_at: float = -math.inf

    def hear(self, suffix: str, value: float, now: float) -> None:
        """Take one number, named by what follows the prefix (``X`` of ``NAV_X``); yaw is not used."""
        attribute = NAV_NUMBERS.get(suffix)
        if attribute is None:
            return
        setattr(self, attribute, value)
        self.heard_at = now
        setattr(self, STAMPS.get(attribute, "heard_at"), now)

    @property
    def has_xy(self) -> bool:
        """Whether the local position is known."""
        return self.x is not None and self.y is not None

    @property
    def has_latlon(self) -> bool:
        """Whether the geodetic position is known."""
        return self.lat is not None and self.lon is not None

    @property
    def is_valid(self) -> bool:
        """Whether speed, heading and one of the positions are known."""
        return self.speed is not None and self.heading is not None and (self.has_xy or self.has_latlon)

    def position(
        self, policy: str, geodesy: Geodesy | None
    ) -> tuple[float | None, float | None, float | None, float | None]:
        """(x, y, lat, lon) after filling one pair from the other as `policy` says.

        literal: as heard. local: lat, lon from x, y. global, global-terse: x, y from lat, lon. fill-empty:
        only a pair that was never heard. use-latest: the older pair from the newer one. A pair that cannot be
        converted stays as heard.
        """
        x, y, lat, lon = self.x, self.y, self.lat, self.lon
        if policy == "literal" or geodesy is None:
            return x, y, lat, lon
        from_xy = x is not None and y is not None
        from_latlon = lat is not None and lon is not None
        if policy == "local":
            from_latlon = False
        elif policy.startswith("global"):
            from_xy = False
        elif from_xy and from_latlon:
            if policy == "fill-empty":
                return x, y, lat, lon
            from_xy = self.xy_at >= self.latlon_at
            from_latlon = not from_xy
        try:
            if from_xy and x is not None and y is not None:
                lat, lon = geodesy.to_latlon(x, y)
            elif from_latlon and lat is not None and lon is not None:
                x, y = geodesy.to_local(lat, lon)
        except GeodesyError:
            return self.x, self.y, self.lat, self.lon
        return x, y, lat, lon


def default_length(platform_type: str) -> float | None:
    """Length in metres of a platform type whose mission does not say, None for an unknown type."""
    word = platform_type.strip().lower()
    for prefix, length in (("skyw", 2.0), ("cray", 3.0)):
        if word.startswith(prefix):
            return length
    return _LENGTHS.get(word)


_LENGTHS = {
    **dict.fromkeys(("kayak", "mokai", "auv", "uuv"), 4.0),
    **dict.fromkeys(("glider", "heron", "swimmer", "buoy"), 3.0),
    **dict.fromkeys(("usv", "smr"), 6.0),
    "ship": 8.0,
    "longship": 15.0,
}
