"""Closest point of approach, and who passes or crosses whom: own ship against one contact (behaviors.md A7).

Both move in straight lines; own ship's course and speed are the candidates to be judged. Scalar questions
are plain Python; `*_grid` answers for all courses x speeds at once, as behaviours need it when they build
an objective function. Trigonometry is exact at any angle (the reference truncates to whole degrees).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoos_lite.geometry.angles import (
    angle360,
    bearing,
    unit_vector,
)

Array = NDArray[np.float64]
MISS = -1.0
_RAD = math.pi / 180.0
# Below this share of own speed toward the contact's bow-stern line the line is never reached.
_NEVER = 1e-5


def unit_vectors(headings: ArrayLike) -> tuple[Array, Array]:
    """(sin, cos) of headings in degrees, exact at multiples of 90."""
    degrees = np.asarray(headings, dtype=np.float64)
    radians = np.deg2rad(np.mod(degrees, 360.0))
    east, north = np.sin(radians), np.cos(radians)
    quarter = np.mod(degrees, 90.0) == 0.0
    if np.any(quarter):
        east = np.where(quarter, np.rint(east), east)
        north = np.where(quarter, np.rint(north), north)
    return east, north


class Aspect(NamedTuple):
    """Own ship seen from the contact: on which sides of it, and how far from its lines in metres.

    On the contact's own lines both sides hold. `gamma` is the distance from its bow-stern line, `epsilon` that
    from its beam line, `theta_gamma` the direction from own ship straight toward the bow-stern line.
    """

    fore: bool
    aft: bool
    port: bool
    star: bool
    gamma: float
    epsilon: float
    theta_gamma: float


class CpaEngine:
    """The geometry of one encounter at one instant.

    cn is the contact (position, heading in degrees, speed in m/s, negative speeds taken as 0), os is own
    ship's position. Courses are degrees, speeds m/s, horizons and times seconds, distances metres.
    """

    __slots__ = (
        "_aspect",
        "_cvx",
        "_cvy",
        "_px",
        "_py",
        "bng_cn_os",
        "bng_os_cn",
        "cnh",
        "cnv",
        "cnx",
        "cny",
        "osx",
        "osy",
        "range",
    )

    def __init__(self, cnx: float, cny: float, cnh: float, cnv: float, osx: float, osy: float) -> None:
        self.cnx, self.cny = cnx, cny
        self.cnh = angle360(cnh)
        self.cnv = max(0.0, cnv)
        self.osx, self.osy = osx, osy
        self._px, self._py = osx - cnx, osy - cny
        ux, uy = unit_vector(self.cnh)
        self._cvx, self._cvy = self.cnv * ux, self.cnv * uy
        self.range = math.hypot(self._px, self._py)
        self.bng_os_cn = bearing(osx, osy, cnx, cny)
        self.bng_cn_os = bearing(cnx, cny, osx, osy)
        self._aspect: Aspect | None = None

    @property
    def aspect(self) -> Aspect:
        """Sides, and distances to lines: worked out when first asked for.

        An engine is made for every contact of every vessel in every helm iteration, and most are only asked
        for a range and a closest approach.
        """
        if self._aspect is None:
            self._aspect = self._look()
        return self._aspect

    def _look(self) -> Aspect:
        # What is_fore, is_aft, is_port and is_star answer, from one bearing instead of four.
        ux, uy = unit_vector(self.cnh)
        if self.cnx == self.osx and self.cny == self.osy:
            fore = aft = port = star = False
        else:
            off_bow = angle360(self.bng_cn_os - self.cnh)
            fore, aft = off_bow <= 90.0 or off_bow >= 270.0, 90.0 <= off_bow <= 270.0
            port, star = off_bow >= 180.0, off_bow <= 180.0
        gamma = abs(self._px * uy - self._py * ux)
        epsilon = abs(self._px * ux + self._py * uy)
        return Aspect(fore, aft, port, star, gamma, epsilon, angle360(self.cnh + (90.0 if port else -90.0)))

    @property
    def contact_velocity(self) -> tuple[float, float]:
        """The contact's velocity, east and north, m/s."""
        return self._cvx, self._cvy

    # ------------------------------------------------------------------------- closest point of approach

    def eval_cpa(self, course: float, speed: float, horizon: float) -> float:
        """Smallest distance within the horizon when own ship takes this course and speed."""
        ux, uy = unit_vector(course)
        wx, wy = speed * ux - self._cvx, speed * uy - self._cvy
        k1 = self._px * wx + self._py * wy
        k2 = wx * wx + wy * wy
        if k1 >= 0.0 or k2 == 0.0:
            return self.range
        t = min(-k1 / k2, horizon)
        return math.hypot(self._px + t * wx, self._py + t * wy)

    def eval_time_cpa(self, course: float, speed: float) -> float:
        """Seconds until the closest point, without a horizon; 0 when the range opens or never changes."""
        ux, uy = unit_vector(course)
        wx, wy = speed * ux - self._cvx, speed * uy - self._cvy
        k1 = self._px * wx + self._py * wy
        k2 = wx * wx + wy * wy
        return -k1 / k2 if k1 < 0.0 and k2 > 0.0 else 0.0

    def eval_roc(self, course: float, speed: float) -> float:
        """Rate of closure, m/s, positive while the range shrinks."""
        return speed * math.cos((self.bng_os_cn - course) * _RAD) + self.cn_spd_in_os_pos

    @property
    def cn_spd_in_os_pos(self) -> float:
        """Part of the contact's speed that points at own ship's present position."""
        return self.cnv * math.cos((self.bng_cn_os - self.cnh) * _RAD)

    def bearing_rate(self, course: float, speed: float) -> float:
        """Change of the contact's bearing, degrees per second, positive when it draws right; 0 at range 0."""
        if self.range == 0.0:
            return 0.0
        tangent = self.bng_os_cn + 90.0
        own = speed * math.cos((course - tangent) * _RAD)
        other = self.cnv * math.cos((self.cnh - tangent) * _RAD)
        return (other - own) * 360.0 / (2.0 * math.pi * self.range)

    def min_max_roc(self, speed: float, count: int = 360) -> tuple[float, float]:
        """Least and greatest rate of closure at this speed over `count` headings evenly around from north."""
        headings = np.arange(count) * (360.0 / count)
        closing = speed * np.cos((self.bng_os_cn - headings) * _RAD) + self.cn_spd_in_os_pos
        return float(closing.min()), float(closing.max())

    # ------------------------------------------------------------- passing: crossing the contact's beam line

    @property
    def os_on_beam(self) -> bool:
        """True when own ship is exactly on the contact's beam line."""
        return self.aspect.fore and self.aspect.aft

    def _beam_closing(self, course: float, speed: float) -> float:
        along = speed * math.cos((course - self.cnh) * _RAD) - self.cnv
        return along if self.aspect.aft else -along

    def passes(self, course: float, speed: float) -> bool:
        """True when own ship will cross (or is on) the contact's beam line."""
        return self.os_on_beam or self._beam_closing(course, speed) > 0.0

    def passes_port(self, course: float, speed: float) -> bool:
        """True when it passes with the contact's port side toward it."""
        if not self.passes(course, speed):
            return False
        if self.os_on_beam:
            return self.aspect.port
        rate = self.bearing_rate(course, speed)
        return rate > 0.0 if self.aspect.aft else rate < 0.0

    def passes_star(self, course: float, speed: float) -> bool:
        """True when it passes, and not on the contact's port side."""
        return self.passes(course, speed) and not self.passes_port(course, speed)

    def _drift_to_line(self, course: float, speed: float) -> float | None:
        """Metres made toward the bow-stern line by the time of passing; None when it never passes."""
        if not self.passes(course, speed):
            return None
        if self.os_on_beam:
            return 0.0
        t = self.aspect.epsilon / self._beam_closing(course, speed)
        return t * speed * math.cos((course - self.aspect.theta_gamma) * _RAD)

    def passes_port_dist(self, course: float, speed: float) -> float:
        """Distance abeam at which it passes to port of the contact; -1 when it does not."""
        drift = self._drift_to_line(course, speed)
        if drift is None:
            return MISS
        if self.aspect.port:
            return self.aspect.gamma - drift if drift <= self.aspect.gamma else MISS
        return drift - self.aspect.gamma if drift > self.aspect.gamma else MISS

    def passes_star_dist(self, course: float, speed: float) -> float:
        """Distance abeam at which it passes to starboard of the contact; -1 when it does not."""
        drift = self._drift_to_line(course, speed)
        if drift is None:
            return MISS
        if not self.aspect.port:
            return self.aspect.gamma - drift if drift <= self.aspect.gamma else MISS
        return drift - self.aspect.gamma if drift > self.aspect.gamma else MISS

    # -------------------------------------------------------- crossing: crossing the contact's bow-stern line

    @property
    def os_on_bow_line(self) -> bool:
        """True exactly ahead of the contact."""
        return self.aspect.gamma == 0.0 and self.range > 0.0 and self.aspect.fore

    @property
    def os_on_stern_line(self) -> bool:
        """True exactly astern of the contact."""
        return self.aspect.gamma == 0.0 and self.range > 0.0 and not self.aspect.fore

    def crosses_bow_or_stern(self, course: float, speed: float) -> bool:
        """True when own ship will cross (or is on) the line through the contact's bow and stern."""
        if self.aspect.gamma == 0.0:
            return True
        return speed > 0.0 and math.cos((course - self.aspect.theta_gamma) * _RAD) > _NEVER

    def _lead_on_line(self, course: float, speed: float) -> float | None:
        """Where it crosses the contact's line: metres ahead of it (negative astern), None if never."""
        if self.aspect.gamma == 0.0:
            return self.aspect.epsilon if self.aspect.fore else -self.aspect.epsilon
        toward = speed * math.cos((course - self.aspect.theta_gamma) * _RAD)
        if not toward > 0.0:
            return None
        t = self.aspect.gamma / toward
        gained = t * (speed * math.cos((course - self.cnh) * _RAD) - self.cnv)
        return gained + (self.aspect.epsilon if self.aspect.fore else -self.aspect.epsilon)

    def crosses_bow_dist(self, course: float, speed: float) -> float:
        """Distance ahead of the contact at which it crosses; -1 when it does not cross there."""
        lead = self._lead_on_line(course, speed)
        return lead if lead is not None and lead >= 0.0 and not self.os_on_stern_line else MISS

    def crosses_stern_dist(self, course: float, speed: float) -> float:
        """Distance astern of the contact at which it crosses; -1 when it does not cross there."""
        lead = self._lead_on_line(course, speed)
        return -lead if lead is not None and lead <= 0.0 else MISS

    def crosses_bow(self, course: float, speed: float) -> bool:
        """True when it crosses ahead of the contact."""
        if not self.crosses_bow_or_stern(course, speed):
            return False
        if self.aspect.gamma == 0.0:
            return self.os_on_bow_line
        rate = self.bearing_rate(course, speed)
        return rate >= 0.0 if self.aspect.port else rate <= 0.0

    def crosses_stern(self, course: float, speed: float) -> bool:
        """True when it crosses astern of the contact."""
        if not self.crosses_bow_or_stern(course, speed):
            return False
        if self.aspect.gamma == 0.0:
            return self.os_on_stern_line
        rate = self.bearing_rate(course, speed)
        return rate <= 0.0 if self.aspect.port else rate >= 0.0

    # ------------------------------------------------------------------------------- whole grids at once

    def cpa_grid(self, courses: ArrayLike, speeds: ArrayLike, horizon: float) -> Array:
        """`eval_cpa` for every course and speed: shape (courses, speeds)."""
        from pymoos_lite.geometry import _kernels

        east, north = unit_vectors(courses)
        v = np.ascontiguousarray(speeds, dtype=np.float64)
        out = np.empty((east.size, v.size))
        _kernels.cpa_grid(self._px, self._py, self._cvx, self._cvy, east, north, v, float(horizon), out)
        return out

    def cpa_points(self, courses: ArrayLike, speeds: ArrayLike, horizon: float) -> Array:
        """`eval_cpa` at scattered points: courses and speeds of one length, as is the answer."""
        from pymoos_lite.geometry import _kernels

        east, north = unit_vectors(courses)
        v = np.ascontiguousarray(speeds, dtype=np.float64)
        out = np.empty(east.size)
        _kernels.cpa_points(self._px, self._py, self._cvx, self._cvy, east, north, v, float(horizon), out)
        return out

    def roc_grid(self, courses: ArrayLike, speeds: ArrayLike) -> Array:
        """`eval_roc` for every course and speed: shape (courses, speeds)."""
        return self._outer_cos(courses, speeds, self.bng_os_cn) + self.cn_spd_in_os_pos

    def bearing_rate_grid(self, courses: ArrayLike, speeds: ArrayLike) -> Array:
        """`bearing_rate` for every course and speed: shape (courses, speeds)."""
        tangent = self.bng_os_cn + 90.0
        own = self._outer_cos(courses, speeds, tangent)
        if self.range == 0.0:
            return np.zeros_like(own)
        other = self.cnv * math.cos((self.cnh - tangent) * _RAD)
        return (other - own) * (360.0 / (2.0 * math.pi * self.range))

    def passes_grid(self, courses: ArrayLike, speeds: ArrayLike) -> NDArray[np.bool_]:
        """`passes` for every course and speed: shape (courses, speeds)."""
        return (
            self._beam_closing_grid(courses, speeds) > 0.0
            if not self.os_on_beam
            else self._all(courses, speeds)
        )

    def passes_port_grid(self, courses: ArrayLike, speeds: ArrayLike) -> NDArray[np.bool_]:
        """`passes_port` for every course and speed: shape (courses, speeds)."""
        if self.os_on_beam:
            return self._all(courses, speeds, self.aspect.port)
        rate = self.bearing_rate_grid(courses, speeds)
        return self.passes_grid(courses, speeds) & (rate > 0.0 if self.aspect.aft else rate < 0.0)

    def passes_star_grid(self, courses: ArrayLike, speeds: ArrayLike) -> NDArray[np.bool_]:
        """`passes_star` for every course and speed: shape (courses, speeds)."""
        return self.passes_grid(courses, speeds) & ~self.passes_port_grid(courses, speeds)

    def passes_port_dist_grid(self, courses: ArrayLike, speeds: ArrayLike) -> Array:
        """`passes_port_dist` for every course and speed: shape (courses, speeds)."""
        return self._passing_dist_grid(courses, speeds, same_side=self.aspect.port)

    def passes_star_dist_grid(self, courses: ArrayLike, speeds: ArrayLike) -> Array:
        """`passes_star_dist` for every course and speed: shape (courses, speeds)."""
        return self._passing_dist_grid(courses, speeds, same_side=not self.aspect.port)

    def crosses_bow_or_stern_grid(self, courses: ArrayLike, speeds: ArrayLike) -> NDArray[np.bool_]:
        """`crosses_bow_or_stern` for every course and speed: shape (courses, speeds)."""
        if self.aspect.gamma == 0.0:
            return self._all(courses, speeds)
        headed = np.cos((np.asarray(courses, dtype=np.float64) - self.aspect.theta_gamma) * _RAD) > _NEVER
        return np.logical_and.outer(headed, np.asarray(speeds, dtype=np.float64) > 0.0)

    def crosses_bow_grid(self, courses: ArrayLike, speeds: ArrayLike) -> NDArray[np.bool_]:
        """`crosses_bow` for every course and speed: shape (courses, speeds)."""
        if self.aspect.gamma == 0.0:
            return self._all(courses, speeds, self.os_on_bow_line)
        rate = self.bearing_rate_grid(courses, speeds)
        ahead = rate >= 0.0 if self.aspect.port else rate <= 0.0
        return self.crosses_bow_or_stern_grid(courses, speeds) & ahead

    def crosses_stern_grid(self, courses: ArrayLike, speeds: ArrayLike) -> NDArray[np.bool_]:
        """`crosses_stern` for every course and speed: shape (courses, speeds)."""
        if self.aspect.gamma == 0.0:
            return self._all(courses, speeds, self.os_on_stern_line)
        rate = self.bearing_rate_grid(courses, speeds)
        astern = rate <= 0.0 if self.aspect.port else rate >= 0.0
        return self.crosses_bow_or_stern_grid(courses, speeds) & astern

    def _outer_cos(self, courses: ArrayLike, speeds: ArrayLike, heading: float) -> Array:
        cosines = np.cos((np.asarray(courses, dtype=np.float64) - heading) * _RAD)
        return np.multiply.outer(cosines, np.asarray(speeds, dtype=np.float64))

    def _beam_closing_grid(self, courses: ArrayLike, speeds: ArrayLike) -> Array:
        along = self._outer_cos(courses, speeds, self.cnh) - self.cnv
        return along if self.aspect.aft else -along

    def _passing_dist_grid(self, courses: ArrayLike, speeds: ArrayLike, *, same_side: bool) -> Array:
        if self.os_on_beam:
            drift = np.zeros((np.size(courses), np.size(speeds)))
            passing = self._all(courses, speeds)
        else:
            closing = self._beam_closing_grid(courses, speeds)
            passing = closing > 0.0
            t = self.aspect.epsilon / np.where(passing, closing, 1.0)
            drift = t * self._outer_cos(courses, speeds, self.aspect.theta_gamma)
        stays = drift <= self.aspect.gamma
        here = passing & (stays if same_side else ~stays)
        return np.where(here, np.abs(self.aspect.gamma - drift), MISS)

    @staticmethod
    def _all(courses: ArrayLike, speeds: ArrayLike, value: bool = True) -> NDArray[np.bool_]:
        return np.full((np.size(courses), np.size(speeds)), value)


def cpa_of(own: Sequence[float], contact: Sequence[float], horizon: float) -> float:
    """CPA distance of two vessels given as (x, y, heading, speed) that hold their courses for the horizon."""
    engine = CpaEngine(*contact[:4], *own[:2])
    return engine.eval_cpa(own[2], own[3], horizon)
