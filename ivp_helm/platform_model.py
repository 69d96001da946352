"""How own ship turns: its turn model in its present pose, and its turn rate (behaviors.md A9)."""

from __future__ import annotations

from collections import deque

from ivp_helm.surroundings import Ownship
from pymoos_lite.config.parameters import ParameterError
from pymoos_lite.geometry.angles import angle180
from pymoos_lite.geometry.formats import SpecError
from pymoos_lite.geometry.turn_paths import TurnModel, parse_turn_model

_RATE_WINDOW = 2.0
"""Seconds of heading history that the turn rate is taken over."""


def read_turn_model(text: str) -> TurnModel:
    """``alg=holo`` or ``alg=dubins # radius=5 # spoke_degs=10``.

    Raises:
        ParameterError: it is neither.
    """
    try:
        return parse_turn_model(text)
    except SpecError as error:
        raise ParameterError(f"pmgen = {text!r}: {error}") from None


class Platform:
    """Own ship's turn model and its recent headings."""

    def __init__(self, model: TurnModel | None = None) -> None:
        self._model = model or TurnModel()
        self._own: Ownship | None = None
        self._heading = 0.0
        self._headings: deque[tuple[float, float]] = deque(maxlen=64)

    def update(self, own: Ownship, now: float) -> None:
        """Own ship's state of this iteration."""
        self._own = own
        headings = self._headings
        # Unwrapped: a turn through north goes on counting, so that the rate is a difference of two ends.
        turned = headings[-1][1] + angle180(own.heading - self._heading) if headings else 0.0
        self._heading = own.heading
        headings.append((now, turned))
        while len(headings) > 2 and now - headings[0][0] > _RATE_WINDOW:
            headings.popleft()

    @property
    def model(self) -> TurnModel:
        """The turn model in own ship's present pose."""
        own = self._own
        if own is not None and (self._model.x, self._model.y, self._model.heading) != own[:3]:
            self._model = self._model.at(own.x, own.y, own.heading)
        return self._model

    @property
    def turn_rate(self) -> float:
        """Degrees per second, positive clockwise, over the last two seconds."""
        headings = self._headings
        if len(headings) < 2 or headings[-1][0] <= headings[0][0]:
            return 0.0
        return (headings[-1][1] - headings[0][1]) / (headings[-1][0] - headings[0][0])
