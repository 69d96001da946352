"""Which rule of the road applies to an encounter, from one look at it to the next (behaviors.md C7).

A state machine without a vessel: it is shown the meeting in every running iteration and keeps the mode. Angles
are degrees, distances metres; alpha is where the contact sees own ship off its bow, beta where own ship sees
the contact.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from pymoos_lite.geometry.angles import angle180, project_point
from pymoos_lite.geometry.encounter import RelativeState
from pymoos_lite.geometry.segments import turn_gap

NONE = "none"
ABAFT = (112.5, 247.5)
"""Relative bearings more than two points abaft the beam: the sector of a stern light."""
HEAD_ON = 12.0  # degrees off the bow, on both sides of both vessels
HISTORY = 5.0  # s over which the contact's turning is judged

MODE_IDS = {
    "none": 0,
    "complete": 3,
    "headon": 10,
    "giveway:stern": 20,
    "giveway:bow": 22,
    "standon:stern": 30,
    "standon:inextremis": 31,
    "standon:bow": 32,
    "standon:unsure_stern": 34,
    "standon:unsure_bow": 36,
    "standon:unsure": 38,
    "standon:neither": 39,
    "overtaking:port": 43,
    "overtaking:starboard": 47,
    "cpa": 50,
}


@dataclass(frozen=True, slots=True)
class Limits:
    """The distances that the modes depend on; `bow` is the giveway_bow_dist, negative for none."""

    outer: float
    near: float
    far: float
    bow: float = -1.0
    turn_radius: float = 0.0

    @property
    def bow_dist(self) -> float:
        """Metres ahead of the contact that are enough for crossing there."""
        return self.bow if self.bow >= 0.0 else (2.0 * self.far + self.near) / 3.0


class RuleWatch:
    """The mode of one encounter. `notes` are (variable, value) of what was found out in the last look."""

    def __init__(self) -> None:
        self.mode = NONE
        self.submode = NONE
        self.held_heading = 0.0
        self.held_speed = 0.0
        self.crossed_sides = False
        """The contact changed from own ship's port to its starboard side or back since the last look."""
        self.notes: list[tuple[str, float | str]] = []
        self._was_port: bool | None = None
        self._headings: deque[tuple[float, float]] = deque()

    @property
    def full_mode(self) -> str:
        """``mode``, or ``mode:submode`` where it has one."""
        return self.mode if self.submode == NONE else f"{self.mode}:{self.submode}"

    @property
    def mode_id(self) -> int:
        """The mode's number in logs."""
        if self.mode == "overtaking":
            return MODE_IDS["overtaking:port" if self.submode == "port" else "overtaking:starboard"]
        return MODE_IDS.get(self.full_mode, 0)

    def force(self, mode: str, submode: str) -> None:
        """Have a mode whatever the situation (for trying things out)."""
        self.mode, self.submode = mode, submode or NONE

    def look(self, m: RelativeState, limits: Limits, now: float, headon_only: bool = False) -> None:
        """Find the mode for this meeting."""
        self.notes.clear()
        self._watch_contact(m, now)
        tests: tuple[tuple[str, Callable[[RelativeState, Limits], None]], ...] = (
            ("overtaking", self._overtaking),
            ("headon", self._headon),
            ("standon_ot", self._standon_ot),
            ("giveway", self._giveway),
            ("standon", self._standon),
            ("cpa", self._cpa),
        )
        for mode, test in tests:
            if self.mode in (NONE, "cpa", mode):
                test(m, limits)
        if headon_only and self.mode not in (NONE, "headon", "cpa"):
            self._set("cpa")

    def _watch_contact(self, m: RelativeState, now: float) -> None:
        port = m.cn_port_of_os
        self.crossed_sides = self._was_port is not None and port != self._was_port
        self._was_port = port
        headings = self._headings
        headings.append((now, m.cnh))
        while now - headings[0][0] > HISTORY:
            headings.popleft()

    def _turn_rate(self) -> float:
        """The contact's turning, degrees per second, positive to starboard; 0 while that cannot be said."""
        (first, from_heading), (last, to_heading) = self._headings[0], self._headings[-1]
        return angle180(to_heading - from_heading) / (last - first) if last > first else 0.0

    def _set(self, mode: str, submode: str = NONE) -> None:
        self.mode, self.submode = mode, submode

    # --- the tests, in the order in which they are made ---------------------------------------------------

    def _overtaking(self, m: RelativeState, limits: Limits) -> None:
        if self.mode == "overtaking":
            alpha, beta = m.cn_os_rel_bng, m.os_cn_rel_bng
            if m.range >= limits.outer or m.roc < 0.0:
                self._set(NONE)
            elif alpha > 337.5 or alpha < 22.5:
                self._set("cpa")
            elif self.submode == "port" and 180.0 < beta < 355.0:
                self.submode = "starboard"
            elif self.submode == "starboard" and beta < 5.0:
                self.submode = "port"
        elif ABAFT[0] <= m.cn_os_rel_bng <= ABAFT[1] and m.os_passes_cn:
            self._set("overtaking", "starboard" if m.cn_port_of_os else "port")
        else:
            self._set(NONE)

    def _headon(self, m: RelativeState, limits: Limits) -> None:
        alpha, beta = m.cn_os_rel_bng, m.os_cn_rel_bng
        if self.mode == "headon":
            more_os, more_cn = beta - HEAD_ON, alpha - HEAD_ON
            starboards = m.os_star_of_cn and m.cn_star_of_os
            wide = more_os > 5.0 or more_cn > 5.0 or more_os + more_cn > 7.5
            if (m.range > limits.near and m.roc < 0.0) or m.os_aft_of_cn or (starboards and wide):
                self._set(NONE)
        elif m.range >= 2.0 * limits.outer:
            self.notes.append(("HEADON", "not entered due to range"))
        elif abs(angle180(alpha)) <= HEAD_ON and abs(angle180(beta)) <= HEAD_ON:
            self._set("headon")
            self.notes.append(("HEADON", "entered head-on mode"))
        else:
            self.notes.append(("HEADON", "not entered due to rel bearing"))

    def _standon_ot(self, m: RelativeState, limits: Limits) -> None:
        if self.mode == "standon_ot":
            # The overtaking vessel may change sides astern: that is no reason to forget about it.
            if m.range >= limits.outer or m.roc < 0.0:
                self._set(NONE)
                return
        elif ABAFT[0] <= m.os_cn_rel_bng <= ABAFT[1] and m.cn_passes_os and m.cpa <= limits.far:
            self._hold(m, "standon_ot")
        else:
            return
        self.submode = "port" if m.cn_port_of_os else "starboard"
        if self._in_extremis(m, limits):
            self.submode = "inextremis"

    def _giveway(self, m: RelativeState, limits: Limits) -> None:
        if self.mode == "giveway":
            if m.range >= limits.outer:
                self._set(NONE)
            elif (m.range > limits.near and m.roc < 0.0) or m.os_star_of_cn:
                self._set("cpa")
        elif m.cn_os_rel_bng >= ABAFT[1] and m.os_cn_rel_bng <= ABAFT[0]:
            self._set("giveway", self._giveway_submode(m, limits))

    def _giveway_submode(self, m: RelativeState, limits: Limits) -> str:
        lead = m.os_crosses_cn_bow_dist
        self.notes.append(("XCN_BOW_DIST", lead))
        if m.os_crosses_cn_bow:
            ahead = project_point(m.cnh, 1.0, m.cnx, m.cny)
            gap = turn_gap(m.osx, m.osy, m.osh, limits.turn_radius, m.cnx, m.cny, *ahead, right=True)
            self.notes.append(("XCN_BOW_TURN_GAP", gap))
            return "bow" if lead > limits.bow_dist or gap < limits.bow_dist else "stern"
        if m.os_crosses_cn_stern:
            return "stern"
        # On a course that never crosses the contact's: ahead of it if going its way.
        return "bow" if abs(angle180(m.osh - m.cnh)) < 90.0 and m.osv > 0.0 else "stern"

    def _standon(self, m: RelativeState, limits: Limits) -> None:
        if self.mode == "standon":
            if m.range >= limits.outer or self.crossed_sides or (m.range > limits.near and m.roc < 0.0):
                self._set(NONE)
                return
        elif (
            m.os_cn_rel_bng >= ABAFT[1]
            and m.cn_os_rel_bng <= ABAFT[0]
            and (m.cn_crosses_os_bow or m.cn_crosses_os_stern)
            and m.roc >= 0.0
        ):
            self._hold(m, "standon")
        else:
            return
        self.submode = self._standon_submode(m, limits)

    def _standon_submode(self, m: RelativeState, limits: Limits) -> str:
        """Whether the contact will pass ahead or astern, by where it would cross and how it turns."""
        if self._in_extremis(m, limits):
            return "inextremis"
        if m.os_port_of_cn:
            return "neither"
        beta, lead, turning = m.os_cn_rel_bng, m.cn_crosses_os_bow_dist, self._turn_rate()
        half = 0.5 * (limits.near + limits.far)
        # (least lead, turning below which it is the first, else the second), for sectors from the bow aft
        steps: tuple[tuple[float, float, str, str], ...]
        if beta > 350.0:
            steps = ((limits.near, 0.0, "bow", "unsure_bow"), (0.0, 0.0, "unsure_bow", "unsure"))
            rest = "unsure_stern"
        elif beta > 315.0:
            steps = (
                (half, 3.0, "bow", "unsure_bow"),
                (limits.near, 0.1, "bow", "unsure_bow"),
                (0.0, 0.0, "unsure_bow", "unsure"),
            )
            rest = "stern"
        elif beta >= 270.0:
            steps = (
                (limits.far, float("inf"), "bow", "bow"),
                (half, 0.1, "bow", "unsure_bow"),
                (0.0, 0.0, "unsure_bow", "unsure"),
            )
            rest = "stern"
        else:
            steps = ((half, 0.1, "unsure_bow", "unsure"), (0.0, float("inf"), "unsure", "unsure"))
            rest = "stern"
        for least, limit, first, second in steps:
            if lead >= least and lead > 0.0:
                return first if turning < limit else second
        return rest

    def _cpa(self, m: RelativeState, limits: Limits) -> None:
        self._set("cpa" if m.range <= limits.outer else NONE)

    def _hold(self, m: RelativeState, mode: str) -> None:
        """Stand on: keep course and speed as they are now."""
        self._set(mode)
        self.held_heading, self.held_speed = m.osh, m.osv

    @staticmethod
    def _in_extremis(m: RelativeState, limits: Limits) -> bool:
        return m.range <= limits.far and m.cpa <= limits.near
