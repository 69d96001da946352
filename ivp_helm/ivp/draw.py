"""Pictures of functions and of what they decide together, as matplotlib figures.

Course and speed are drawn as a compass rose (north up, clockwise, speed outwards), one variable as a
curve, any other two variables as a map. Of more variables the picture shows the plane through the
decision. Nothing is written to disk here; matplotlib is imported when the first figure is made.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from ivp_helm.ivp.domain import Domain, Variable
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction
from ivp_helm.ivp.solver import Solution, solve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

MAX_PANELS: Final = 16
PANEL: Final = 4.2  # inches
_UNITS: Final = {"course": "course (degrees)", "speed": "speed (m/s)", "depth": "depth (m)"}
_NO_VALUE: Final = "#bbbbbb"
_DECISION: Final = "#d62728"


def joint_domain(functions: Sequence[IvPFunction]) -> Domain:
    """The union of the functions' domains, variables in order of first appearance."""
    if not functions:
        raise IvPError("no functions to draw")
    domain = functions[0].domain
    for f in functions[1:]:
        domain = domain.union(f.domain)
    if "speed" in domain and "course" in domain and domain.position("speed") < domain.position("course"):
        names = ["course", "speed", *(n for n in domain.names if n not in ("course", "speed"))]
        domain = domain.subdomain(names)
    return domain


def draw(
    functions: Sequence[IvPFunction],
    domain: Domain | None = None,
    *,
    decision: Solution | None = None,
    only_sum: bool = False,
    title: str = "",
) -> Figure:
    """A figure of every function, and of their weighted sum where there are several.

    domain     the decision domain; by default the union of the functions' domains
    decision   the solution to mark; by default the functions are solved here
    only_sum   leave the single functions out

    Values shown are times the priority weight. At most 16 panels are drawn.
    """
    from matplotlib.figure import Figure

    domain = domain or joint_domain(functions)
    if decision is None:
        decision = solve(domain, functions)
    panels: list[tuple[str, list[IvPFunction]]] = []
    if not only_sum or len(functions) == 1:
        panels = [(_label(f, i), [f]) for i, f in enumerate(functions)]
    if len(functions) > 1:
        panels.append((f"sum of {len(functions)} functions", list(functions)))
    if len(panels) > MAX_PANELS:
        raise IvPError(f"{len(panels)} panels are more than {MAX_PANELS}; draw fewer, or the sum only")
    columns = len(panels) if len(panels) <= 3 else 2 if len(panels) == 4 else 3 if len(panels) <= 9 else 4
    rows = math.ceil(len(panels) / columns)
    shown = _shown(domain)
    figure = Figure(figsize=(PANEL * columns + 0.8, PANEL * rows + 0.6), layout="constrained")
    for i, (label, members) in enumerate(panels):
        polar = shown == ("course", "speed")
        axes = figure.add_subplot(rows, columns, i + 1, projection="polar" if polar else None)
        table, rest = _plane(domain, members, shown, decision)
        if len(shown) == 1:
            _curve(axes, domain[shown[0]], table, members, decision)
        elif polar:
            _rose(figure, axes, domain, table, decision)
        else:
            _map(figure, axes, domain[shown[0]], domain[shown[1]], table, decision)
        axes.set_title(label + (f"\nat {rest}" if rest else ""), fontsize=9)
    figure.suptitle((title + "\n" if title else "") + _said(decision), fontsize=10)
    return figure


def _label(f: IvPFunction, i: int) -> str:
    name = f.context or f"function {i + 1}"
    return f"{name}\nweight {f.weight:g}, {f.pieces} pieces"


def _said(decision: Solution) -> str:
    if not decision.found:
        return f"no decision ({decision.status.value})"
    parts = (f"{name} {value:g}" for name, value in decision.as_dict().items())
    return f"decision: {', '.join(parts)}   (value {decision.value:.6g})"


def _shown(domain: Domain) -> tuple[str, ...]:
    """Which one or two variables span the picture."""
    if "course" in domain and "speed" in domain:
        return ("course", "speed")
    return domain.names[:2]


def _plane(
    domain: Domain, functions: Sequence[IvPFunction], shown: tuple[str, ...], decision: Solution
) -> tuple[Floats, str]:
    """The weighted sum over the shown variables, others held at the decision; and what they are held at."""
    table = np.zeros([domain[name].points for name in shown])
    held: dict[str, float] = {}
    for f in functions:
        at: list[Any] = []
        for name in f.domain.names:
            if name in shown:
                at.append(slice(None))
            else:
                v = domain[name]
                j = decision.indexes[domain.position(name)] if decision.found else v.points // 2
                held[name] = v.value(j)
                at.append(j)
        part = f.weight * f.table()[tuple(at)]
        present = [name for name in f.domain.names if name in shown]
        order = [present.index(name) for name in shown if name in present]
        shape = [domain[name].points if name in present else 1 for name in shown]
        table += np.transpose(part, order).reshape(shape)
    return table, ", ".join(f"{name} {value:g}" for name, value in held.items())


def _edges(v: Variable) -> Floats:
    half = v.delta / 2 or 0.5
    return np.concatenate((v.values() - half, [v.high + half]))


def _rose(figure: Figure, axes: Any, domain: Domain, table: Floats, decision: Solution) -> None:
    from matplotlib.patheffects import withStroke

    course, speed = domain["course"], domain["speed"]
    radii = np.maximum(_edges(speed), 0.0)
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_facecolor(_NO_VALUE)
    mesh = axes.pcolormesh(
        np.radians(_edges(course)), radii, np.ma.masked_invalid(table.T), cmap="viridis", rasterized=True
    )
    axes.set_rlim(0, radii[-1])
    axes.set_thetagrids(range(0, 360, 45))
    axes.tick_params(labelsize=7)
    for label in axes.get_yticklabels():  # readable on bright and on dark ground
        label.set_path_effects([withStroke(linewidth=2.0, foreground="white", alpha=0.7)])
    axes.grid(alpha=0.35)
    figure.colorbar(mesh, ax=axes, shrink=0.75, pad=0.1).ax.tick_params(labelsize=7)
    if decision.found:
        at = decision.as_dict()
        theta, radius = math.radians(at["course"]), at["speed"]
        axes.plot([theta, theta], [0, radius], color=_DECISION, linewidth=1.0)
        _mark(axes, theta, radius)


def _map(
    figure: Figure, axes: Axes, across: Variable, up: Variable, table: Floats, decision: Solution
) -> None:
    axes.set_facecolor(_NO_VALUE)
    mesh = axes.pcolormesh(
        _edges(across), _edges(up), np.ma.masked_invalid(table.T), cmap="viridis", rasterized=True
    )
    axes.set_xlabel(_UNITS.get(across.name, across.name), fontsize=8)
    axes.set_ylabel(_UNITS.get(up.name, up.name), fontsize=8)
    axes.tick_params(labelsize=7)
    figure.colorbar(mesh, ax=axes).ax.tick_params(labelsize=7)
    if decision.found:
        at = decision.as_dict()
        _mark(axes, at[across.name], at[up.name])


def _mark(axes: Any, x: float, y: float) -> None:
    axes.plot([x], [y], "o", color=_DECISION, markeredgecolor="white", markersize=8, clip_on=False)


def _curve(
    axes: Axes, v: Variable, table: Floats, functions: Sequence[IvPFunction], decision: Solution
) -> None:
    x = v.values()
    axes.plot(x, table, color="#1f77b4", linewidth=1.4)
    if len(functions) == 1:  # where pieces begin and end
        f = functions[0]
        ends = np.unique(np.concatenate((f.low[:, 0], f.high[:, 0])))
        axes.plot(x[ends], table[ends], ".", color="#1f77b4", markersize=5)
    missing = np.isnan(table)
    for j in np.flatnonzero(missing):
        axes.axvspan(x[j] - v.delta / 2, x[j] + v.delta / 2, color=_NO_VALUE, linewidth=0)
    axes.set_xlabel(_UNITS.get(v.name, v.name), fontsize=8)
    axes.set_ylabel("utility x weight", fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.3)
    axes.margins(x=0.02)
    if decision.found:
        at = decision.as_dict()[v.name]
        axes.axvline(at, color=_DECISION, linewidth=1.0)
        axes.plot([at], [table[decision.indexes[decision.domain.position(v.name)]]], "o", color=_DECISION)
