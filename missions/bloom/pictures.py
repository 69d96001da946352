"""Pictures of the bloom mission: the sea at a moment, coalitions over time, an animation, the study.

Functions take what `run_log` and the study's tables hold and give back a matplotlib `Figure`; only the
animation is written here. matplotlib is imported when something is drawn.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, radians, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from missions.bloom.environment import STORM_LABEL
from missions.bloom.run_log import RunLog
from missions.bloom.zones import XRAY, YANKEE
from opinion_engine.plots import COLOURS, figure, into_limits, on_simplex
from pymoos_lite.geometry.specs import parse_polygon

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OPTION_COLOURS = {"explore": "#0072B2", "exploit": "#009E73", "migrate": "#D55E00"}
NONE_COLOUR = "#9A9A9A"
BLOOM_COLOURS = {"red": "#C0392B", "pink": "#E48FB4", "limegreen": "#55A630"}
BLOOM_WORDS = {"red": "not found", "pink": "detected", "limegreen": "sampled"}
STORM_COLOUR, LINK_COLOUR = "#5B6C8F", "#D62728"
TRAIL = 300
"""Seconds of track shown behind each vessel."""
ZOOM = -4.0
"""Least opinion on the animation's simplex, the greatest is twice as much the other way: close enough to see
explore and exploit part. Migrations run along the edge."""
VESSEL_LENGTH = 26.0
"""Metres that a vessel is drawn long: visible, not to scale."""


# --- the sea at a moment --------------------------------------------------------------------------


def snapshot_figure(run: RunLog, seconds: float, comms_range: float = 160.0) -> Figure:
    """Zones, blooms, storm, vessels in the colour of their option, and who can hear whom, at a time."""
    made, axis = figure(8.6, 5.6)
    _sea(axis)
    _moment(axis, run, run.index(seconds), comms_range)
    minutes, rest = divmod(int(run.t[run.index(seconds)]), 60)
    axis.set_title(f"{minutes} min {rest:02d} s", fontsize=10, loc="left")
    _legend(axis, run, comms_range)
    return made


def sheet_figure(run: RunLog, moments: Sequence[float], comms_range: float = 160.0) -> Figure:
    """A contact sheet: the snapshot at several times (s), three in a row.

    Raises:
        ValueError: no moment is given.
    """
    if not moments:
        raise ValueError("a contact sheet needs at least one moment")
    columns = min(3, len(moments))
    rows = -(-len(moments) // columns)
    made, axes = figure(3.6 * columns, 2.75 * rows + 0.6, rows, columns, squeeze=False)
    for axis in axes.flat:
        axis.set_axis_off()
    for axis, seconds in zip(axes.flat, moments, strict=False):
        k = run.index(seconds)
        _sea(axis)
        _moment(axis, run, k, comms_range)
        axis.set_title(f"{run.t[k] / 60.0:.0f} min", fontsize=9, loc="left")
        for text in axis.texts:
            text.set_fontsize(6)
    _legend(axes[0][0], run, comms_range)
    return made


def _sea(axis: Any) -> None:
    for name, text in (("X-ray", XRAY), ("Yankee", YANKEE)):
        zone = parse_polygon(text)
        axis.fill(
            *zip(*zone.points, strict=True), facecolor="#EEF4F8", edgecolor="#888888", linewidth=1.0, zorder=0
        )
        # Outside the corner, where neither vessels nor blooms are.
        x, y = max(zone.points, key=lambda p: p[1])
        axis.annotate(
            name, (x, y), (0, 6), textcoords="offset points", ha="center", fontsize=11, color="#555555"
        )
    axis.set_aspect("equal")
    axis.set_xlim(-360, 570)
    axis.set_ylim(-545, 150)
    axis.set_xlabel("east, m")
    axis.set_ylabel("north, m")


def _moment(axis: Any, run: RunLog, k: int, comms_range: float) -> list[Any]:
    """Draw what changes with time; the artists, so that an animation can take them away again."""
    from matplotlib.patches import Circle as Disc
    from matplotlib.patheffects import withStroke

    drawn: list[Any] = []
    for label, circle in run.circles_at(float(run.t[k])).items():
        storm = label == STORM_LABEL
        state = circle.attributes.edge_color
        colour = STORM_COLOUR if storm else BLOOM_COLOURS.get(state, "#888888")
        patch = Disc(
            (circle.x, circle.y), circle.radius, facecolor=colour, edgecolor=colour, alpha=0.18 if storm else 0.4,
            linestyle="--" if storm else "-", zorder=1,
        )  # fmt: skip
        drawn.append(axis.add_patch(patch))
    xs, ys = run.x[k], run.y[k]
    heard = run.opinions.degree[k] > 0  # a vessel that fell silent may lie within range of others
    for i in range(len(run.names)):
        for j in range(i + 1, len(run.names)):
            if heard[i] and heard[j] and np.hypot(xs[i] - xs[j], ys[i] - ys[j]) <= comms_range:
                drawn += axis.plot(
                    xs[[i, j]], ys[[i, j]], color=LINK_COLOUR, linewidth=0.6, alpha=0.55, zorder=2
                )
    first = max(0, k - TRAIL)
    for i, name in enumerate(run.names):
        colour = _option_colour(run, k, i)
        drawn += axis.plot(
            run.x[first : k + 1, i], run.y[first : k + 1, i], color=colour, linewidth=0.7, alpha=0.6
        )
        hull = _hull(xs[i], ys[i], run.heading[k, i])
        drawn += axis.fill(*hull, facecolor=colour, edgecolor="white", linewidth=0.6, zorder=4)
        label = axis.annotate(name, (xs[i], ys[i]), (7, 6), textcoords="offset points", fontsize=8, zorder=5)
        label.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
        drawn.append(label)
    return drawn


def _option_colour(run: RunLog, k: int, i: int) -> str:
    option = run.option[k, i]
    return OPTION_COLOURS.get(run.opinions.options[option] if option >= 0 else "", NONE_COLOUR)


def _hull(x: float, y: float, heading: float) -> tuple[list[float], list[float]]:
    """Corners of a dart at (x, y)."""
    half = VESSEL_LENGTH / 2.0
    corners = ((half, 0.0), (-half, 140.0), (-half * 0.45, 180.0), (-half, 220.0))
    points = [(abs(r), heading + a) for r, a in corners]
    return [x + r * sin(radians(a)) for r, a in points], [y + r * cos(radians(a)) for r, a in points]


def _legend(axis: Any, run: RunLog, comms_range: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Patch(color=OPTION_COLOURS[o], label=o) for o in run.opinions.options]
    handles.append(Patch(color=NONE_COLOUR, label="none"))
    handles += [Patch(color=c, alpha=0.4, label=f"bloom, {BLOOM_WORDS[s]}") for s, c in BLOOM_COLOURS.items()]
    handles.append(Patch(color=STORM_COLOUR, alpha=0.25, label="storm"))
    handles.append(Line2D([], [], color=LINK_COLOUR, linewidth=0.8, label=f"within {comms_range:.0f} m"))
    axis.figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=8, frameon=False)


# --- coalitions over time ---------------------------------------------------------------------------


def coalitions_figure(run: RunLog) -> Figure:
    """What each vessel did over the whole run: a strip per vessel, a colour per option."""
    made, axis = figure(8.5, 0.36 * len(run.names) + 1.2)
    minutes = run.t / 60.0
    for i in range(len(run.names)):
        changes = np.flatnonzero(np.diff(run.option[:, i])) + 1
        edges = [0, *changes.tolist(), run.t.size - 1]
        for a, b in itertools.pairwise(edges):
            axis.barh(
                i, minutes[b] - minutes[a], left=minutes[a], height=0.75, color=_option_colour(run, a, i)
            )
    axis.set_yticks(range(len(run.names)), run.names)
    axis.invert_yaxis()
    axis.set_xlabel("minutes")
    axis.set_xlim(minutes[0], minutes[-1])
    from matplotlib.patches import Patch

    handles = [Patch(color=OPTION_COLOURS[o], label=o) for o in run.opinions.options]
    handles.append(Patch(color=NONE_COLOUR, label="none (not deployed, or on the way home)"))
    made.legend(handles=handles, loc="outside upper center", ncols=len(handles), fontsize=8, frameon=False)
    return made


# --- animation --------------------------------------------------------------------------------------


def animate(run: RunLog, path: str, step: float = 20.0, comms_range: float = 160.0) -> int:
    """Write map, simplex and attention side by side as an animated GIF, a frame for every `step` seconds.

    Returns the number of frames. Needs Pillow, which matplotlib brings.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    made, (sea, simplex, attention) = figure(14.0, 4.6, 1, 3, width_ratios=[1.55, 1.0, 1.0])
    made.set_dpi(75)
    canvas: Any = FigureCanvasAgg(made)
    _sea(sea)
    _legend(sea, run, comms_range)
    _simplex_frame(simplex, run.opinions.options)
    minutes = run.t / 60.0
    attention.set_xlim(minutes[0], minutes[-1])
    attention.set_ylim(0.0, max(2.1, 1.05 * float(np.nanmax(run.opinions.u, initial=0.0))))
    attention.set_xlabel("minutes")
    attention.set_title("attention u", fontsize=10, loc="left")
    curves = [
        attention.plot([], [], color=COLOURS[i % len(COLOURS)], linewidth=0.9)[0]
        for i in range(len(run.names))
    ]
    now = attention.axvline(0.0, color="#BBBBBB", linewidth=0.8)
    places = on_simplex(into_limits(run.opinions.z, ZOOM, -2.0 * ZOOM))
    drawn: list[Any] = []

    def show(frame: int) -> None:
        for artist in drawn:
            artist.remove()
        drawn.clear()
        drawn.extend(_moment(sea, run, frame, comms_range))
        sea.set_title(f"{run.t[frame] / 60.0:.0f} min", fontsize=10, loc="left")
        first = max(0, frame - TRAIL)
        for i in range(len(run.names)):
            colour = COLOURS[i % len(COLOURS)]
            drawn.extend(
                simplex.plot(*places[first : frame + 1, i].T, color=colour, linewidth=0.6, alpha=0.6)
            )
            drawn.extend(
                simplex.plot(*places[frame, i], "o", color=colour, markersize=6, markeredgecolor="white")
            )
            curves[i].set_data(minutes[: frame + 1], run.opinions.u[: frame + 1, i])
        now.set_xdata([minutes[frame]] * 2)

    frames = [int(k) for k in np.arange(0, run.t.size, max(1, round(step)))]
    # Arranged once, as it is in the middle of the run, or the panels would shift about.
    show(frames[len(frames) // 2])
    made.draw_without_rendering()
    made.set_layout_engine("none")
    images = []
    for frame in frames:  # matplotlib's own writers draw each frame three times
        show(frame)
        canvas.draw()
        picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
        images.append(picture.quantize(256, dither=Image.Dither.NONE))
    images[0].save(path, save_all=True, append_images=images[1:], duration=100, loop=0)
    return len(frames)


def _simplex_frame(axis: Any, options: Sequence[str]) -> None:
    axis.set_axis_off()
    axis.set_aspect("equal")
    corners = on_simplex(np.where(np.eye(3) == 1.0, -2.0 * ZOOM, ZOOM))
    axis.fill(*corners.T, facecolor="#F6F6F4", edgecolor="#444444", linewidth=1.0, zorder=0)
    for corner, name, shift in zip(corners, options, ((0, -12), (0, -12), (0, 9)), strict=True):
        axis.annotate(
            name, corner, shift, textcoords="offset points", ha="center", va="center",
            color=OPTION_COLOURS.get(name, "#444444"), fontweight="bold",
        )  # fmt: skip
    axis.margins(0.1)


# --- the study ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Curve:
    """One method's results against the size of the fleet: mean, least and most."""

    name: str
    sizes: tuple[int, ...]
    mean: tuple[float, ...]
    least: tuple[float, ...]
    most: tuple[float, ...]
    runs: int


METHOD_LOOKS = {
    "gcid": ("#0072B2", "-", "o"),
    "static": ("#D55E00", "--", "s"),
    "greedy": ("#7A7A7A", ":", "^"),
}
BANDS = ("gcid", "static")
STUDY_PANELS = {"percent_sampled": "blooms sampled, %", "samples_per_km": "samples per km"}


def curves(rows: Sequence[Mapping[str, str]], column: str) -> list[Curve]:
    """The curves of a study's table (as CSV gives it) for one column; rows that failed do not count."""
    found: dict[str, dict[int, list[float]]] = {}
    for row in rows:
        if row.get("status") == "ok" and row.get(column, "") != "" and row.get("vehicles", "").isdigit():
            sizes = found.setdefault(row.get("method", ""), {})
            sizes.setdefault(int(row["vehicles"]), []).append(float(row[column]))
    made = []
    for name, sizes in found.items():
        ordered = sorted(sizes.items())
        made.append(
            Curve(
                name,
                tuple(size for size, _ in ordered),
                tuple(float(np.mean(values)) for _, values in ordered),
                tuple(min(values) for _, values in ordered),
                tuple(max(values) for _, values in ordered),
                sum(len(values) for _, values in ordered),
            )
        )
    return made


def study_figure(rows: Sequence[Mapping[str, str]]) -> Figure:
    """Blooms sampled above, samples per kilometre below, against fleet size: means, and the range over seeds.

    Raises:
        ValueError: no run in the table has these columns.
    """
    made, axes = figure(6.2, 7.2, 2, 1, sharex=True)
    sizes: set[int] = set()
    runs = 0
    for axis, (column, label) in zip(axes, STUDY_PANELS.items(), strict=True):
        found = curves(rows, column)
        runs = max(runs, sum(curve.runs for curve in found))
        for curve in found:
            sizes.update(curve.sizes)
            colour, line, marker = METHOD_LOOKS.get(curve.name, ("#444444", "-", "."))
            # Three filled bands over each other are mud: the third method has edges only.
            if curve.name in BANDS:
                axis.fill_between(curve.sizes, curve.least, curve.most, color=colour, alpha=0.1, linewidth=0)
            for edge in (curve.least, curve.most):
                axis.plot(curve.sizes, edge, line, color=colour, linewidth=0.7, alpha=0.6)
            axis.plot(
                curve.sizes, curve.mean, line, color=colour, marker=marker, markersize=5, label=curve.name
            )
        axis.set_ylabel(label)
        axis.set_ylim(bottom=0.0)
        axis.grid(axis="y", color="#EEEEEE")
    if not sizes:
        raise ValueError("the table has no finished run with these columns")
    axes[1].set_xticks(sorted(sizes))
    axes[1].set_xlabel("vessels")
    handles, labels = axes[0].get_legend_handles_labels()
    made.legend(
        handles, labels, loc="outside upper center", ncols=3, fontsize=9, frameon=False,
        title=f"{runs} runs: mean, and band from least to most", title_fontsize=8,
    )  # fmt: skip
    return made
