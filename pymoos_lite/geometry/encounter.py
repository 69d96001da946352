"""Two vessels seen from each other, and what changes between them from one look to the next.

`RelativeState` answers, for one instant, everything that contact behaviours ask, name in flags or print in
macros; `EncounterHistory` keeps the last few and says when a tagged contact flag is due (behaviors.md B4).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise

from mypy_extensions import mypyc_attr

from pymoos_lite.compiled.once import once
from pymoos_lite.geometry.angles import angle360, is_aft, is_fore, is_port, is_star
from pymoos_lite.geometry.cpa import CpaEngine
from pymoos_lite.geometry.formats import SpecError, shown
from pymoos_lite.geometry.text import parse_number

CPA_HORIZON = 120.0
DEPTH = 5


@mypyc_attr(native_class=False)
@dataclass(frozen=True, init=False)
class RelativeState:
    """Own ship (os) and a contact (cn) at one instant: positions, headings in degrees, speeds in m/s.

    Most of what is derived is computed when first asked for. "passes" is about the other's beam line, "crosses"
    about the line through its bow and stern, both as behaviors.md A7 defines them, for the present
    courses and speeds.
    """

    osx: float
    osy: float
    osh: float
    osv: float
    cnx: float
    cny: float
    cnh: float
    cnv: float
    engine: CpaEngine = field(init=False, repr=False, compare=False)
    """The encounter with the contact as contact."""
    range: float = field(init=False, repr=False, compare=False)
    """Distance between the two, metres."""

    def __init__(
        self,
        osx: float,
        osy: float,
        osh: float,
        osv: float,
        cnx: float,
        cny: float,
        cnh: float,
        cnv: float,
    ) -> None:
        # By its dictionary: one for every contact of every vessel in every helm iteration.
        engine = CpaEngine(cnx, cny, cnh, cnv, osx, osy)
        self.__dict__.update(
            osx=osx,
            osy=osy,
            osh=osh,
            osv=osv,
            cnx=cnx,
            cny=cny,
            cnh=cnh,
            cnv=cnv,
            engine=engine,
            range=engine.range,
        )

    @once
    def mirror(self) -> CpaEngine:
        """The encounter as the contact sees it: own ship as its contact."""
        return CpaEngine(self.osx, self.osy, self.osh, self.osv, self.cnx, self.cny)

    @property
    def os_cn_rel_bng(self) -> float:
        """Where own ship sees the contact, degrees off its bow, [0, 360): beta."""
        return angle360(self.engine.bng_os_cn - self.osh)

    @property
    def cn_os_rel_bng(self) -> float:
        """Where the contact sees own ship, degrees off its bow, [0, 360): alpha."""
        return angle360(self.engine.bng_cn_os - self.cnh)

    @property
    def roc(self) -> float:
        """Rate of closure, m/s, positive while closing."""
        return self.engine.eval_roc(self.osh, self.osv)

    @property
    def bng_rate(self) -> float:
        """Rate of the contact's bearing, degrees per second, positive when it draws right."""
        return self.engine.bearing_rate(self.osh, self.osv)

    @once
    def cpa(self) -> float:
        """Closest point of approach within CPA_HORIZON seconds at the present courses and speeds."""
        return self.engine.eval_cpa(self.osh, self.osv, CPA_HORIZON)

    @property
    def cn_spd_in_os_pos(self) -> float:
        """Part of the contact's speed toward own ship's position, m/s."""
        return self.engine.cn_spd_in_os_pos

    @property
    def os_fore_of_cn(self) -> bool:
        """Own ship is ahead of the contact's beam line, or on it."""
        return self.engine.aspect.fore

    @property
    def os_aft_of_cn(self) -> bool:
        """Own ship is behind the contact's beam line, or on it."""
        return self.engine.aspect.aft

    @property
    def os_port_of_cn(self) -> bool:
        """Own ship is to port of the contact."""
        return self.engine.aspect.port

    @property
    def os_star_of_cn(self) -> bool:
        """Own ship is to starboard of the contact."""
        return self.engine.aspect.star

    @property
    def cn_fore_of_os(self) -> bool:
        """The contact is ahead of own ship's beam line, or on it."""
        return is_fore(self.osx, self.osy, self.osh, self.cnx, self.cny)

    @property
    def cn_aft_of_os(self) -> bool:
        """The contact is behind own ship's beam line, or on it."""
        return is_aft(self.osx, self.osy, self.osh, self.cnx, self.cny)

    @property
    def cn_port_of_os(self) -> bool:
        """The contact is to port of own ship."""
        return is_port(self.osx, self.osy, self.osh, self.cnx, self.cny)

    @property
    def cn_star_of_os(self) -> bool:
        """The contact is to starboard of own ship."""
        return is_star(self.osx, self.osy, self.osh, self.cnx, self.cny)

    @property
    def os_passes_cn(self) -> bool:
        """Own ship will cross the contact's beam line."""
        return self.engine.passes(self.osh, self.osv)

    @property
    def os_passes_cn_port(self) -> bool:
        """Own ship will cross the contact's beam line on its port side."""
        return self.engine.passes_port(self.osh, self.osv)

    @property
    def os_passes_cn_star(self) -> bool:
        """Own ship will cross the contact's beam line on its starboard side."""
        return self.engine.passes_star(self.osh, self.osv)

    @property
    def os_crosses_cn_bow(self) -> bool:
        """Own ship will cross ahead of the contact."""
        return self.engine.crosses_bow(self.osh, self.osv)

    @property
    def os_crosses_cn_stern(self) -> bool:
        """Own ship will cross astern of the contact."""
        return self.engine.crosses_stern(self.osh, self.osv)

    @property
    def os_crosses_cn_bow_dist(self) -> float:
        """Metres ahead of the contact at which own ship crosses; -1 when it does not."""
        return self.engine.crosses_bow_dist(self.osh, self.osv)

    @property
    def cn_passes_os(self) -> bool:
        """The contact will cross own ship's beam line."""
        return self.mirror.passes(self.cnh, self.cnv)

    @property
    def cn_passes_os_port(self) -> bool:
        """The contact will cross own ship's beam line on its port side."""
        return self.mirror.passes_port(self.cnh, self.cnv)

    @property
    def cn_passes_os_star(self) -> bool:
        """The contact will cross own ship's beam line on its starboard side."""
        return self.mirror.passes_star(self.cnh, self.cnv)

    @property
    def cn_crosses_os_bow(self) -> bool:
        """The contact will cross ahead of own ship."""
        return self.mirror.crosses_bow(self.cnh, self.cnv)

    @property
    def cn_crosses_os_stern(self) -> bool:
        """The contact will cross astern of own ship."""
        return self.mirror.crosses_stern(self.cnh, self.cnv)

    @property
    def cn_crosses_os_bow_dist(self) -> float:
        """Metres ahead of own ship at which the contact crosses; -1 when it does not."""
        return self.mirror.crosses_bow_dist(self.cnh, self.cnv)


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class ContactTag:
    """When a contact flag is due: a range limit (`<30`, `@>50`) or an event (`@cpa`, `@os_passed_cn_port`).

    `kind` is `<`, `>`, `@<`, `@>` with its `range`, or the event's name without the `@`.
    """

    kind: str
    range: float = 0.0

    @classmethod
    def parse(cls, text: str) -> ContactTag:
        """Tag from text; raises SpecError for an unknown event or a range that is no number of at least 0."""
        word = "".join(text.lower().split())
        for kind in ("@<", "@>", "<", ">"):
            if word.startswith(kind):
                limit = parse_number(word[len(kind) :])
                if limit is None or limit < 0.0:
                    raise SpecError(f"contact flag tag '{shown(text)}' needs a range of at least 0")
                return cls(kind, limit)
        if word.startswith("@") and word[1:] in EVENTS:
            return cls(word[1:])
        known = ", ".join(f"@{event}" for event in EVENTS)
        raise SpecError(f"unknown contact flag tag '{shown(text)}', expected <R, >R, @<R, @>R, {known}")

    def to_text(self) -> str:
        """The tag as it is written."""
        if self.kind in ("<", ">", "@<", "@>"):
            return f"{self.kind}{self.range:g}"
        return f"@{self.kind}"

    def __str__(self) -> str:
        return self.to_text()


EVENTS = (
    "cpa",
    "os_passed_cn",
    "os_passed_cn_port",
    "os_passed_cn_star",
    "cn_passed_os",
    "cn_passed_os_port",
    "cn_passed_os_star",
    "os_crossed_cn",
    "os_crossed_cn_bow",
    "os_crossed_cn_stern",
    "cn_crossed_os",
    "cn_crossed_os_bow",
    "cn_crossed_os_stern",
)


class EncounterHistory:
    """The last few states of one encounter, newest last.

    `threshold` is by how many metres the range must open again before the closest point counts as reached.
    """

    __slots__ = ("_at_cpa", "_least", "_states", "threshold")

    def __init__(self, threshold: float = 0.1) -> None:
        self.threshold = threshold
        self._states: deque[RelativeState] = deque(maxlen=DEPTH)
        self._least: float | None = None
        self._at_cpa = False

    def add(self, state: RelativeState) -> None:
        """Look at the encounter anew."""
        self._states.append(state)
        self._at_cpa = False
        now = state.range
        if self._least is not None:
            # Closing: the least range so far stands until the range has opened by the threshold, however
            # many looks that takes. (The reference wants it to open that far from one look to the next.)
            self._least = min(self._least, now)
            if now >= self._least + self.threshold:
                self._at_cpa = True
                self._least = None
        elif len(self._states) == DEPTH:
            ranges = [s.range for s in self._states]
            if now < ranges[0] and all(b <= a for a, b in pairwise(ranges)):
                self._least = now

    def clear(self) -> None:
        """Forget everything: the next state is the first."""
        self._states.clear()
        self._least = None
        self._at_cpa = False

    @property
    def now(self) -> RelativeState | None:
        """The newest state."""
        return self._states[-1] if self._states else None

    @property
    def before(self) -> RelativeState | None:
        """The state before the newest."""
        return self._states[-2] if len(self._states) > 1 else None

    def due(self, tag: ContactTag) -> bool:
        """True when a flag with this tag is to be posted for the newest state.

        Range limits without `@` are due every time; everything else is a change since the state before,
        so that nothing is due on the first.
        """
        now, before = self.now, self.before
        if now is None:
            return False
        if tag.kind == "<":
            return now.range <= tag.range
        if tag.kind == ">":
            return now.range >= tag.range
        if before is None:
            return False
        if tag.kind == "@<":
            return now.range <= tag.range < before.range
        if tag.kind == "@>":
            return now.range >= tag.range > before.range
        return tag.kind in self.events()

    def due_tags(self, tags: Iterable[ContactTag]) -> list[ContactTag]:
        """The tags that are due, in the order given."""
        return [tag for tag in tags if self.due(tag)]

    def events(self) -> frozenset[str]:
        """Names (see EVENTS) of everything that happened between the state before and the newest.

        A vessel has passed the other when it changed from fore to aft of it or back, and crossed it when
        it changed sides; the suffix says where it then is.
        """
        now, before = self.now, self.before
        if now is None or before is None:
            return frozenset()
        found: set[str] = set()
        port_star, bow_stern = ("_star", "_port"), ("_stern", "_bow")
        if now.os_fore_of_cn != before.os_fore_of_cn:
            found.update(("os_passed_cn", "os_passed_cn" + port_star[now.os_port_of_cn]))
        if now.cn_fore_of_os != before.cn_fore_of_os:
            found.update(("cn_passed_os", "cn_passed_os" + port_star[now.cn_port_of_os]))
        if now.os_port_of_cn != before.os_port_of_cn:
            found.update(("os_crossed_cn", "os_crossed_cn" + bow_stern[now.os_fore_of_cn]))
        if now.cn_port_of_os != before.cn_port_of_os:
            found.update(("cn_crossed_os", "cn_crossed_os" + bow_stern[now.cn_fore_of_os]))
        if self._at_cpa:
            found.add("cpa")
        return frozenset(found)


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class BearingLine:
    """`bearing_line_config`: the colour of the line drawn to a contact, by its relevance or range.

    `steps` are (threshold, colour) in ascending order.
    """

    steps: tuple[tuple[float, str], ...] = ()
    by_range: bool = False

    @classmethod
    def parse(cls, text: str) -> BearingLine:
        """From `white:0, green:0.65, yellow:0.8, red:1.0[, info:range|relevance]`; else SpecError."""
        steps: list[tuple[float, str]] = []
        by_range = False
        for piece in text.split(","):
            if not piece.strip():
                continue
            color, _, value = (part.strip() for part in piece.rpartition(":"))
            if color.lower() == "info":
                if value.lower() not in ("range", "relevance"):
                    raise SpecError(f"bearing line info must be range or relevance, found '{shown(value)}'")
                by_range = value.lower() == "range"
                continue
            threshold = parse_number(value)
            if not color or threshold is None:
                raise SpecError(f"expected color:threshold in a bearing line, found '{shown(piece)}'")
            steps.append((threshold, color))
        return cls(tuple(sorted(steps)), by_range)

    def color(self, relevance: float, range_: float) -> str:
        """Colour of the first step whose threshold is not below the value, `blank` beyond the last."""
        value = range_ if self.by_range else relevance
        for threshold, color in self.steps:
            if threshold >= value:
                return color
        return "blank"
