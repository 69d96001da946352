"""One vessel's mission control: what it knows, what it wants, where it samples, where it migrates (gcid.md 12).

A core without I/O: news go in by the methods, `step` gives what to post. The three inputs drive the
opinion manager; the opinion that wins comes back as OPTION and switches the helm's behaviours. Angles are
degrees, positions metres, times mission seconds.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from math import cos, hypot, inf, radians, sin

from mypy_extensions import mypyc_attr

from missions.bloom.allocation import METHODS
from missions.bloom.inputs import Battery, InputSettings, exploit_input, explore_input, migrate_input
from pymoos_lite.core.message import Value
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY, Point
from pymoos_lite.geometry.specs import erase_point_text, parse_point, point_text, seglist_text

GROWN = 0.05
"""Zones count as this much larger when it comes to who is in them."""
ORDER_PERIOD = 2.0
"""Seconds after which an update for a behaviour is posted again."""
OTHER_ZONE_LABELS = ("one", "two")
SAMPLE_AROUND = (
    ("cent", 0.0, 0.0),
    ("north", 0.0, 1.0),
    ("east", 1.0, 0.0),
    ("south", 0.0, -1.0),
    ("west", -1.0, 0.0),
)


@mypyc_attr(native_class=False)
@dataclass(frozen=True)
class ControlSettings:
    """Metres and seconds. `standby` is where to wait for sample points, relative to a zone's centroid."""

    zones: tuple[Polygon, Polygon]
    inputs: InputSettings = field(default_factory=InputSettings)
    sample_radius: float = 15.0
    sample_time: float = 30.0
    sample_capture_radius: float = 5.0
    report_max_age: float = 35.0
    allocation: str = "greedy"
    exploit_set: frozenset[str] = frozenset()
    explore_set: frozenset[str] = frozenset()
    standby: XY = (0.0, 0.0)

    @property
    def fixed(self) -> bool:
        """Whether coalitions are given instead of chosen."""
        return bool(self.exploit_set or self.explore_set)


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Post:
    """Something to publish here, and to all other vessels as a node message if `to_all`."""

    variable: str
    value: Value
    to_all: bool = False


@dataclass
class Totals:
    """What the run's row of a study is made of."""

    samples: int = 0
    discoveries: int = 0
    migrations: int = 0
    in_storm: float = 0.0
    option_changes: int = 0


class Control:
    """See the module. `name` is the vessel's, in lower case everywhere inside."""

    def __init__(self, name: str, settings: ControlSettings, now: float) -> None:
        self.name = name.lower()
        self.settings = settings
        self.zone = 0
        self.x: float | None = None
        self.y: float | None = None
        self.odometer = 0.0
        self.option = ""
        self.storm = False
        self.bloom = False
        self.migration_done = True
        self.points: dict[str, XY] = {}
        """Known sample points by label."""
        self.target: str | None = None
        """Label of the sample point that is this vessel's."""
        self.sampling_at: XY | None = None
        self.totals = Totals()
        self.battery = Battery(settings.inputs)
        self.inputs = (0.0, 0.0, 0.0)
        self._grown = tuple(zone.grown_by_factor(GROWN) for zone in settings.zones)
        self._middles = tuple(zone.area_centroid for zone in settings.zones)
        self._others: dict[str, tuple[float, float, float]] = {}
        self._contacts: frozenset[str] = frozenset()
        self._exploring: frozenset[str] = frozenset()
        self._exploiting: frozenset[str] = frozenset()
        self._announced: dict[str, float] = {}
        """Vessels that are sampling, and since when."""
        self._migrated_at = now
        self._last_start = -inf
        self._sample_seen = now
        self._at = now
        self._posts: list[Post] = []
        self._said: dict[str, Value] = {}
        self._ordered: dict[str, float] = {}
        self._ignore_due = True
        self._told: Totals | None = None

    # --- news --------------------------------------------------------------------------------

    def hear_position(self, x: float | None, y: float | None) -> None:
        """Own position; None for a coordinate that is not news."""
        former = (self.x, self.y)
        self.x, self.y = self.x if x is None else x, self.y if y is None else y
        if None not in former and self.x is not None and self.y is not None:
            self.odometer += hypot(self.x - (former[0] or 0.0), self.y - (former[1] or 0.0))

    def hear_report(self, name: str, x: float, y: float, now: float) -> None:
        """Where another vessel is."""
        if name.lower() != self.name:
            self._others[name.lower()] = (x, y, now)

    def hear_contacts(self, names: Iterable[str]) -> None:
        """The contact manager's list."""
        found = frozenset(name.lower() for name in names)
        self._ignore_due = self._ignore_due or found != self._contacts
        self._contacts = found

    def hear_coalition(self, option: str, names: Iterable[str]) -> None:
        """Who else explores, or exploits."""
        found = frozenset(name.lower() for name in names)
        if option == "explore":
            self._ignore_due = self._ignore_due or found != self._exploring
            self._exploring = found
        elif option == "exploit":
            self._exploiting = found

    def hear_option(self, option: str, now: float) -> None:
        """The own choice, in any case."""
        former, self.option = self.option, option.lower()
        if former == self.option:
            return
        self.totals.option_changes += 1
        if self.option == "migrate":
            self._begin_migration(now)

    def hear_bloom(self, inside: bool) -> None:
        """The sensor says whether this vessel is in a bloom; entering one while exploring is a discovery."""
        entered = inside and not self.bloom
        self.bloom = inside
        if not entered or self.option != "explore" or self.x is None or self.y is None:
            return
        apart = 2.0 * self.settings.sample_radius
        if not self._grown[self.zone].contains(self.x, self.y):
            return
        if all(hypot(x - self.x, y - self.y) >= apart for x, y in self.points.values()):
            self._discover(self.x, self.y)

    def hear_sample_point(self, text: str) -> None:
        """A sample point from another vessel, or its withdrawal.

        Raises:
            ValueError: it is no point.
        """
        point = parse_point(text)
        label = point.label
        if not label:
            raise ValueError("a sample point needs a label")
        if not point.attributes.active:
            self._forget(label)
        elif label not in self.points and self._grown[self.zone].contains(point.x, point.y):
            self.points[label] = (point.x, point.y)
            self._show(label)

    def hear_start(self, name: str, now: float) -> None:
        """A vessel begins to sample where it is."""
        name = name.lower()
        self._announced[name] = now
        if name == self.name and self.x is not None and self.y is not None:
            target = self.points.get(self.target or "")
            self.sampling_at = target or (self.x, self.y)

    def hear_finish(self, name: str) -> None:
        """A vessel has sampled."""
        name = name.lower()
        if name == self.name and name in self._announced:
            self.totals.samples += 1
        self._announced.pop(name, None)
        if name == self.name:
            self.sampling_at = None

    def hear_migration_done(self, done: bool, now: float) -> None:
        """The helm has brought this vessel into the new zone, or is on the way."""
        if done and not self.migration_done:
            self._migrated_at = now
        self.migration_done = done

    # --- what follows ------------------------------------------------------------------------

    def step(self, now: float) -> list[Post]:
        """Everything to post now. Call it a few times per second."""
        self._forget_old(now)
        if self.storm:
            self.totals.in_storm += now - self._at
        self._at = now
        self._take_away_sampled()
        self._choose_target(now)
        self._want(now)
        self._steer(now)
        if self._ignore_due:
            self._ignore_due = False
            self._post("PROX_SET_IGNORE_LIST", ",".join(sorted(self._contacts - self.explorers)))
        if self.totals != self._told:
            self._told = replace(self.totals)
            self._post_news("NUMBER_OF_SAMPLED_BLOOMS", str(self.totals.samples))
            self._post_news("NUMBER_OF_MIGRATIONS", float(self.totals.migrations))
            self._post_news("OPTION_CHANGES", float(self.totals.option_changes))
            self._post_news("SECONDS_IN_STORM", round(self.totals.in_storm, 3))
        self._post("N_ODOM_BLOOM_CTRL", self.odometer)
        posts, self._posts = self._posts, []
        return posts

    @property
    def explorers(self) -> frozenset[str]:
        """The other vessels that explore."""
        return (self.settings.explore_set if self.settings.fixed else self._exploring) - {self.name}

    @property
    def samplers(self) -> frozenset[str]:
        """All vessels that sample, this one included if it does."""
        if self.settings.fixed:
            return self.settings.exploit_set
        return self._exploiting | ({self.name} if self.option == "exploit" else frozenset())

    def unfinished(self) -> bool:
        """Whether a migration is under way and somebody known is not in the zone yet."""
        if self.migration_done or self.x is None or self.y is None:
            return False
        zone = self._grown[self.zone]
        places = [(self.x, self.y)]
        places += [self._others[name][:2] for name in self._contacts if name in self._others]
        return any(not zone.contains(x, y) for x, y in places)

    def _forget_old(self, now: float) -> None:
        settings = self.settings
        for name in [n for n, (_, _, at) in self._others.items() if now - at > settings.report_max_age]:
            del self._others[name]
        for name in [n for n, at in self._announced.items() if now - at > settings.sample_time]:
            del self._announced[name]
            if name == self.name:
                self.sampling_at = None

    def _place(self, name: str) -> XY | None:
        if name == self.name:
            return None if self.x is None or self.y is None else (self.x, self.y)
        known = self._others.get(name)
        return None if known is None else known[:2]

    def _take_away_sampled(self) -> None:
        """A point is taken once a sampling vessel has announced to sample right there."""
        if not self.points:
            return
        capture = self.settings.sample_capture_radius
        for name in sorted(self._announced):
            place = self._place(name)
            if place is None or name not in self.samplers:
                continue
            for label, (x, y) in list(self.points.items()):
                if hypot(x - place[0], y - place[1]) <= capture:
                    self._forget(label)

    def _choose_target(self, now: float) -> None:
        self.target = None
        own = self._place(self.name)
        if own is None or not self.points:
            return
        places = {self.name: own}
        for name in self.samplers:
            place = self._place(name)
            if place is not None:
                places[name] = place
        busy = {
            name: max(0.0, self.settings.sample_time - (now - at)) for name, at in self._announced.items()
        }
        labels = list(self.points)
        found = METHODS[self.settings.allocation](self.name, places, list(self.points.values()), busy)
        self.target = None if found is None else labels[found]

    def _want(self, now: float) -> None:
        settings, own = self.settings.inputs, self._place(self.name)
        point = self.points.get(self.target or "")
        distance = None if point is None or own is None else hypot(point[0] - own[0], point[1] - own[1])
        if distance is not None:
            self._sample_seen = now
        self.inputs = (
            explore_input(
                settings, self.battery.update(self.odometer, now), distance is not None, self.storm
            ),
            exploit_input(settings, distance, self.name in self._announced),
            migrate_input(
                settings, self.storm, self.unfinished(), now - self._migrated_at, now - self._sample_seen
            ),
        )
        for name, value in zip(("EXPLORE_INPUT", "EXPLOIT_INPUT", "MIGRATE_INPUT"), self.inputs, strict=True):
            self._post(name, value)

    def _steer(self, now: float) -> None:
        """Where to go to sample, and where to stay while sampling or waiting."""
        point = self.points.get(self.target or "")
        cx, cy = self._middles[self.zone]
        x, y = point or (cx + self.settings.standby[0], cy + self.settings.standby[1])
        sx, sy = self.sampling_at or (x, y)
        self._post_news("SAMPLE_AVAILABLE", "false" if point is None else "true")
        self._post_order("SAMPLE_TRAVEL_UPDATE", f"point={x:.2f},{y:.2f}", now)
        self._post_order("SAMPLE_UPDATE", f"station_pt={sx:.2f},{sy:.2f}", now)

    # --- migration ---------------------------------------------------------------------------

    def _begin_migration(self, now: float) -> None:
        for label in list(self.points):
            self._forget(label)
        if now - self._last_start < self.settings.inputs.migration_pause:
            return
        self._last_start = now
        self.zone = 1 - self.zone
        self.migration_done = False
        self.totals.migrations += 1
        points = seglist_text(Polygon(self.settings.zones[self.zone].points), 2)
        bare = points.removeprefix("pts={").removesuffix("}")
        self._post("MIGRATION_DONE", "false")
        self._post("PROX_UP_REGION", bare)
        self._post("UP_MOVE", f"region={points},label={OTHER_ZONE_LABELS[self.zone]}")
        self._post("VECTOR_UPDATE", f"op_region={points}")
        self._post("CURR_REGION", points)
        self._post("OP_REGION_RESET", "true")

    # --- sample points -----------------------------------------------------------------------

    def _discover(self, x: float, y: float) -> None:
        """Five points: here, and to the north, east, south and west."""
        self.totals.discoveries += 1
        radius = self.settings.sample_radius
        for side, east, north in SAMPLE_AROUND:
            label = f"{self.name}_{self.totals.discoveries}_{side}"
            place = (x + east * radius, y + north * radius)
            self.points[label] = place
            text = point_text(Point(*place, attributes=Attributes(label=label)))
            self._posts.append(Post("SAMPLE_LOC", text, to_all=True))
            self._show(label)

    def _show(self, label: str) -> None:
        looks = Attributes(label=label, vertex_color="green", vertex_size=4.0)
        self._post("VIEW_POINT", point_text(Point(*self.points[label], attributes=looks)))

    def _forget(self, label: str) -> None:
        if self.points.pop(label, None) is not None:
            self._post("VIEW_POINT", erase_point_text(label))

    # --- posts -------------------------------------------------------------------------------

    def _post(self, variable: str, value: Value) -> None:
        self._posts.append(Post(variable, value))

    def _post_order(self, variable: str, value: Value, now: float) -> None:
        """Post an update for a behaviour, and again from time to time: a helm that is parked does not keep it."""
        if self._said.get(variable) != value or now - self._ordered.get(variable, -inf) >= ORDER_PERIOD:
            self._said[variable] = value
            self._ordered[variable] = now
            self._post(variable, value)

    def _post_news(self, variable: str, value: Value) -> None:
        if self._said.get(variable) != value:
            self._said[variable] = value
            self._post(variable, value)


def standby_offset(index: int, count: int, radius: float) -> XY:
    """Place number `index` (from 0) of `count` around a circle of `radius` metres."""
    angle = radians(360.0 * index / max(count, 1))
    return radius * sin(angle), radius * cos(angle)
