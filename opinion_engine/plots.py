"""Figures of opinions: trajectories on the simplex, attention and degree, bifurcations, basins, cascades.

Functions take arrays and give back a matplotlib `Figure`; nothing is shown or written here. matplotlib is
imported when a figure is made. `opinion_tool` has one command for each.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from opinion_engine.graphs import Graph
from opinion_engine.model import Floats, OpinionError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Distinguishable with the usual colour-vision deficiencies (Okabe & Ito), then darker repeats.
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#7A6F00", "#555555")
PREDICTED, SIMULATED, QUIET = "#D55E00", "#0072B2", "#8A8A8A"

# Columns: where a zero-sum triple (z1, z2, z3) lies in the plane; option 1 left, 2 right, 3 on top.
PLANE = np.array([[-1.0, 1.0, 0.0] / np.sqrt(2.0), [-1.0, -1.0, 2.0] / np.sqrt(6.0)]).T


def figure(
    width: float, height: float, rows: int = 1, columns: int = 1, **options: Any
) -> tuple[Figure, Any]:
    """An empty figure (inches) and its axes, without touching a display."""
    from matplotlib.figure import Figure as Canvas

    made = Canvas(figsize=(width, height), layout="constrained", dpi=130)
    axes = made.subplots(rows, columns, **options)
    for one in np.ravel(axes):
        one.spines[["top", "right"]].set_visible(False)
        one.tick_params(labelsize=8)
    return made, axes


def on_simplex(z: ArrayLike) -> Floats:
    """(..., 2) places of zero-sum triples (..., 3) in the plane, distances kept."""
    return np.asarray(np.asarray(z, dtype=np.float64) @ PLANE)


def into_limits(z: ArrayLike, low: float, high: float) -> Floats:
    """Triples outside [low, high] scaled back towards the origin until they fit (gcid.md 19)."""
    z = np.asarray(z, dtype=np.float64)
    ratio = np.maximum(z / high, z / low).max(axis=-1, keepdims=True)
    return np.asarray(z / np.maximum(1.0, ratio))


def simplex_figure(
    z: ArrayLike,
    names: Sequence[str],
    options: Sequence[str],
    zooms: Sequence[float] = (-20.0, -4.0),
) -> Figure:
    """One trace per vessel on the simplex of three options, its end as a dot; z (T, N, 3).

    One panel per zoom: its frame is where every opinion is at least that value, so that the largest possible
    is twice as much; -20 is the paper's zoom, [-20, 40]. A trace that leaves the frame runs along its edge.
    """
    z = np.asarray(z, dtype=np.float64)
    if z.ndim != 3 or z.shape[2] != 3 or len(options) != 3 or len(names) != z.shape[1]:
        raise OpinionError(f"simplex needs z (T, N, 3), N names and 3 options, got {z.shape}")
    if any(low >= 0.0 for low in zooms):
        raise OpinionError("a zoom is the least opinion shown, which is less than 0")
    made, axes = figure(5.6 * len(zooms), 5.3, 1, len(zooms), squeeze=False)
    for axis, low in zip(axes[0], zooms, strict=True):
        simplex_panel(axis, z, names, options, low)
        axis.set_title(f"[{low:g}, {-2.0 * low:g}]", fontsize=10, color="#555555", loc="left")
    handles, labels = axes[0][0].get_legend_handles_labels()
    made.legend(
        handles, labels, loc="outside lower center", ncols=len(names), fontsize=8, frameon=False,
        title="dot: where each vessel ends", title_fontsize=8,
    )  # fmt: skip
    return made


def simplex_panel(axis: Any, z: Floats, names: Sequence[str], options: Sequence[str], low: float) -> None:
    """One trace per vessel, z (T, N, 3), in a simplex whose least opinion is `low`; see `simplex_figure`."""
    axis.set_axis_off()
    axis.set_aspect("equal")
    corners = on_simplex(np.where(np.eye(3) == 1.0, -2.0 * low, low))
    axis.fill(*corners.T, facecolor="#F6F6F4", edgecolor="#444444", linewidth=1.0, zorder=0)
    _simplex_grid(axis, low)
    for corner, name, shift in zip(corners, options, ((6, -14), (-6, -14), (0, 9)), strict=True):
        axis.annotate(
            name,
            corner,
            shift,
            textcoords="offset points",
            fontsize=11,
            fontweight="bold",
            ha="center",
            va="center",
        )
    for k, name in enumerate(names):
        path = on_simplex(into_limits(z[:, k], low, -2.0 * low))
        colour = COLOURS[k % len(COLOURS)]
        axis.plot(*path.T, color=colour, linewidth=0.7, alpha=0.75, zorder=2)
        axis.plot(
            *path[-1],
            "o",
            color=colour,
            markersize=7,
            markeredgecolor="white",
            zorder=3,
            label=name,
            linestyle="",
        )
    axis.margins(0.07)


def _simplex_grid(axis: Any, low: float) -> None:
    """Lines of equal opinion, labelled along the edge where the option two places on is at its least."""
    step = abs(low) / 2.0
    for j in range(3):
        other, last = (j + 1) % 3, (j + 2) % 3
        for level in np.arange(low + step, -2.0 * low - 1e-9, step):
            ends = np.full((2, 3), low)
            ends[:, j] = level
            ends[0, other] = ends[1, last] = -level - low
            line = on_simplex(ends)
            strong = abs(level) < 1e-9
            axis.plot(
                *line.T, color="#9A9A9A" if strong else "#DDDDDA", linewidth=0.9 if strong else 0.6, zorder=1
            )
            offset = 9.0 * (line[0] - line[1]) / np.linalg.norm(line[0] - line[1])
            axis.annotate(
                f"{level:g}", line[0], offset, textcoords="offset points", fontsize=7, color="#777777",
                ha="center", va="center",
            )  # fmt: skip


def attention_figure(t: ArrayLike, u: ArrayLike, degree: ArrayLike, names: Sequence[str]) -> Figure:
    """Attention above, number of contacts below, against time in minutes; t (T,) in s, u and degree (T, N)."""
    minutes = np.asarray(t, dtype=np.float64) / 60.0
    u, degree = np.asarray(u, dtype=np.float64), np.asarray(degree, dtype=np.float64)
    if u.shape != degree.shape or u.shape != (minutes.size, len(names)):
        raise OpinionError(f"u {u.shape} and degree {degree.shape} must be ({minutes.size}, {len(names)})")
    made, (top, bottom) = figure(8.5, 5.2, 2, 1, sharex=True)
    for k, name in enumerate(names):
        colour = COLOURS[k % len(COLOURS)]
        top.plot(minutes, u[:, k], color=colour, linewidth=1.0, label=name)
        # A small offset keeps equal degrees apart.
        shifted = degree[:, k] + 0.08 * (k - 0.5 * (len(names) - 1))
        bottom.plot(minutes, shifted, color=colour, linewidth=0.8, drawstyle="steps-post")
    top.set_ylabel("attention u")
    bottom.set_ylabel("vessels heard")
    bottom.set_xlabel("minutes")
    bottom.set_xlim(minutes[0], minutes[-1])
    bottom.set_yticks(range(len(names)))
    bottom.grid(axis="y", color="#EEEEEE")
    top.grid(axis="y", color="#EEEEEE")
    top.legend(ncols=len(names), fontsize=8, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return made


def pitchfork_panel(
    axis: Any, title: str, predicted: Sequence[tuple[Floats, Floats, bool]], simulated: tuple[Floats, Floats],
    u_star: float, leading: tuple[Floats, Floats] | None = None,
) -> None:  # fmt: skip
    """Predicted branches (u, opinion, stable) as lines, where simulations end as dots, u* as a mark."""
    axis.axhline(0.0, color="#EEEEEE", linewidth=0.8, zorder=0)
    axis.axvline(u_star, color=QUIET, linewidth=0.8, linestyle=":", zorder=1)
    axis.annotate(
        "u*", (u_star, 1.0), (3, -2), xycoords=("data", "axes fraction"), textcoords="offset points",
        fontsize=9, color="#555555", va="top",
    )  # fmt: skip
    axis.plot(
        *simulated, "o", color=SIMULATED, markersize=3.6, markeredgewidth=0, zorder=3, label="simulated"
    )
    drawn: set[bool] = set()
    for u, x, stable in predicted:
        label = {True: "predicted, stable", False: "predicted, unstable"}[stable]
        axis.plot(
            u, x, color=PREDICTED, linewidth=1.4, linestyle="-" if stable else (0, (4, 2)), zorder=2,
            label=None if stable in drawn else label,
        )  # fmt: skip
        drawn.add(stable)
    if leading is not None:
        axis.plot(
            *leading, color="#009E73", linewidth=1.0, linestyle=(0, (1, 1.2)), zorder=2, label="leading order"
        )
        axis.plot(leading[0], -leading[1], color="#009E73", linewidth=1.0, linestyle=(0, (1, 1.2)), zorder=2)
    axis.set_title(title, fontsize=10)
    axis.set_xlabel("attention u")


def fold_panel(
    axis: Any,
    predicted: tuple[Floats, Floats, Floats],
    simulated: tuple[Floats, Floats],
    fold: tuple[float, float],
) -> None:
    """The S-shaped curve of equilibria (b, x, stable) under attention feedback, and where simulations end."""
    b, x, stable = predicted
    for flag, style in ((True, "-"), (False, (0, (4, 2)))):
        shown = np.where((stable > 0.5) == flag, x, np.nan)
        axis.plot(b, shown, color=PREDICTED, linewidth=1.4, linestyle=style, zorder=2)
    axis.plot(*simulated, "o", color=SIMULATED, markersize=3.6, markeredgewidth=0, zorder=3)
    axis.axvline(fold[0], color=QUIET, linewidth=0.8, linestyle=":", zorder=1)
    axis.annotate(
        f"b* = {fold[0]:.4f}",
        fold,
        (9, 4),
        textcoords="offset points",
        fontsize=9,
        color="#555555",
        va="bottom",
    )
    axis.set_xlabel("input b at every agent")


def basin_panel(axis: Any, extent: float, ends: Floats, marks: Sequence[tuple[float, float, bool]]) -> None:
    """Which of several ends (M, M; -1 for none) a start (x1, x2) leads to; marks are equilibria (x1, x2,
    stable).
    """
    _colour_cells(axis, (-extent, extent, -extent, extent), ends)
    for x, y, stable in marks:
        axis.plot(
            x, y, "o", color="black" if stable else "white", markeredgecolor="black", markersize=6.5, zorder=3
        )
    axis.set_aspect("equal")


def simplex_pixels(
    low: float, resolution: int
) -> tuple[Floats, np.ndarray, tuple[float, float, float, float]]:
    """Cells over the simplex: triples (R, R, 3), which of them lie inside (R, R), and the box in the plane."""
    corners = on_simplex(np.where(np.eye(3) == 1.0, -2.0 * low, low))
    (left, bottom), (right, top) = corners.min(axis=0), corners.max(axis=0)
    x = left + (np.arange(resolution) + 0.47) * (right - left) / resolution
    y = bottom + (np.arange(resolution) + 0.53) * (top - bottom) / resolution
    triples = np.stack(np.meshgrid(x, y), axis=-1) @ PLANE.T
    return triples, triples.min(axis=-1) >= low, (left, right, bottom, top)


def simplex_basin_panel(
    axis: Any, low: float, box: tuple[float, float, float, float], ends: Floats, options: Sequence[str]
) -> None:
    """The same on the simplex: the end each cell of `simplex_pixels` leads to, -1 outside."""
    _colour_cells(axis, box, ends)
    axis.set_ylim(box[2], box[3] + 0.12 * (box[3] - box[2]))  # room for the label on top
    corners = on_simplex(np.where(np.eye(3) == 1.0, -2.0 * low, low))
    axis.plot(*np.vstack([corners, corners[:1]]).T, color="#444444", linewidth=1.0, zorder=2)
    for corner, name, shift in zip(corners, options, ((0, -9), (0, -9), (0, 8)), strict=True):
        axis.annotate(name, corner, shift, textcoords="offset points", fontsize=9, ha="center", va="center")
    axis.set_aspect("equal")
    axis.set_axis_off()


def _pale(colour: tuple[float, float, float]) -> tuple[float, float, float]:
    """Halfway to white, for areas behind marks."""
    return tuple(0.45 * c + 0.55 for c in colour)  # type: ignore[return-value]


def _colour_cells(axis: Any, box: tuple[float, float, float, float], ends: Floats) -> None:
    from matplotlib.colors import to_rgb

    picture = np.ones((*ends.shape, 3))
    for end in np.unique(ends[ends >= 0]):
        picture[ends == end] = _pale(to_rgb(COLOURS[int(end) % len(COLOURS)]))
    axis.imshow(picture, origin="lower", extent=box, interpolation="nearest", zorder=0)


def cascade_sheet(rows: Sequence[tuple[str, Graph, Floats, Floats]], columns: int = 5) -> Figure:
    """A contact sheet: per row (title, graph with positions, t (T,), x (T, N) the opinion that spreads).

    The columns are moments between the first and the last change, evenly spaced in the number of agents
    reached.
    """
    shapes = [
        float(np.clip(np.divide(*np.ptp(_folded(g.positions), axis=0)[::-1]), 0.5, 1.2))
        for _, g, _, _ in rows
    ]
    heights = [0.35 + 2.2 * shape for shape in shapes]
    made, axes = figure(
        2.3 * columns, sum(heights) + 0.7, len(rows), columns, squeeze=False, height_ratios=heights
    )
    top = max(float(np.abs(x).max()) for _, _, _, x in rows)
    for axis_row, (title, graph, t, x) in zip(axes, rows, strict=True):
        moments = _moments(x, columns)
        for axis, moment in zip(axis_row, moments, strict=True):
            last = draw_network(axis, graph, x[moment], top)
            reached = int(np.count_nonzero(x[moment] > 0.25 * top))
            axis.set_title(f"t = {t[moment]:.0f} s, {reached} of {graph.n_agents}", fontsize=8)
        axis_row[0].annotate(
            title, (0.0, 0.5), (-14, 0), xycoords="axes fraction", textcoords="offset points", fontsize=10,
            rotation=90, ha="center", va="center",
        )  # fmt: skip
    bar = made.colorbar(last, ax=axes, location="bottom", fraction=0.03, aspect=60, pad=0.02)
    bar.set_label("opinion about the option that spreads", fontsize=9)
    bar.ax.tick_params(labelsize=8)
    return made


def _moments(x: Floats, columns: int) -> list[int]:
    """Indices of t at which about 0, 1/(c-1), ... of all that will be reached are reached."""
    count = (x > 0.25 * np.abs(x).max()).sum(axis=1)
    first = int(np.argmax(count > 0))
    wanted = np.linspace(count[first], count.max(), columns)
    found = [int(np.argmax(count >= level)) for level in wanted]
    for k in range(1, columns):  # strictly later, so that no two pictures are the same
        found[k] = min(max(found[k], found[k - 1] + 1), len(x) - 1)
    return found


def draw_network(axis: Any, graph: Graph, x: Floats, top: float) -> Any:
    """Agents as dots coloured by x (N,), links as thin lines; returns what a colour bar needs."""
    from matplotlib.collections import LineCollection

    places = _folded(graph.positions)
    hearer, heard = graph.hearers().astype(int), graph.indices.astype(int)
    once = hearer < heard
    segments = np.stack([places[hearer[once]], places[heard[once]]], axis=1)
    axis.add_collection(LineCollection(list(segments), colors="#C9C9C9", linewidths=0.6, zorder=1))
    size = float(np.clip(2600.0 / graph.n_agents, 9.0, 46.0))
    dots = axis.scatter(
        *places.T,
        c=x,
        cmap="viridis",
        vmin=0.0,
        vmax=top,
        s=size,
        edgecolors="#333333",
        linewidths=0.35,
        zorder=2,
    )
    axis.set_axis_off()
    axis.set_aspect("equal")
    axis.margins(0.08)
    return dots


def _folded(positions: Floats | None) -> Floats:
    """Places to draw; a straight line is folded into rows so that its agents can be told apart."""
    if positions is None:
        raise OpinionError("drawing a graph needs positions")
    if np.ptp(positions[:, 1]) > 0.0 or len(positions) < 12:
        return positions
    across = int(np.ceil(np.sqrt(len(positions) * 1.6)))
    index = np.arange(len(positions))
    row, place = index // across, index % across
    return np.column_stack([np.where(row % 2 == 0, place, across - 1 - place), -row]).astype(np.float64)


def cascade_animation(graph: Graph, t: Floats, x: Floats, path: str, frames: int = 60) -> None:
    """Write the spreading of x (T, N) over the graph as an animated GIF (needs Pillow)."""
    from matplotlib.animation import FuncAnimation, PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    made, axis = figure(4.6, 4.8)
    FigureCanvasAgg(made)
    top = float(np.abs(x).max())
    dots = draw_network(axis, graph, x[0], top)
    reached = (x > 0.25 * top).sum(axis=1)
    end = min(len(t) - 1, int(np.argmax(reached == reached.max()) * 1.15) + 2)
    chosen = np.unique(np.linspace(0, end, frames).astype(int))

    def show(frame: int) -> list[Any]:
        dots.set_array(x[frame])
        axis.set_title(f"t = {t[frame]:.0f} s, {reached[frame]} of {graph.n_agents} reached", fontsize=9)
        return [dots]

    FuncAnimation(made, show, frames=[int(k) for k in chosen]).save(path, writer=PillowWriter(fps=12))
