"""BHV_GoToDepth: one depth after the other (behaviors.md C20)."""

from __future__ import annotations

import re
from collections.abc import Iterable

from behaviors import forms
from behaviors.steering import depth_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter, parse_number

Level = tuple[float, float]
"""Depth in metres, and the seconds to stay there."""


def _levels(text: str) -> list[Level]:
    found = []
    for piece in text.split(":"):
        numbers = [parse_number(part.strip()) for part in piece.split(",")]
        if len(numbers) > 2 or min(numbers) < 0.0:
            raise ValueError(f"'{piece.strip()}': give DEPTH or DEPTH,SECONDS, both at least 0")
        found.append((numbers[0], numbers[1] if len(numbers) == 2 else 0.0))
    return found


def _arrival_name(text: str) -> str:
    word = text.strip()
    if not word or re.search(r"\s", word):
        raise ValueError("give the end of a variable's name, without blanks")
    return word


class GoToDepth(Behavior):
    """Goes to a depth, stays there, goes to the next; completes after the last one."""

    BHV_NAME = "BHV_GoToDepth"
    DEFAULT_NAME = "bhv_goto_depth"
    VARIABLES = ("depth",)
    INFO = ("NAV_DEPTH",)
    PARAMETERS = Declaration(
        (
            forms.custom(
                "depth", _levels, (), "Depths and how long to stay; further lines append.", "20,60:40"
            ),
            Parameter("repeat", "integer", 0, "", "Further rounds after the first.", low=0),
            forms.number(
                "capture_delta", 1.0, "m", "A depth is reached within this.", aliases=("arrival_delta",)
            ),
            forms.custom(
                "capture_flag",
                _arrival_name,
                "",
                "GTD_ and this is the variable that counts arrivals.",
                "ARRIVED",
                aliases=("arrival_flag",),
            ),
        )
    )

    def setup(self) -> None:
        self._index = 0
        self._rounds = 0
        self._arrivals = 0
        self._arrived: float | None = None
        """When the present level was reached."""
        self._last: float | None = None

    def set_depth(self, levels: list[Level]) -> None:
        vars(self.config)["depth"] = (*self.config.depth, *levels)

    def check(self) -> Iterable[str]:
        if not self.config.depth:
            yield "no depth is given: set depth = 20,60:40"

    def on_run(self) -> IvPFunction | None:
        levels = self.config.depth
        if not levels:
            self.warn("no depth is given")
            return None
        depth = self.number("NAV_DEPTH")
        if depth is not None and self._move_on(depth, levels):
            self.complete("all depths reached")
            return None
        level, stay = levels[self._index]
        waiting = "" if self._arrived is None else f", {stay - (self.now - self._arrived):.0f} s to stay"
        self.why = f"depth {self._index + 1} of {len(levels)}: {level:g} m{waiting}"
        return depth_peak(self.domain, level, 0.0, 5.0)

    def _move_on(self, depth: float, levels: tuple[Level, ...]) -> bool:
        """Notice arrivals and go on to the next level; True after the last one of all rounds."""
        level, stay = levels[self._index]
        former, self._last = self._last, depth
        if self._arrived is None:
            crossed = former is not None and (former - level) * (depth - level) < 0.0
            if abs(depth - level) > self.config.capture_delta and not crossed:
                return False
            self._arrived = self.now
            self._arrivals += 1
            if self.config.capture_flag:
                self.post(f"GTD_{self.config.capture_flag}", float(self._arrivals))
        if self.now - self._arrived < stay - 1e-9:
            return False
        self._arrived = None
        self._index += 1
        if self._index >= len(levels):
            self._index = 0
            self._rounds += 1
            if self._rounds > self.config.repeat:
                self._rounds = 0
                return True
        self.post("LEVEL_DEPTH", levels[self._index][0])
        return False
