"""BHV_MinAltitudeX: keep off the bottom (behaviors.md C14)."""

from __future__ import annotations

from behaviors import forms
from behaviors.steering import at_most
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter


class MinAltitudeX(Behavior):
    """Limits the depth so that so much water stays below the vessel.

    The bottom is where NAV_DEPTH and NAV_ALTITUDE say it is; an altitude of 0 or less is no measurement.
    """

    BHV_NAME = "BHV_MinAltitudeX"
    DEFAULT_NAME = "bhv_min_altitude"
    VARIABLES = ("depth",)
    INFO = ("NAV_DEPTH", "NAV_ALTITUDE")
    CONSTRAINT = True
    PARAMETERS = Declaration(
        (
            forms.number("min_altitude", 0.0, "m", "Water to keep below the vessel."),
            Parameter(
                "missing_altitude_critical",
                "boolean",
                True,
                "",
                "Unknown depth or altitude stops the vessel (else it is a warning).",
            ),
        )
    )

    def on_run(self) -> IvPFunction | None:
        depth, altitude = self.buffer.number("NAV_DEPTH"), self.buffer.number("NAV_ALTITUDE")
        if depth is None or altitude is None:
            self._complain("NAV_DEPTH" if depth is None else "NAV_ALTITUDE")
            return None
        for variable in self.INFO:
            self.retract_warning(_missing(variable))
        if altitude <= 0.0:
            self.why = "no bottom in sight"
            return None
        limit = max(0.0, depth + altitude - self.config.min_altitude)
        self.why = f"bottom at {depth + altitude:.1f} m, at most {limit:.1f} m deep"
        return at_most(self.domain, "depth", limit, 0.0)

    def _complain(self, variable: str) -> None:
        self.post("MIN_ALT_STATUS", _missing(variable))
        self.why = _missing(variable)
        if self.config.missing_altitude_critical:
            self.error(_missing(variable))
        else:
            self.warn(_missing(variable))


def _missing(variable: str) -> str:
    return f"Missing {variable} info"
