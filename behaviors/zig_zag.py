"""BHV_ZigZag: swing to and fro about a stem heading (behaviors.md C16)."""

from __future__ import annotations

from behaviors import forms
from behaviors.odometers import Odometers
from behaviors.steering import speed_band, toward
from ivp_helm.behavior import Behavior, BehaviorError
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter, parse_number
from pymoos_lite.geometry.angles import angle360, angle_diff, project_point, unit_vector
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.segments import dist_to_line
from pymoos_lite.geometry.shapes import XY, SegList
from pymoos_lite.geometry.specs import seglist_text

SIDES = {"port": "port", "left": "port", "star": "star", "starboard": "star", "right": "star"}
STALE = 5.0
"""Seconds after which position, heading or speed are not to be relied upon."""
FULL_SWING = 170.0
"""Degrees within which a heading still counts as lying ahead on the turning side."""
LINE = 20.0


def _side(text: str) -> str:
    side = SIDES.get(text.strip().lower())
    if side is None:
        raise ValueError(f"expected one of {', '.join(SIDES)}")
    return side


def _mod_speed(text: str) -> float | None:
    """None for ``reset``."""
    return None if text.strip().lower() == "reset" else parse_number(text.strip())


def _angle(name: str, default: float | None, doc: str, *aliases: str) -> Parameter:
    def read(text: str) -> float:
        value = parse_number(text.strip())
        if not 1.0 <= value <= 75.0:
            raise ValueError("give degrees from 1 to 75")
        return value

    return forms.custom(name, read, default, doc, "30", aliases=aliases, unit="deg")


class ZigZag(Behavior):
    """Turns to either side of a stem heading in turn; a leg ends when its heading is reached."""

    BHV_NAME = "BHV_ZigZag"
    DEFAULT_NAME = "bhv_zigzag"
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")
    PARAMETERS = Declaration(
        (
            forms.number("speed", 0.0, "m/s", "Speed to go at."),
            forms.custom(
                "mod_speed", _mod_speed, None, "Add so much to the speed, or reset it.", "0.2", unit="m/s"
            ),
            Parameter(
                "speed_on_active",
                "boolean",
                False,
                "",
                "Keep the speed of the moment it begins to run.",
                aliases=("spd_on_active",),
            ),
            forms.number("stem_hdg", 0.0, "deg", "The heading to swing about.", low=None),
            Parameter("stem_on_active", "boolean", False, "", "Swing about the heading it begins with."),
            _angle("zig_angle", 0.0, "Swing so far to either side."),
            _angle(
                "zig_angle_fierce",
                None,
                "When fierce, ask for a heading so far ahead of the present one.",
                "delta_heading",
            ),
            Parameter(
                "fierce_zigging", "boolean", False, "", "Ask for a constant turn, not for the leg's heading."
            ),
            forms.number("hdg_thresh", 0.0, "deg", "A heading is reached within this."),
            forms.custom("zig_first", _side, "port", "The side of the first leg.", "port"),
            Parameter("max_zig_legs", "integer", 2, "", "Complete after so many legs.", low=0),
            Parameter("max_zig_zags", "integer", None, "", "Complete after so many pairs of legs.", low=0),
            forms.custom(
                "max_stem_odo",
                forms.read_off_or(lambda value: value >= 0.0, "metres of at least 0"),
                None,
                "Complete after coming so far along the stem.",
                "off",
                unit="m",
            ),
            forms.flag("zigflag", "Posted at the end of each leg."),
            forms.flag("zagflag", "Posted at the end of every second leg."),
            forms.flag("portflag", "Posted when a leg to port begins."),
            forms.flag("starflag", "Posted when a leg to starboard begins."),
            forms.flag("portflagx", "Posted when a leg to port ends."),
            forms.flag("starflagx", "Posted when a leg to starboard ends."),
            Parameter("draw_set_hdg", "boolean", True, "", "Draw the leg's heading."),
            Parameter("draw_req_hdg", "boolean", True, "", "Draw the heading asked for."),
            forms.hint_lines("draw_req_hdg=false,set_hdg_color=green"),
        )
    )

    def setup(self) -> None:
        self._colors = {"set": "white", "req": "yellow"}
        self._base_speed = 0.0
        self._odometers = Odometers("all", "zig", "zag")
        self._origin: XY = (0.0, 0.0)
        self._stem = 0.0
        self._side: str | None = None
        """The side of the present leg, None on the stem."""
        self._set = 0.0
        self._legs = 0
        self._legs_ever = 0
        self._zags_ever = 0
        self._start_speed = 0.0
        self._least_speed = 0.0

    # --- parameters ---------------------------------------------------------------------------------------

    def set_speed(self, speed: float) -> None:
        self._base_speed = vars(self.config)["speed"] = min(speed, self.max_speed)

    def set_mod_speed(self, change: float | None) -> None:
        speed = self._base_speed if change is None else self.config.speed + change
        vars(self.config)["speed"] = min(max(speed, 0.0), self.max_speed)

    def set_stem_hdg(self, heading: float) -> None:
        vars(self.config)["stem_hdg"] = angle360(heading)

    def set_max_zig_zags(self, pairs: int) -> None:
        vars(self.config).update(max_zig_zags=pairs, max_zig_legs=2 * pairs)

    def set_visual_hints(self, text: str) -> None:
        for key, value in forms.hint_pairs(text):
            if key in ("draw_set_hdg", "draw_req_hdg"):
                self.set_parameter(key, value)
            elif key in ("set_hdg_color", "req_hdg_color"):
                self._colors[key[:3]] = forms.read_color(value)
            else:
                raise ValueError(
                    f"'{key}' is none of draw_set_hdg, draw_req_hdg, set_hdg_color, req_hdg_color"
                )

    # --- states -------------------------------------------------------------------------------------------

    def on_idle_to_run(self) -> None:
        self._begin()

    def _begin(self) -> None:
        own, config = self.own, self.config
        if config.stem_on_active:
            vars(config)["stem_hdg"] = own.heading
        if config.speed_on_active:
            vars(config)["speed"] = min(own.speed, self.max_speed)
        self._origin, self._stem = (own.x, own.y), config.stem_hdg
        self._side = None
        self._legs = 0
        self._odometers.restart(own.x, own.y)

    def on_run(self) -> IvPFunction | None:
        self._require_fresh()
        own, config = self.own, self.config
        self._odometers.move(own.x, own.y)
        self._least_speed = min(self._least_speed, own.speed)
        if self._side is None:
            self._start_leg(config.zig_first)
        elif self._leg_done():
            self._end_leg()
        if self._legs >= config.max_zig_legs or self._stem_done():
            self.complete(f"{self._legs} legs")
            self._begin()
            return None
        asked = self._heading_asked()
        self._draw(asked)
        self.why = (
            f"leg {self._legs + 1} of {config.max_zig_legs}, to {self._side}, for heading {self._set:.0f}"
        )
        return toward(self.domain, asked, speed_band(self.domain, config.speed, 85.0, 20.0))

    def _require_fresh(self) -> None:
        for variable in self.INFO:
            age = self.buffer.age(variable)
            if age is None or age > STALE:
                raise BehaviorError(f"{variable} not found or stale.")

    # --- legs ---------------------------------------------------------------------------------------------

    def _start_leg(self, side: str) -> None:
        own = self.own
        self._side = side
        turn = -self.config.zig_angle if side == "port" else self.config.zig_angle
        self._set = angle360(self._stem + turn)
        self._odometers.reset("zig")
        self._start_speed = self._least_speed = own.speed
        self.post_flags(self.config.portflag if side == "port" else self.config.starflag)

    def _leg_done(self) -> bool:
        heading = self.own.heading
        if angle_diff(heading, self._set) < self.config.hdg_thresh:
            return True
        left = angle360(heading - self._set) if self._side == "port" else angle360(self._set - heading)
        return not 0.0 < left < FULL_SWING

    def _end_leg(self) -> None:
        config, side = self.config, self._side
        self._legs += 1
        self._legs_ever += 1
        self.post_flags(config.zigflag)
        if self._legs % 2 == 0:
            self._zags_ever += 1
            self.post_flags(config.zagflag)
            self._odometers.reset("zag")
        self.post_flags(config.portflagx if side == "port" else config.starflagx)
        self._start_leg("star" if side == "port" else "port")

    def _stem_done(self) -> bool:
        limit = self.config.max_stem_odo
        return limit is not None and self._along_stem() >= limit

    def _along_stem(self) -> float:
        own, (ux, uy) = self.surroundings.own, unit_vector(self._stem)
        return 0.0 if own is None else (own.x - self._origin[0]) * ux + (own.y - self._origin[1]) * uy

    def _heading_asked(self) -> float:
        config = self.config
        if not config.fierce_zigging:
            return self._set
        ahead = config.zig_angle if config.zig_angle_fierce is None else config.zig_angle_fierce
        return angle360(self.own.heading + (-ahead if self._side == "port" else ahead))

    # --- words for flags ----------------------------------------------------------------------------------

    def macro(self, name: str) -> float | str | None:
        config, odometers = self.config, self._odometers
        own = self.surroundings.own
        x, y = (own.x, own.y) if own is not None else self._origin
        ahead = project_point(self._stem, 1.0, *self._origin)
        values: dict[str, float | str] = {
            "ODO": odometers["all"],
            "ZIG_ODO": odometers["zig"],
            "ZAG_ODO": odometers["zag"],
            "STEM_DIST": dist_to_line(*self._origin, *ahead, x, y),
            "STEM_ODO": self._along_stem(),
            "ZIGS": float(self._legs),
            "ZAGS": float(self._legs // 2),
            "ZIGS_EVER": float(self._legs_ever),
            "ZAGS_EVER": float(self._zags_ever),
            "STEM_HDG": self._stem,
            "STEM_SPD": config.speed,
            "ZIG_START_SPD": self._start_speed,
            "ZIG_MIN_SPD": self._least_speed,
            "ZIG_SPD_DELTA": self._start_speed - self._least_speed,
            "ZIGS_TOGO": float(max(0, config.max_zig_legs - self._legs)),
            "ZAGS_TOGO": float(max(0, config.max_zig_legs // 2 - self._legs // 2)),
            "ZIG_PORT": "true" if self._side == "port" else "false",
            "ZIG_STAR": "true" if self._side == "star" else "false",
            "ZIG_SIDE": self._side or "stem",
        }
        return values.get(name)

    # --- drawing ------------------------------------------------------------------------------------------

    def _draw(self, asked: float) -> None:
        if not self.visuals:
            return
        own = self.own
        for which, heading, wanted in (
            ("set", self._set, self.config.draw_set_hdg),
            ("req", asked, self.config.draw_req_hdg),
        ):
            if wanted:
                looks = Attributes(
                    label=f"zig_{which}_{self.community}",
                    label_color="invisible",
                    edge_color=self._colors[which],
                    vertex_color=self._colors[which],
                    duration=5.0,
                    vertex_size=2.0,
                    edge_size=1.0,
                )
                line = ((own.x, own.y), project_point(heading, LINE, own.x, own.y))
                self.post("VIEW_SEGLIST", seglist_text(SegList(line, attributes=looks), 1))
