"""What every drawable carries besides its shape: label, life span, sizes, colours.

The names, their order in text and their rounding are behaviors.md A3 and A5. Unknown keys are ignored by
readers and so are illegal values: a bad colour must not cost a vehicle its waypoints.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from mypy_extensions import mypyc_attr

from pymoos_lite.geometry.colors import color_text
from pymoos_lite.geometry.text import num, parse_bool, parse_number


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Attributes:
    """Label, provenance, life span and looks of a drawable; None and "" mean not set.

    time is in MOOS seconds and duration in seconds (-1 = for ever); sizes are pixels;
    fill_transparency runs from 0 (invisible) to 1 (opaque).
    """

    label: str = ""
    msg: str = ""
    source: str = ""
    vsource: str = ""
    id: str = ""
    active: bool = True
    label_color: str = ""
    edge_color: str = ""
    vertex_color: str = ""
    fill_color: str = ""
    time: float | None = None
    duration: float | None = None
    vertex_size: float | None = None
    edge_size: float | None = None
    fill_transparency: float | None = None

    def expired(self, now: float) -> bool:
        """True when both time and duration are set, neither means for ever, and they have run out."""
        return (
            self.time is not None
            and self.duration is not None
            and self.duration >= 0.0
            and self.time > 0.0
            and now - self.time > self.duration
        )

    def tail(self, *, show_active: bool = False) -> str:
        """The text after the shape, `,label=..,...` with its leading comma; "" when nothing is set.

        `active=false` always shows; `active=true` only on request, and then first, as the nextpt of
        the waypoint behaviour has it.
        """
        parts = [""]
        if not self.active:
            parts.append("active=false")
        elif show_active:
            parts.append("active=true")
        for key in _TEXT_KEYS:
            value = getattr(self, key)
            if value:
                parts.append(f"{key}={_one_field(value)}")
        for key, decimals in _NUMBER_KEYS:
            number = getattr(self, key)
            if number is not None:
                parts.append(f"{key}={num(number, decimals)}")
        return ",".join(parts)


PLAIN = Attributes()

_TEXT_KEYS = (
    "label",
    "msg",
    "source",
    "vsource",
    "id",
    "label_color",
    "edge_color",
    "vertex_color",
    "fill_color",
)
_NUMBER_KEYS = (("time", 2), ("duration", 2), ("vertex_size", 1), ("edge_size", 1), ("fill_transparency", 2))


def _one_field(value: str) -> str:
    """Text that cannot end its field early; readers of these specs know no quoting."""
    if "," in value or "{" in value or "}" in value:
        return "".join(c for c in value if c not in ",{}").strip()
    return value


def read_attributes(pairs: Mapping[str, str] | Iterable[tuple[str, str]]) -> Attributes:
    """Attributes from fields with lower-case keys; unknown keys and illegal values are ignored."""
    found: dict[str, Any] = {}
    for key, value in pairs.items() if isinstance(pairs, Mapping) else pairs:
        reader = _READERS.get(key)
        if reader is not None:
            parsed = reader(value)
            if parsed is not None:
                found[key] = parsed
    return Attributes(**found) if found else PLAIN


def is_attribute(key: str) -> bool:
    """True for the keys of the attribute tail, `type` included, which is read and ignored."""
    return key in _READERS or key == "type"


def _text(value: str) -> str:
    return value.strip()


def _duration(value: str) -> float | None:
    seconds = parse_number(value)
    return None if seconds is None else seconds if seconds >= 0.0 else -1.0


def _size(value: str) -> float | None:
    size = parse_number(value)
    return size if size is not None and size >= 0.0 else None


def _fraction(value: str) -> float | None:
    number = parse_number(value)
    return None if number is None else min(max(number, 0.0), 1.0)


_READERS: dict[str, Callable[[str], Any]] = {
    **dict.fromkeys(("label", "msg", "source", "vsource", "id"), _text),
    **dict.fromkeys(("label_color", "edge_color", "vertex_color", "fill_color"), color_text),
    "active": parse_bool,
    "time": parse_number,
    "duration": _duration,
    "vertex_size": _size,
    "edge_size": _size,
    "fill_transparency": _fraction,
}
