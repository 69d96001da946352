"""How own ship turns: the path it takes to a new heading, and its turn rate (behaviors.md A9)."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from ivp_helm.surroundings import Ownship
from pymoos_lite.config.parameters import ParameterError, parse_number
from pymoos_lite.geometry.angles import angle180, angle360, angle_diff, is_port_turn, project_point

Point = tuple[float, float]
_ALIASES = {"radius": "radius", "rad": "radius", "spoke_degs": "spoke", "degs": "spoke"}
_RATE_WINDOW = 2.0
"""Seconds of heading history that the turn rate is taken over."""


@dataclass(frozen=True, slots=True)
class TurnModel:
    """`kind` is ``holo`` (turns on the spot) or ``dubins`` (on a circle of `radius` metres, drawn with one
    vertex every `spoke` degrees)."""

    kind: str = "holo"
    radius: float = 0.0
    spoke: float = 10.0

    @classmethod
    def parse(cls, text: str) -> TurnModel:
        """Read ``alg=dubins # radius=5 # degs=2``; nothing is taken over if any part is bad.

        Raises:
            ParameterError: unknown word or value, or no `alg`.
        """
        kind = ""
        values = {"radius": 5.0, "spoke": 10.0}
        for piece in text.split("#"):
            key, equals, value = (part.strip().lower() for part in piece.partition("="))
            if not key:
                continue
            if key == "alg" and value in ("holo", "dubins"):
                kind = value
            elif key.removeprefix("mod_") in _ALIASES and equals:
                name = _ALIASES[key.removeprefix("mod_")]
                number = _positive(key, value, key.startswith("mod_"))
                values[name] = values[name] + number if key.startswith("mod_") else number
            else:
                raise ParameterError(
                    f"pmgen = {text!r}: '{piece.strip()}' is none of alg=holo|dubins, radius=M, spoke_degs=DEG"
                )
        if not kind:
            raise ParameterError(f"pmgen = {text!r}: alg=holo or alg=dubins is missing")
        return cls(kind, values["radius"] if kind == "dubins" else 0.0, values["spoke"])

    def path(self, own: Ownship, heading: float) -> list[Point]:
        """Own position and the vertices of the turn to `heading`; from the last one it goes on straight."""
        points = [(own.x, own.y)]
        if self.kind == "holo" or self.radius <= 0.0:
            return points
        port = is_port_turn(own.heading, heading)
        side = -90.0 if port else 90.0
        step = -self.spoke if port else self.spoke
        centre = project_point(angle360(own.heading + side), self.radius, own.x, own.y)
        count = int(angle_diff(own.heading, heading) / self.spoke + 0.5)
        limit = int(180.0 / self.spoke - 1e-9)
        for k in range(1, min(count, limit) + 1):
            outward = angle360(own.heading - side + k * step)
            points.append(project_point(outward, self.radius, *centre))
        return points


def _positive(key: str, text: str, any_sign: bool) -> float:
    try:
        value = parse_number(text)
    except ValueError:
        raise ParameterError(f"pmgen: {key} = {text!r} is not a number") from None
    if value <= 0.0 and not any_sign:
        raise ParameterError(f"pmgen: {key} = {text} must be above 0")
    return value


class Platform:
    """The turn model and the recent headings of own ship."""

    def __init__(self, model: TurnModel | None = None) -> None:
        self.model = model or TurnModel()
        self._headings: deque[tuple[float, float]] = deque(maxlen=64)

    def update(self, own: Ownship, now: float) -> None:
        headings = self._headings
        headings.append((now, own.heading))
        while len(headings) > 2 and now - headings[0][0] > _RATE_WINDOW:
            headings.popleft()

    @property
    def turn_rate(self) -> float:
        """Degrees per second, positive clockwise, over the last two seconds."""
        headings = self._headings
        if len(headings) < 2 or headings[-1][0] <= headings[0][0]:
            return 0.0
        turned = 0.0
        former = headings[0][1]
        for _, heading in headings:
            turned += angle180(heading - former)
            former = heading
        return turned / (headings[-1][0] - headings[0][0])
