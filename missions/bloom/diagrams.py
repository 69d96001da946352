"""Two drawings that hold no data: how a fleet decides, and what one opinion engine does (gcid.md 19)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from opinion_engine.plots import figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Box = tuple[str, float, float, str]
"""Text, centre x and y, colour."""
CHOICE, DECISION, PLAIN = "#DCEBF5", "#E3F2E1", "#F3F1EC"
WIDTH, HEIGHT = 2.0, 0.86


def framework_figure() -> Figure:
    """From a network of vessels to a rudder: group choice, individual decision."""
    boxes: dict[str, Box] = {
        "others": ("other vessels'\nopinions", 0.0, 1.5, CHOICE),
        "inputs": ("own inputs\nb for each option", 0.0, 0.0, CHOICE),
        "choice": ("group choice\nopinions z, attention u", 2.5, 0.75, CHOICE),
        "select": ("strongest option\nactivates behaviours\n(A_c, W)", 5.0, 0.75, DECISION),
        "solve": ("interval programming\nbest course, speed", 7.5, 0.75, DECISION),
        "act": ("controller\nrudder, thrust", 10.0, 0.75, PLAIN),
    }
    arrows = [
        ("others", "choice"),
        ("inputs", "choice"),
        ("choice", "select"),
        ("select", "solve"),
        ("solve", "act"),
    ]
    return _diagram(boxes, arrows, [("choice", "others", "own opinion, a few bytes a second")])


def engine_figure() -> Figure:
    """One update of the opinion engine."""
    boxes: dict[str, Box] = {
        "mail": ("neighbours' messages\nfresh ones only", 0.0, 1.5, CHOICE),
        "raw": ("raw inputs\nclipped and scaled to b", 0.0, 0.0, CHOICE),
        "attention": ("attention\ntau_u u' = -u + S_u(y)", 2.8, 1.5, CHOICE),
        "opinion": ("opinions\nz' = P0(-dz + u S(Az) + b)", 2.8, 0.0, CHOICE),
        "pick": ("strongest option\nabove the threshold", 5.6, 0.0, DECISION),
        "send": ("send own opinion\ntext, or 3, 6, 12 bytes", 5.6, 1.5, DECISION),
        "post": ("post its outputs\nOPTION = EXPLORE", 8.4, 0.0, PLAIN),
    }
    arrows = [
        ("mail", "attention"),
        ("mail", "opinion"),
        ("raw", "opinion"),
        ("attention", "opinion"),
        ("opinion", "attention"),
        ("opinion", "pick"),
        ("opinion", "send"),
        ("pick", "post"),
    ]
    return _diagram(boxes, arrows, [])


def _diagram(
    boxes: dict[str, Box], arrows: list[tuple[str, str]], backward: list[tuple[str, str, str]]
) -> Figure:
    from matplotlib.patches import FancyBboxPatch

    right = max(x for _, x, _, _ in boxes.values())
    made, axis = figure(1.05 * (right + WIDTH + 0.2), 3.0)
    axis.set_axis_off()
    axis.set_aspect("equal")
    axis.set_xlim(-WIDTH / 2 - 0.1, right + WIDTH / 2 + 0.1)
    axis.set_ylim(-0.6, 2.6 if backward else 2.1)
    for text, x, y, colour in boxes.values():
        corner = (x - WIDTH / 2, y - HEIGHT / 2)
        axis.add_patch(
            FancyBboxPatch(
                corner, WIDTH, HEIGHT, boxstyle="round,pad=0,rounding_size=0.1", facecolor=colour,
                edgecolor="#555555", linewidth=0.8,
            )
        )  # fmt: skip
        axis.text(x, y, text, ha="center", va="center", fontsize=8.5, linespacing=1.35)
    for start, end in arrows:
        _arrow(axis, boxes[start], boxes[end])
    for start, end, text in backward:
        (_, x0, y0, _), (_, x1, y1, _) = boxes[start], boxes[end]
        axis.annotate(
            "", (x1 + 0.3, y1 + HEIGHT / 2), (x0, y0 + HEIGHT / 2),
            arrowprops={"arrowstyle": "->", "color": "#555555", "connectionstyle": "arc3,rad=0.4"},
        )  # fmt: skip
        axis.text(x0 + 0.08, (y0 + y1) / 2.0 + HEIGHT / 2, text, fontsize=8, color="#555555", ha="left")
    return made


def _arrow(axis: Any, start: Box, end: Box) -> None:
    (_, x0, y0, _), (_, x1, y1, _) = start, end
    upright = abs(x1 - x0) < WIDTH
    down = 1.0 if y0 > y1 else -1.0
    aside = 0.25 * down  # arrows both ways lie beside each other
    tail = (x0 + aside, y0 - down * HEIGHT / 2) if upright else (x0 + WIDTH / 2, y0)
    head = (x1 + aside, y1 + down * HEIGHT / 2) if upright else (x1 - WIDTH / 2, y1)
    axis.annotate(
        "", head, tail, arrowprops={"arrowstyle": "->", "color": "#555555", "shrinkA": 0, "shrinkB": 1}
    )
