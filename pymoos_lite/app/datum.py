"""The mission's local grid: LatOrigin and LongOrigin of the mission file as a `Geodesy`."""

from __future__ import annotations

from pymoos_lite.app.base import App
from pymoos_lite.geometry.geodesy import Geodesy, GeodesyError
from pymoos_lite.records.csp import parse_number


def mission_geodesy(app: App, needed: bool = True) -> Geodesy | None:
    """The conversion for the mission's datum; None, with a configuration warning, if there is no usable one.

    An app for which it is not `needed` is not warned when none is given at all.

    The mission-global `geodesy = utm|grid` chooses the projection (community.md 4.3).
    """
    lat, lon = parse_number(app.mission_global("LatOrigin")), parse_number(app.mission_global("LongOrigin"))
    if lat is None or lon is None:
        if needed:
            app.config_warning(
                "LatOrigin and LongOrigin are not both given: there is no latitude or longitude"
            )
        return None
    try:
        return Geodesy(lat, lon, app.mission_global("geodesy", "utm").lower() or "utm")
    except GeodesyError as error:
        app.config_warning(str(error))
        return None
