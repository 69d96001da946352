"""The `start` entries of a fleet file: a pose for every vehicle, given or drawn."""

from __future__ import annotations

import random
from math import sqrt

from pymoos_lite.config.start_poses import Area, NoRoom, Pose, draw_poses
from pymoos_lite.config.strict_yaml import Listing, Reader, Table


def read_starts(table: Reader, readers: list[Reader], dice: random.Random) -> list[Pose]:
    """A pose for every vehicle: its own, one of the list, or one drawn."""
    plan = table.get("start")
    given: list[Pose | None] = [None] * len(readers)
    for i, reader in enumerate(readers):
        own = reader.get("start")
        if own is not None:
            given[i] = _pose(Reader(own, table.file, "start", table.problems))
    if isinstance(plan, Listing):
        for i, item in enumerate(plan.items[: len(readers)]):
            if given[i] is None:
                given[i] = _pose(Reader(item, table.file, "start", table.problems))
        plan = None
    missing = [i for i, pose in enumerate(given) if pose is None]
    area = Reader(plan, table.file, "start", table.problems)
    separation = area.number("separation", 10.0, low=0.0)
    headings = _range(area, "heading", (0.0, 359.0))
    speed = area.number("speed", 0.0)
    room_for = area.integer("room_for", 0, low=1)
    ground = _area(area)
    area.done()
    if ground is not None and 0 < room_for < len(readers):
        ground = ground.grown(sqrt(len(readers) / room_for))  # as much room for each as `room_for` have
    if missing and ground is None:
        text = "start: where do the vehicles start? Give an area to draw from, or a start for each"
        table.problem(table.line_of("start"), text)
        return [pose or Pose() for pose in given]
    if missing and ground is not None:
        taken = [pose for pose in given if pose is not None]
        try:
            drawn = draw_poses(len(missing), ground, separation, headings, speed, taken, dice)
        except NoRoom as error:
            table.problem(table.line_of("start"), f"start: {error}")
            drawn = [Pose()] * len(missing)
        for i, pose in zip(missing, drawn, strict=True):
            given[i] = pose
    return [pose or Pose() for pose in given]


def _pose(table: Reader) -> Pose:
    for key in ("x", "y"):
        if key not in table:
            table.problem(table.line, f"start: {key} is missing")
    pose = Pose(
        table.number("x", 0.0),
        table.number("y", 0.0),
        table.number("heading", 0.0),
        table.number("speed", 0.0),
    )
    table.done()
    return pose


def _area(table: Reader) -> Area | None:
    tree = table.get("area")
    if tree is None:
        return None
    if isinstance(tree, Table):
        box = Reader(tree, table.file, "area", table.problems)
        wide, high = _range(box, "x", (0.0, 0.0)), _range(box, "y", (0.0, 0.0))
        box.done()
        if wide[0] >= wide[1] or high[0] >= high[1]:
            table.problem(tree.line, "area: expected x: [LOW, HIGH] and y: [LOW, HIGH]")
            return None
        return Area.box(*wide, *high)
    if isinstance(tree, Listing):
        corners: list[tuple[float, float]] = []
        for item in tree.items:
            place = item.items if isinstance(item, Listing) else ()
            if len(place) != 2:
                table.problem(item.line, "area: a corner is [X, Y]")
                return None
            corners.append((table.as_number(place[0], "area", 0.0), table.as_number(place[1], "area", 0.0)))
        if len(corners) >= 3:
            return Area(tuple(corners))
    table.problem(tree.line, "area: expected {x: [LOW, HIGH], y: [LOW, HIGH]} or a list of corners [X, Y]")
    return None


def _range(table: Reader, key: str, default: tuple[float, float]) -> tuple[float, float]:
    """`[LOW, HIGH]`, or one number that is both."""
    tree = table.get(key)
    if tree is None:
        return default
    if isinstance(tree, Listing):
        if len(tree.items) != 2:
            table.problem(tree.line, f"{key}: expected [LOW, HIGH]")
            return default
        low, high = (table.as_number(item, key, default[0]) for item in tree.items)
        return low, high
    value = table.as_number(tree, key, default[0])
    return value, value
