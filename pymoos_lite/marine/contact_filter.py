"""Which contacts matter: by name, group, type and region (marine_apps.md 5.1)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import parse_polygon
from pymoos_lite.geometry.text import unbrace

KINDS = ("name", "group", "type")
FILTER_KEYS = frozenset(
    {f"{sense}_{kind}" for sense in ("ignore", "match") for kind in (*KINDS, "region")} | {"strict_ignore"}
)


@dataclass(frozen=True, slots=True)
class ContactFilter:
    """Lists of what to match and what to ignore; an empty list says nothing.

    Words compare in any case. With `strict`, a contact without group or type is ignored where there is a
    list of groups or types to ignore.
    """

    match: dict[str, frozenset[str]] = field(default_factory=dict)
    ignore: dict[str, frozenset[str]] = field(default_factory=dict)
    match_regions: tuple[Polygon, ...] = ()
    ignore_regions: tuple[Polygon, ...] = ()
    strict: bool = True
    says_nothing: bool = field(init=False, repr=False, compare=False)
    """True when every contact passes."""

    def __post_init__(self) -> None:
        told = self.match or self.ignore or self.match_regions or self.ignore_regions
        object.__setattr__(self, "says_nothing", not told)

    def with_entry(self, key: str, value: str) -> ContactFilter:
        """The filter with one more `ignore_name = a,b` or the like.

        Raises:
            ValueError: unknown key, a word in both lists of a kind, or a region that is no convex polygon.
        """
        sense, _, kind = key.lower().partition("_")
        if key.lower() == "strict_ignore":
            word = value.strip().lower()
            if word not in ("true", "false"):
                raise ValueError(f"strict_ignore = {value}: expected true or false")
            return replace(self, strict=word == "true")
        if sense not in ("match", "ignore") or kind not in (*KINDS, "region"):
            raise ValueError(f"'{key}' is no contact filter")
        if kind == "region":
            region = parse_polygon(value)
            if not region.points:
                raise ValueError(f"{key} needs a polygon with points")
            if sense == "match":
                return replace(self, match_regions=(*self.match_regions, region))
            return replace(self, ignore_regions=(*self.ignore_regions, region))
        words = frozenset(word.strip().lower() for word in unbrace(value).split(",") if word.strip())
        own, other = (self.match, self.ignore) if sense == "match" else (self.ignore, self.match)
        both = words & other.get(kind, frozenset())
        if both:
            raise ValueError(f"{kind} '{min(both)}' cannot be both matched and ignored")
        merged = {**own, kind: own.get(kind, frozenset()) | words}
        return replace(self, match=merged) if sense == "match" else replace(self, ignore=merged)

    def passes(self, name: str, group: str, kind: str, x: float, y: float) -> bool:
        """Whether a contact of that name, group and type at (x, y) matters."""
        if self.says_nothing:
            return True
        words = (("name", name), ("group", group), ("type", kind))
        return all(self.passes_word(what, told) for what, told in words) and self.passes_place(x, y)

    def passes_word(self, what: str, told: str) -> bool:
        """Whether a contact whose `what` (name, group or type) is `told` matters, as far as that goes."""
        word = told.strip().lower()
        ignored, matched = self.ignore.get(what), self.match.get(what)
        if ignored and (word in ignored or (not word and self.strict and what != "name")):
            return False
        return not matched or word in matched

    def passes_place(self, x: float, y: float) -> bool:
        """Whether a contact at (x, y) matters, as far as that goes."""
        if any(region.contains(x, y) for region in self.ignore_regions):
            return False
        return not self.match_regions or any(region.contains(x, y) for region in self.match_regions)
