"""`pymoos log plot`: tracks, drawings and variables of logs as a PNG picture."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pymoos_lite.geometry.shapes import Circle, Point, SegList
from pymoos_lite.records.alog import read_entries
from pymoos_lite.tools.log_reading import LogError, Selection, find_log, read_log, split_words
from pymoos_lite.tools.log_series import LogPicture, Series, Track, collect, unwrapped_gaps

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DEFAULT_PANELS = (("NAV_HEADING", "DESIRED_HEADING"), ("NAV_SPEED", "DESIRED_SPEED"))
MAX_PANELS = 12
MAX_LEVELS = 15
ARROWS = 14
_COLORS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b", "#e377c2")
_COURSES = ("HEADING", "COURSE", "HDG", "YAW")


def add_plot(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "words",
        nargs="+",
        metavar="LOG.alog [VAR ..]",
        help="logs of one or more vessels, and variables: A,B share a panel, A* is a beginning",
    )
    parser.add_argument("-o", "--output", metavar="FILE.png", help="default: the name of the first log")
    parser.add_argument(
        "--from", dest="low", type=float, default=-math.inf, metavar="S", help="begin at this time"
    )
    parser.add_argument(
        "--to", dest="high", type=float, default=math.inf, metavar="S", help="end at this time"
    )
    parser.add_argument("--no-track", action="store_true", help="only variables")
    parser.add_argument("--no-shapes", action="store_true", help="leave out what VIEW_* variables draw")
    parser.add_argument("--dpi", type=int, default=110, help="resolution (default 110)")


def run_plot(args: argparse.Namespace) -> int:
    logs, words = split_words(args.words)
    if not logs:
        raise LogError("expected at least one log file ending in .alog")
    panels = [tuple(name.strip() for name in word.split(",") if name.strip()) for word in words]
    wanted = Selection.of(name for panel in panels or DEFAULT_PANELS for name in panel)
    pictures = [
        collect(read_entries(read_log(log)), vessel_name(find_log(log)), wanted, args.low, args.high)
        for log in logs
    ]
    missing = [n for n in sorted(wanted.exact) if panels and not any(n in p.series for p in pictures)]
    if missing:
        raise LogError(f"{logs[0]}: no entries of {', '.join(missing)} (pymoos log scan shows what there is)")
    if args.no_shapes:
        for picture in pictures:
            picture.drawings.clear()
    if args.no_track:
        for picture in pictures:
            picture.tracks.clear()
            picture.drawings.clear()
    figure = draw(pictures, _matched(pictures, panels or DEFAULT_PANELS))
    output = Path(args.output or find_log(logs[0]).name.removesuffix(".gz").removesuffix(".alog") + ".png")
    try:
        figure.savefig(output, dpi=args.dpi)
    except (OSError, ValueError) as refusal:
        raise LogError(f"{output}: cannot be written ({refusal})") from None
    print(output)
    return 0


def vessel_name(path: Path) -> str:
    """The vessel's name as the log's file name tells it: `LOG_ABE_23_11_2026_____00_35_26` is `abe`."""
    stem = path.name.removesuffix(".gz").removesuffix(".alog").partition("_____")[0]
    words = [word for word in stem.split("_") if not word.isdigit() and word not in ("LOG", "XLOG")]
    return "_".join(words).lower() or stem


def _matched(pictures: Sequence[LogPicture], panels: Sequence[Sequence[str]]) -> list[list[str]]:
    """Panels with beginnings (`NAV_*`) replaced by the variables there are, one panel each."""
    known = sorted({name for picture in pictures for name in picture.series})
    found: list[list[str]] = []
    for panel in panels:
        exact = [name for name in panel if name in known]
        if exact:
            found.append(exact)
        for pattern in panel:
            if pattern.endswith("*"):
                found += [[name] for name in known if name.startswith(pattern[:-1])]
    if len(found) > MAX_PANELS:
        raise LogError(f"{len(found)} panels do not fit one picture; name at most {MAX_PANELS} variables")
    return found


def draw(pictures: Sequence[LogPicture], panels: Sequence[Sequence[str]]) -> Figure:
    """A figure with the tracks on the left and one panel per group of variables on the right."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with_track = any(picture.tracks or picture.drawings for picture in pictures)
    if not with_track and not panels:
        raise LogError("nothing to draw: there is no track, and no variable was named or found")
    width = (7.5 if with_track else 0.0) + (6.5 if panels else 0.0)
    height = max(6.5 if with_track else 0.0, 1.9 * len(panels) + 0.6)
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(max(len(panels), 1), 2 if with_track and panels else 1)
    colors: dict[str, str] = {}
    if with_track:
        _draw_map(figure.add_subplot(grid[:, 0]), pictures, colors)
    first: Axes | None = None
    for row, names in enumerate(panels):
        axes = figure.add_subplot(grid[row, -1], sharex=first)
        first = first or axes
        _draw_panel(axes, pictures, names, colors)
        if row < len(panels) - 1:
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("time since the log's start, s")
    return figure


def _color(name: str, colors: dict[str, str]) -> str:
    return colors.setdefault(name, _COLORS[len(colors) % len(_COLORS)])


def _draw_map(axes: Axes, pictures: Sequence[LogPicture], colors: dict[str, str]) -> None:
    for picture in pictures:
        for drawing in picture.drawings.values():
            _draw_shape(axes, drawing)
    # A vessel's own log knows its track better than what the others heard of it.
    own = {p.own: p.tracks[p.own] for p in pictures if p.own in p.tracks}
    heard = {name: track for p in pictures for name, track in p.tracks.items() if name not in own}
    for name, track in (*own.items(), *heard.items()):
        _draw_track(axes, name, track, _color(name, colors))
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x (east), m")
    axes.set_ylabel("y (north), m")
    axes.grid(alpha=0.25)
    if own or heard:
        axes.legend(loc="best", fontsize=8, framealpha=0.7)
    spans = [(p.start, p.stop) for p in pictures if p.stop >= p.start]
    if spans:
        axes.set_title(f"{min(s for s, _ in spans):.0f} to {max(s for _, s in spans):.0f} s", fontsize=9)


def _draw_track(axes: Axes, name: str, track: Track, color: str) -> None:
    axes.plot(track.xs, track.ys, color=color, linewidth=1.3, label=name, zorder=3)
    axes.plot(track.xs[:1], track.ys[:1], "o", color=color, markersize=5, markerfacecolor="white", zorder=4)
    places = arrow_places(track)
    if places:
        xs, ys, headings = zip(*places, strict=True)
        us = [math.sin(math.radians(h)) for h in headings]
        vs = [math.cos(math.radians(h)) for h in headings]
        axes.quiver(
            xs,
            ys,
            us,
            vs,
            color=color,
            angles="xy",
            scale=32,
            width=0.0045,
            headwidth=5,
            pivot="mid",
            zorder=4,
        )


def arrow_places(track: Track, count: int = ARROWS) -> list[tuple[float, float, float]]:
    """Places (x, y) and headings at even times along a track, the last one at its end."""
    if not track.headings or not track.times:
        return []
    places = []
    at = heading_at = 0
    start, stop = track.times[0], track.times[-1]
    for step in range(1, count + 1):
        time = start + (stop - start) * step / count
        while at + 1 < len(track.times) and track.times[at + 1] <= time:
            at += 1
        while heading_at + 1 < len(track.heading_times) and track.heading_times[heading_at + 1] <= time:
            heading_at += 1
        places.append((track.xs[at], track.ys[at], track.headings[heading_at]))
    return places


def _draw_shape(axes: Axes, drawing: object) -> None:
    from matplotlib.patches import Circle as CirclePatch

    from pymoos_lite.geometry.polygon import Polygon

    if isinstance(drawing, SegList):
        points = list(drawing.points)
        if isinstance(drawing, Polygon) and len(points) > 2:
            xs, ys = [p[0] for p in points], [p[1] for p in points]
            axes.fill(xs, ys, facecolor="#888888", alpha=0.12, edgecolor="#666666", linewidth=0.9, zorder=1)
        else:
            axes.plot(
                [p[0] for p in points],
                [p[1] for p in points],
                "s--",
                color="#777777",
                linewidth=0.8,
                markersize=4,
                zorder=2,
            )
        if points and drawing.label:
            axes.annotate(
                drawing.label, points[0], (4, 4), textcoords="offset points", fontsize=6, color="#555555"
            )
    elif isinstance(drawing, Point):
        axes.plot([drawing.x], [drawing.y], "x", color="#777777", markersize=5, zorder=2)
    elif isinstance(drawing, Circle):
        axes.add_patch(
            CirclePatch((drawing.x, drawing.y), drawing.radius, fill=False, edgecolor="#777777", zorder=1)
        )


def _draw_panel(
    axes: Axes, pictures: Sequence[LogPicture], names: Sequence[str], colors: dict[str, str]
) -> None:
    several = len(pictures) > 1
    levels: list[str] = []
    for picture in pictures:
        for index, name in enumerate(names):
            series = picture.series.get(name)
            if series is None:
                continue
            label = f"{picture.own} {name}" if several else name
            color = _color(picture.own, colors) if several else _COLORS[index % len(_COLORS)]
            style = "-" if index == 0 else "--"
            _draw_series(axes, series, name, picture.stop, levels, label=label, color=color, linestyle=style)
    if levels:
        axes.set_yticks(range(len(levels)), [level[:28] for level in levels], fontsize=7)
        axes.set_ylim(-0.5, len(levels) - 0.5)
    axes.legend(loc="best", fontsize=7, framealpha=0.6)
    axes.grid(alpha=0.25)


def _draw_series(axes: Axes, series: Series, name: str, stop: float, levels: list[str], **looks: Any) -> None:
    order = sorted(range(len(series.times)), key=series.times.__getitem__)
    times, values = [series.times[i] for i in order], [series.values[i] for i in order]
    if series.is_text:
        for text in series.levels:
            if text not in levels:
                levels.append(text)
        if len(levels) > MAX_LEVELS:
            raise LogError(f"{name} has more than {MAX_LEVELS} different texts: too many to draw")
        values = [float(levels.index(series.levels[int(v)])) for v in values]
    held = series.is_text or name.startswith("DESIRED_")
    if held:  # posted when it changes: it holds until the next post, the last one to the end
        times.append(stop)
        values.append(values[-1])
    elif any(word in name.upper() for word in _COURSES):
        for at in reversed(unwrapped_gaps(values)):
            times.insert(at, times[at])
            values.insert(at, math.nan)
    axes.plot(times, values, linewidth=1.1, drawstyle="steps-post" if held else "default", **looks)
