"""BHV_StationKeep: stay near a point (behaviors.md C3)."""

from __future__ import annotations

from math import hypot

from behaviors import forms
from behaviors.station import HIBERNATING, Hibernation, Radii
from behaviors.steering import speed_peak, toward
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.angles import bearing
from pymoos_lite.geometry.hints import VisualHints
from pymoos_lite.geometry.shapes import XY, Point
from pymoos_lite.geometry.text import fix, num

NO_STATION = "STATION_POINT_NOT_SET"
HINTS = VisualHints(
    {
        "vertex_color": "red",
        "edge_color": "light_blue",
        "label_color": "white",
        "vertex_size": 1.0,
        "edge_size": 1.0,
    }
)
HINT_KEYS = ("vertex_color", "edge_color", "label_color", "vertex_size", "edge_size")


def radii_parameters(
    outer: float, inner: float, outer_speed: float, extra_speed: float
) -> tuple[Parameter, ...]:
    """Radii and speeds of the way back."""

    def above(name: str, default: float, unit: str, doc: str, *aliases: str) -> Parameter:
        return forms.number(name, default, unit, doc, open_low=True, aliases=aliases)

    return (
        above("inner_radius", inner, "m", "Within this distance the vessel rests."),
        above("outer_radius", outer, "m", "Beyond this distance it comes back at full speed."),
        above("outer_speed", outer_speed, "m/s", "Speed just inside the outer radius."),
        above("extra_speed", extra_speed, "m/s", "Speed beyond the outer radius.", "transit_speed"),
    )


class StationKeep(Behavior):
    """Stays near a point: rests close to it, comes back the faster the further off it is."""

    BHV_NAME = "BHV_StationKeep"
    DEFAULT_NAME = "bhv_station_keep"
    INFO = ("NAV_X", "NAV_Y", "NAV_SPEED", "NAV_HEADING")
    PARAMETERS = Declaration(
        (
            forms.point("station_pt", "The point to stay at.", "point"),
            Parameter("center_activate", "boolean", False, "", "Stay where own ship is on starting to run."),
            *radii_parameters(15.0, 4.0, 1.2, 2.5),
            Parameter(
                "swing_time",
                "number",
                0.0,
                "s",
                "With center_activate: go on for so long before the point is taken.",
                low=0.0,
                high=60.0,
                clip=True,
            ),
            forms.custom(
                "hibernation_radius",
                forms.read_off_or(lambda value: value > 0.0, "a radius above 0"),
                None,
                "Drift freely within this distance once the station was reached; off: never.",
                "off",
                unit="m",
            ),
            forms.hint_lines("vertex_color=green"),
        )
    )

    def setup(self) -> None:
        self.station: XY | None = None
        self.hints = HINTS
        self._hibernation = Hibernation()
        self._swing_end: float | None = None
        """Until then own ship's position is taken for the station again and again."""
        self._drawing_key: tuple[object, ...] = ()
        self._drawing: dict[str, str] = {}

    # --- parameters ---------------------------------------------------------------------------------------

    def set_station_pt(self, point: Point) -> None:
        """The point to stay at, from now on."""
        self.config.__dict__["station_pt"] = point
        self._take((point.x, point.y))

    def set_outer_speed(self, speed: float) -> None:
        vars(self.config).update(outer_speed=speed, extra_speed=max(speed, self.config.extra_speed))

    def set_visual_hints(self, text: str) -> None:
        self.hints, complaints = forms.tolerant_hints(self.hints, text, HINT_KEYS)
        for complaint in complaints:
            self.event(complaint)

    def _take(self, station: XY) -> None:
        if station != self.station:
            self.station = station
            self._hibernation.restart()

    def settings(self) -> str:
        x, y = self.station or (0.0, 0.0)
        config = self.config
        hibernation = config.hibernation_radius
        return (
            f"x={fix(x)},y={fix(y)},inner_radius={fix(config.inner_radius, 1)},"
            f"outer_radius={fix(config.outer_radius, 1)},"
            f"hibernation_radius={fix(-1.0 if hibernation is None else hibernation, 1)},"
            f"outer_speed={fix(config.outer_speed, 1)},"
            f"center_activate={'true' if config.center_activate else 'false'}"
        )

    # --- state changes ------------------------------------------------------------------------------------

    def on_idle_to_run(self) -> None:
        self.post(
            "BHV_SETTINGS", f"type={type(self).BHV_NAME},name={self.name},{self.settings()}", repeat=True
        )
        self._hibernation.restart()
        if self.config.center_activate:
            self._swing_end = self.now + self.config.swing_time

    def on_run_to_idle(self) -> None:
        self._swing_end = None
        self._erase()

    def on_complete(self) -> None:
        self._erase()

    # --- running ------------------------------------------------------------------------------------------

    def on_run(self) -> IvPFunction | None:
        own = self.own
        swinging = self._swing(own.x, own.y)
        if self.station is None:
            self.warn(NO_STATION)
            self.why = "there is no station"
            self._erase()
            return None
        x, y = self.station
        distance = hypot(own.x - x, own.y - y)
        self.post("DIST_TO_STATION", distance)
        speed = self._radii.speed(distance)
        mode = "disabled"
        if self.config.hibernation_radius is not None:
            config = self.config
            mode = self._hibernation.update(
                self.now, distance, config.hibernation_radius, config.inner_radius
            )
            if mode == HIBERNATING:
                speed = 0.0
        self.post("PSKEEP_MODE", mode.upper())
        self._draw()
        self.why = f"{distance:.1f} m from the station, {num(speed, 2)} m/s"
        course = own.heading if swinging else bearing(own.x, own.y, x, y)
        return toward(self.domain, course, speed_peak(self.domain, speed, 0.0, 0.4, 0.0, 25.0))

    def _swing(self, x: float, y: float) -> bool:
        """Take own position for the station while that is wanted; True if that goes on."""
        end = self._swing_end
        if end is None:
            return False
        self._take((x, y))
        if self.now >= end - 1e-9:
            self._swing_end = None
            return False
        return True

    @property
    def _radii(self) -> Radii:
        config = self.config
        return Radii(config.inner_radius, config.outer_radius, config.outer_speed, config.extra_speed)

    # --- drawing ------------------------------------------------------------------------------------------

    def _circles(self) -> dict[str, str]:
        """Texts of the outer, inner and hibernation circle."""
        config, hints = self.config, self.hints
        outer = max(config.outer_radius, config.inner_radius)
        hibernation = -1.0 if config.hibernation_radius is None else config.hibernation_radius
        x, y = self.station or (0.0, 0.0)
        key = (x, y, outer, config.inner_radius, hibernation, hints)
        if key != self._drawing_key:
            self._drawing_key = key
            looks = (
                f"pts=32,edge_size={num(hints.size('edge_size') or 0.0, 1)},"
                f"vertex_size={num(hints.size('vertex_size') or 0.0, 1)},"
                f"edge_color={hints.color('edge_color')},label_color={hints.color('label_color')},"
                f"vertex_color={hints.color('vertex_color')}"
            )
            start = f"radial:: x={fix(x, 1)},y={fix(y, 1)},source={self.community}:{self.name},{looks}"
            self._drawing = {
                which: f"{start},label={self.community}:station-keep-{which},radius={fix(radius, 1)}"
                for which, radius in (("out", outer), ("in", config.inner_radius), ("hiber", hibernation))
            }
        return self._drawing

    def _draw(self) -> None:
        if not self.visuals:
            return
        config, texts = self.config, self._circles()
        self.post("VIEW_POLYGON", texts["out"], "outer")
        if config.inner_radius < config.outer_radius:
            self.post("VIEW_POLYGON", texts["in"], "inner")
        if (config.hibernation_radius or 0.0) > config.outer_radius:
            self.post("VIEW_POLYGON", texts["hiber"], "hiber")

    def _erase(self) -> None:
        if self.visuals:
            for which, key in (("out", "outer"), ("in", "inner"), ("hiber", "hiber")):
                self.post("VIEW_POLYGON", f"{self._circles()[which]},active=false", key)
