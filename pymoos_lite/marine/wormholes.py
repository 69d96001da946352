"""Wormholes: a vessel that enters one polygon fades out and comes back in another (marine_apps.md 1.8)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import parse_polygon, seglist_text
from pymoos_lite.records.csp import field_map, parse_bool, parse_number, unbrace

_HALF = 5.0  # s of fading out, and of fading in again
_CONNECTIONS = ("from_madrid", "from_weber", "both")


@dataclass(frozen=True, slots=True)
class Wormhole:
    """One pair of mouths; a mouth is None until a line of the same tag gives it."""

    tag: str
    madrid: Polygon | None = None
    weber: Polygon | None = None
    connection: str = "from_madrid"

    def mouths(self) -> list[tuple[Polygon, Polygon]]:
        """(entry, exit) pairs that are open."""
        if self.madrid is None or self.weber is None:
            return []
        ways = [(self.madrid, self.weber), (self.weber, self.madrid)]
        return (
            ways if self.connection == "both" else ways[:1] if self.connection == "from_madrid" else ways[1:]
        )

    def views(self) -> list[str]:
        """VIEW_POLYGON texts of both mouths."""
        texts = []
        for name, polygon, color in (("madrid", self.madrid, "orange"), ("weber", self.weber, "turquoise")):
            if polygon is not None:
                looks = Attributes(label=f"{self.tag}_{name}", edge_color=color, fill_color=color)
                texts.append(seglist_text(replace(polygon, attributes=looks), 2))
        return texts


def parse_wormhole(text: str) -> Wormhole:
    """`tag=T, madrid_poly={x,y:..}, weber_poly={x,y:..}, connection=from_madrid|from_weber|both`.

    `delay` and `id_change` are read and checked, and have no effect. Raises ValueError for anything else.
    """
    hole = Wormhole("")
    for key, value in field_map("wormhole", text).items():
        if key == "tag" and value:
            hole = replace(hole, tag=value)
        elif key in ("madrid_poly", "weber_poly"):
            polygon = parse_polygon(f"pts={{{unbrace(value)}}}")
            hole = replace(hole, madrid=polygon) if key == "madrid_poly" else replace(hole, weber=polygon)
        elif key == "connection" and value.lower() in _CONNECTIONS:
            hole = replace(hole, connection=value.lower())
        elif (key == "delay" and parse_number(value) is not None) or (
            key == "id_change" and parse_bool(value) is not None
        ):
            continue
        else:
            raise ValueError(f"'{key}={value}' is no part of a wormhole")
    if not hole.tag:
        raise ValueError("a wormhole needs a tag")
    return hole


def merge_wormholes(lines: list[Wormhole]) -> list[Wormhole]:
    """One wormhole per tag, in order of first mention; later lines add to and replace parts of earlier ones."""
    merged: dict[str, Wormhole] = {}
    for line in lines:
        before = merged.get(line.tag, Wormhole(line.tag))
        merged[line.tag] = Wormhole(
            line.tag,
            line.madrid or before.madrid,
            line.weber or before.weber,
            line.connection if line.connection != "from_madrid" else before.connection,
        )
    return list(merged.values())


class Tunnel:
    """Where one vessel is with respect to all wormholes."""

    def __init__(self, wormholes: list[Wormhole]) -> None:
        self._mouths = [pair for hole in wormholes for pair in hole.mouths()]
        self._way: tuple[Polygon, Polygon] | None = None
        self._entered_at = 0.0
        self._entry = (0.0, 0.0)
        self._moved = False
        self._inside: Polygon | None = None  # the mouth come out of, closed until it has been left

    def step(self, x: float, y: float, now: float) -> tuple[float, tuple[float, float] | None] | None:
        """None outside any tunnel; else (opacity 0..1, where to put the vessel or None to let it sail)."""
        if self._inside is not None and not self._inside.contains(x, y):
            self._inside = None
        if self._way is None:
            for way in self._mouths:
                if way[0] is not self._inside and way[0].contains(x, y):
                    self._way, self._entered_at, self._entry, self._moved = way, now, (x, y), False
                    break
            else:
                return None
        elapsed = now - self._entered_at
        entry, exit_ = self._way
        target = None
        if elapsed >= _HALF and not self._moved:
            self._moved = True
            self._inside = exit_
            target = _image(self._entry, entry, exit_)
        if elapsed >= 2.0 * _HALF:
            self._way = None
            return 1.0, target
        return abs(1.0 - elapsed / _HALF), target


def _image(point: tuple[float, float], entry: Polygon, exit_: Polygon) -> tuple[float, float]:
    """The point of the exit that corresponds to `point` of the entry, by their centroids."""
    x = exit_.centroid[0] + point[0] - entry.centroid[0]
    y = exit_.centroid[1] + point[1] - entry.centroid[1]
    return (x, y) if exit_.contains(x, y) else exit_.nearest_point(x, y)
