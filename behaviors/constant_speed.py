"""BHV_ConstantSpeed: go at one speed (behaviors.md C4)."""

from __future__ import annotations

from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction, Peak, zaic_peak
from pymoos_lite.config.parameters import Declaration, Parameter


class ConstantSpeed(Behavior):
    """Keeps a speed. Completes at once unless `duration` says otherwise."""

    BHV_NAME = "BHV_ConstantSpeed"
    DEFAULT_NAME = "bhv_constant_speed"
    VARIABLES = ("speed",)
    INFO = ("NAV_SPEED",)
    DEFAULTS = {"duration": 0.0}  # noqa: RUF012
    PARAMETERS = Declaration(
        (
            Parameter("speed", "number", 0.0, "m/s", "Speed to keep.", low=0.0),
            Parameter("peakwidth", "number", 0.0, "m/s", "Half width of the summit.", low=0.0, clip=True),
            Parameter("basewidth", "number", 0.2, "m/s", "Width of each flank.", low=0.0, clip=True),
            Parameter(
                "summitdelta", "number", 0.0, "", "Fall over the summit.", low=0.0, high=100.0, clip=True
            ),
            Parameter("speed_mismatch_var", "text", "", "", "Variable for the difference to the speed kept."),
        )
    )

    def setup(self) -> None:
        self._function: IvPFunction | None = None

    def on_parameters(self) -> None:
        self._function = None

    def on_every_state(self) -> None:
        if self.config.speed_mismatch_var:
            actual = self.number("NAV_SPEED")
            if actual is not None:
                self.post(self.config.speed_mismatch_var, abs(actual - self._speed))

    @property
    def _speed(self) -> float:
        return float(min(self.config.speed, self.max_speed))

    def on_run(self) -> IvPFunction | None:
        config = self.config
        self.why = f"keeps {self._speed:g} m/s"
        if self._function is None:
            peak = Peak(self._speed, config.peakwidth, config.basewidth, config.summitdelta)
            self._function = zaic_peak(self.domain, "speed", peak)
        return self._function
