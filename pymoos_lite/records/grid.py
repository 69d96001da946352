"""VIEW_GRID and VIEW_GRID_DELTA: a field of square cells over a convex region, each with named values.

A search grid posts the whole grid once and then what changed (marine_apps.md 13); a viewer keeps a grid per
label and applies the deltas. Cells are numbered from the south-west,
northward first, then column by column eastward.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from pymoos_lite.geometry.attributes import PLAIN, Attributes, read_attributes
from pymoos_lite.geometry.polygon import TOLERANCE, Polygon
from pymoos_lite.geometry.shapes import XY
from pymoos_lite.geometry.specs import SpecError, parse_polygon, seglist_text
from pymoos_lite.geometry.text import num, parse_number, split_protected
from pymoos_lite.records.csp import MAX_TEXT, RecordError, clip

_RECORD = "VIEW_GRID"
MAX_CELLS = 40_000
MAX_CORNERS = 1000


@dataclass(frozen=True)
class ConvexGrid:
    """A convex region, the side of its cells in metres, and the values of every variable in every cell.

    `variables` are (name, initial value); `limits` maps a name to its (least, greatest) value, either None.
    `values` holds per variable one tuple with a number per cell.
    """

    region: Polygon
    cell_size: float
    variables: tuple[tuple[str, float], ...] = (("x", 0.0),)
    limits: tuple[tuple[str, float | None, float | None], ...] = ()
    values: tuple[tuple[float, ...], ...] = ()
    attributes: Attributes = PLAIN

    @property
    def label(self) -> str:
        """The label among the attributes."""
        return self.attributes.label

    @classmethod
    def create(
        cls,
        region: Polygon,
        cell_size: float,
        variables: Mapping[str, float] | None = None,
        limits: Mapping[str, tuple[float | None, float | None]] | None = None,
        attributes: Attributes = PLAIN,
    ) -> Self:
        """Grid with every cell at its initial value.

        Raises RecordError when the region is not convex, or the cell size not positive or so small that
        there are more than MAX_CELLS cells.
        """
        if not region.is_convex:
            raise RecordError(_RECORD, "region is not convex")
        if len(region) > MAX_CORNERS:
            raise RecordError(_RECORD, f"region has {len(region)} corners, more than {MAX_CORNERS}")
        x0, y0, x1, y1 = region.bounds
        if not cell_size > 0.0:
            raise RecordError(_RECORD, f"cell_size must be greater than 0, found {cell_size:g}")
        if ((x1 - x0) / cell_size + 1.0) * ((y1 - y0) / cell_size + 1.0) > MAX_CELLS:
            raise RecordError(_RECORD, f"cell_size {cell_size:g} makes more than {MAX_CELLS} cells")
        names = tuple((variables or {"x": 0.0}).items())
        bounds = tuple((name, low, high) for name, (low, high) in sorted((limits or {}).items()))
        grid = cls(replace(region, attributes=PLAIN), cell_size, names, bounds, (), attributes)
        count = len(grid.cells)
        return replace(grid, values=tuple((grid._held(name, first),) * count for name, first in names))

    @cached_property
    def cells(self) -> tuple[XY, ...]:
        """South-west corner of every cell that touches the region."""
        x0, y0, x1, y1 = self.region.bounds
        half = self.cell_size / 2.0
        columns = max(1, math.ceil((x1 - x0) / self.cell_size - 1e-9))
        rows = max(1, math.ceil((y1 - y0) / self.cell_size - 1e-9))
        cx = np.repeat(x0 + half + self.cell_size * np.arange(columns), rows)
        cy = np.tile(y0 + half + self.cell_size * np.arange(rows), columns)
        # Two convex shapes are apart only if an edge of one of them separates them; the cells' own
        # edges cannot, since all cells lie within the region's bounding box.
        slack = TOLERANCE * self.region.size
        touching = np.ones(cx.size, dtype=np.bool_)
        for nx, ny, c in self.region.half_planes:
            touching &= nx * cx + ny * cy - c - half * (abs(nx) + abs(ny)) <= slack
        return tuple(zip((cx[touching] - half).tolist(), (cy[touching] - half).tolist(), strict=True))

    def cell_at(self, x: float, y: float) -> int | None:
        """Number of the cell that contains (x, y), None outside of all cells."""
        return self._numbers.get(self._place(x, y))

    def _place(self, x: float, y: float) -> tuple[int, int]:
        x0, y0, _, _ = self.region.bounds
        return math.floor((x - x0) / self.cell_size), math.floor((y - y0) / self.cell_size)

    @cached_property
    def _numbers(self) -> dict[tuple[int, int], int]:
        half = self.cell_size / 2.0
        return {self._place(x + half, y + half): number for number, (x, y) in enumerate(self.cells)}

    def value(self, cell: int, variable: str = "x") -> float:
        """Value of a variable in a cell; raises KeyError for an unknown variable, IndexError for a cell."""
        for (name, _), column in zip(self.variables, self.values, strict=True):
            if name == variable:
                return column[cell]
        raise KeyError(variable)

    def changed(self, changes: Iterable[tuple[int, str, float]]) -> Self:
        """The grid after adding each (cell, variable, delta); results are held within the limits.

        Changes of unknown cells or variables are ignored: a delta may be older than the grid.
        """
        columns = {name: list(column) for (name, _), column in zip(self.variables, self.values, strict=True)}
        for cell, name, delta in changes:
            column = columns.get(name)
            if column is not None and 0 <= cell < len(column):
                column[cell] = self._held(name, column[cell] + delta)
        return replace(self, values=tuple(tuple(columns[name]) for name, _ in self.variables))

    def _held(self, name: str, value: float) -> float:
        for limited, low, high in self.limits:
            if limited == name:
                if low is not None:
                    value = max(low, value)
                if high is not None:
                    value = min(high, value)
        return value

    def to_text(self) -> str:
        """`pts={..},cell_size=5,cell_vars=x:0,cell_min=x:0,cell_max=x:10[,cell=ix:x:3]..[,attributes]`.

        Only cells that differ from the initial values are listed.
        """
        parts = [seglist_text(self.region, 2), f"cell_size={num(self.cell_size, 3)}"]
        parts.append("cell_vars=" + ":".join(f"{name}:{num(first, 4)}" for name, first in self.variables))
        for key, side in (("cell_min", 1), ("cell_max", 2)):
            held = [(limit[0], limit[side]) for limit in self.limits]
            shown = [f"{name}:{num(value, 4)}" for name, value in held if isinstance(value, float | int)]
            if shown:
                parts.append(f"{key}=" + ":".join(shown))
        for cell in range(len(self.cells)):
            marks = [
                f"{name}:{num(column[cell], 4)}"
                for (name, first), column in zip(self.variables, self.values, strict=True)
                if column[cell] != self._held(name, first)
            ]
            if marks:
                parts.append(f"cell={cell}:" + ":".join(marks))
        return ",".join(parts) + self.attributes.tail()

    __str__ = to_text

    @classmethod
    def parse(cls, text: str) -> Self:
        """Grid from text; raises RecordError, and nothing else, when it is none."""
        if len(text) > MAX_TEXT:
            raise RecordError(_RECORD, f"text of {len(text)} characters is longer than {MAX_TEXT}")
        pairs = [piece.partition("=") for piece in split_protected(text, quotes=False) if piece]
        fields = {key.strip().lower(): value.strip() for key, _, value in pairs}
        try:
            region = parse_polygon(f"pts={fields.get('pts', '')}")
        except SpecError as error:
            raise RecordError(_RECORD, str(error)) from None
        size = parse_number(fields.get("cell_size", ""))
        if size is None:
            raise RecordError(_RECORD, f"cell_size must be a number in '{clip(text)}'")
        variables = dict(_named(fields.get("cell_vars", "x:0")))
        low, high = dict(_named(fields.get("cell_min", ""))), dict(_named(fields.get("cell_max", "")))
        limits = {name: (low.get(name), high.get(name)) for name in {*low, *high}}
        grid = cls.create(region, size, variables, limits, read_attributes(fields))
        marks: list[tuple[int, str, float]] = []
        for key, _, value in pairs:
            if key.strip().lower() == "cell":
                number, _, rest = value.partition(":")
                cell = parse_number(number)
                if cell is None or not 0 <= cell < len(grid.cells):
                    raise RecordError(_RECORD, f"no cell '{clip(number)}' in a grid of {len(grid.cells)}")
                for name, mark in _named(rest):
                    if name in variables:
                        marks.append((int(cell), name, mark - grid.value(int(cell), name)))
        return grid.changed(marks)


def _named(text: str) -> list[tuple[str, float]]:
    """(name, number) pairs of `x:0:y:1`."""
    words = [word.strip() for word in text.split(":")] if text.strip() else []
    if len(words) % 2:
        raise RecordError(_RECORD, f"expected name:value:name:value, found '{clip(text)}'")
    pairs: list[tuple[str, float]] = []
    for name, word in zip(words[::2], words[1::2], strict=True):
        value = parse_number(word)
        if value is None or not name:
            raise RecordError(_RECORD, f"expected name:value:name:value, found '{clip(text)}'")
        pairs.append((name, value))
    return pairs


@dataclass(frozen=True, slots=True)
class GridDelta:
    """VIEW_GRID_DELTA `psg@ix,x,delta:ix,x,delta`: what to add to which cells of the grid of this label."""

    label: str
    changes: tuple[tuple[int, str, float], ...] = ()

    @classmethod
    def parse(cls, text: str) -> GridDelta:
        """Delta from text; raises RecordError when it is not `label@ix,var,delta:...`."""
        if len(text) > MAX_TEXT:
            raise RecordError("VIEW_GRID_DELTA", f"text of {len(text)} characters is too long")
        label, at, body = text.partition("@")
        if not at or not label.strip():
            raise RecordError("VIEW_GRID_DELTA", f"expected label@ix,var,delta:..., found '{clip(text)}'")
        changes: list[tuple[int, str, float]] = []
        for piece in body.split(":") if body.strip() else []:
            words = [word.strip() for word in piece.split(",")]
            cell = parse_number(words[0])
            delta = parse_number(words[-1])
            if len(words) != 3 or cell is None or delta is None or cell < 0 or not words[1]:
                raise RecordError("VIEW_GRID_DELTA", f"expected ix,var,delta, found '{clip(piece)}'")
            changes.append((int(cell), words[1], delta))
        return cls(label.strip(), tuple(changes))

    def to_text(self) -> str:
        """`label@ix,var,delta:ix,var,delta`."""
        return f"{self.label}@" + ":".join(
            f"{cell},{name},{num(delta, 4)}" for cell, name, delta in self.changes
        )

    __str__ = to_text
