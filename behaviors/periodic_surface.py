"""BHV_PeriodicSurface: come up from time to time, for a position fix or to be heard (behaviors.md C22)."""

from __future__ import annotations

from typing import Literal

from behaviors import forms
from behaviors.steering import coupled, depth_peak, speed_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter, parse_number
from pymoos_lite.geometry.text import num, split_protected

GRADES = {"linear": 1.0, "quadratic": 2.0, "quasi": 1.5, "fullspeed": 0.0}
State = Literal["waiting", "ascending", "at_surface"]


def _acomms_mark(text: str) -> tuple[str, float, float] | None:
    if not text.strip():
        return None
    pieces = split_protected(text, ",")
    if len(pieces) != 3 or not pieces[0] or " " in pieces[0]:
        raise ValueError("give VARIABLE,interval,max")
    interval, most = parse_number(pieces[1]), parse_number(pieces[2])
    if interval < 0.0 or most < 0.0:
        raise ValueError("interval and max are seconds of at least 0")
    return pieces[0], interval, most


def _ascent_speed(text: str) -> float | None:
    """None for ``current``."""
    if text.strip().lower() == "current":
        return None
    value = parse_number(text.strip())
    if value < 0.0:
        raise ValueError("give a speed of at least 0, or current")
    return value


class PeriodicSurface(Behavior):
    """Waits, comes up, stays at the surface until a mark comes in or its time is up, and waits again."""

    BHV_NAME = "BHV_PeriodicSurface"
    DEFAULT_NAME = "bhv_periodic_surface"
    VARIABLES = ("speed", "depth")
    INFO = ("NAV_DEPTH", "NAV_SPEED")
    PARAMETERS = Declaration(
        (
            forms.number("period", 300.0, "s", "Longest time between two marks."),
            forms.variable("mark_variable", "GPS_UPDATE_RECEIVED", "A fresh post of this ends the stay."),
            forms.custom(
                "acomms_mark_variable",
                _acomms_mark,
                None,
                "A post of VARIABLE delays the ascent by interval, in all by max.",
                "ACOMMS_RECEIVED,60,300",
                unit="s",
            ),
            forms.variable("pending_status_var", "PENDING_SURFACE", "Variable for the seconds to wait."),
            forms.variable(
                "atsurface_status_var", "TIME_AT_SURFACE", "Variable for the seconds at the surface."
            ),
            forms.number("max_time_at_surface", 300.0, "s", "Longest stay at the surface."),
            forms.custom(
                "ascent_speed",
                _ascent_speed,
                None,
                "Speed to begin the ascent with, or current.",
                "current",
                aliases=("speed_to_surface",),
                unit="m/s",
            ),
            forms.number("zero_speed_depth", 0.0, "m", "From this depth up the vessel is at the surface."),
            Parameter(
                "ascent_grade",
                "choice",
                "linear",
                "",
                "How speed falls on the way up.",
                choices=tuple(GRADES),
            ),
        )
    )

    def setup(self) -> None:
        self._phase: State = "waiting"
        self._mark: float | None = None
        """When the present wait began."""
        self._extension = 0.0
        self._surfaced = 0.0
        self._start_depth = 0.0
        self._start_speed = 0.0

    def on_parameters(self) -> None:
        acomms = self.config.acomms_mark_variable
        self.watch(self.config.mark_variable, acomms[0] if acomms else "")

    def on_every_state(self) -> None:
        config = self.config
        acomms = config.acomms_mark_variable
        if self._mark is None:
            self._mark = self.now
        if self.buffer.updated(config.mark_variable):
            self._restart()
        elif acomms is not None and self.buffer.updated(acomms[0]):
            self._extension = min(self._extension + acomms[1], acomms[2])
        self.post_int(config.pending_status_var, self._pending)

    @property
    def _pending(self) -> float:
        """Seconds until the ascent begins."""
        mark = self.now if self._mark is None else self._mark
        return max(0.0, float(self.config.period) - (self.now - mark) + self._extension)

    def _restart(self) -> None:
        if self._phase == "ascending":
            self.post("PERIODIC_ASCEND", "false")
        self._phase = "waiting"
        self._mark = self.now
        self._extension = 0.0

    def on_run(self) -> IvPFunction | None:
        config = self.config
        depth, speed = self.buffer.number("NAV_DEPTH"), self.buffer.number("NAV_SPEED")
        if depth is None or speed is None:
            self.error(f"No ownship {'depth' if depth is None else 'speed'} info in info_buffer.")
            return None
        if self._phase == "waiting" and self._pending <= 0.0:
            self._phase = "ascending"
            self._start_depth = depth
            self._start_speed = speed if config.ascent_speed is None else config.ascent_speed
            self.post("PERIODIC_ASCEND", "true")
        if self._phase == "ascending" and depth <= config.zero_speed_depth:
            self._phase = "at_surface"
            self._surfaced = self.now
            self.post("PERIODIC_ASCEND", "false")
        at_surface = self.now - self._surfaced if self._phase == "at_surface" else 0.0
        if at_surface > config.max_time_at_surface:
            self.post("PSF_AT_SURFACE_TIMEOUT", f"Timestamp={num(self.now, 2)}", repeat=True)
            self._restart()
            at_surface = 0.0
        self.post_int(config.atsurface_status_var, at_surface)
        return self._function(depth)

    def _function(self, depth: float) -> IvPFunction | None:
        if self._phase == "waiting":
            self.why = f"{self._pending:.0f} s to the ascent"
            return None
        speed = self._speed(depth) if self._phase == "ascending" else 0.0
        self.why = f"{self._phase.replace('_', ' ')}, {depth:.1f} m deep, {num(speed, 2)} m/s"
        flank = 0.5 if self._phase == "ascending" else 0.0
        return coupled(speed_peak(self.domain, speed, 0.0, flank), depth_peak(self.domain, 0.0, 0.0, 0.0))

    def _speed(self, depth: float) -> float:
        """From the speed begun with down to 0 at `zero_speed_depth`, by the grade."""
        span = self._start_depth - self.config.zero_speed_depth
        share = (depth - self.config.zero_speed_depth) / span if span > 0.0 else 0.0
        return self._start_speed * float(min(max(share, 0.0), 1.0) ** GRADES[self.config.ascent_grade])
