"""The line that viewers draw from own ship to a contact, coloured by how much it matters (behaviors.md B4)."""

from __future__ import annotations

from dataclasses import dataclass

from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.colors import color_text
from pymoos_lite.geometry.shapes import SegList
from pymoos_lite.geometry.specs import seglist_text
from pymoos_lite.geometry.text import parse_number

_DURATION = 100.0  # s; a line whose behaviour died with its community goes away by itself
_NO_COLOR = "blank"


@dataclass(frozen=True, slots=True)
class BearingLine:
    """Colours with the greatest index value each stands for, in the order given; `info` names the index."""

    colors: tuple[tuple[str, float], ...] = ()
    info: str = "relevance"

    def color(self, index: float) -> str:
        """The first colour whose threshold is not below the index."""
        return next((color for color, limit in self.colors if limit >= index), _NO_COLOR)

    def text(
        self,
        label: str,
        ends: tuple[tuple[float, float], tuple[float, float]],
        index: float,
        now: float,
        named: bool,
    ) -> str:
        """The VIEW_SEGLIST from the first end to the other; `named` shows its label."""
        color = self.color(index) if self.colors else "white"
        attributes = Attributes(
            label=label,
            label_color="" if named else "invisible",
            edge_color=color,
            vertex_color=color,
            time=now,
            duration=_DURATION,
        )
        return seglist_text(SegList(ends, attributes=attributes))


def parse_bearing_line(text: str) -> BearingLine:
    """``white:0, green:0.65, yellow:0.8, red:1.0[, info:range|relevance]``.

    Raises:
        ValueError: a part is neither a known colour with a number nor the info.
    """
    colors = []
    info = "relevance"
    for part in text.split(","):
        key, colon, value = (word.strip().lower() for word in part.partition(":"))
        limit = parse_number(value)
        if key == "info" and value in ("range", "relevance"):
            info = value
        elif colon and limit is not None and color_text(key) is not None:
            colors.append((key, limit))
        else:
            raise ValueError(
                f"bearing_line_config: '{part.strip()}' is neither colour:number nor info:range|relevance"
            )
    return BearingLine(tuple(colors), info)
