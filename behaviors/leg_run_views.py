"""What BHV_LegRun draws (behaviors.md C17)."""

from __future__ import annotations

from collections.abc import Iterator

from behaviors.leg_course import LegCourse
from pymoos_lite.geometry.angles import bearing
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.hints import VisualHints
from pymoos_lite.geometry.shapes import XY, Point, SegList
from pymoos_lite.geometry.specs import erase_point_text, erase_seglist_text, point_text, seglist_text

HINTS = VisualHints(
    {
        "nextpt_vertex_color": "yellow",
        "nextpt_label_color": "aqua",
        "nextpt_vertex_size": 3.0,
        "legpt_vertex_color": "orange",
        "legpt_edge_color": "gray60",
        "legpt_label_color": "invisible",
        "legpt_vertex_size": 7.0,
        "legpt_edge_size": 1.0,
        "turn_vertex_color": "gray70",
        "turn_edge_color": "gray30",
        "turn_label_color": "invisible",
        "turn_vertex_size": 2.0,
        "turn_edge_size": 1.0,
    },
    ("nextpt", "legpt", "turn"),
)
FLAG_SHARE = 0.42
"""Share of a turn's length at which the mark stands that shows its direction."""
View = tuple[str, str, str]
"""Variable, text, and the key under which repetitions are dropped."""


def course_views(community: str, course: LegCourse, hints: VisualHints) -> tuple[list[View], list[View]]:
    """The race track: both turns and the leg with marks on the turns; and its two points."""
    lines: list[View] = []
    marks: list[View] = []
    for number, path in ((1, course.path1), (2, course.path2)):
        lines.append(_line(path, f"{community}_pview{number}", hints, "turn"))
        marks.append(_mark(path, f"{community}_fpt{number}"))
    lines.append(_line((course.p1, course.p2), f"{community}_pview3", hints, "legpt"))
    size = hints.size("vertex_size", "legpt") or 0.0
    points = []
    for number, (x, y), scale in ((1, course.p1, 1.5), (2, course.p2, 1.0)):
        label = f"{community}_p{number}"
        looks = Attributes(
            label=label,
            label_color=hints.color("label_color", "legpt"),
            vertex_color=hints.color("vertex_color", "legpt"),
            vertex_size=size * scale,
        )
        points.append(("VIEW_POINT", point_text(Point(x, y, attributes=looks)), label))
    return lines + marks, points


def turn_view(community: str, path: tuple[XY, ...], hints: VisualHints) -> View:
    """The turn under way."""
    return _line(path, f"{community}_turn", hints, "turn")


def target_views(community: str, target: XY, track: XY | None, hints: VisualHints) -> Iterator[View]:
    """The point steered for on the line (None: not drawn), and the point to be reached."""
    label = f"{community}'s track-point"
    if track is None:
        text = erase_point_text(label)
    else:
        color = hints.color("vertex_color", "nextpt")
        looks = Attributes(label=label, label_color=color, vertex_color=color, vertex_size=4.0)
        text = point_text(Point(*track, attributes=looks))
    yield "VIEW_POINT", text, "trk"
    looks = Attributes(
        label=f"{community}'s next waypoint",
        label_color=hints.color("label_color", "nextpt"),
        vertex_color=hints.color("color", "nextpt") or hints.color("vertex_color", "nextpt"),
        vertex_size=hints.size("vertex_size", "nextpt"),
    )
    yield "VIEW_POINT", point_text(Point(*target, attributes=looks)), "wpt"


def erasures(community: str) -> Iterator[View]:
    """Everything above taken away."""
    for key, label in (("trk", f"{community}'s track-point"), ("wpt", f"{community}'s next waypoint")):
        yield "VIEW_POINT", erase_point_text(label), key
    for name in ("fpt1", "fpt2", "p1", "p2"):
        yield "VIEW_POINT", erase_point_text(f"{community}_{name}"), f"{community}_{name}"
    for name in ("pview1", "pview2", "pview3", "turn"):
        yield "VIEW_SEGLIST", erase_seglist_text(f"{community}_{name}"), f"{community}_{name}"


def _line(points: tuple[XY, ...], label: str, hints: VisualHints, kind: str) -> View:
    looks = Attributes(
        label=label,
        label_color=hints.color("label_color", kind),
        edge_color=hints.color("edge_color", kind),
        vertex_color=hints.color("vertex_color", kind),
        vertex_size=hints.size("vertex_size", kind),
        edge_size=hints.size("edge_size", kind),
    )
    return "VIEW_SEGLIST", seglist_text(SegList(points, attributes=looks), 1), label


def _mark(path: tuple[XY, ...], label: str) -> View:
    line = SegList(path)
    here = line.length * FLAG_SHARE
    x, y = line.point_at(here)
    onward = line.point_at(here + 0.01)
    looks = Attributes(
        label=label, label_color="invisible", vertex_color="limegreen", duration=600.0, vertex_size=8.0
    )
    heading = float(round(bearing(x, y, *onward)))
    return "VIEW_POINT", point_text(Point(x, y, heading, attributes=looks)), label
