"""How to approximate a function by pieces, as options and as the text `build_info` of a behaviour.

    uniform_piece = discrete @ course:3,speed:3 # uniform_grid = discrete @ course:9,speed:6

Texts are read from left to right and the last assignment wins; a behaviour puts its own default text
first and what the user writes after it, so the user wins. (MOOS-IvP reverses this: there a behaviour's
defaults beat the user.) The word `clear` forgets everything before it. Source: ivp_math.md 6.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from ivp_helm.ivp.boxes import Region, parse_point_box, parse_region_box
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.errors import IvPError, nearest_spelling


@dataclass(frozen=True, slots=True)
class Build:
    """What pieces to make. Lengths are in points per variable, regions inclusive index ranges.

    uniform_amount     about so many equal pieces, if no `uniform_piece` is given
    uniform_piece      edge lengths of the equal pieces
    uniform_grid       edge lengths of the search cells other tools use; the uniform piece if None
    refine_regions, refine_pieces   pairs: the first region gets pieces of the first size, and so on
    plateaus, basins   regions where the function is known to be at its highest, at its lowest
    smart_amount       so many more pieces, each time splitting the one with the largest error
    smart_percent      the same in percent of the pieces so far; the larger of the two counts
    smart_thresh       stop splitting when no error is larger than this
    auto_peak          split around the highest piece until it is a single point
    auto_peak_max      at most so many pieces more for that (None: no limit)
    strict_range       keep each piece within the values at its corners and centre
    """

    uniform_amount: int = 1
    uniform_piece: tuple[int, ...] | None = None
    uniform_grid: tuple[int, ...] | None = None
    refine_regions: tuple[Region, ...] = ()
    refine_pieces: tuple[tuple[int, ...], ...] = ()
    plateaus: tuple[Region, ...] = ()
    basins: tuple[Region, ...] = ()
    smart_amount: int = 0
    smart_percent: int = 0
    smart_thresh: float = 0.0
    auto_peak: bool = False
    auto_peak_max: int | None = None
    strict_range: bool = True


ALIASES = {
    "uniform_amt": "uniform_amount",
    "uniform_box": "uniform_piece",
    "focus_region": "refine_region",
    "focus_box": "refine_piece",
    "priority_amt": "smart_amount",
}
NAMES = (
    *("uniform_amount", "uniform_piece", "uniform_grid"),
    *("refine_region", "refine_piece", "refine_clear", "refine_point"),
    *("plateau_region", "basin_region"),
    *("smart_amount", "smart_percent", "smart_thresh", "queue_levels"),
    *("auto_peak", "auto_peak_max_pcs", "strict_range"),
)


def join_build_info(texts: Iterable[str]) -> str:
    """Several texts as one, defaults first and the user's last. `clear` drops what stands before it."""
    kept: list[str] = []
    for text in texts:
        for part in text.split("#"):
            if part.strip().lower() == "clear":
                kept.clear()
            elif part.strip():
                kept.append(part.strip())
    return " # ".join(kept)


def parse_build_info(
    domain: Domain, text: str, base: Build | None = None, notes: list[str] | None = None
) -> Build:
    """Read a build_info text on top of `base`.

    A part that is not name=value, and a parameter that is understood but has no effect here, is noted in
    `notes`. Raises `IvPError` for an unknown name or a bad value.
    """
    build = base or Build()
    for part in text.split("#"):
        part = part.strip()
        if not part:
            continue
        if part.lower() == "clear":
            build = Build()
            continue
        name, equals, value = (x.strip() for x in part.partition("="))
        if not equals or "=" in value:
            if notes is not None:
                notes.append(f"build_info: {part!r} is not name=value and was left out")
            continue
        name = ALIASES.get(name.lower(), name.lower())
        build = replace(build, **_assignment(domain, build, name, value, notes))
    if len(build.refine_regions) != len(build.refine_pieces) and notes is not None:
        notes.append(
            f"build_info: {len(build.refine_regions)} refine_region(s) but {len(build.refine_pieces)}"
            " refine_piece(s); those without a partner are left out"
        )
    return build


def _assignment(
    domain: Domain, build: Build, name: str, value: str, notes: list[str] | None
) -> dict[str, Any]:
    match name:
        case "uniform_amount":
            return {"uniform_amount": _whole(name, value, 1)}
        case "smart_amount" | "smart_percent":
            return {name: _whole(name, value, 0)}
        case "auto_peak_max_pcs":
            return {"auto_peak_max": _whole(name, value, 1)}
        case "smart_thresh":
            return {"smart_thresh": _threshold(name, value)}
        case "uniform_piece" | "uniform_grid":
            return {name: parse_point_box(domain, value)}
        case "refine_region":
            return {"refine_regions": (*build.refine_regions, parse_region_box(domain, value))}
        case "refine_piece":
            return {"refine_pieces": (*build.refine_pieces, parse_point_box(domain, value))}
        case "refine_clear":
            return {"refine_regions": (), "refine_pieces": ()}
        case "plateau_region":
            return {"plateaus": (*build.plateaus, parse_region_box(domain, value))}
        case "basin_region":
            return {"basins": (*build.basins, parse_region_box(domain, value))}
        case "auto_peak":
            if value.lower() not in ("true", "false"):
                raise IvPError(f"build_info: auto_peak value must be true/false, not {value!r}")
            return {"auto_peak": value.lower() == "true"}
        case "strict_range":
            return {"strict_range": value.lower() == "true"}
        case "queue_levels" | "refine_point":
            if name == "queue_levels":
                _whole(name, value, 1)
            if notes is not None:
                notes.append(f"build_info: {name} has no effect here (the queue has room for every piece)")
            return {}
        case _:
            raise IvPError(f"build_info: {name}: unhandled parameter{nearest_spelling(name, NAMES)}")


def _whole(name: str, value: str, least: int) -> int:
    try:
        number = int(value)
    except ValueError:
        number = least - 1
    if number < least:
        raise IvPError(f"build_info: {name} value must be >= {least}, not {value!r}")
    return number


def _threshold(name: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number >= 0):
        raise IvPError(f"build_info: {name} value must be >= 0, not {value!r}")
    return number
