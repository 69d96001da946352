"""Latitude and longitude to the mission's local x/y, and back.

The mission's datum (LatOrigin, LongOrigin) is x = y = 0. Two conversions exist (community.md 4.3):
`utm`, the default, subtracts the datum's UTM coordinates and always stays in the datum's zone, so
nothing jumps at a zone border; `grid` uses a tangent grid with its axes along true east and north.
The two are rotated against each other by the grid convergence.

UTM here is the sixth-order Krueger series (C. F. F. Karney, "Transverse Mercator with an accuracy of
a few nanometers", J. Geodesy 85, 2011, equations 7 to 12, 35 and 36), which has a matching exact inverse.
"""

from __future__ import annotations

import math

from pymoos_lite.geometry.angles import angle180

SEMI_MAJOR = 6378137.0
FLATTENING = 1.0 / 298.257223563
SCALE = 0.9996
FALSE_EASTING = 500000.0
FALSE_NORTHING_SOUTH = 10_000_000.0

_GRID_A = 6378137.0
_GRID_B = 6356752.0

_E2 = FLATTENING * (2.0 - FLATTENING)
_E = math.sqrt(_E2)
_N = FLATTENING / (2.0 - FLATTENING)
_RECTIFYING = SEMI_MAJOR / (1 + _N) * (1 + _N**2 / 4 + _N**4 / 64 + _N**6 / 256)

_Series = tuple[float, float, float, float, float, float]

# Karney (2011) equation 35: conformal to rectifying latitude.
_ALPHA: _Series = (
    _N / 2 - 2 * _N**2 / 3 + 5 * _N**3 / 16 + 41 * _N**4 / 180 - 127 * _N**5 / 288 + 7891 * _N**6 / 37800,
    13 * _N**2 / 48 - 3 * _N**3 / 5 + 557 * _N**4 / 1440 + 281 * _N**5 / 630 - 1983433 * _N**6 / 1935360,
    61 * _N**3 / 240 - 103 * _N**4 / 140 + 15061 * _N**5 / 26880 + 167603 * _N**6 / 181440,
    49561 * _N**4 / 161280 - 179 * _N**5 / 168 + 6601661 * _N**6 / 7257600,
    34729 * _N**5 / 80640 - 3418889 * _N**6 / 1995840,
    212378941 * _N**6 / 319334400,
)
# Karney (2011) equation 36: rectifying to conformal latitude.
_BETA: _Series = (
    _N / 2 - 2 * _N**2 / 3 + 37 * _N**3 / 96 - _N**4 / 360 - 81 * _N**5 / 512 + 96199 * _N**6 / 604800,
    _N**2 / 48 + _N**3 / 15 - 437 * _N**4 / 1440 + 46 * _N**5 / 105 - 1118711 * _N**6 / 3870720,
    17 * _N**3 / 480 - 37 * _N**4 / 840 - 209 * _N**5 / 4480 + 5569 * _N**6 / 90720,
    4397 * _N**4 / 161280 - 11 * _N**5 / 504 - 830251 * _N**6 / 7257600,
    4583 * _N**5 / 161280 - 108847 * _N**6 / 3991680,
    20648693 * _N**6 / 638668800,
)

# Farther from the central meridian than this the series no longer converges to anything useful.
_MAX_DLON = 60.0


class GeodesyError(ValueError):
    """A datum or position that the projection cannot represent."""


def utm_zone(lat: float, lon: float) -> int:
    """UTM zone 1..60 of a position in degrees, with the exceptions for Norway and Svalbard."""
    if 56.0 <= lat < 64.0 and 3.0 <= lon < 12.0:
        return 32
    if 72.0 <= lat <= 84.0 and 0.0 <= lon < 42.0:
        for zone, east_edge in ((31, 9.0), (33, 21.0), (35, 33.0), (37, 42.0)):
            if lon < east_edge:
                return zone
    return int((lon + 180.0) % 360.0 / 6.0) + 1


def utm_forward(lat: float, lon: float, central_meridian: float) -> tuple[float, float]:
    """(easting, northing) in metres, without the southern false northing; all arguments in degrees.

    Raises GeodesyError for a position that is not finite, beyond a pole, or more than 60 degrees of
    longitude from the central meridian.
    """
    dlon = angle180(lon - central_meridian)
    # `not (...)` rather than the opposite comparison, so that nan is refused as well.
    if not (-90.0 <= lat <= 90.0 and abs(dlon) <= _MAX_DLON):
        raise GeodesyError(f"position lat={lat} lon={lon} is outside what UTM can represent here")
    phi = math.radians(lat)
    lam = math.radians(dlon)
    sin_phi = math.sin(phi)
    cos_phi = math.cos(phi)
    if cos_phi < 1e-12:
        xi, eta = math.copysign(math.pi / 2, lat), 0.0
    else:
        tau = sin_phi / cos_phi
        sigma = math.sinh(_E * math.atanh(_E * sin_phi))
        tau_c = tau * math.sqrt(1.0 + sigma * sigma) - sigma * math.sqrt(1.0 + tau * tau)
        cos_lam = math.cos(lam)
        xi = math.atan2(tau_c, cos_lam)
        eta = math.asinh(math.sin(lam) / math.sqrt(tau_c * tau_c + cos_lam * cos_lam))
    more_xi, more_eta = _sine_series(_ALPHA, xi, eta)
    k = SCALE * _RECTIFYING
    return FALSE_EASTING + k * (eta + more_eta), k * (xi + more_xi)


def utm_inverse(easting: float, northing: float, central_meridian: float) -> tuple[float, float]:
    """(lat, lon) in degrees of UTM coordinates given without the southern false northing.

    Raises GeodesyError when the coordinates lie outside the projection's domain or are not finite.
    """
    k = SCALE * _RECTIFYING
    xi, eta = northing / k, (easting - FALSE_EASTING) / k
    if not (abs(xi) <= math.pi / 2 + 1e-9 and abs(eta) <= 1.5):
        raise GeodesyError(f"easting={easting} northing={northing} is outside what UTM can represent")
    less_xi, less_eta = _sine_series(_BETA, xi, eta)
    xi -= less_xi
    eta -= less_eta
    sinh_eta = math.sinh(eta)
    cos_xi = math.cos(xi)
    flat = math.hypot(sinh_eta, cos_xi)
    lon = angle180(central_meridian + math.degrees(math.atan2(sinh_eta, cos_xi)))
    if flat < 1e-12:
        return math.copysign(90.0, xi), lon
    tau_c = math.sin(xi) / flat
    rest = 1.0 - _E2
    tau = tau_c / rest
    # Newton's method, Karney (2011) equations 19 to 21; two rounds reach machine precision.
    sqrt = math.sqrt
    for _ in range(5):
        root = sqrt(1.0 + tau * tau)
        sigma = math.sinh(_E * math.atanh(_E * tau / root))
        guess = tau * sqrt(1.0 + sigma * sigma) - sigma * root
        step = (tau_c - guess) / sqrt(1.0 + guess * guess) * (1.0 + rest * tau * tau) / (rest * root)
        tau += step
        if abs(step) <= 1e-14 * max(1.0, abs(tau)):
            break
    return math.degrees(math.atan(tau)), lon


def _sine_series(coefficients: _Series, xi: float, eta: float) -> tuple[float, float]:
    """Sum of c_j sin(2 j zeta), j = 1..6, zeta = xi + i eta: (real, imaginary).

    Clenshaw's recurrence, one complex sine instead of six; by its parts, since compiled code keeps complex
    numbers no quicker than Python does.
    """
    c1, c2, c3, c4, c5, c6 = coefficients
    sin_re, cos_re = math.sin(2.0 * xi), math.cos(2.0 * xi)
    sinh_im, cosh_im = math.sinh(2.0 * eta), math.cosh(2.0 * eta)
    # factor = 2 cos(2 zeta), then b = factor * (the b before) - (the b before that) + c
    re, im = 2.0 * (cos_re * cosh_im), -2.0 * (sin_re * sinh_im)
    x5, y5 = re * c6 + c5, im * c6
    x4, y4 = re * x5 - im * y5 - c6 + c4, re * y5 + im * x5
    x3, y3 = re * x4 - im * y4 - x5 + c3, re * y4 + im * x4 - y5
    x2, y2 = re * x3 - im * y3 - x4 + c2, re * y3 + im * x3 - y4
    x1, y1 = re * x2 - im * y2 - x3 + c1, re * y2 + im * x2 - y3
    sin_x, sin_y = sin_re * cosh_im, cos_re * sinh_im
    return x1 * sin_x - y1 * sin_y, x1 * sin_y + y1 * sin_x


class Geodesy:
    """Converts between (lat, lon) degrees and the local (x east, y north) metres of one datum.

    `kind` is "utm" (what every stock app uses) or "grid". The datum must have lat in [-80, 84] and
    lon in [-180, 180]; anything else raises GeodesyError.
    """

    __slots__ = ("_gain", "_meridian", "_x0", "_y0", "kind", "lat", "lon", "zone")

    def __init__(self, lat: float, lon: float, kind: str = "utm") -> None:
        if not (-80.0 <= lat <= 84.0):
            raise GeodesyError(f"LatOrigin {lat} is not a latitude between -80 and 84 degrees")
        if not (-180.0 <= lon <= 180.0):
            raise GeodesyError(f"LongOrigin {lon} is not a longitude between -180 and 180 degrees")
        if kind not in ("utm", "grid"):
            raise GeodesyError(f"unknown geodesy '{kind}', expected utm or grid")
        self.kind = kind
        self.lat = lat
        self.lon = lon
        self.zone = utm_zone(lat, lon)
        self._meridian = 6.0 * self.zone - 183.0
        self._x0, self._y0 = utm_forward(lat, lon, self._meridian)
        self._gain = _grid_radius(lat)

    def __repr__(self) -> str:
        return f"Geodesy(lat={self.lat}, lon={self.lon}, kind={self.kind!r})"

    @property
    def utm_origin(self) -> tuple[float, float]:
        """(easting, northing) of the datum, with the false northing when it lies south of the equator."""
        return self._x0, self._y0 + (FALSE_NORTHING_SOUTH if self.lat < 0.0 else 0.0)

    def to_local(self, lat: float, lon: float) -> tuple[float, float]:
        """(x, y) of a position in degrees; raises GeodesyError where the projection has no answer."""
        if self.kind == "utm":
            easting, northing = utm_forward(lat, lon, self._meridian)
            return easting - self._x0, northing - self._y0
        dlon = angle180(lon - self.lon)
        if not (-90.0 < lat < 90.0 and abs(dlon) <= 90.0):
            raise GeodesyError(f"position lat={lat} lon={lon} is outside what the local grid can represent")
        radius = _grid_radius(lat)
        return (
            radius * math.sin(math.radians(dlon)) * math.cos(math.radians(lat)),
            radius * math.sin(math.radians(lat - self.lat)),
        )

    def to_latlon(self, x: float, y: float) -> tuple[float, float]:
        """(lat, lon) in degrees of a local point; raises GeodesyError where the projection has no answer."""
        if self.kind == "utm":
            return utm_inverse(x + self._x0, y + self._y0, self._meridian)
        south_north = y / self._gain
        west_east = x / (self._gain * math.cos(math.radians(self.lat)))
        if not (abs(south_north) <= 1.0 and abs(west_east) <= 1.0):
            raise GeodesyError(f"point x={x} y={y} is outside what the local grid can represent")
        return (
            self.lat + math.degrees(math.asin(south_north)),
            angle180(self.lon + math.degrees(math.asin(west_east))),
        )


def _grid_radius(lat: float) -> float:
    """Distance from the earth's centre of the tangent grid at a latitude, metres."""
    tan2 = math.tan(math.radians(lat)) ** 2
    return _GRID_B * math.sqrt(1.0 + tan2) / math.sqrt(_GRID_B**2 / _GRID_A**2 + tan2)
