"""Forms of parameters that several behaviours declare: repeats, suffixes, shapes, speeds, hints.

Each is a reader for a custom `Parameter` or makes the whole declaration; readers raise `ValueError` with
what would be right.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from ivp_helm.base_parameters import flag_parameter
from pymoos_lite.config.parameters import Parameter, ParameterError, parse_number
from pymoos_lite.geometry.colors import color_text
from pymoos_lite.geometry.formats import SpecError
from pymoos_lite.geometry.hints import VisualHints
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import Point
from pymoos_lite.geometry.specs import parse_point, parse_polygon
from pymoos_lite.geometry.text import fields

__all__ = [
    "custom",
    "flag",
    "hint_lines",
    "hint_pairs",
    "number",
    "point",
    "polygon",
    "read_color",
    "read_off_or",
    "read_repeat",
    "read_suffix",
    "tolerant_hints",
    "variable",
]

flag = flag_parameter


def number(name: str, default: float, unit: str, doc: str, low: float | None = 0.0, **more: Any) -> Parameter:
    """A number, at least 0 unless said otherwise."""
    return Parameter(name, "number", default, unit, doc, low=low, **more)


def custom(
    name: str, parse: Callable[[str], Any], default: Any, doc: str, example: str = "", **more: Any
) -> Parameter:
    """A parameter with a reader of its own."""
    unit = more.pop("unit", "")
    return Parameter(name, "custom", default, unit, doc, parse=parse, example=example, **more)


def variable(name: str, default: str, doc: str, *aliases: str) -> Parameter:
    """The name of a variable to post to; empty for none."""
    return Parameter(name, "custom", default, "", doc, parse=_variable, aliases=aliases, example=default)


def _variable(text: str) -> str:
    word = text.strip().strip('"').strip()
    if re.search(r"\s", word):
        raise ValueError("a variable name has no blanks")
    return word


def polygon(name: str, doc: str, *aliases: str) -> Parameter:
    """A convex polygon in any spelling of behaviors.md A4."""
    return custom(name, _polygon, None, doc, "pts={0,0:50,0:50,50:0,50}", aliases=aliases)


def _polygon(text: str) -> Polygon:
    return parse_polygon(text)


def point(name: str, doc: str, *aliases: str) -> Parameter:
    """A point in any spelling of behaviors.md A4."""
    return custom(name, _point, None, doc, "x=40,y=-110", aliases=aliases)


def _point(text: str) -> Point:
    return parse_point(text)


def read_repeat(text: str) -> int | None:
    """Further rounds: a whole number, or None for ``forever``."""
    if text.strip().lower() == "forever":
        return None
    value = parse_number(text.strip())
    if value < 0 or value != int(value):
        raise ParameterError(f"repeat = {text!r}: give a whole number of at least 0, or forever")
    return int(value)


def read_suffix(text: str) -> str:
    """What is put behind the names of posted variables, with an underscore in front; empty for nothing."""
    word = text.strip()
    if re.search(r"\s", word):
        raise ValueError("no blanks are allowed")
    return word if not word or word.startswith("_") else f"_{word}"


def read_off_or(reader: Callable[[float], bool], legal: str) -> Callable[[str], float | None]:
    """A reader of numbers for which ``off`` (and -1) is None; `legal` says which others are allowed."""

    def read(text: str) -> float | None:
        if text.strip().lower() == "off":
            return None
        value = parse_number(text.strip())
        if value == -1.0:
            return None
        if not reader(value):
            raise ValueError(f"give {legal}, or off")
        return value

    return read


def read_color(text: str) -> str:
    """A colour as it is written in messages."""
    color = color_text(text)
    if color is None:
        raise ValueError(f"'{text.strip()}' is no colour")
    return color


def hint_lines(example: str) -> Parameter:
    """`visual_hints`, a line of which the behaviour takes in with `set_visual_hints`."""
    return custom("visual_hints", str, None, "Colours and sizes of what is drawn.", example, repeated=True)


def hint_pairs(text: str) -> list[tuple[str, str]]:
    """Lower-case keys and values of a line of hints."""
    return [(key.lower(), value) for key, value in fields(text)]


def tolerant_hints(hints: VisualHints, text: str, known: tuple[str, ...]) -> tuple[VisualHints, list[str]]:
    """Hints with every good entry of a line applied, and a complaint about each of the others.

    For behaviours whose hints the reference reads without ever refusing one (behaviors.md A6).
    """
    complaints: list[str] = []
    for key, value in fields(text):
        if key.lower().replace("lcolor", "label_color") not in known:
            complaints.append(f"visual_hints: nothing is drawn with '{key}'")
            continue
        try:
            hints = hints.updated(f"{key}={value}")
        except SpecError as error:
            complaints.append(str(error))
    return hints, complaints
