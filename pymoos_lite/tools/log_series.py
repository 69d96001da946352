"""What a picture of a log needs: tracks, drawings and values over time, collected in one pass.

Pure: entries in, plain lists out; `log_plot` draws them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from pymoos_lite.records.alog import AlogEntry
from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.node_report import NodeReport
from pymoos_lite.records.view import VIEW_VARIABLES, Drawable, parse_view
from pymoos_lite.tools.log_reading import Selection

MAX_DRAWINGS = 2000
_VIEWS = frozenset(VIEW_VARIABLES)
_REPORTS = ("NODE_REPORT", "NODE_REPORT_LOCAL")


@dataclass(slots=True)
class Track:
    """Where one vessel was: seconds, metres east, metres north; headings have times of their own (degrees)."""

    times: list[float] = field(default_factory=list)
    xs: list[float] = field(default_factory=list)
    ys: list[float] = field(default_factory=list)
    heading_times: list[float] = field(default_factory=list)
    headings: list[float] = field(default_factory=list)

    def add(self, time: float, x: float, y: float) -> None:
        # Logs are not sorted: a repeated or late entry must not draw a line back.
        if not self.times or time > self.times[-1]:
            self.times.append(time)
            self.xs.append(x)
            self.ys.append(y)

    def add_heading(self, time: float, heading: float) -> None:
        if not self.heading_times or time > self.heading_times[-1]:
            self.heading_times.append(time)
            self.headings.append(heading)


@dataclass(slots=True)
class Series:
    """One variable over time: numbers, or texts as the numbers of `levels`."""

    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    levels: list[str] = field(default_factory=list)

    @property
    def is_text(self) -> bool:
        return bool(self.levels)


@dataclass(slots=True)
class LogPicture:
    """Everything found. The vessel's own track has the name `own`; those of node reports their vessels' names."""

    own: str = ""
    tracks: dict[str, Track] = field(default_factory=dict)
    drawings: dict[tuple[str, str], Drawable] = field(default_factory=dict)
    series: dict[str, Series] = field(default_factory=dict)
    start: float = float("inf")
    stop: float = float("-inf")


def collect(entries: Iterable[AlogEntry], own: str, wanted: Selection, low: float, high: float) -> LogPicture:
    """Gather what lies between `low` and `high` seconds; `wanted` variables become series.

    Shapes stay in the picture after they were erased: a finished survey is what one wants to see.
    """
    picture = LogPicture(own)
    last_x: float | None = None
    for entry in entries:
        time, name, _, value, number = entry
        if not low <= time <= high:
            continue
        picture.start, picture.stop = min(picture.start, time), max(picture.stop, time)
        if name == "NAV_X":
            last_x = number
        elif name == "NAV_Y" and number is not None and last_x is not None:
            _track(picture, own).add(time, last_x, number)
        elif name == "NAV_HEADING" and number is not None:
            _track(picture, own).add_heading(time, number)
        elif name in _VIEWS:
            _add_drawing(picture, name, value)
        elif name in _REPORTS:
            _add_report(picture, value, time)
        if wanted.covers(name):
            _add_value(picture, name, time, value, number)
    tracked = picture.tracks.get(own)
    if tracked is not None and not tracked.times:
        del picture.tracks[own]
    return picture


def _track(picture: LogPicture, name: str) -> Track:
    track = picture.tracks.get(name)
    if track is None:
        track = picture.tracks[name] = Track()
    return track


def _add_report(picture: LogPicture, text: str, time: float) -> None:
    try:
        report = NodeReport.parse(text)
    except RecordError:
        return
    if report.x is None or report.y is None or not report.name or report.name == picture.own:
        return
    track = _track(picture, report.name)
    track.add(time, report.x, report.y)
    if report.heading is not None:
        track.add_heading(time, report.heading)


def _add_drawing(picture: LogPicture, name: str, text: str) -> None:
    try:
        drawing = parse_view(name, text)
    except RecordError:
        return
    key = (name, drawing.label)
    if drawing.attributes.active and (key in picture.drawings or len(picture.drawings) < MAX_DRAWINGS):
        picture.drawings[key] = drawing


def _add_value(picture: LogPicture, name: str, time: float, value: str, number: float | None) -> None:
    series = picture.series.setdefault(name, Series())
    if number is None:
        if series.values and not series.levels:
            return  # a stray text in a variable of numbers
        if value not in series.levels:
            series.levels.append(value)
        number = float(series.levels.index(value))
    elif series.levels:
        return
    series.times.append(time)
    series.values.append(number)


def unwrapped_gaps(values: list[float], limit: float = 180.0) -> list[int]:
    """Indices at which a course jumps over north, where a line must not be drawn across the picture."""
    return [i for i in range(1, len(values)) if abs(values[i] - values[i - 1]) > limit]
