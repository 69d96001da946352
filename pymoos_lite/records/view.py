"""VIEW_*: what apps and behaviours ask a viewer to draw.

Points, seglists, polygons and seglrs are the shapes of `geometry`, written as `geometry.specs` has it; the
rest are small records of this module. `parse_view` and `view_text` serve every variable: a viewer needs
nothing else. Text that is `active=false` may leave everything but its label out: it only erases.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self, TypeAlias

from pymoos_lite.geometry.attributes import PLAIN, Attributes, read_attributes
from pymoos_lite.geometry.colors import color_text
from pymoos_lite.geometry.shapes import Circle, Point, SegList, Seglr
from pymoos_lite.geometry.specs import (
    SpecError,
    parse_point,
    parse_polygon,
    parse_seglist,
    parse_seglr,
    point_text,
    seglist_text,
    seglr_text,
)
from pymoos_lite.geometry.text import num, parse_number
from pymoos_lite.records.csp import RecordError, clip, field_map


@dataclass(frozen=True, slots=True)
class _Drawing:
    """Shared reading and printing of the records that are a list of named numbers and words.

    Subclasses name their fields once: NUMBERS maps a field to its decimals, WORDS are texts, COLORS are
    colours, ALIASES other spellings, NEEDED what an active record must have.
    """

    attributes: Attributes = field(default=PLAIN, kw_only=True)

    VARIABLE: ClassVar[str] = ""
    NUMBERS: ClassVar[Mapping[str, int]] = {}
    WORDS: ClassVar[tuple[str, ...]] = ()
    COLORS: ClassVar[tuple[str, ...]] = ()
    ALIASES: ClassVar[Mapping[str, str]] = {}
    NEEDED: ClassVar[tuple[str, ...]] = ()

    @property
    def label(self) -> str:
        """The label among the attributes."""
        return self.attributes.label

    @classmethod
    def parse(cls, text: str) -> Self:
        """Record from text; raises RecordError when a needed field is missing or a number is none."""
        raw = field_map(cls.VARIABLE, text)
        values = {cls.ALIASES.get(key, key): value for key, value in raw.items()}
        attributes = read_attributes(values)
        found: dict[str, Any] = {}
        for key in cls.NUMBERS:
            if key in values:
                number = parse_number(values[key])
                if number is None:
                    raise RecordError(cls.VARIABLE, f"{key} must be a number, found '{clip(values[key])}'")
                found[key] = number
        for key in cls.WORDS:
            if key in values:
                found[key] = values[key]
        for key in cls.COLORS:
            color = color_text(values[key]) if key in values else None
            if color is not None:
                found[key] = color
        if attributes.active:
            for key in cls.NEEDED:
                if key not in found:
                    raise RecordError(cls.VARIABLE, f"no {key} in '{clip(text)}'")
        record = cls(attributes=attributes, **found)
        reason = record.problem()
        if reason and attributes.active:
            raise RecordError(cls.VARIABLE, reason)
        return record

    def problem(self) -> str:
        """Why this record cannot be drawn, "" when it can."""
        return ""

    def to_text(self) -> str:
        """`field=value,...` followed by the attribute tail; what was never set is left out."""
        parts = []
        for key, decimals in self.NUMBERS.items():
            value = getattr(self, key)
            if value is not None and math.isfinite(value):
                parts.append(f"{key}={num(value, decimals)}")
        for key in (*self.WORDS, *self.COLORS):
            value = getattr(self, key)
            if value:
                parts.append(f"{key}={''.join(c for c in value if c not in ',{}').strip()}")
        return ",".join(parts) + self.attributes.tail()

    __str__ = to_text

    def with_attributes(self, **changes: Any) -> Self:
        """The same record with some drawing attributes changed."""
        return replace(self, attributes=replace(self.attributes, **changes))


@dataclass(frozen=True, slots=True)
class RangePulse(_Drawing):
    """VIEW_RANGE_PULSE: a ring that grows from (x, y) to `radius` within `duration` seconds of `time`.

    `fill` is the opacity of the disc inside the ring, 0..1; `linger` keeps the full ring for that long.
    """

    x: float = 0.0
    y: float = 0.0
    radius: float = 40.0
    fill: float | None = None
    linger: float | None = None

    VARIABLE = "VIEW_RANGE_PULSE"
    NUMBERS: ClassVar[Mapping[str, int]] = {"x": 2, "y": 2, "radius": 2, "fill": 2, "linger": 2}
    ALIASES: ClassVar[Mapping[str, str]] = {"rad": "radius"}
    NEEDED = ("x", "y")

    def problem(self) -> str:
        """A pulse needs a radius that is not negative."""
        return f"radius must be at least 0, found {self.radius:g}" if self.radius < 0.0 else ""

    def radius_at(self, now: float) -> float | None:
        """Radius of the ring at a time; None before it starts and after its duration and linger."""
        age = now - (self.attributes.time or 0.0)
        duration = 15.0 if self.attributes.duration is None else self.attributes.duration
        if age < 0.0 or (duration >= 0.0 and age > duration + (self.linger or 0.0)):
            return None
        return self.radius if duration <= 0.0 else self.radius * min(1.0, age / duration)


@dataclass(frozen=True, slots=True)
class CommsPulse(_Drawing):
    """VIEW_COMMS_PULSE: a beam from the sender (sx, sy) to the target (tx, ty).

    `beam_width` is the width at the target in metres, `fill` its opacity 0..1, `pulse_type` `msg` for
    messages. A label without a colour after it marks a node report, drawn orange.
    """

    sx: float = 0.0
    sy: float = 0.0
    tx: float = 0.0
    ty: float = 0.0
    beam_width: float = 7.0
    fill: float | None = None
    pulse_type: str = ""

    VARIABLE = "VIEW_COMMS_PULSE"
    NUMBERS: ClassVar[Mapping[str, int]] = {"sx": 2, "sy": 2, "tx": 2, "ty": 2, "beam_width": 2, "fill": 2}
    WORDS = ("pulse_type",)
    NEEDED = ("sx", "sy", "tx", "ty")


@dataclass(frozen=True, slots=True)
class Marker(_Drawing):
    """VIEW_MARKER: a sign on the chart; `type` is its shape, as circle, square, diamond, gateway."""

    x: float = 0.0
    y: float = 0.0
    width: float | None = None
    range: float | None = None
    type: str = "circle"
    primary_color: str = ""
    secondary_color: str = ""

    VARIABLE = "VIEW_MARKER"
    NUMBERS: ClassVar[Mapping[str, int]] = {"x": 2, "y": 2, "width": 2, "range": 2}
    WORDS = ("type",)
    COLORS = ("primary_color", "secondary_color")
    ALIASES: ClassVar[Mapping[str, str]] = {"color": "primary_color", "shape": "type", "scale": "width"}
    NEEDED = ("x", "y")


@dataclass(frozen=True, slots=True)
class Vector(_Drawing):
    """VIEW_VECTOR: an arrow from (x, y) along heading `ang` that stands for a magnitude `mag`."""

    x: float = 0.0
    y: float = 0.0
    mag: float = 0.0
    ang: float = 0.0
    head_size: float | None = None

    VARIABLE = "VIEW_VECTOR"
    NUMBERS: ClassVar[Mapping[str, int]] = {"x": 2, "y": 2, "mag": 2, "ang": 2, "head_size": 1}
    NEEDED = ("x", "y", "mag", "ang")


@dataclass(frozen=True, slots=True)
class Arrow(_Drawing):
    """VIEW_ARROW: a block arrow with its base at (x, y), pointing along heading `ang`; sizes in metres."""

    x: float = 0.0
    y: float = 0.0
    ang: float = 0.0
    base_wid: float = 10.0
    base_hgt: float = 30.0
    head_wid: float = 20.0
    head_hgt: float = 20.0

    VARIABLE = "VIEW_ARROW"
    NUMBERS: ClassVar[Mapping[str, int]] = {
        "x": 2,
        "y": 2,
        "base_wid": 2,
        "base_hgt": 2,
        "head_wid": 2,
        "head_hgt": 2,
        "ang": 2,
    }
    NEEDED = ("x", "y")


@dataclass(frozen=True, slots=True)
class TextBox(_Drawing):
    """VIEW_TEXTBOX: a line of text (`msg` among the attributes) at (x, y) in `fsize` points."""

    x: float = 0.0
    y: float = 0.0
    fsize: float = 10.0
    mcolor: str = ""

    VARIABLE = "VIEW_TEXTBOX"
    NUMBERS: ClassVar[Mapping[str, int]] = {"x": 2, "y": 2, "fsize": 0}
    COLORS = ("mcolor",)
    NEEDED = ("x", "y")


@dataclass(frozen=True, slots=True)
class Wedge(_Drawing):
    """VIEW_WEDGE: the part of a ring about (x, y) between two radii and, clockwise, two headings."""

    x: float = 0.0
    y: float = 0.0
    lang: float = 0.0
    rang: float = 0.0
    range_min: float = 0.0
    range_max: float = 0.0

    VARIABLE = "VIEW_WEDGE"
    NUMBERS: ClassVar[Mapping[str, int]] = {
        "x": 2,
        "y": 2,
        "lang": 2,
        "rang": 2,
        "range_min": 2,
        "range_max": 2,
    }
    ALIASES: ClassVar[Mapping[str, str]] = {
        "ang_low": "lang",
        "ang_hgh": "rang",
        "rad_low": "range_min",
        "rad_hgh": "range_max",
        "range": "range_max",
    }
    NEEDED = ("x", "y", "lang", "rang", "range_max")

    def problem(self) -> str:
        """Radii must be ordered."""
        if 0.0 <= self.range_min < self.range_max:
            return ""
        return f"range_min {self.range_min:g} must be at least 0 and less than range_max {self.range_max:g}"


@dataclass(frozen=True, slots=True)
class Oval(_Drawing):
    """VIEW_OVAL: everything within `rad` metres of the segment (x1, y1) to (x2, y2)."""

    x1: float = 0.0
    y1: float = 0.0
    x2: float = 0.0
    y2: float = 0.0
    rad: float = 0.0
    draw_degs: float | None = None

    VARIABLE = "VIEW_OVAL"
    NUMBERS: ClassVar[Mapping[str, int]] = {"x1": 2, "y1": 2, "x2": 2, "y2": 2, "rad": 2, "draw_degs": 2}
    ALIASES: ClassVar[Mapping[str, str]] = {"radius": "rad"}
    NEEDED = ("x1", "y1", "x2", "y2", "rad")

    def problem(self) -> str:
        """An oval needs a positive radius."""
        return "" if self.rad > 0.0 else f"rad must be greater than 0, found {self.rad:g}"


Drawable: TypeAlias = (
    Point
    | SegList
    | Seglr
    | Circle
    | RangePulse
    | CommsPulse
    | Marker
    | Vector
    | Arrow
    | TextBox
    | Wedge
    | Oval
)


def parse_circle(text: str) -> Circle:
    """VIEW_CIRCLE from `x=..,y=..,radius=..,label=..`; raises RecordError unless all three are numbers."""
    values = field_map("VIEW_CIRCLE", text)
    attributes = read_attributes(values)
    if "rad" in values:
        values.setdefault("radius", values["rad"])
    found: dict[str, float] = {}
    for key in ("x", "y", "radius"):
        number = parse_number(values[key]) if key in values else None if attributes.active else 0.0
        if number is None:
            raise RecordError("VIEW_CIRCLE", f"{key} must be a number in '{clip(text)}'")
        found[key] = number
    if found["radius"] < 0.0:
        raise RecordError("VIEW_CIRCLE", f"radius must be at least 0, found {found['radius']:g}")
    return Circle(found["x"], found["y"], found["radius"], attributes)


def circle_text(circle: Circle, decimals: int = 2) -> str:
    """`x=..,y=..,radius=..[,attributes]`."""
    x, y, radius = (num(v, decimals) for v in (circle.x, circle.y, circle.radius))
    return f"x={x},y={y},radius={radius}{circle.attributes.tail()}"


_SMALL: tuple[type[_Drawing], ...] = (
    RangePulse,
    CommsPulse,
    Marker,
    Vector,
    Arrow,
    TextBox,
    Wedge,
    Oval,
)
_PARSERS: dict[str, Callable[[str], Any]] = {
    "VIEW_POINT": parse_point,
    "VIEW_SEGLIST": parse_seglist,
    "VIEW_POLYGON": lambda text: parse_polygon(text, convex=False),
    "VIEW_SEGLR": parse_seglr,
    "VIEW_CIRCLE": parse_circle,
    **{record.VARIABLE: record.parse for record in _SMALL},
}
VIEW_VARIABLES = tuple(_PARSERS)


def parse_view(variable: str, text: str) -> Drawable:
    """What a VIEW_* variable's text asks to draw; raises RecordError, and nothing else, when it cannot be.

    Polygons need not be convex to be drawn. Expiry and erasing are in the record's attributes.
    """
    parser = _PARSERS.get(variable)
    if parser is None:
        raise RecordError(clip(variable), f"no drawing, expected one of {', '.join(VIEW_VARIABLES)}")
    try:
        record: Drawable = parser(text)
    except SpecError as error:
        raise RecordError(variable, str(error)) from None
    return record


def view_text(drawable: Drawable, decimals: int | None = None) -> str:
    """Text that draws it, in the stock form; decimals default to 2 for points and circles, 1 for lists."""
    if isinstance(drawable, Point):
        return point_text(drawable, 2 if decimals is None else decimals)
    if isinstance(drawable, SegList):
        return seglist_text(drawable, 1 if decimals is None else decimals)
    if isinstance(drawable, Seglr):
        return seglr_text(drawable, 1 if decimals is None else decimals)
    if isinstance(drawable, Circle):
        return circle_text(drawable, 2 if decimals is None else decimals)
    return drawable.to_text()
