"""Points, seglists and polygons as text: every form missions and messages use, in and out.

The forms are behaviors.md A4 (in) and A5 (out). Reading either returns a valid shape or raises SpecError
with what is wrong; blanks around tokens do not matter.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from pymoos_lite.geometry.attributes import PLAIN, Attributes, is_attribute, read_attributes
from pymoos_lite.geometry.formats import (
    FORMAT_KEY,
    POLYGON_FORMATS,
    SEGLIST_FORMATS,
    SpecError,
    checked,
    described,
    key_values,
    number_field,
    shown,
)
from pymoos_lite.geometry.patterns import MAX_VERTICES
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY, Point, SegList, Seglr
from pymoos_lite.geometry.text import num, parse_bool, parse_number

__all__ = [
    "SpecError",
    "erase_point_text",
    "erase_seglist_text",
    "parse_point",
    "parse_polygon",
    "parse_seglist",
    "parse_seglr",
    "point_text",
    "seglist_text",
    "seglr_text",
]

# ---------------------------------------------------------------------------------------------- points


def parse_point(text: str) -> Point:
    """Point from `5,6`, `5:6`, `x=5,y=6[,z=..][,shiftx=..]...[,attributes]` or `5,6[,z]:label,foo:...`.

    Raises SpecError when x or y is missing or a coordinate is no number.
    """
    text = checked(text)
    if "=" in text:
        return _point_from_fields(key_values(text, "point"), text)
    groups = [[part.strip() for part in group.split(",")] for group in text.split(":")]
    if len(groups) == 2 and len(groups[0]) == 1 and len(groups[1]) == 1:
        groups = [[groups[0][0], groups[1][0]]]
    coordinates = [parse_number(part) for part in groups[0]]
    if not 2 <= len(coordinates) <= 3 or any(c is None for c in coordinates):
        raise SpecError(f"expected a point such as 5,6 or x=5,y=6, found '{shown(text)}'")
    x, y, *z = [c for c in coordinates if c is not None]
    return Point(x, y, z[0] if z else None, attributes=_word_attributes(groups[1:], text))


def _point_from_fields(pairs: dict[str, str], text: str) -> Point:
    numbers: dict[str, float] = {}
    for key in ("x", "y", "z", "shiftx", "shifty", "shiftz", "trans"):
        if key in pairs:
            numbers[key] = number_field(pairs, key)
    for needed in ("x", "y"):
        if needed not in numbers:
            raise SpecError(f"point has no {needed}: '{shown(text)}'")
    z = numbers.get("z")
    if z is not None:
        z += numbers.get("shiftz", 0.0)
    trans = numbers.get("trans")
    return Point(
        numbers["x"] + numbers.get("shiftx", 0.0),
        numbers["y"] + numbers.get("shifty", 0.0),
        z,
        None if trans is None else min(max(trans, 0.0), 1.0),
        read_attributes(pairs),
    )


def point_text(point: Point, decimals: int = 2, *, show_active: bool = False) -> str:
    """`x=..,y=..[,z=..][,trans=..][,attributes]`."""
    text = f"x={num(point.x, decimals)},y={num(point.y, decimals)}"
    if point.z is not None:
        text += f",z={num(point.z, decimals)}"
    if point.transparency is not None:
        text += f",trans={num(point.transparency, 2)}"
    return text + point.attributes.tail(show_active=show_active)


def erase_point_text(label: str) -> str:
    """Message that removes the point with this label from a viewer."""
    return point_text(Point(attributes=Attributes(label=label, active=False)))


# ---------------------------------------------------------------------------------------------- seglists


def parse_seglist(text: str) -> SegList:
    """Seglist from `pts={...},..`, a lawnmower, zigzag or bowtie description, or `0,0:5,0:label,foo`.

    Inactive text without points (`active=false,label=foo`) is an erase message and gives no vertices.
    Raises SpecError otherwise when there is no vertex, or a coordinate is no number.
    """
    text = checked(text)
    shape = _standard(text, "seglist")
    if shape is not None:
        return shape
    pattern = described(text, SEGLIST_FORMATS)
    if pattern is not None:
        points, attributes = pattern
        return SegList(tuple(points), attributes=attributes)
    return _abbreviated(text, "seglist")


def parse_polygon(text: str, *, convex: bool = True) -> Polygon:
    """Polygon from any of the forms of behaviors.md A4; convex unless `convex=False` says it need not be.

    Inactive text without points (`active=false,label=foo`) is an erase message and gives no vertices.
    Raises SpecError otherwise when there is no vertex, a number is out of range, or it is not convex.
    """
    text = checked(text)
    plain = _standard(text, "polygon")
    if plain is None:
        pattern = described(text, POLYGON_FORMATS)
        if pattern is not None:
            points, attributes = pattern
            plain = SegList(tuple(points), attributes=attributes)
        else:
            plain = _abbreviated(text, "polygon")
    polygon = Polygon(plain.points, plain.zs, plain.properties, plain.tags, plain.attributes)
    if convex and polygon.points and not polygon.is_convex:
        raise SpecError(f"polygon is not convex: '{shown(text)}'")
    return polygon


def seglist_text(shape: SegList, decimals: int = 1, *, show_active: bool = False) -> str:
    """`pts={x,y:x,y:...}[,attributes]` of a seglist or polygon; z and property where a vertex has them."""
    parts = []
    if shape.points or shape.attributes.active:
        parts.append("pts={" + _points_text(shape, decimals) + "}")
    if shape.tags:
        parts.append(f"tags={shape.tags}")
    tail = shape.attributes.tail(show_active=show_active)
    return ",".join(parts) + tail if parts else tail[1:]


def erase_seglist_text(label: str, *, duration: float | None = None) -> str:
    """Message that removes the seglist or polygon with this label; its dummy points are never drawn."""
    attributes = Attributes(label=label, active=False, duration=duration)
    return seglist_text(SegList(((0.0, 0.0), (9.0, 0.0), (0.0, 9.0)), attributes=attributes))


def _points_text(shape: SegList, decimals: int) -> str:
    if not shape.zs and not shape.properties:
        return ":".join([f"{num(x, decimals)},{num(y, decimals)}" for x, y in shape.points])
    vertices = []
    for i, (x, y) in enumerate(shape.points):
        vertex = f"{num(x, decimals)},{num(y, decimals)}"
        z = shape.zs[i] if shape.zs else None
        if z is not None:
            vertex += f",{num(z, decimals)}"
        if shape.properties and shape.properties[i]:
            vertex += f",{shape.properties[i]}"
        vertices.append(vertex)
    return ":".join(vertices)


_POINTS = re.compile(r"(?:^|,)\s*pts\s*=\s*\{([^{}]*)\}", re.IGNORECASE)


def _standard(text: str, kind: str) -> SegList | None:
    """The `pts={...}` form, or the erase form; None when the text is neither."""
    match = _POINTS.search(text)
    if match is None:
        if "pts={" in text.replace(" ", "").lower() or not text:
            raise SpecError(f"expected pts={{x,y:x,y:...}}, found '{shown(text)}'")
        if "=" in text and FORMAT_KEY.search(text) is None:
            fields = key_values(text, kind)
            if parse_bool(fields.get("active", "")) is False:
                return SegList(attributes=read_attributes(fields))
        return None
    rest = text[: match.start()] + "," + text[match.end() :]
    fields = key_values(rest, kind)
    vertices = match.group(1).split(":")
    if len(vertices) > MAX_VERTICES:
        raise SpecError(f"{kind} of {len(vertices)} vertices has more than {MAX_VERTICES}")
    points: list[XY] = []
    zs: list[float | None] = []
    properties: list[str] = []
    for vertex in vertices:
        x, y, z, prop = _vertex(vertex, kind)
        points.append((x, y))
        zs.append(z)
        properties.append(prop)
    return SegList(
        tuple(points),
        tuple(zs) if any(z is not None for z in zs) else (),
        tuple(properties) if any(properties) else (),
        fields.get("tags", ""),
        read_attributes(fields),
    )


def _vertex(text: str, kind: str) -> tuple[float, float, float | None, str]:
    parts = [part.strip() for part in text.split(",")]
    if "=" in text:
        named = {k.strip().lower(): v.strip() for k, _, v in (part.partition("=") for part in parts)}
        parts = [named.get("x", ""), named.get("y", "")] + ([named["z"]] if "z" in named else [])
    if not 2 <= len(parts) <= 4:
        raise SpecError(f"{kind} vertex '{shown(text)}' is not x,y[,z][,property]")
    x, y = parse_number(parts[0]), parse_number(parts[1])
    if x is None or y is None:
        raise SpecError(f"{kind} vertex '{shown(text)}' is not x,y[,z][,property]")
    z: float | None = None
    extra = parts[2:]
    if extra:
        z = parse_number(extra[0])
        if z is not None:
            extra = extra[1:]
    if len(extra) > 1:
        raise SpecError(f"{kind} vertex '{shown(text)}' is not x,y[,z][,property]")
    return x, y, z, extra[0] if extra else ""


def _abbreviated(text: str, kind: str) -> SegList:
    """`0,0:200,-150:100,100:label,foo`, with `pts:` or `points:` in front tolerated."""
    groups = [[part.strip() for part in group.split(",")] for group in text.split(":")]
    if groups[0] in (["pts"], ["points"]):
        groups = groups[1:]
    if len(groups) > MAX_VERTICES:
        raise SpecError(f"{kind} of {len(groups)} vertices has more than {MAX_VERTICES}")
    points: list[XY] = []
    words: list[list[str]] = []
    for group in groups:
        x = parse_number(group[0])
        y = parse_number(group[1]) if len(group) in (2, 3) else None
        if x is not None and y is not None:
            points.append((x, y))
        else:
            words.append(group)
    if not points:
        raise SpecError(f"expected a {kind} such as pts={{0,0:10,0:10,10}}, found '{shown(text)}'")
    return SegList(tuple(points), attributes=_word_attributes(words, text))


def _word_attributes(groups: Sequence[Sequence[str]], text: str) -> Attributes:
    """Attributes written as `label,foo` groups; raises SpecError when a group is no such pair."""
    pairs: dict[str, str] = {}
    for group in groups:
        key = group[0].lower()
        if len(group) < 2 or not is_attribute(key):
            raise SpecError(
                f"neither coordinates nor an attribute: '{shown(','.join(group))}' in '{shown(text)}'"
            )
        pairs[key] = ",".join(group[1:])
    return read_attributes(pairs) if pairs else PLAIN


# ------------------------------------------------------------------------------------------------ seglr


def parse_seglr(text: str) -> Seglr:
    """`pts={x,y:..},ray=45[,ray_len=..][,head_size=..][,cpa=..,cpax=..,cpay=..][,attributes]`.

    Raises SpecError without points or ray (unless inactive), or when a number is none.
    """
    text = checked(text)
    shape = _standard(text, "seglr")
    if shape is None:
        raise SpecError(f"expected pts={{x,y:x,y:...}},ray=..., found '{shown(text)}'")
    match = _POINTS.search(text)
    rest = text if match is None else text[: match.start()] + "," + text[match.end() :]
    values = key_values(rest, "seglr")
    drawn = {key: number_field(values, key) for key in _SEGLR_NUMBERS if key in values}
    ray = number_field(values, "ray", None if shape.attributes.active else 0.0) % 360.0
    return replace(Seglr(shape.points, ray, attributes=shape.attributes), **drawn)  # type: ignore[arg-type]


_SEGLR_NUMBERS = ("ray_len", "head_size", "cpa", "cpax", "cpay")


def seglr_text(seglr: Seglr, decimals: int = 1) -> str:
    """`pts={x,y:..},ray=45[,attributes],ray_len=20,head_size=1[,cpa=..,cpax=..,cpay=..]`."""
    text = "pts={" + _points_text(SegList(seglr.points), decimals) + "}"
    text += f",ray={num(seglr.ray, decimals)}{seglr.attributes.tail()}"
    text += f",ray_len={num(seglr.ray_len, decimals)},head_size={num(seglr.head_size, decimals)}"
    for key in ("cpa", "cpax", "cpay"):
        value = getattr(seglr, key)
        if value is not None:
            text += f",{key}={num(value, decimals)}"
    return text
