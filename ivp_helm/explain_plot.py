"""Pictures of a decision: every function, and the weighted sum, with own best points and the decision."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ivp_helm.explain import Explanation, point_text
from ivp_helm.ivp import Domain, IvPFunction
from pymoos_lite.geometry.text import num


def plot_explanation(explanation: Explanation, file: Path) -> None:
    """Draw all functions of an iteration and their sum to an image file (its suffix says which kind).

    Functions of course and speed are drawn as maps, of one variable as curves; of more variables the cut
    through the decision is shown.

    Raises:
        ValueError: there is no function to draw.
    """
    named = explanation.functions
    if not named:
        raise ValueError(f"iteration {explanation.iteration} has no functions to draw")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    functions = [function for _, function in named]
    axes_domain = _joint(functions)
    panels = [(f"{name}, weight {num(f.weight, 1)}", [f]) for name, f in named]
    panels.append(("weighted sum", functions))
    columns = min(3, len(panels))
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(4.6 * columns, 3.8 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(
        f"Iteration {explanation.iteration}: {point_text(explanation.decision) or explanation.reason}"
    )
    for k, (title, group) in enumerate(panels):
        axes = figure.add_subplot(rows, columns, k + 1)
        axes.set_title(title, fontsize=10)
        _panel(
            axes, group, axes_domain, explanation.decision, weighted=len(group) > 1 or k == len(panels) - 1
        )
    figure.savefig(file, dpi=110)


def _joint(functions: Sequence[IvPFunction]) -> Domain:
    domain = functions[0].domain
    for function in functions[1:]:
        domain = domain.union(function.domain)
    return domain


def _panel(
    axes: Any, group: Sequence[IvPFunction], joint: Domain, decision: Mapping[str, float], *, weighted: bool
) -> None:
    domain = _joint(group)
    names = [name for name in ("course", "speed") if name in domain] or list(domain.names[:1])
    if len(names) == 1 and len(domain.names) > 1:
        names = list(domain.names[:2])
    values = _values(group, domain, names, decision, weighted)
    ticks = [domain[name].values() for name in names]
    if len(names) == 1:
        axes.plot(ticks[0], values)
        axes.set_xlabel(names[0])
        if names[0] in decision:
            axes.axvline(decision[names[0]], color="black", linestyle="--", linewidth=1)
        return
    picture = axes.pcolormesh(ticks[0], ticks[1], values.T, shading="nearest", cmap="viridis")
    axes.figure.colorbar(picture, ax=axes, shrink=0.85)
    best = np.unravel_index(int(np.nanargmax(values)), values.shape)
    axes.plot(ticks[0][best[0]], ticks[1][best[1]], "w^", markersize=7, markeredgecolor="black", label="best")
    if all(name in decision for name in names):
        axes.plot(decision[names[0]], decision[names[1]], "ro", markersize=6, label="decision")
    axes.set_xlabel(names[0])
    axes.set_ylabel(names[1])
    axes.legend(fontsize=7, loc="upper right")


def _values(
    group: Sequence[IvPFunction],
    domain: Domain,
    names: Sequence[str],
    decision: Mapping[str, float],
    weighted: bool,
) -> NDArray[np.float64]:
    """The (weighted) sum over the named variables; the others are held at the decision."""
    grids = np.meshgrid(*[np.arange(domain[name].points) for name in names], indexing="ij")
    total = np.zeros(grids[0].shape)
    for function in group:
        columns = []
        for name in function.domain.names:
            if name in names:
                columns.append(grids[names.index(name)].ravel())
            else:
                variable = function.domain[name]
                columns.append(np.full(total.size, variable.index(decision.get(name, variable.low))))
        utility = function.evaluate(np.stack(columns, axis=1)).reshape(total.shape)
        total += utility * (function.weight if weighted else 1.0)
    return total
