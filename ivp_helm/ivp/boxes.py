"""Boxes of domain points: edge lengths of pieces, and regions, as text or numbers.

Lengths count points, regions are inclusive index ranges. Source: ivp_math.md 1.5 and 1.6.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ivp_helm.ivp.domain import Domain, Variable
from ivp_helm.ivp.errors import IvPError, nearest_spelling


class Region(NamedTuple):
    """An axis-aligned part of a domain: inclusive lowest and highest index per variable."""

    low: tuple[int, ...]
    high: tuple[int, ...]


def parse_point_box(domain: Domain, text: str) -> tuple[int, ...]:
    """Edge lengths in points per variable: `discrete @ course:3,speed:3` or `native @ course:45,speed:1.3`.

    "float" is another word for "native", which is also what a text without "@" is. Discrete lengths are
    cut to the variable, native ones too ("all" for the whole length) and rounded to whole steps, at least
    one point. Every variable must occur; others are ignored. Raises `IvPError` for anything else.
    """
    kind, entries = _entries(domain, text, need_kind=False)
    lengths = []
    for v in domain.variables:
        value = _one(entries, v, text, 1)[0]
        if kind == "discrete":
            points = _real(value, text)
            if points < 1:
                raise IvPError(f"box {text!r}: length {value} of {v.name!r} is below one point")
            lengths.append(min(math.trunc(points), v.points))
            continue
        length = v.high - v.low if value == "all" else _real(value, text)
        if length <= 0 and v.points > 1:
            raise IvPError(f"box {text!r}: length {value} of {v.name!r} is not above 0")
        steps = min(length, v.high - v.low) / v.delta if v.points > 1 else 1.0
        lengths.append(min(max(1, math.trunc(steps + 0.5)), v.points))
    return tuple(lengths)


def parse_region_box(domain: Domain, text: str) -> Region:
    """A region from `native @ course:45:90,speed:1.3:2.1` or `discrete @ course:4:32,speed:0:20`.

    The kind before "@" is needed. Native limits are drawn inwards to domain points, discrete ones are
    indexes; both are cut to the domain, and "all" stands for the full range. Raises `IvPError` for
    reversed limits, limits wholly outside, and missing variables.
    """
    kind, entries = _entries(domain, text, need_kind=True)
    low, high = [], []
    for v in domain.variables:
        values = _one(entries, v, text, 2)
        if values == ["all"]:
            low.append(0)
            high.append(v.points - 1)
            continue
        first, last = (_real(x, text) for x in values)
        if first > last:
            raise IvPError(f"region {text!r}: limits of {v.name!r} are reversed")
        bottom, top = (v.low, v.high) if kind == "native" else (0, v.points - 1)
        if last < bottom or first > top:
            raise IvPError(f"region {text!r}: limits of {v.name!r} are outside {bottom:g} to {top:g}")
        if kind == "native":
            a, b = v.index(first, "ceil"), v.index(last, "floor")
        else:
            a, b = max(0, math.trunc(first)), min(v.points - 1, math.trunc(last))
        if a > b:
            raise IvPError(
                f"region {text!r}: no domain point of {v.name!r} lies between {first:g} and {last:g}"
            )
        low.append(a)
        high.append(b)
    return Region(tuple(low), tuple(high))


def checked_region(domain: Domain, region: Region) -> Region:
    """The region itself, if it lies in the domain with limits in order; else `IvPError`."""
    if len(region.low) != len(domain) or len(region.high) != len(domain):
        raise IvPError(f"region {region} does not fit domain {domain}")
    for v, a, b in zip(domain.variables, region.low, region.high, strict=True):
        if not 0 <= a <= b < v.points:
            raise IvPError(f"region {a} to {b} of {v.name!r}: expected 0 <= low <= high <= {v.points - 1}")
    return region


def uniform_piece(domain: Domain, amount: int) -> tuple[int, ...]:
    """The edge lengths of equal pieces such that about (and at most) `amount` of them cover the domain.

    The variable with the longest edges is divided once more, again and again, while the budget allows.
    """
    if amount < 1:
        raise IvPError(f"a domain cannot be covered with {amount} pieces")
    parts = [1] * len(domain)
    still_open = list(range(len(domain)))
    total = 1
    while still_open:
        d = max(still_open, key=lambda i: domain.points[i] / parts[i])  # the first of equals
        more = total // parts[d] * (parts[d] + 1)
        if more > amount:
            still_open.remove(d)
            continue
        parts[d] += 1
        total = more
        if parts[d] >= domain.points[d]:
            still_open.remove(d)
    return tuple(-(-points // k) for points, k in zip(domain.points, parts, strict=True))


def _entries(domain: Domain, text: str, *, need_kind: bool) -> tuple[str, dict[str, list[str]]]:
    kind, at, rest = text.partition("@")
    if not at:
        if need_kind:
            raise IvPError(f"region {text!r}: expected 'native @ ...' or 'discrete @ ...'")
        kind, rest = "native", text
    kind = kind.strip().lower()
    if kind == "float":
        kind = "native"
    if kind not in ("native", "discrete"):
        raise IvPError(f"box {text!r}: {kind!r} is neither native nor discrete")
    entries: dict[str, list[str]] = {}
    for part in rest.split(","):
        name, *values = (field.strip().lower() for field in part.split(":"))
        if not values:
            raise IvPError(f"box {text!r}: {part.strip()!r} is not name:value")
        entries[name] = values
    return kind, entries


def _one(entries: dict[str, list[str]], v: Variable, text: str, fields: int) -> list[str]:
    values = entries.get(v.name.lower())
    if values is None:
        raise IvPError(
            f"box {text!r}: variable {v.name!r} is missing{nearest_spelling(v.name.lower(), entries)}"
        )
    if len(values) != fields and values != ["all"]:
        raise IvPError(f"box {text!r}: {v.name!r} needs {fields} number(s), or all")
    return values


def _real(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise IvPError(f"box {where!r}: {text!r} is not a number")
    return value
