"""`visual_hints`: how a behaviour's drawings shall look (behaviors.md A6).

Keys are `[prefix_]vertex_color, edge_color, label_color, fill_color, vertex_size, edge_size`; a prefix names
one of several drawings of a behaviour and falls back on the key without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pymoos_lite.geometry.attributes import PLAIN, Attributes
from pymoos_lite.geometry.colors import color_text
from pymoos_lite.geometry.formats import SpecError, key_values, shown
from pymoos_lite.geometry.text import num, parse_number

_COLORS = ("vertex_color", "edge_color", "label_color", "fill_color")
_SIZES = ("vertex_size", "edge_size")


class VisualHints:
    """An immutable set of hints; `updated` gives a new one from a line of a mission file."""

    __slots__ = ("_prefixes", "_values")

    def __init__(
        self, defaults: Mapping[str, str | float] | None = None, prefixes: tuple[str, ...] = ()
    ) -> None:
        """Defaults by full key; `prefixes` are the drawings this behaviour has, for `unknown_keys`."""
        self._values: dict[str, str | float] = {
            key: (color_text(value) or value) if isinstance(value, str) else value
            for key, value in (defaults or {}).items()
        }
        self._prefixes = prefixes

    def __eq__(self, other: object) -> bool:
        return isinstance(other, VisualHints) and self._values == other._values

    def __hash__(self) -> int:
        return hash(frozenset(self._values.items()))

    def __repr__(self) -> str:
        return f"VisualHints({self.to_text()!r})"

    def updated(self, text: str) -> VisualHints:
        """Hints with `key=value, key=value` applied.

        A key with `color` in it needs a colour (`lcolor` is short for `label_color`), any other a number of
        at least 0. All or nothing: raises SpecError at the first illegal entry.
        """
        changed = dict(self._values)
        for key, value in key_values(text, "visual_hints").items():
            key = key.replace("lcolor", "label_color")
            if "color" in key:
                color = color_text(value)
                if color is None:
                    raise SpecError(f"visual hint {shown(key)} needs a colour, found '{shown(value)}'")
                changed[key] = color
            else:
                size = parse_number(value)
                if size is None or size < 0.0:
                    raise SpecError(
                        f"visual hint {shown(key)} needs a number of at least 0, found '{shown(value)}'"
                    )
                changed[key] = size
        return VisualHints(changed, self._prefixes)

    def unknown_keys(self) -> tuple[str, ...]:
        """Keys that no drawing will ever ask for, sorted: worth a warning."""
        known = {*_COLORS, *_SIZES}
        known.update(f"{prefix}_{key}" for prefix in self._prefixes for key in (*_COLORS, *_SIZES))
        return tuple(sorted(key for key in self._values if key not in known))

    def color(self, key: str, prefix: str = "", default: str = "") -> str:
        """Colour of `prefix_key`, else of `key`, else the default; key ends in _color."""
        value = self._find(key, prefix)
        return value if isinstance(value, str) else default

    def size(self, key: str, prefix: str = "", default: float | None = None) -> float | None:
        """Size of `prefix_key`, else of `key`, else the default."""
        value = self._find(key, prefix)
        return value if isinstance(value, float | int) else default

    def attributes(self, prefix: str = "", base: Attributes = PLAIN) -> Attributes:
        """`base` with every colour and size that these hints know for the drawing called `prefix`."""
        found: dict[str, Any] = {}
        for key in (*_COLORS, *_SIZES):
            value = self._find(key, prefix)
            if value is not None:
                found[key] = value
        return replace(base, **found) if found else base

    def to_text(self) -> str:
        """`key=value,key=value`, sorted by key."""
        items = sorted(self._values.items())
        return ",".join(f"{k}={v if isinstance(v, str) else num(v, 2)}" for k, v in items)

    def _find(self, key: str, prefix: str) -> str | float | None:
        if prefix:
            value = self._values.get(f"{prefix}_{key}")
            if value is not None:
                return value
        return self._values.get(key)
