"""community.md 4.3: local x/y and latitude/longitude, against the printed vectors and a second formula."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.geometry.geodesy import Geodesy, GeodesyError, utm_forward, utm_zone


def snyder_forward(lat: float, lon: float, meridian: float) -> tuple[float, float]:
    """The truncated power series of community.md 4.3: another road to the same coordinates."""
    a, f, k0 = 6378137.0, 1 / 298.257223563, 0.9996
    e2 = f * (2 - f)
    ep2 = e2 / (1 - e2)
    phi = math.radians(lat)
    n = a / math.sqrt(1 - e2 * math.sin(phi) ** 2)
    t = math.tan(phi) ** 2
    c = ep2 * math.cos(phi) ** 2
    d = math.cos(phi) * math.radians(lon - meridian)
    m = a * (
        (1 - e2 / 4 - 3 * e2**2 / 64 - 5 * e2**3 / 256) * phi
        - (3 * e2 / 8 + 3 * e2**2 / 32 + 45 * e2**3 / 1024) * math.sin(2 * phi)
        + (15 * e2**2 / 256 + 45 * e2**3 / 1024) * math.sin(4 * phi)
        - (35 * e2**3 / 3072) * math.sin(6 * phi)
    )
    east = k0 * n * (d + (1 - t + c) * d**3 / 6 + (5 - 18 * t + t * t + 72 * c - 58 * ep2) * d**5 / 120)
    north = k0 * (
        m
        + n
        * math.tan(phi)
        * (
            d**2 / 2
            + (5 - t + 9 * c + 4 * c * c) * d**4 / 24
            + (61 - 58 * t + t * t + 600 * c - 330 * ep2) * d**6 / 720
        )
    )
    return east + 500000.0, north


def test_the_utm_origin_of_the_reference_datum_is_the_printed_one() -> None:
    easting, northing = Geodesy(43.8253, -70.3304).utm_origin
    assert easting == pytest.approx(393023.475, abs=0.001)
    assert northing == pytest.approx(4853329.705, abs=0.001)


def test_a_grid_point_and_its_utm_point_differ_by_the_convergence() -> None:
    lat, lon = Geodesy(43.8253, -70.3304, "grid").to_latlon(300.0, -400.0)
    x, y = Geodesy(43.8253, -70.3304).to_local(lat, lon)
    assert (round(x, 2), round(y, 2)) == (294.44, -404.56)


def test_the_datum_is_the_local_origin() -> None:
    for kind in ("utm", "grid"):
        geo = Geodesy(-33.5, 151.2, kind)
        assert geo.to_local(-33.5, 151.2) == pytest.approx((0.0, 0.0), abs=1e-9)
        assert geo.to_latlon(0.0, 0.0) == pytest.approx((-33.5, 151.2), abs=1e-12)


def test_a_southern_datum_has_the_false_northing_only_in_its_utm_coordinates() -> None:
    south = Geodesy(-10.0, 20.0)
    assert south.utm_origin[1] == pytest.approx(10_000_000.0 - Geodesy(10.0, 20.0).utm_origin[1])
    assert abs(south.to_local(-10.001, 20.0)[1]) < 200.0


@given(st.floats(-79.0, 83.0), st.floats(-3.0, 3.0))
def test_both_utm_series_agree_to_millimetres_within_a_zone(lat: float, dlon: float) -> None:
    east, north = utm_forward(lat, 9.0 + dlon, 9.0)
    assert (east, north) == pytest.approx(snyder_forward(lat, 9.0 + dlon, 9.0), abs=0.005)


@given(
    st.floats(-79.0, 83.0),
    st.floats(-180.0, 180.0),
    st.floats(-50_000.0, 50_000.0),
    st.floats(-50_000.0, 50_000.0),
)
def test_utm_there_and_back_is_the_same_point_to_a_micrometre(
    lat: float, lon: float, x: float, y: float
) -> None:
    geo = Geodesy(lat, lon)
    assert geo.to_local(*geo.to_latlon(x, y)) == pytest.approx((x, y), abs=1e-5)


@given(st.floats(-70.0, 70.0), st.floats(-180.0, 180.0), st.floats(-400.0, 400.0), st.floats(-400.0, 400.0))
def test_the_grid_there_and_back_is_off_by_centimetres(lat: float, lon: float, x: float, y: float) -> None:
    geo = Geodesy(lat, lon, "grid")
    assert geo.to_local(*geo.to_latlon(x, y)) == pytest.approx((x, y), abs=0.15)


def test_nothing_jumps_at_a_zone_border() -> None:
    geo = Geodesy(50.0, 5.9999)
    west, _ = geo.to_local(50.0, 5.99999)
    east, _ = geo.to_local(50.0, 6.00001)
    assert east - west == pytest.approx(1.43, abs=0.01)


def test_the_dateline_is_no_border_either() -> None:
    geo = Geodesy(-17.0, 179.999)
    x, y = geo.to_local(-17.0, -179.999)
    assert x == pytest.approx(212.9, abs=0.3)
    assert geo.to_latlon(x, y)[1] == pytest.approx(-179.999, abs=1e-9)


@pytest.mark.parametrize(
    ("lat", "lon", "zone"),
    [
        (43.8, -70.3, 19),
        (60.0, 5.0, 32),
        (78.0, 8.0, 31),
        (78.0, 15.0, 33),
        (78.0, 40.0, 37),
        (55.9, 5.0, 31),
        (0.0, -180.0, 1),
        (0.0, 180.0, 1),
        (0.0, 179.9, 60),
    ],
)
def test_zones_follow_the_map_with_its_norwegian_exceptions(lat: float, lon: float, zone: int) -> None:
    assert utm_zone(lat, lon) == zone


@pytest.mark.parametrize(
    ("lat", "lon"), [(84.1, 0), (-80.1, 0), (0, 181), (0, -181), (math.nan, 0), (0, math.nan), (math.inf, 0)]
)
def test_an_impossible_datum_is_refused(lat: float, lon: float) -> None:
    with pytest.raises(GeodesyError):
        Geodesy(lat, lon)


@given(st.sampled_from(["utm", "grid"]), st.floats(), st.floats())
def test_any_position_converts_to_finite_numbers_or_is_refused(kind: str, a: float, b: float) -> None:
    geo = Geodesy(43.8, -70.3, kind)
    for convert in (geo.to_local, geo.to_latlon):
        try:
            result = convert(a, b)
        except GeodesyError:
            continue
        assert all(math.isfinite(v) for v in result)
