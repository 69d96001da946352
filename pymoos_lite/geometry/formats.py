"""Shapes described by a few named numbers: `format=lawnmower,x=..`, `radial:: x=..`, `pylon: ...`.

Field names, synonyms and defaults are behaviors.md A4; the vertices themselves come from `patterns`.
Here also live the small readers that every spec form shares, and SpecError.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from mypy_extensions import mypyc_attr

from pymoos_lite.geometry import patterns
from pymoos_lite.geometry.attributes import Attributes, is_attribute, read_attributes
from pymoos_lite.geometry.patterns import MAX_VERTICES, PatternError
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY, SegList
from pymoos_lite.geometry.text import parse_bool, parse_number, split_protected

MAX_TEXT = 1 << 20


class SpecError(ValueError):
    """Text that describes no shape of the wanted kind. One line: what was expected, what was found."""


def shown(text: str) -> str:
    """Text made fit to be quoted in a one-line message."""
    head = "".join(c if c.isprintable() else " " for c in text[:60])
    return head if len(text) <= 60 else head + "..."


def checked(text: str) -> str:
    """The text trimmed, or SpecError when it is too long to be honest."""
    if len(text) > MAX_TEXT:
        raise SpecError(f"text of {len(text)} characters is longer than {MAX_TEXT}")
    return text.strip()


FORMAT_KEY = re.compile(r"(?:^|,)\s*format\s*=\s*(\w+)\s*", re.IGNORECASE)
_PREFIX = re.compile(r"^\s*([a-z]+)\s*::?\s*", re.IGNORECASE)


def key_values(text: str, kind: str) -> dict[str, str]:
    """Values by lower-case key; SpecError for a piece without `=`."""
    values: dict[str, str] = {}
    for piece in split_protected(text, quotes=False):
        if not piece:
            continue
        key, equals, value = piece.partition("=")
        if not equals:
            raise SpecError(f"expected key=value in a {kind}, found '{shown(piece)}'")
        values[key.strip().lower()] = value.strip()
    return values


def number_field(values: Mapping[str, str], key: str, default: float | None = None) -> float:
    """Value of a numeric field; SpecError when it is no number, or missing without a default."""
    text = values.get(key)
    if text is None:
        if default is None:
            raise SpecError(f"no {key} given")
        return default
    value = parse_number(text)
    if value is None:
        raise SpecError(f"{key} must be a number, found '{shown(text)}'")
    return value


def _whole(values: Mapping[str, str], key: str) -> int:
    value = number_field(values, key)
    if value != math.floor(value) or abs(value) > MAX_VERTICES:
        raise SpecError(f"{key} must be a whole number up to {MAX_VERTICES}, found '{shown(values[key])}'")
    return int(value)


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class _Format:
    """How one described shape is written: its fields in their positional order, and its builder."""

    fields: tuple[str, ...]
    build: Callable[[Mapping[str, str]], list[XY]]
    synonyms: Mapping[str, str]


def described(text: str, formats: Mapping[str, _Format]) -> tuple[list[XY], Attributes] | None:
    """Vertices and attributes of `format=name,...` or `name:...` text; None when it is neither."""
    match = FORMAT_KEY.search(text)
    if match is not None:
        name = match.group(1).lower()
        body = text[: match.start()] + "," + text[match.end() :]
        if name not in formats:
            raise SpecError(f"unknown format '{shown(name)}', expected one of {', '.join(sorted(formats))}")
    else:
        prefix = _PREFIX.match(text)
        if prefix is None or prefix.group(1).lower() not in formats:
            return None
        name = prefix.group(1).lower()
        body = text[prefix.end() :]
    form = formats[name]
    if "=" in body:
        values = key_values(body, name)
    else:
        words = [word.strip() for word in body.split(",")]
        if len(words) > len(form.fields):
            raise SpecError(f"{name} takes at most {len(form.fields)} values: {','.join(form.fields)}")
        values = dict(zip(form.fields, words, strict=False))
    values = {form.synonyms.get(key, key): value for key, value in values.items()}
    for key in values:
        if key not in form.fields and not is_attribute(key):
            raise SpecError(f"{name} has no field '{shown(key)}', it has {', '.join(form.fields)}")
    try:
        return form.build(values), read_attributes(values)
    except (PatternError, SpecError) as error:
        raise SpecError(f"{name}: {error}") from None


def _radial(v: Mapping[str, str]) -> list[XY]:
    radius, count = number_field(v, "radius"), _whole(v, "pts")
    inactive = parse_bool(v.get("active", "")) is False
    # The station-keeping behaviour erases a circle it never had with radius -1.
    if radius <= 0.0 and inactive:
        return []
    if radius <= 0.0 or count < 3:
        raise SpecError(f"radius must be above 0 and pts at least 3, found {radius:g} and {count}")
    polygon = Polygon.radial(
        number_field(v, "x") + number_field(v, "shiftx", 0.0),
        number_field(v, "y") + number_field(v, "shifty", 0.0),
        radius,
        count,
        snap=number_field(v, "snap", 0.0),
    )
    return list(polygon.points)


def _ellipse(v: Mapping[str, str]) -> list[XY]:
    rads = number_field(v, "rads", math.radians(number_field(v, "degs", 0.0)))
    x, y, snap = number_field(v, "x"), number_field(v, "y"), number_field(v, "snap", 0.0)
    return patterns.ellipse(
        x, y, number_field(v, "major"), number_field(v, "minor"), _whole(v, "pts"), rads=rads, snap=snap
    )


def _wedge(v: Mapping[str, str]) -> list[XY]:
    sides = number_field(v, "lang"), number_field(v, "rang"), number_field(v, "range")
    return patterns.wedge(
        number_field(v, "x"),
        number_field(v, "y"),
        *sides,
        _whole(v, "pts"),
        snap=number_field(v, "snap", 0.0),
    )


def _range_wedge(v: Mapping[str, str]) -> list[XY]:
    sides = (
        number_field(v, "lang"),
        number_field(v, "rang"),
        number_field(v, "range_min"),
        number_field(v, "range_max"),
    )
    snap = number_field(v, "snap", 0.0)
    return patterns.range_wedge(
        number_field(v, "x"), number_field(v, "y"), *sides, _whole(v, "pts"), snap=snap
    )


def _ends(v: Mapping[str, str]) -> tuple[float, float, float, float]:
    return number_field(v, "x1"), number_field(v, "y1"), number_field(v, "x2"), number_field(v, "y2")


def _pylon(v: Mapping[str, str]) -> list[XY]:
    snap = number_field(v, "snap", 0.0)
    return patterns.pylon(*_ends(v), number_field(v, "axis_pad"), number_field(v, "perp_pad"), snap=snap)


def _oval(v: Mapping[str, str]) -> list[XY]:
    step, snap = number_field(v, "draw_degs", 10.0), number_field(v, "snap", 0.0)
    return patterns.oval(*_ends(v), number_field(v, "rad"), step_degs=step, snap=snap)


def _rect(v: Mapping[str, str]) -> list[XY]:
    width, height = number_field(v, "width"), number_field(v, "height")
    if width <= 0.0 or height <= 0.0:
        raise SpecError(f"width and height must be greater than 0, found {width:g} and {height:g}")
    x, y = number_field(v, "x"), number_field(v, "y")
    corners = ((-0.5, 0.5), (0.5, 0.5), (0.5, -0.5), (-0.5, -0.5))
    box = SegList(tuple((x + i * width, y + j * height) for i, j in corners))
    return list(box.rotated(number_field(v, "degs", 0.0), (x, y)).points)


def _lawnmower(v: Mapping[str, str]) -> list[XY]:
    rows = v.get("rows", "ew").lower()
    if rows not in _ROWS:
        raise SpecError(f"rows must be one of {', '.join(_ROWS)}, found '{shown(rows)}'")
    return patterns.lawnmower(
        *(number_field(v, key) for key in ("x", "y", "width", "height", "swath")),
        degs=number_field(v, "degs", 0.0),
        east_west=_ROWS[rows],
        start=(number_field(v, "startx", 0.0), number_field(v, "starty", 0.0)),
        snap=number_field(v, "snap", 0.00001),
    )


def _zigzag(v: Mapping[str, str]) -> list[XY]:
    names = ("startx", "starty", "angle", "length", "period", "amplitude")
    return patterns.zigzag(*(number_field(v, key) for key in names), snap=number_field(v, "snap", 0.0001))


def _bowtie(v: Mapping[str, str]) -> list[XY]:
    start = (number_field(v, "startx"), number_field(v, "starty")) if "startx" in v or "starty" in v else None
    names = ("x", "y", "height", "wid1", "wid2", "wid3")
    return patterns.bowtie(
        *(number_field(v, key) for key in names), start=start, snap=number_field(v, "snap", 0.0)
    )


_ROWS = {"ew": True, "east-west": True, "ns": False, "north-south": False}


def _form(fields: str, build: Callable[[Mapping[str, str]], list[XY]], **synonyms: str) -> _Format:
    return _Format(tuple(fields.split()), build, synonyms)


POLYGON_FORMATS: dict[str, _Format] = {
    "radial": _form("x y radius pts snap label shiftx shifty z", _radial, snap_value="snap"),
    "ellipse": _form("x y major minor pts degs snap rads", _ellipse, snap_value="snap"),
    "wedge": _form("x y lang rang range pts snap", _wedge, snap_value="snap"),
    "piewedge": _form("x y lang rang range pts snap", _wedge, snap_value="snap"),
    "rangewedge": _form("x y lang rang range_min range_max pts snap", _range_wedge, snap_value="snap"),
    "pylon": _form("x1 y1 x2 y2 axis_pad perp_pad snap", _pylon, snap_value="snap"),
    "oval": _form("x1 y1 x2 y2 rad draw_degs snap", _oval, snap_value="snap"),
    "rect": _form("x y width height degs", _rect),
}
SEGLIST_FORMATS: dict[str, _Format] = {
    "lawnmower": _form(
        "x y width height swath rows startx starty degs snap",
        _lawnmower,
        lane_width="swath",
        snap_value="snap",
    ),
    "zigzag": _form("startx starty angle length period amplitude snap", _zigzag, x="startx", y="starty"),
    "bowtie": _form("x y height wid1 wid2 wid3 startx starty snap", _bowtie, snap_value="snap"),
}
